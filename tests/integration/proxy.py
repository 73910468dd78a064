# SPDX-License-Identifier: GPL-3.0-or-later
"""A line between client and daemon that breaks or stops where a test says.

The daemon listens on 127.0.0.1, the proxy on the same two ports of 127.0.0.2: so the data port that the daemon names is
the proxy's too, and nothing has to be rewritten. It writes down which bytes of which packets it let through.
"""

import socket
import struct
import threading

HOST = "127.0.0.2"
_CHUNK, _CHUNK_HEADER = 0x0030, 28


class Line:
    """What one connection may carry from the server to the client: `limit` bytes, then it is cut, or held."""

    def __init__(self, limit=None, hold=False):
        self.limit = limit
        self.hold = hold


class _ChunkCounter:
    """Finds the chunks in a data channel's bytes and tells which bytes of which packet they are."""

    def __init__(self):
        self.buffer = b""
        self.seen = []  # (packet, first byte, byte behind the last)

    def take(self, data):
        self.buffer += data
        while len(self.buffer) >= 6:
            length, kind = struct.unpack_from("<IH", self.buffer)
            if len(self.buffer) < 4 + length:
                return
            self._chunk(kind, self.buffer[6:4 + length])
            self.buffer = self.buffer[4 + length:]

    def finish(self):
        """What a cut left of the last frame."""
        if len(self.buffer) > 6:
            self._chunk(struct.unpack_from("<IH", self.buffer)[1], self.buffer[6:])
        self.buffer = b""

    def _chunk(self, kind, body):
        if kind != _CHUNK or len(body) <= _CHUNK_HEADER:
            return
        _, handle, packet, offset, _ = struct.unpack_from("<IIIQQ", body)
        if handle != 0:  # 0: the mesh list
            self.seen.append((packet, offset, offset + len(body) - _CHUNK_HEADER))


class Proxy:
    """Use as a context. `request_lines` and `data_lines` say what the first connections of each port may carry; those
    behind them, everything."""

    def __init__(self, daemon, request_lines=(), data_lines=()):
        self.ports = {"request": daemon.request_port, "data": daemon.data_port}
        self.lines = {"request": list(request_lines), "data": list(data_lines)}
        self.chunks = []  # one list of (packet, from, to) for each data connection
        self.released = threading.Event()
        self.held = threading.Event()
        self.listeners = {}
        self.threads = []
        self.lock = threading.Lock()

    def __enter__(self):
        for channel, port in self.ports.items():
            listener = socket.create_server((HOST, port))
            self.listeners[channel] = listener
            self.threads.append(threading.Thread(target=self._accept, args=(channel, listener), daemon=True))
            self.threads[-1].start()
        return self

    def __exit__(self, *_):
        self.released.set()
        for listener in self.listeners.values():
            listener.shutdown(socket.SHUT_RDWR)  # wakes accept()
        for thread in self.threads:
            thread.join()
        for listener in self.listeners.values():
            listener.close()

    @property
    def address(self):
        return f"{HOST}:{self.ports['request']}"

    def _accept(self, channel, listener):
        while True:
            try:
                client, _ = listener.accept()
            except OSError:
                return
            with self.lock:
                line = self.lines[channel].pop(0) if self.lines[channel] else Line()
                counter = _ChunkCounter()
                if channel == "data":
                    self.chunks.append(counter.seen)
            threading.Thread(target=self._serve, args=(channel, client, line, counter), daemon=True).start()

    def _serve(self, channel, client, line, counter):
        try:
            server = socket.create_connection(("127.0.0.1", self.ports[channel]))
        except OSError:
            client.close()
            return
        threading.Thread(target=self._up, args=(client, server), daemon=True).start()
        left = line.limit
        try:
            while left is None or left > 0:
                data = server.recv(65536 if left is None else min(left, 65536))
                if not data:
                    break
                counter.take(data)
                client.sendall(data)
                left = None if left is None else left - len(data)
            if line.hold:
                self.held.set()
                self.released.wait()
        except OSError:
            pass
        counter.finish()
        # In order, so that the client gets every byte that was counted, and then the end.
        for end, how in ((client, socket.SHUT_WR), (server, socket.SHUT_RDWR)):
            try:
                end.shutdown(how)
            except OSError:
                pass

    @staticmethod
    def _up(client, server):
        try:
            while data := client.recv(65536):
                server.sendall(data)
        except OSError:
            pass
        for end in (server, client):
            try:
                end.shutdown(socket.SHUT_RDWR)
            except OSError:
                pass
            end.close()


def ranges(chunks):
    """The bytes of each packet that went through, as {packet: [(from, to), ...]} with neighbours joined, in the order in
    which they went. A byte that went twice makes two ranges that overlap."""
    found = {}
    for connection in chunks:
        for packet, first, end in connection:
            known = found.setdefault(packet, [])
            if known and known[-1][1] == first:
                known[-1] = (known[-1][0], end)
            else:
                known.append((first, end))
    return found
