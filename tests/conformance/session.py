# SPDX-License-Identifier: MIT
"""A client's side of a session: two channels, requests under way, and what must hold of every answer.

Whatever the server sends is judged at once (F-1, F-3, R-3, R-4, R-8, S-2, T-1 to T-3, K-1); what is wrong raises Failed.
Marks in the texts are those of docs/PROTOCOL.md. It knows nothing of packets' contents.
"""

import itertools
import select
import socket
import struct
import time

import wire

TIMEOUT_S = 10  # how long an answer may take, unless a check says otherwise


class Failed(Exception):
    """The server did something else than the document says."""

    def __init__(self, expected, got):
        super().__init__(f"expected {expected}; got {got}")
        self.expected, self.got = str(expected), str(got)


class Channel:
    """One connection: bytes out, frames in. `closed` is None, "closed" or "reset"."""

    def __init__(self, address, label, limit=wire.MAX_TO_CLIENT, receive_buffer=None):
        self.label, self.limit, self.closed, self.buffer = label, limit, None, bytearray()
        if isinstance(address, str):
            self.socket = socket.socket(socket.AF_UNIX)
            self.socket.settimeout(TIMEOUT_S)
            self.socket.connect(address)
            return
        family, kind, number, _, where = socket.getaddrinfo(*address, type=socket.SOCK_STREAM)[0]
        self.socket = socket.socket(family, kind, number)
        self.socket.settimeout(TIMEOUT_S)
        if receive_buffer:
            self.socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, receive_buffer)
        self.socket.connect(where)
        self.socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)

    def send(self, data):
        """Sends all, as far as the server takes it: what a server does that closes is seen when reading."""
        try:
            self.socket.sendall(data)
        except (ConnectionError, socket.timeout):
            pass

    def read(self, most=1 << 20):
        """Reads once (call it when there is something) and returns the messages that are whole now."""
        try:
            data = self.socket.recv(most)
        except ConnectionError:
            self.closed = "reset"
            return []
        if not data:
            self.closed = "closed"
            if self.buffer:
                raise Failed(f"F-3 whole frames on the {self.label} channel", f"its end behind {wire.hex_of(self.buffer)}")
            return []
        self.buffer += data
        return list(self._frames())

    def _frames(self):
        while len(self.buffer) >= 4:
            length = struct.unpack_from("<I", self.buffer)[0]
            if not 2 <= length <= self.limit:
                raise Failed(f"F-1 a frame of 2 to {self.limit} bytes on the {self.label} channel", f"length {length}")
            if len(self.buffer) < 4 + length:
                return
            number = struct.unpack_from("<H", self.buffer, 4)[0]
            body = bytes(self.buffer[6:4 + length])
            del self.buffer[:4 + length]
            try:
                yield wire.parse(number, body)
            except wire.WrongForm as wrong:
                raise Failed("F-3 a body of its type's form", wrong) from wrong

    def next(self, timeout=None):
        """The next single message; for channels that are not part of a Session. None at the end of the line."""
        timeout = timeout or TIMEOUT_S
        if not hasattr(self, "waiting"):
            self.waiting = []
        deadline = time.monotonic() + timeout
        while not self.waiting and self.closed is None:
            left = deadline - time.monotonic()
            if left <= 0 or not select.select([self.socket], [], [], left)[0]:
                raise Failed(f"a frame on the {self.label} channel", f"silence for {timeout} s")
            self.waiting += self.read()
        return self.waiting.pop(0) if self.waiting else None

    def close(self):
        self.socket.close()
        self.closed = self.closed or "closed"


class Request:
    """One request and all that came for it. `outcome` is "open", a result's name, or a code's name."""

    def __init__(self, kind, number, fields):
        self.kind, self.id, self.fields = kind, number, fields
        self.opened, self.error, self.end = None, None, None
        self.chunks, self.first, self.next, self.total, self.packet, self.handle = 0, None, None, None, None, None
        self.data = bytearray()
        self.cancelled = False
        self.opens = kind == "get_base_mesh"  # will mesh_opened come if it goes well?

    def __str__(self):
        return f"{self.kind} {self.id}"

    @property
    def outcome(self):
        if self.error is not None:
            return wire.CODE_NAMES.get(self.error.code, str(self.error.code))
        if self.end is None:
            return "open"
        if self.end.result == wire.FAILED:
            return wire.CODE_NAMES.get(self.end.code, str(self.end.code))
        return wire.RESULTS[self.end.result]

    @property
    def ended(self):
        return self.error is not None or self.end is not None

    @property
    def done(self):
        """Ended, and nothing is on its way on the other channel either (S-2)."""
        return self.ended and not (self.opens and self.opened is None and self.outcome == "complete")


