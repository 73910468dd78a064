# SPDX-License-Identifier: MIT
"""A proper server's side of one session, in plain Python: what the mock server does wherever no scenario says otherwise.

It serves first in, first out, one transfer at a time, from .pmcd files in memory. It is written for tests: no time-outs, no
limits on sessions, a token that never grows old.
"""

import asyncio
import struct

import wire

_CHUNK = 16384
_CLIENT_TYPES = {"hello", "ping", "goodbye", "join", "cancel", *wire.REQUESTS}


class EndOfSession(Exception):
    """The session ends by this code (None: without an error), told on this channel."""

    def __init__(self, code, channel="request"):
        super().__init__(code)
        self.code, self.channel = code, channel


class Line:
    """One accepted connection: frames in and out. `log` gets each as text."""

    def __init__(self, label, reader, writer, log):
        self.label, self.reader, self.writer, self.log, self.pieces = label, reader, writer, log, None

    async def next(self):
        """The client's next message, None at the end; raises EndOfSession for what cannot be read."""
        try:
            length = struct.unpack("<I", await self.reader.readexactly(4))[0]
            if length < 2:
                raise EndOfSession("malformed", self.label)
            if length > wire.MAX_TO_SERVER:
                raise EndOfSession("frame_too_long", self.label)
            content = await self.reader.readexactly(length)
        except (asyncio.IncompleteReadError, ConnectionError):
            self.log(f"client, {self.label}: closed")
            return None
        number, body = struct.unpack_from("<H", content)[0], content[2:]
        try:
            message = wire.parse(number, body)
        except wire.WrongForm as wrong:
            # Magic and version are judged before anything else; names have a code of their own.
            message = wire.Message(number, body, wire.NAMES[number])
            if message.name == "get_base_mesh" and len(body) >= 5 and len(body) == 5 + body[4]:
                message.fields = {"id": struct.unpack_from("<I", body)[0], "name": "/"}
            else:
                message.fields = {"wrong": str(wrong)}
        self.log(f"client, {self.label}: {message}")
        return message

    def send(self, name, /, **fields):
        self.log(f"server, {self.label}: {name}" + (f" {fields['id']}" if "id" in fields else ""))
        self.write(wire.message(name, **fields))

    def write(self, data):
        size = self.pieces or len(data)
        for begin in range(0, len(data), size or 1):
            if not self.writer.is_closing():
                self.writer.write(data[begin:begin + size])

    async def drain(self):
        try:
            await self.writer.drain()
        except ConnectionError:
            pass

    def close(self):
        self.writer.close()

    def cut(self):
        """Ends the connection at once; what was not sent yet is lost."""
        self.writer.transport.abort()


def judge_hello(message, name, magic=wire.MAGIC):
    """Raises EndOfSession unless this is a `name` of our version and form."""
    if message.name != name:
        raise EndOfSession("wrong_state")
    if len(message.body) >= 4 and message.body[:4] != magic:
        raise EndOfSession("bad_magic")
    if len(message.body) >= 8 and struct.unpack_from("<H", message.body, 4)[0] != wire.MAJOR:
        raise EndOfSession("unsupported_version")
    if "wrong" in message.fields or len(message.fields.get("agent", "").encode()) > wire.MAX_AGENT:
        raise EndOfSession("malformed")


def _raw(text):
    """The bytes of a filter or after, which need not be UTF-8."""
    return text.encode("utf-8", "surrogateescape")


class Transfer:
    """A request that waits or runs."""

    def __init__(self, number, handle, source):
        self.id, self.handle, self.source, self.cancelled = number, handle, source, False


