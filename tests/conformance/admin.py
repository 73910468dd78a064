# SPDX-License-Identifier: MIT
"""An operator's client of the admin channel: requests, their JSON answers, and ingests. It judges the form of what comes."""

import json

import packets
import wire
from session import Channel, Failed


class Admin:
    """One connection to the admin socket at `path`."""

    def __init__(self, path, greet=True, on_code=None):
        self.channel = Channel(str(path), "admin", wire.MAX_ADMIN)
        self.on_code = on_code or (lambda code: None)
        self._id = 0
        if greet:
            self.send("admin_hello", agent="conformance")
            answer = self.next()
            if answer is None or answer.name != "admin_hello_ok" or answer.magic != wire.ADMIN_MAGIC:
                raise Failed("A-1 admin_hello_ok", answer)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.channel.close()

    def send(self, name, /, **fields):
        self.channel.send(wire.message(name, **fields))

    def next(self, timeout=20):
        """The next message, or None at the end of the line."""
        message = self.channel.next(timeout)
        if message is not None and message.name == "error":
            self.on_code(message.code)
        return message

    def new_id(self):
        self._id += 1
        return self._id

    def expect_end(self, code):
        """An error with id 0 and this code (None: without), then the end of the line."""
        message = self.next()
        if code is not None:
            if message is None or (message.name, message.fields.get("id"), message.fields.get("code")) != (
                    "error", 0, wire.CODES[code]):
                raise Failed(f"error with id 0, {code}", message)
            message = self.next()
        if message is not None:
            raise Failed("the end of the admin channel", message)

    def ask(self, name, /, **fields):
        """(document, None), or (None, name of the code) if it was refused."""
        number = self.new_id()
        self.send(name, id=number, **fields)
        text = b""
        while True:
            message = self.next()
            if message is None or message.fields.get("id") != number or message.name not in ("admin_answer", "error"):
                raise Failed(f"A-1 an answer to {name} {number}", message)
            if message.name == "error":
                return None, wire.CODE_NAMES.get(message.code, str(message.code))
            text += message.text
            if message.last > 1 or len(message.text) > wire.MAX_CHUNK:
                raise Failed("A-6 last 0 or 1, and a text of at most 262144 bytes", message)
            if message.last:
                return json.loads(text.decode("utf-8")), None

    def begin(self, name, file, replace=False, directory=None):
        """Sends ingest_begin; returns (id, name of the code or None)."""
        number = self.new_id()
        self.send("ingest_begin", id=number, flags=1 if replace else 0, name=name,
                  directory=file.directory.raw if directory is None else directory)
        return number, self.outcome(number, "ingest_ready")

    def outcome(self, number, good):
        """None if `good` comes for this id, the code's name if an error does."""
        message = self.next()
        if message is not None and message.fields.get("id") == number:
            if message.name == "error":
                return wire.CODE_NAMES.get(message.code, str(message.code))
            if message.name == good:
                self.last = message
                return None
        raise Failed(f"A-2 {good} or error for {number}", message)

    def data(self, number, packet, offset, content):
        self.send("ingest_data", id=number, packet=packet, offset=offset, bytes=content)

    def send_packets(self, number, file, step=wire.MAX_CHUNK):
        for k, content in enumerate(file.packets):
            for offset in range(0, len(content), step):
                self.data(number, k, offset, content[offset:offset + step])

    def commit(self, number):
        self.send("ingest_commit", id=number)
        return self.outcome(number, "ingest_ok")

    def ingest(self, name, source, replace=False, step=wire.MAX_CHUNK):
        """Stores a PacketFile or a .pmcd file under `name`; None, or the name of the code that refused it."""
        file = source if isinstance(source, packets.PacketFile) else packets.PacketFile.load(source)
        number, refused = self.begin(name, file, replace)
        if refused:
            return refused
        self.send_packets(number, file, step)
        return self.commit(number)
