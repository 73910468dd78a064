# SPDX-License-Identifier: GPL-3.0-or-later
"""A line that goes dead: the client's machine is cut off without a word while it owes the daemon acknowledgements.

Daemon and client live in network namespaces of their own, joined by a pair of virtual cards, one of which is switched
off. That needs root; without it the test is skipped.
"""

import contextlib
import ctypes
import os
import socket
import struct
import subprocess
import time
import unittest

import hollow
import house

_CLONE_NEWNET = 0x40000000
_LIBC = ctypes.CDLL(None, use_errno=True)
_SERVER, _CLIENT = "192.0.2.1", "192.0.2.2"
_STALL_S = 1.5
_SLACK_S = 4
_MIB = 1 << 20

# Frames that are used here; docs/PROTOCOL.md has them all.
_HELLO, _HELLO_OK, _JOIN, _JOIN_OK = 0x0001, 0x0002, 0x0007, 0x0008
_GET_BASE_MESH, _CHUNK, _TRANSFER_END = 0x0011, 0x0030, 0x0031
_HEAD = b"PMCD" + struct.pack("<HH", 1, 0)


def _namespace_call(name, *arguments):
    if getattr(_LIBC, name)(*arguments) != 0:
        number = ctypes.get_errno()
        raise OSError(number, f"{name}: {os.strerror(number)}")


def _current_namespace():
    """The network namespace of this thread, as a descriptor that keeps it alive."""
    return os.open("/proc/thread-self/ns/net", os.O_RDONLY | os.O_CLOEXEC)


@contextlib.contextmanager
def _inside(namespace):
    """Sockets and programs that begin in this context live in `namespace`."""
    before = _current_namespace()
    _namespace_call("setns", namespace, _CLONE_NEWNET)
    try:
        yield
    finally:
        _namespace_call("setns", before, _CLONE_NEWNET)
        os.close(before)


def _new_namespace():
    before = _current_namespace()
    _namespace_call("unshare", _CLONE_NEWNET)
    made = _current_namespace()
    _namespace_call("setns", before, _CLONE_NEWNET)
    os.close(before)
    return made


def _ip(command):
    subprocess.run(["ip", *command.split()], check=True, capture_output=True, timeout=house.TIMEOUT_S)


class _Session:
    """Both channels, frame by frame; its data channel takes little at a time."""

    def __init__(self, address, port):
        self.requests = self._connect(address, port)
        self._send(self.requests, _HELLO, _HEAD + b"\x04dead")
        body = self._receive(self.requests, _HELLO_OK)
        token, data_port = body[8:24], struct.unpack_from("<H", body, 24)[0]
        self.data = self._connect(address, data_port)
        self._send(self.data, _JOIN, _HEAD + token)
        self._receive(self.data, _JOIN_OK)

    def ask_for(self, name):
        self._send(self.requests, _GET_BASE_MESH, struct.pack("<IB", 1, len(name)) + name.encode())

    def first_chunk(self):
        return self._receive(self.data, _CHUNK)

    def end(self):
        return self._receive(self.data, _TRANSFER_END)

    def close(self):
        self.requests.close()
        self.data.close()

    @staticmethod
    def _connect(address, port):
        channel = socket.socket()
        channel.settimeout(house.TIMEOUT_S)
        channel.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
        channel.connect((address, port))
        return channel

    @staticmethod
    def _send(channel, kind, body):
        channel.sendall(struct.pack("<IH", 2 + len(body), kind) + body)

    def _receive(self, channel, wanted):
        """The body of the next frame of the type `wanted`; others are passed over."""
        while True:
            length, kind = struct.unpack("<IH", self._exactly(channel, 6))
            body = self._exactly(channel, length - 2)
            if kind == wanted:
                return body

    @staticmethod
    def _exactly(channel, count):
        data = bytearray()
        while len(data) < count:
            piece = channel.recv(count - len(data))
            if not piece:
                raise ConnectionError("the daemon closed the connection")
            data += piece
        return bytes(data)


class DeadLine(house.HouseTest):
    def setUp(self):
        super().setUp()
        try:
            self.ours = _new_namespace()
            self.theirs = _new_namespace()
        except OSError as error:
            self.skipTest(f"no network namespace can be made here (that needs root): {error}")
        self.addCleanup(os.close, self.ours)
        self.addCleanup(os.close, self.theirs)
        with _inside(self.ours):
            _ip("link set lo up")
            _ip("link add near type veth peer name far")
            _ip(f"link set far netns /proc/{os.getpid()}/fd/{self.theirs}")
            _ip(f"address add {_SERVER}/24 dev near")
            _ip("link set near up")
        with _inside(self.theirs):
            _ip(f"address add {_CLIENT}/24 dev far")
            _ip("link set far up")

    def test_the_slot_is_free_after_the_stall_time(self):
        big = hollow.write(self.folder / "big.pmcd", [8 * _MIB], generation=1)
        small = hollow.write(self.folder / "small.pmcd", [100], generation=2)
        self.enterContext(_inside(self.ours))
        daemon = self.start_daemon("--listen", "0.0.0.0", "--stall-timeout", str(_STALL_S),
                                   "--slots", "1", "--quantum", "0")
        self.ingest(daemon, big, "--name", "big")
        self.ingest(daemon, small, "--name", "small")
        with _inside(self.theirs):
            dead = _Session(_SERVER, daemon.request_port)
            dead.ask_for("big")
            dead.first_chunk()
            _ip("link set far down")
        cut = time.monotonic()
        other = _Session("127.0.0.1", daemon.request_port)
        other.ask_for("small")
        other.end()
        lost = time.monotonic() - cut
        self.assertGreater(lost, _STALL_S / 2, "the slot was not held")
        self.assertLess(lost, _STALL_S + _SLACK_S)
        lines = [line for line in daemon.log.read_text(encoding="utf-8").splitlines()
                 if f"from {_CLIENT}:" in line and "closed" in line]
        self.assertEqual(len(lines), 1, lines)
        self.assertRegex(lines[0], "closed: stalled: the (data channel acknowledges nothing|request channel does not take)")
        # Not even a good-bye holds the end of the daemon up.
        dead.close()
        other.close()
        self.assertEqual(daemon.stop(), 0)


if __name__ == "__main__":
    unittest.main()