class MockSession:
    """The state of one session: handles, places, the queue. handle() takes a message of the request channel."""

    def __init__(self, meshes, token, request):
        self.meshes, self.token, self.request, self.data = meshes, token, request, None
        self.places, self.names, self.last = {}, {}, 0  # by handle
        self.queue, self.open, self.ready = [], {}, asyncio.Event()
        self.chunk, self.most, self.damage = _CHUNK, wire.MAX_PAGE, None  # what scenarios change
        self.opened_late, self.held = False, []

    def welcome(self, data_port):
        self.request.send("hello_ok", token=self.token, data_port=data_port, seconds=30, open_requests=8,
                          agent="pmcd-mock 1.0")

    def joined(self, data):
        self.data = data
        data.send("join_ok")

    def handle(self, message):
        """Does at once what needs no turn, and queues the rest. Raises EndOfSession."""
        if message.name is None:
            number = struct.unpack_from("<I", message.body)[0] if len(message.body) >= 4 else 0
            self.request.send("error", id=number, code=wire.CODES["unknown_type"], text="unknown type")
        elif message.name not in _CLIENT_TYPES or message.name in ("hello", "join"):
            raise EndOfSession("wrong_state")
        elif "wrong" in message.fields or message.name in (*wire.REQUESTS, "cancel") and message.id == 0:
            raise EndOfSession("malformed")
        elif message.name == "goodbye":
            raise EndOfSession(None)
        elif message.name == "ping":
            self.request.send("pong", id=message.id)
        elif self.data is None:
            self.refuse(message, "not_joined")
        elif message.name == "cancel":
            self._cancel(message.id)
        else:
            self._request(message)

    def refuse(self, message, code):
        self.request.send("error", id=message.id, code=wire.CODES[code], text=code.replace("_", " "))

    def _cancel(self, number):
        transfer = self.open.get(number)
        if transfer is None:
            return
        transfer.cancelled = True
        if transfer in self.queue:
            self.queue.remove(transfer)
            self.end(transfer, wire.CANCELLED)

    def end(self, transfer, result, code=0):
        self.data.send("transfer_end", id=transfer.id, result=result, code=code)
        self.open.pop(transfer.id, None)

    def _request(self, message):
        if message.name == "get_mesh_list" and 128 < max(len(_raw(message.filter)), len(_raw(message.after))):
            raise EndOfSession("malformed")
        if message.id in self.open:
            raise EndOfSession("duplicate_id")
        if len(self.open) >= 8:
            return self.refuse(message, "too_many_requests")
        source, handle = getattr(self, f"_{message.name}")(message)
        if source:
            self.open[message.id] = Transfer(message.id, handle, source)
            self.queue.append(self.open[message.id])
            self.ready.set()
        return None

    def _get_mesh_list(self, message):
        return lambda: (self.page(message.filter, message.after, message.most), 0, 0), 0

    def _get_base_mesh(self, message):
        if not wire.is_mesh_name(message.fields["name"]):
            return self.refuse(message, "bad_name"), 0
        if message.fields["name"] not in self.meshes:
            return self.refuse(message, "unknown_mesh"), 0
        handle = self.open_mesh(message, self.meshes[message.fields["name"]])

        return lambda: (self.names[handle].packets[0], 0, 0), handle

    def _get_next_packet(self, message):
        handle = message.handle or self.last
        if handle not in self.places:
            return self.refuse(message, "unknown_handle"), 0
        self.last = handle
        return lambda: self._packet(handle), handle

    def _get_packet(self, message):
        file = next((f for f in self.meshes.values() if f.generation == message.generation), None)
        if file is None:
            return self.refuse(message, "mesh_changed"), 0
        if message.packet >= len(file.packets) or message.offset >= len(file.packets[message.packet]):
            return self.refuse(message, "bad_range"), 0
        if file in self.names.values():
            handle = self.last = next(h for h, f in self.names.items() if f is file)
        else:
            handle = self.open_mesh(message, file)
            self.places[handle] = message.packet

        return lambda: (file.packets[message.packet], message.offset, message.packet), handle

    def open_mesh(self, message, file):
        handle = next((h for h, f in self.names.items() if f is file), len(self.names) + 1)
        self.names[handle] = file
        self.places.setdefault(handle, 0)
        self.last = handle
        opened = {"id": message.id, "handle": handle, "generation": file.generation, "directory": file.directory.raw}
        if self.opened_late:
            self.held.append(opened)
        else:
            self.request.send("mesh_opened", **opened)
        return handle

    def release(self):
        """Sends what was held back of mesh_opened."""
        while self.held:
            self.request.send("mesh_opened", **self.held.pop(0))

    def _packet(self, handle):
        place, all_packets = self.places[handle], self.names[handle].packets
        return (all_packets[place], 0, place) if place < len(all_packets) else None

    def page(self, text, after, most):
        """The bytes of a page of the mesh list."""
        def fold(name):
            return bytes(byte + 32 if 65 <= byte <= 90 else byte for byte in _raw(name))
        names = sorted((n for n in self.meshes if fold(text) in fold(n)), key=str.encode)
        rest = [n for n in names if n.encode() > _raw(after)]
        shown = rest[:min(most or self.most, self.most)]
        out = struct.pack("<III", len(names), len(rest) - len(shown), len(shown))
        for name in shown:
            directory = self.meshes[name].directory
            last = directory.levels[-1]
            out += struct.pack("<B", len(name.encode())) + name.encode() + struct.pack(
                "<QIIIQBBB6d", directory.generation, last.vertices, last.faces, len(directory.levels),
                directory.all_bytes, directory.flags, directory.bits, directory.raw[4], *directory.box)
        return out

    async def run_queue(self):
        """Serves what is queued, one after the other, until it is cancelled itself."""
        while True:
            while not self.queue:
                self.ready.clear()
                await self.ready.wait()
            await self.transfer(self.queue.pop(0))

    async def transfer(self, transfer, until=None):
        """Sends the chunks and the end of one transfer; `until`: stop silently behind this byte of the packet."""
        found = transfer.source()
        if found is None:
            return self.end(transfer, wire.END_OF_MESH)
        content, offset, number = found
        if self.damage is not None:
            content = bytes(byte ^ (place == self.damage) for place, byte in enumerate(content))
        while offset < len(content):
            if transfer.cancelled:
                return self.end(transfer, wire.CANCELLED)
            stop = min(offset + self.chunk, len(content), until if until is not None else len(content))
            if stop <= offset:
                return None
            self.data.send("chunk", id=transfer.id, handle=transfer.handle, packet=number, offset=offset,
                           total=len(content), bytes=content[offset:stop])
            offset = stop
            await self.data.drain()
        if transfer.handle:
            self.places[transfer.handle] = number + 1
        return self.end(transfer, wire.COMPLETE)
