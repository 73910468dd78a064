# SPDX-License-Identifier: MIT
"""Whether the networks do what they say: goodput of TCP and the round trip, line by line, each alone on it.

A fixed payload is timed at its receiver, first byte to last, so that neither the handshake nor what a queue still holds
counts. No pmcd takes part."""

import dataclasses
import socket
import threading
import time

import network

_PORT = 7000
_SECONDS = 4  # that a payload takes at the nominal rate
_TIMEOUT = 60


@dataclasses.dataclass
class Measured:
    what: str
    nominal_kbit: float
    expected_kbit: float  # after the heads of TCP and IP
    goodput_kbit: float
    round_trip_ms: float
    least_round_trip_ms: float

    @property
    def ratio(self):
        return self.goodput_kbit / self.expected_kbit


def _transfer(sender, receiver, address, payload):
    """Bytes a second of a payload between two namespaces. The one with SERVER_ADDRESS listens."""
    listens = sender if sender.endswith("-server") else receiver
    listener = network.socket_inside(listens, socket.SOCK_STREAM)
    connecting = network.socket_inside(receiver if listens == sender else sender, socket.SOCK_STREAM)
    with listener, connecting:
        listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        listener.bind((address, _PORT))
        listener.listen()
        for one in (listener, connecting):
            one.settimeout(_TIMEOUT)
        connecting.connect((address, _PORT))
        accepted, _ = listener.accept()
        with accepted:
            accepted.settimeout(_TIMEOUT)
            source, sink = (accepted, connecting) if listens == sender else (connecting, accepted)
            sending = threading.Thread(target=source.sendall, args=(bytes(payload),), daemon=True)
            sending.start()
            first = last = None
            received = before = 0
            while received < payload:
                count = len(sink.recv(65536))
                if count == 0:
                    raise network.NetworkError("a connection of the self-test was closed")
                last = time.monotonic()
                received += count
                if first is None:
                    first, before = last, count
            sending.join()
    return (payload - before) / (last - first)


def _round_trip(namespace, server):
    """Seconds, the least of five small datagrams."""
    echo, asking = (network.socket_inside(name, socket.SOCK_DGRAM) for name in (server, namespace))
    with echo, asking:
        echo.bind((network.SERVER_ADDRESS, _PORT))
        for one in (echo, asking):
            one.settimeout(_TIMEOUT)
        best = None
        for _ in range(5):
            begin = time.monotonic()
            asking.sendto(b"?", (network.SERVER_ADDRESS, _PORT))
            message, sender = echo.recvfrom(16)
            echo.sendto(message, sender)
            asking.recv(16)
            taken = time.monotonic() - begin
            best = taken if best is None else min(best, taken)
    return best


def carries(line, uplink_kbit):
    """kbit/s that are left down this line, alone on the uplink, after the heads of TCP, IP and the uplink's Ethernet."""
    kbit = min(line.down_kbit, uplink_kbit)
    heads = network.HEADER_BYTES + (network.ETHERNET_BYTES if uplink_kbit <= line.down_kbit else 0)
    return kbit * network.SEGMENT_BYTES / (network.SEGMENT_BYTES + heads)


def measure(relay_program, line, uplink_kbit, congestion=None, seconds=_SECONDS):
    """Down and up of one line, the line alone on the uplink. Yields Measured."""
    with network.Network(relay_program, [line], uplink_kbit, congestion) as net:
        client = net.clients[0]
        round_trip = _round_trip(client, net.server)
        for way, kbit in (("down", min(line.down_kbit, uplink_kbit)), ("up", line.up_kbit)):
            # The bytes of the first burst come at no cost; the payload is many times as long.
            payload = max(12 * network.burst_bytes(kbit), round(kbit * 1000 / 8 * seconds))
            ends = (net.server, client) if way == "down" else (client, net.server)
            goodput = _transfer(*ends, network.SERVER_ADDRESS, payload) * 8 / 1000
            expected = carries(line, uplink_kbit) if way == "down" else (
                kbit * network.SEGMENT_BYTES / (network.SEGMENT_BYTES + network.HEADER_BYTES))
            yield Measured(f"{line.name} {way}", kbit, expected, goodput, round_trip * 1000, 2 * line.delay_ms)


def measure_loss(relay_program, loss, count=2000):
    """How many of `count` datagrams a line with this loss swallows on the way up."""
    line = network.Line("loss", 100_000, 100_000, 0, 64000, loss)
    net = network.Network(relay_program, [line], 100_000)
    try:
        with net, network.socket_inside(net.clients[0], socket.SOCK_DGRAM) as asking:
            for _ in range(count):
                asking.sendto(b"?", (network.SERVER_ADDRESS, _PORT))
                time.sleep(0.0001)  # slower than the relay, or the device's own queue loses some too
            # Nobody answers; the last one is on its way for less than this.
            time.sleep(0.2)
            return net.close()[0]["back"]["lost"]
    finally:
        net.close()
