# SPDX-License-Identifier: MIT
"""Networks of one run: a server behind a shaped uplink, a router, and clients each behind a line of its own.

    server == veth, tbf: the uplink == router == tun, tbf: down - rules_relay: delay, loss - tbf: up, tun == client

Each host is a network namespace of its own, so nothing of the machine's network is touched and any number of runs live
beside each other. Rates are the kernel's (tbf, in the queue of the sending side); delay and loss are the relay's. Needs
root. It starts no server and no client."""

import ctypes
import dataclasses
import itertools
import json
import os
import pathlib
import socket
import subprocess
import threading

_PATIENCE_SECONDS = 20
_CLONE_NEWNET = 0x40000000
_MTU = 1500
_counter = itertools.count()

SERVER_ADDRESS = "10.83.0.1"
# Of every packet on a line, beside the payload of TCP: IPv4, and TCP with time stamps. On the uplink Ethernet's too.
HEADER_BYTES = 52
SEGMENT_BYTES = _MTU - HEADER_BYTES
ETHERNET_BYTES = 14


class NetworkError(Exception):
    pass


@dataclasses.dataclass(frozen=True)
class Line:
    """What a client is connected by. Rates in 1000 bits a second; the delay is that of one way."""
    name: str
    down_kbit: float
    up_kbit: float
    delay_ms: float
    queue_bytes: int  # that wait at most, each way
    loss: float = 0

    def scaled(self, speed, delay):
        """Speeds times `speed`, delay divided by `delay`."""
        return dataclasses.replace(self, down_kbit=self.down_kbit * speed, up_kbit=self.up_kbit * speed,
                                   delay_ms=self.delay_ms / delay)


# One way of a V.34 modem takes 60 to 100 ms, of interleaved ADSL 15 to 25. Queues of a quarter of a second, or five
# packets; a second on the uplink, whose boxes are known for it.
MODEM = Line("modem", 33.6, 33.6, 75, 8000)
DSL_1024 = Line("1024/256", 1024, 256, 20, 32000)
DSL_2048 = Line("2048/384", 2048, 384, 15, 64000)
UPLINK_KBIT = 256
UPLINK_QUEUE_BYTES = 32000


def burst_bytes(kbit):
    """What may go out at once: a packet, or what the rate brings in the 4 ms that a busy machine's timer is late."""
    return max(1600, round(kbit * 1000 / 8 * 0.004))


def missing():
    """What keeps this machine from making such networks, or None. Tries it."""
    if os.geteuid() != 0:
        return "it needs root, for network namespaces"
    name = f"pmcd-rules-{os.getpid()}-try"
    try:
        _ip("netns", "add", name)
    except (NetworkError, OSError) as error:
        return f"no network namespace can be made here: {error}"
    try:
        _ip("-n", name, "tuntap", "add", "dev", "try0", "mode", "tun")
        _tbf(name, "try0", 1000, 32000)
    except NetworkError as error:
        return f"no tun device can be shaped here: {error}"
    finally:
        _ip("netns", "del", name)
    return None


def _command(*words):
    done = subprocess.run(words, stdin=subprocess.DEVNULL, capture_output=True, text=True, check=False,
                          start_new_session=True)
    if done.returncode != 0:
        raise NetworkError(f"{' '.join(words)}: {(done.stderr or done.stdout).strip()}")


def _ip(*words):
    _command("ip", *words)


def _tbf(namespace, device, kbit, queue_bytes):
    _command("tc", "-n", namespace, "qdisc", "add", "dev", device, "root", "tbf", "rate", f"{round(kbit * 1000)}bit",
             "burst", str(burst_bytes(kbit)), "limit", str(queue_bytes))


def inside(namespace):
    """The words that make a command run in the namespace. The process that is started becomes that command."""
    return ["ip", "netns", "exec", namespace]


def call_inside(namespace, function):
    """What function() gives when it runs in the namespace; sockets that it makes stay there."""
    answers = []

    def enter_and_call():
        try:
            with open(f"/run/netns/{namespace}", "rb") as file:
                if ctypes.CDLL(None, use_errno=True).setns(file.fileno(), _CLONE_NEWNET) != 0:
                    raise OSError(ctypes.get_errno(), f"entering the namespace {namespace}")
            answers.append((function(), None))
        except Exception as error:  # pylint: disable=broad-except
            answers.append((None, error))

    # Only the thread that asks changes its namespace; this one ends with it.
    thread = threading.Thread(target=enter_and_call)
    thread.start()
    thread.join()
    answer, error = answers[0]
    if error:
        raise error
    return answer


