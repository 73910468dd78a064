# SPDX-License-Identifier: MIT
"""Plays a scenario for one client: steps of a JSON file, session by session; README.md beside it has the list of steps.

What a step does not say is done properly by MockSession. Pings are answered whenever they come, unless a step expects one.
"""

import asyncio
import secrets

import wire
from mock_session import EndOfSession, Line, MockSession, judge_hello

_ON_DATA = ("join_ok", "chunk", "transfer_end")
_STEPS = {"accept", "greet", "expect", "serve", "default", "send", "raw", "wait", "quiet", "close", "gone"}


class WrongClient(Exception):
    """The client did something else than the scenario demands."""


class WrongScenario(Exception):
    """The scenario cannot be played."""


class Play:
    """One run of a scenario against whoever connects."""

    def __init__(self, scenario, server, timeout):
        self.sessions = scenario.get("sessions")
        if not isinstance(self.sessions, list) or not all(isinstance(steps, list) for steps in self.sessions):
            raise WrongScenario("a scenario has `sessions`, a list of lists of steps")
        for step in (step for steps in self.sessions for step in steps):
            if len(_STEPS & set(step)) != 1:
                raise WrongScenario(f"a step is one of {', '.join(sorted(_STEPS))}: {step}")
        self.server, self.timeout, self.pieces = server, timeout, scenario.get("pieces")
        self.waiting = {"request": asyncio.Queue(), "data": asyncio.Queue()}
        self.inbox = None

    # Connections as they come.

    async def on_request(self, reader, writer):
        await self.waiting["request"].put(Line("request", reader, writer, self.server.log))

    async def on_data(self, reader, writer):
        await self.waiting["data"].put(Line("data", reader, writer, self.server.log))

    async def run(self):
        for number, steps in enumerate(self.sessions, 1):
            self.server.log(f"-- session {number}")
            self.inbox, self.readers, self.session, self.data, self.last = asyncio.Queue(), [], None, None, None
            for place, step in enumerate(steps, 1):
                try:
                    await self._step(step)
                except WrongClient as wrong:
                    raise WrongClient(f"session {number}, step {place} {step}: {wrong}") from wrong
                except EndOfSession as end:
                    raise WrongClient(f"session {number}, step {place} {step}: it deserves {end.code}") from end
            self._close("both")
            for reader in self.readers:
                reader.cancel()

    async def _step(self, step):
        kind = next(iter(_STEPS & set(step)))
        await getattr(self, f"_do_{kind}")(step[kind], step)

    async def _in_time(self, what, awaitable):
        try:
            return await asyncio.wait_for(awaitable, self.timeout)
        except asyncio.TimeoutError:
            raise WrongClient(f"{what} did not come within {self.timeout} s") from None

    async def _read(self, line):
        while True:
            try:
                message = await line.next()
            except EndOfSession as end:
                message = end
            await self.inbox.put((line.label, message))
            if not isinstance(message, wire.Message):
                return

    # Steps.

    async def _do_accept(self, channel, _):
        label = "data" if channel == "data" else "request"
        line = await self._in_time(f"a connection to the {label} channel", self.waiting[label].get())
        line.pieces = self.pieces
        self.readers.append(asyncio.create_task(self._read(line)))
        if label == "data":
            self.data = line
        else:
            self.session = MockSession(self.server.meshes, secrets.token_bytes(16), line)

    async def _do_greet(self, *_):
        await self._do_accept("request", None)
        await self._expect("request")
        judge_hello(self.last, "hello")
        self.session.welcome(self.server.data_port)
        await self._do_accept("data", None)
        await self._expect("data")
        judge_hello(self.last, "join")
        if self.last.token != self.session.token:
            raise WrongClient(f"another token: {self.last}")
        self.session.joined(self.data)

    async def _do_expect(self, name, step):
        await self._expect(step.get("channel", "data" if name == "join" else "request"), name)
        self._match(step.get("where", {}))

    def _match(self, where):
        for field, expected in where.items():
            got = self.last.fields.get(field)
            if isinstance(expected, str) and expected.startswith("$"):
                expected = self._value(expected)
            if expected != "*" and got not in (expected if isinstance(expected, list) else [expected]):
                raise WrongClient(f"{field} {expected} was demanded: {self.last}")

    async def _expect(self, channel, name=None):
        """Takes the client's next frame into self.last; pings are answered on the way."""
        while True:
            label, message = await self._in_time(name or "a frame", self.inbox.get())
            if message is None:
                raise WrongClient(f"the client closed the {label} channel instead of sending {name or 'a frame'}")
            if isinstance(message, EndOfSession):
                raise message
            if message.name == "ping" and name != "ping":
                self.session.request.send("pong", id=message.id)
                continue
            if label != channel or name and message.name != name:
                raise WrongClient(f"{name or 'a frame'} on the {channel} channel was demanded: {message} on the {label} channel")
            self.last = message
            return

    async def _do_serve(self, how, _):
        """Serves the last frame: properly (true), or with `how` an object: upto, chunk, most, damage, opened_late."""
        session, how = self.session, how if isinstance(how, dict) else {}
        before = session.chunk, session.most
        session.chunk, session.most = how.get("chunk", session.chunk), how.get("most", session.most)
        session.damage, session.opened_late = how.get("damage"), how.get("opened_late", False)
        if self.last.name == "hello":
            judge_hello(self.last, "hello")
            session.welcome(self.server.data_port)
        elif self.last.name == "join":
            session.joined(self.data)
        else:
            session.handle(self.last)
        while session.queue:
            await session.transfer(session.queue.pop(0), how.get("upto"))
        if session.held:
            await session.data.drain()
            await asyncio.sleep(0.05)  # so that the data channel really is first
            session.release()
        session.damage, session.opened_late = None, False
        session.chunk, session.most = before
        await session.request.drain()

    async def _do_default(self, how, step):
        """Serves properly until the client has gone, or, with `until`, until that frame comes (which is not served)."""
        until = how.get("until") if isinstance(how, dict) else None
        count = how.get("count", 1) if isinstance(how, dict) else 1
        while True:
            label, message = await self._in_time("a frame", self.inbox.get())
            if message is None or isinstance(message, wire.Message) and message.name == "goodbye":
                if until:
                    raise WrongClient(f"the client left before {until}")
                return
            if isinstance(message, EndOfSession):
                raise message
            if label == "data":
                raise WrongClient(f"{message} on the data channel")
            self.last = message
            if message.name == until:
                count -= 1
                if count == 0:
                    self._match(step.get("where", {}))
                    return
            await self._do_serve(True, None)

    async def _do_send(self, name, step):
        fields = {key: self._value(value) for key, value in step.get("fields", {}).items()}
        if isinstance(name, int):
            data = wire.frame(name, bytes.fromhex(step.get("body", "")))
        else:
            data = wire.frame(wire.TYPES[name], wire.body_of(name, **fields) + bytes.fromhex(step.get("extra", "")))
        channel = step.get("channel", "data" if name in _ON_DATA else "request")
        self.server.log(f"server, {channel}: {name}, by the scenario")
        for _ in range(step.get("times", 1)):
            await self._write(data, channel, step.get("pieces"))

    async def _do_raw(self, text, step):
        await self._write(bytes.fromhex(text), step.get("channel", "request"), step.get("pieces"))

    async def _write(self, data, channel, pieces):
        line = self.data if channel == "data" else self.session.request
        size = pieces or len(data) or 1
        for begin in range(0, len(data), size):
            line.write(data[begin:begin + size])
            await line.drain()
            if pieces:
                await asyncio.sleep(0.001)

    async def _do_wait(self, seconds, _):
        await asyncio.sleep(seconds)

    async def _do_quiet(self, seconds, _):
        """The client sends nothing for so long."""
        await asyncio.sleep(seconds)
        if not self.inbox.empty():
            raise WrongClient(f"{self.inbox.get_nowait()[1]} where nothing may come")

    async def _do_close(self, which, step):
        self._close(which, step.get("how") == "cut")

    def _close(self, which, cut=False):
        for line in (self.session and self.session.request, self.data):
            if line and which in ("both", line.label):
                if cut:
                    line.cut()
                else:
                    line.close()

    async def _do_gone(self, before, _):
        """The client says goodbye or closes a channel; before that it sends nothing but frames of the list, if it is one."""
        while True:
            _, message = await self._in_time("the client's end", self.inbox.get())
            if message is None or isinstance(message, wire.Message) and message.name == "goodbye":
                return
            if isinstance(before, list) and isinstance(message, wire.Message) and message.name in before:
                continue
            raise WrongClient(f"{message} instead of the client's end")

    def _value(self, value):
        """What a field's text stands for: $id, $handle, $generation, $directory, $token, $data_port, $packet:K[:FROM:TO]."""
        if not isinstance(value, str) or not value.startswith("$"):
            return value
        word, *numbers = value[1:].split(":")
        session = self.session
        if word == "id":
            return self.last.id
        if word == "handle":
            return session.last or 1
        if word == "token":
            return session.token
        if word == "data_port":
            return self.server.data_port
        file = session.names.get(session.last) or next(iter(self.server.meshes.values()))
        if word == "generation":
            return file.generation
        if word == "directory":
            return file.directory.raw
        if word == "packet":
            content = file.packets[int(numbers[0])]
            return content[int(numbers[1]):int(numbers[2])] if len(numbers) == 3 else content
        if word == "size":
            return len(file.packets[int(numbers[0])])
        raise WrongScenario(f"unknown word {value}")
