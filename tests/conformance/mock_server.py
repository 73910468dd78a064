#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""A scripted server for testing clients; README.md beside it has the form of a scenario.

usage: mock_server.py [--port P] [--data-port P] [--mesh NAME=FILE.pmcd]... [--scenario FILE.json] [--timeout S] [--quiet]

Without a scenario it serves the meshes properly until it is ended. With one it plays the scenario, prints what the client
did, and ends: exit code 0 if the client behaved as the scenario demands, 1 if not, 2 for wrong usage or a wrong scenario.
The first line of its output is `listening on HOST:PORT`.
"""

import argparse
import asyncio
import json
import pathlib
import secrets
import sys

import packets
import wire
from mock_scenario import Play, WrongClient, WrongScenario
from mock_session import EndOfSession, Line, MockSession, judge_hello


class Server:
    """Two listeners, and the sessions by token, each a `kind`."""

    def __init__(self, meshes, log, kind=MockSession):
        self.meshes, self.log, self.kind, self.sessions, self.data_port = meshes, log, kind, {}, 0

    async def listen(self, host, port, data_port, on_request, on_data):
        data = await asyncio.start_server(on_data, host, data_port)
        self.data_port = data.sockets[0].getsockname()[1]
        request = await asyncio.start_server(on_request, host, port)
        self.address = host, request.sockets[0].getsockname()[1]
        return request, data

    async def on_request(self, reader, writer):
        """A proper session, from its first frame to its end."""
        line, session, queue = Line("request", reader, writer, self.log), None, None
        try:
            message = await line.next()
            if message is not None:
                judge_hello(message, "hello")
                session = self.kind(self.meshes, secrets.token_bytes(16), line)
                self.sessions[session.token] = session
                session.ended = asyncio.Event()
                session.welcome(self.data_port)
                queue = asyncio.create_task(session.run_queue())
                ended = asyncio.create_task(session.ended.wait())
                while await self._step(line, session, ended):
                    pass
        except EndOfSession as end:
            _say(line if end.channel == "request" else session.data, end)
        finally:
            if queue:
                queue.cancel()
            if session:
                self.sessions.pop(session.token, None)
                if session.data:
                    session.data.close()
            line.close()

    async def _step(self, line, session, ended):
        reading = asyncio.create_task(line.next())
        await asyncio.wait((reading, ended), return_when=asyncio.FIRST_COMPLETED)
        if not reading.done():
            reading.cancel()
            raise EndOfSession("channel_lost")
        message = reading.result()
        if message is not None:
            session.handle(message)
        return message is not None

    async def on_data(self, reader, writer):
        line, session = Line("data", reader, writer, self.log), None
        try:
            message = await line.next()
            if message is None:
                return
            judge_hello(message, "join")
            session = self.sessions.get(message.token)
            if session is None or session.data is not None:
                session = None
                raise EndOfSession("bad_token")
            session.joined(line)
            while (message := await line.next()) is not None:
                if message.name is not None:
                    raise EndOfSession("wrong_state")
                number = int.from_bytes(message.body[:4], "little") if len(message.body) >= 4 else 0
                line.send("error", id=number, code=wire.CODES["unknown_type"], text="unknown type")
        except EndOfSession as end:
            _say(line, end)
            if session:
                _say(session.request, EndOfSession("channel_lost"))
                session.request.close()
        finally:
            line.close()
            if session:
                session.ended.set()


def _say(line, end):
    if end.code:
        line.send("error", id=0, code=wire.CODES[end.code], text=end.code.replace("_", " "))


def _arguments(argv):
    parser = argparse.ArgumentParser(description="A scripted pmcd server for testing clients.")
    parser.add_argument("--host", default="127.0.0.1")
    parser.add_argument("--port", type=int, default=0, help="request port; 0: any free one")
    parser.add_argument("--data-port", type=int, default=0)
    parser.add_argument("--mesh", action="append", default=[], metavar="NAME=FILE.pmcd")
    parser.add_argument("--scenario", type=pathlib.Path)
    parser.add_argument("--value", action="append", default=[], metavar="NAME=JSON", help="a value of the scenario")
    parser.add_argument("--timeout", type=float, default=10, help="seconds that a step may wait for the client")
    parser.add_argument("--quiet", action="store_true", help="do not print every frame")
    return parser.parse_args(argv)


def _meshes(options, scenario):
    """The meshes of the scenario (paths are relative to it), then those of the command line."""
    found = {}
    for name, source in scenario.get("meshes", {}).items():
        found[name] = (packets.make(source, name) if isinstance(source, list)
                       else packets.PacketFile.load(options.scenario.parent / source))
    for one in options.mesh:
        name, _, path = one.partition("=")
        found[name] = packets.PacketFile.load(path)
    return found


def _scenario(options):
    """The scenario with its values put in: `$NAME` of "values" is what --value says, or the first of the list."""
    if not options.scenario:
        return {}
    scenario = json.loads(options.scenario.read_text(encoding="utf-8"))
    chosen = {name: choices[0] for name, choices in scenario.get("values", {}).items()}
    for one in options.value:
        name, _, text = one.partition("=")
        if name not in chosen:
            raise WrongScenario(f"it has no value {name}")
        chosen[name] = json.loads(text)

    def put(value):
        if isinstance(value, dict):
            return {key: put(inner) for key, inner in value.items()}
        if isinstance(value, list):
            return [put(inner) for inner in value]
        return chosen.get(value[1:], value) if isinstance(value, str) and value.startswith("$") else value

    return {**scenario, "sessions": put(scenario.get("sessions"))}


async def _main(options):
    log = (lambda text: None) if options.quiet else (lambda text: print(text, flush=True))
    scenario = _scenario(options)
    server = Server(_meshes(options, scenario), log)
    told = "listening on {}:{}".format
    if not options.scenario:
        listeners = await server.listen(options.host, options.port, options.data_port, server.on_request, server.on_data)
        print(told(*server.address), flush=True)
        await asyncio.gather(*(listener.serve_forever() for listener in listeners))
    play = Play(scenario, server, options.timeout)
    await server.listen(options.host, options.port, options.data_port, play.on_request, play.on_data)
    print(told(*server.address), flush=True)
    await play.run()
    print("the client behaved as the scenario demands", flush=True)


def main(argv):
    options = _arguments(argv)
    try:
        asyncio.run(_main(options))
    except WrongClient as wrong:
        print(f"the client did something else: {wrong}", flush=True)
        return 1
    except (WrongScenario, packets.BadFile, OSError, json.JSONDecodeError) as wrong:
        print(f"mock_server: {wrong}", file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        return 0
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