class Network:
    """The network of one run, while it is entered. `lines`: of the clients in turn, scaled already."""

    def __init__(self, relay_program, lines, uplink_kbit, congestion=None, seed=1):
        self._relay_program = str(relay_program)
        self.lines = lines
        self._uplink_kbit = uplink_kbit
        self._congestion = congestion
        self._seed = seed
        name = f"pmcd-rules-{os.getpid()}-{next(_counter)}"
        self.server, self._router = f"{name}-server", f"{name}-router"
        self.clients = [f"{name}-client{number}" for number in range(1, len(lines) + 1)]
        self._made = []
        self._relays = []

    def __enter__(self):
        try:
            for namespace in (self.server, self._router, *self.clients):
                _ip("netns", "add", namespace)
                self._made.append(namespace)
                _ip("-n", namespace, "link", "set", "dev", "lo", "up")
                self._write_setting(namespace, "ipv6/conf/all/disable_ipv6", "1")  # it would talk by itself
            self._make_uplink()
            for number, (namespace, line) in enumerate(zip(self.clients, self.lines), 1):
                self._make_line(number, namespace, line)
            self._set_congestion_control()
        except BaseException:
            self.close()
            raise
        return self

    def __exit__(self, *_):
        self.close()

    def _make_uplink(self):
        _ip("-n", self._router, "link", "add", "name", "uplink", "type", "veth", "peer", "name", "uplink", "netns",
            self.server)
        for namespace, address in ((self.server, SERVER_ADDRESS), (self._router, "10.83.0.2")):
            # tbf cuts what was put together for a card and is longer than its burst, and charges one head for what it
            # lets through: so nothing is put together.
            _ip("-n", namespace, "link", "set", "dev", "uplink", "mtu", str(_MTU), "gso_max_segs", "1", "up")
            _ip("-n", namespace, "address", "add", f"{address}/24", "dev", "uplink")
        _ip("-n", self.server, "route", "add", "default", "via", "10.83.0.2")
        _tbf(self.server, "uplink", self._uplink_kbit, UPLINK_QUEUE_BYTES)
        self._write_setting(self._router, "ipv4/ip_forward", "1")

    def _make_line(self, number, namespace, line):
        device = f"line{number}"
        relay = subprocess.Popen(
            [self._relay_program, f"{self._router}:{device}", f"{namespace}:{device}", "--delay-ms", str(line.delay_ms),
             "--loss", str(line.loss), "--seed", str(self._seed * 1000 + number)],
            stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, start_new_session=True)
        self._relays.append(relay)
        if not relay.stdout.readline():
            raise NetworkError(f"rules_relay ended with exit code {relay.wait()}: {relay.stderr.read().strip()}")
        for side, own, other, kbit in ((self._router, 1, 2, line.down_kbit), (namespace, 2, 1, line.up_kbit)):
            _ip("-n", side, "address", "add", f"10.83.{number}.{own}", "peer", f"10.83.{number}.{other}", "dev", device)
            _ip("-n", side, "link", "set", "dev", device, "mtu", str(_MTU), "up")
            _tbf(side, device, kbit, line.queue_bytes)
        _ip("-n", namespace, "route", "add", "default", "via", f"10.83.{number}.1")

    @staticmethod
    def _write_setting(namespace, name, value):
        call_inside(namespace, lambda: pathlib.Path("/proc/sys/net", name).write_text(value, "ascii"))

    def _set_congestion_control(self):
        if not self._congestion:
            return
        for namespace in (self.server, *self.clients):
            try:
                self._write_setting(namespace, "ipv4/tcp_congestion_control", self._congestion)
            except OSError as error:
                raise NetworkError(f"the kernel does not take {self._congestion} for congestion control: "
                                   f"{error.strerror}") from None

    def close(self):
        """Ends the relays and removes the namespaces; returns what each relay counted."""
        for relay in self._relays:
            relay.terminate()
        counted = []
        for relay in self._relays:
            try:
                output = relay.communicate(timeout=_PATIENCE_SECONDS)[0]
            except subprocess.TimeoutExpired:
                relay.kill()
                output = relay.communicate()[0]
            try:
                counted.append(json.loads(output))
            except json.JSONDecodeError:
                counted.append(None)
        self._relays = []
        while self._made:
            subprocess.run(["ip", "netns", "del", self._made.pop()], stdin=subprocess.DEVNULL, check=False,
                           start_new_session=True)
        return counted


def congestion_control(network):
    """The name of what the server's kernel uses."""
    return call_inside(network.server, lambda: pathlib.Path("/proc/sys/net/ipv4/tcp_congestion_control").read_text(
        "ascii").strip())


def socket_inside(namespace, kind):
    """A socket of IPv4 in the namespace, `kind` as socket.SOCK_STREAM."""
    return call_inside(namespace, lambda: socket.socket(socket.AF_INET, kind))