class Session:
    """Both channels of a session. Messages are dealt out as they come, to requests and to the lists below."""

    def __init__(self, address, greet=True, join=True, agent="conformance", receive_buffer=None, on_code=None):
        self.host, self.on_code, self.receive_buffer = address[0], on_code or (lambda code: None), receive_buffer
        self.request = Channel(address, "request")
        self.data = None
        self.hello_ok = self.join_ok = None
        self.requests, self.handles = {}, {}  # by id; generation by handle
        self.fatal = []       # (channel, code) of errors that end the session
        self.refusals = []    # errors for ids that are no request, and every unknown_type
        self.pongs, self.notices, self.unknown, self.ends = [], [], [], []
        self._turn = {}       # handle: the request whose chunks are coming
        self._ids = itertools.count(1)
        if greet:
            self.say_hello(agent=agent)
            if join:
                self.connect_data()
                self.join()

    # What the client says.

    def say_hello(self, **fields):
        self.request.send(wire.message("hello", **{"agent": "conformance", **fields}))
        self.until(lambda: self.hello_ok, "hello_ok")

    def connect_data(self):
        self.data = Channel((self.host, self.hello_ok.data_port), "data", receive_buffer=self.receive_buffer)

    def widen(self):
        """Takes the data channel quickly from now on, after a small receive buffer."""
        self.data.socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 1 << 22)

    def narrow(self):
        """Takes the data channel slowly from now on."""
        self.data.socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)

    def join(self, **fields):
        self.data.send(wire.message("join", **{"token": self.hello_ok.token, **fields}))
        self.until(lambda: self.join_ok, "join_ok")

    def send(self, name, /, **fields):
        self.request.send(wire.message(name, **fields))

    def prepare(self, kind, number=None, /, **fields):
        """A Request that is known from now on, and its frame, for whoever sends it in a way of their own."""
        request = Request(kind, next(self._ids) if number is None else number, fields)
        if kind == "get_packet":
            request.opens = fields["generation"] not in self.handles.values()
        self.requests[request.id] = request
        return request, wire.message(kind, id=request.id, **fields)

    def ask(self, kind, number=None, /, **fields):
        request, frame = self.prepare(kind, number, **fields)
        self.request.send(frame)
        return request

    def cancel(self, request):
        request.cancelled = True
        self.send("cancel", id=request.id)

    def cancel_unread(self, *requests):
        """Cancels while the data channel is left unread; returns, with it unread, when the server has seen the cancels."""
        for request in requests:
            self.cancel(request)
        data, self.data = self.data, None
        try:
            self.ping()
        finally:
            self.data = data
        self.widen()

    def ping(self, number=77):
        """A ping and its pong; fails unless it comes (the connection stays)."""
        before = len(self.pongs)
        self.send("ping", id=number)
        self.until(lambda: len(self.pongs) > before, "pong")
        if self.pongs[-1] != number:
            raise Failed(f"H-3 pong {number}", f"pong {self.pongs[-1]}")

    # What comes.

    def pump(self, timeout):
        """Deals out what has come, waiting at most `timeout` seconds for something."""
        channels = [c for c in (self.request, self.data) if c is not None and c.closed is None]
        ready = select.select([c.socket for c in channels], [], [], max(0, timeout))[0] if channels else []
        for channel in channels:
            if channel.socket in ready:
                for message in channel.read():
                    self.deal(channel, message)
        return bool(ready)

    def pump_request(self):
        """Deals out what has come on the request channel, and leaves the data channel unread."""
        data, self.data = self.data, None
        try:
            self.pump(0)
        finally:
            self.data = data

    def until(self, true, what, timeout=None):
        """Waits until `true()`; fails with `what` if the session ends before, or nothing of it comes in time."""
        timeout = timeout or TIMEOUT_S
        deadline = time.monotonic() + timeout
        while not true():
            left = deadline - time.monotonic()
            if left <= 0:
                raise Failed(what, f"nothing of it within {timeout} s")
            closed = [c for c in (self.request, self.data) if c is not None and c.closed]
            if closed and not self.pump(0.2):
                raise Failed(what, f"the end of the {closed[0].label} channel, errors {self._fatal_names() or 'none'}")
            self.pump(left)

    def finish(self, *requests, timeout=None):
        """Waits until all are done; returns the last one."""
        for request in requests:
            self.until(lambda one=request: one.done, f"an end of {request}", timeout)
        return requests[-1]

    def settle(self, seconds=0.15):
        """Takes what comes until the line was quiet for so long: nothing more may be on its way."""
        while self.pump(seconds) and not (self.request.closed or self.data is None or self.data.closed):
            pass

    def expect_end(self, code, channel="request", timeout=None):
        """The session ends by `code` (None: without an error) on `channel`, both channels closed (H-5).

        For an error on the data channel the request channel has to say channel_lost.
        """
        channels = [c for c in (self.request, self.data) if c is not None]
        deadline = time.monotonic() + (timeout or TIMEOUT_S)
        while not all(c.closed for c in channels):
            if time.monotonic() > deadline:
                still = ", ".join(c.label for c in channels if not c.closed)
                raise Failed(f"H-5 {code or 'goodbye'} and both channels closed",
                             f"still open: {still}; errors {self._fatal_names() or 'none'}")
            self.pump(0.5)
        expected = [f"{code} on the {channel} channel"]
        if channel == "data":
            expected.append("channel_lost on the request channel")
        if code is not None and sorted(self._fatal_names()) != sorted(expected):
            how = ", ".join(f"{c.label} channel {c.closed}" for c in channels)
            raise Failed(" and ".join(expected), f"{'; '.join(self._fatal_names()) or 'no error'} ({how})")

    def _fatal_names(self):
        return [f"{wire.CODE_NAMES.get(code, code)} on the {label} channel" for label, code in self.fatal]

    def close(self):
        for channel in (self.request, self.data):
            if channel is not None:
                channel.close()

    def deal(self, channel, message):
        name = message.name
        deal = getattr(self, f"_on_{name}", None) if name else None
        if name is None:
            self.unknown.append(message)
        elif deal is None:
            raise Failed("a frame that a server sends", message)
        elif name != "error" and channel is not {"join_ok": self.data, "chunk": self.data,
                                                 "transfer_end": self.data}.get(name, self.request):
            raise Failed(f"{name} on its channel", f"{message} on the {channel.label} channel")
        else:
            deal(channel, message)

    def _on_hello_ok(self, _, message):
        self.hello_ok = message

    def _on_join_ok(self, _, message):
        self.join_ok = message

    def _on_pong(self, _, message):
        self.pongs.append(message.id)

    def _on_notice(self, _, message):
        self.notices.append(message)

    def _on_error(self, channel, message):
        self.on_code(message.code)
        if message.code == 0:
            raise Failed("a code other than 0 in error", message)
        request = self.requests.get(message.id)
        if not (32 <= message.code <= 95 or 128 <= message.code <= 159):
            if message.id != 0:
                raise Failed("H-5 id 0 in an error that ends the session", message)
            self.fatal.append((channel.label, message.code))
        elif message.code == wire.CODES["unknown_type"] or request is None:
            self.refusals.append(message)
        elif request.ended or request.chunks:
            raise Failed(f"R-3 exactly one end of {request}, error only before any chunk", message)
        else:
            request.error = message
            self.ends.append(request.id)

    def _open(self, message):
        request = self.requests.get(message.id)
        if request is None or request.ended and message.name != "mesh_opened":
            raise Failed("R-3 frames only for requests that are open", message)
        return request

    def _on_mesh_opened(self, _, message):
        request = self._open(message)
        if request.opened or request.error or request.kind not in ("get_base_mesh", "get_packet"):
            raise Failed(f"one mesh_opened, for get_base_mesh and get_packet, before its error, of {request}", message)
        if message.handle == 0 or not 1 <= len(message.directory) <= wire.MAX_DIRECTORY:
            raise Failed("a handle that is not 0 and a directory", message)
        if request.handle not in (None, message.handle):
            raise Failed(f"the handle of the chunks, {request.handle}", message)
        request.opened = message
        self.handles[message.handle] = message.generation

    def _on_chunk(self, _, message):
        request = self._open(message)
        size, what = len(message.bytes), f"of {request}, which has {request.chunks} chunks up to {request.next}"
        if not 1 <= size <= wire.MAX_CHUNK:
            raise Failed("T-2 a chunk of 1 to 262144 bytes", message)
        if request.chunks == 0:
            request.first = request.next = request.fields.get("offset", 0)
            request.total, request.packet, request.handle = message.total, message.packet, message.handle
            if request.opened and request.opened.handle != message.handle:
                raise Failed(f"the handle of mesh_opened, {request.opened.handle}", message)
        if (message.offset, message.total) != (request.next, request.total) or message.offset + size > message.total:
            raise Failed(f"T-1 a chunk at {request.next} of {request.total} {what}", message)
        if (message.packet, message.handle) != (request.packet, request.handle):
            raise Failed(f"T-1 a chunk of packet {request.packet}, handle {request.handle} {what}", message)
        if request.handle and self._turn.setdefault(request.handle, request) is not request:
            raise Failed(f"R-4 the end of {self._turn[request.handle]} before chunks of the same handle", message)
        request.chunks += 1
        request.next += size
        request.data += message.bytes

    def _on_transfer_end(self, _, message):
        request = self._open(message)
        if message.result > wire.END_OF_MESH or (message.code != 0) != (message.result == wire.FAILED):
            raise Failed("T-3 a known result, and a code with failed only", message)
        if message.result == wire.COMPLETE and (request.chunks == 0 or request.next != request.total):
            raise Failed(f"T-1 a complete transfer up to {request.total}", f"{message} behind {request.next}")
        if message.result == wire.END_OF_MESH and (request.chunks or request.kind != "get_next_packet"):
            raise Failed("R-8 end_of_mesh for get_next_packet without a chunk", message)
        if message.result == wire.CANCELLED and not request.cancelled:
            raise Failed("K-1 cancelled only of what was cancelled", message)
        if message.code:
            self.on_code(message.code)
        self._turn.pop(request.handle, None)
        request.end = message
        self.ends.append(request.id)
