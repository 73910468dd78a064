#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""The suite itself: it finds nothing wrong with the proper mock server, and finds each of the faults made here.

A fault is a MockSession that does one thing otherwise; the check named with it has to fail, and to say what it expected.
"""

import asyncio
import pathlib
import struct
import threading
import unittest

import packets
import report
import run
import session
import suite
import wire
from mock_server import Server
from mock_session import EndOfSession, MockSession

_GOLDEN = pathlib.Path(__file__).resolve().parents[1] / "golden" / "torus-lossless.pmcd"
_MESHES = {"small": packets.make([100, 200, 3000, 49], 1), "Golden torus": packets.PacketFile.load(_GOLDEN),
           "big": packets.make([24 << 20, 500], "big")}


class Running:
    """A mock server with sessions of this kind, in a thread. Use as a context."""

    def __init__(self, kind=MockSession):
        self.kind, self.loop, self.address = kind, asyncio.new_event_loop(), None
        self.loop.set_exception_handler(lambda *_: None)  # a faulty server may well trip over itself
        self.thread = threading.Thread(target=self._serve, daemon=True)

    def _serve(self):
        self.loop.run_forever()

    def __enter__(self):
        self.thread.start()
        server = Server(_MESHES, lambda text: None, self.kind)
        listening = server.listen("127.0.0.1", 0, 0, server.on_request, server.on_data)
        self.listeners = asyncio.run_coroutine_threadsafe(listening, self.loop).result(10)
        self.address = server.address
        return self

    def __exit__(self, *_):
        asyncio.run_coroutine_threadsafe(self._cancel(), self.loop).result(10)
        self.loop.call_soon_threadsafe(self.loop.stop)
        self.thread.join(10)
        self.loop.close()

    async def _cancel(self):
        for listener in self.listeners:
            listener.close()
        for task in asyncio.all_tasks():
            if task is not asyncio.current_task():
                task.cancel()
        await asyncio.sleep(0)

    def results(self, names=None):
        meshes = [suite.Mesh(name, file) for name, file in _MESHES.items()]
        return run.run_checks(suite.Context(self.address, *meshes), names=names)


class EndsTwice(MockSession):
    def end(self, transfer, result, code=0):
        super().end(transfer, result, code)
        super().end(transfer, result, code)


class EndsWithoutCode(MockSession):
    def end(self, transfer, result, code=0):
        super().end(transfer, result, 65 if result == wire.COMPLETE else 0)


class SkipsBytes(MockSession):
    async def transfer(self, transfer, until=None):
        source = transfer.source
        transfer.source = lambda: (lambda found: found and (found[0], found[1] + 1, found[2]))(source())
        return await super().transfer(transfer, until)


class Damages(MockSession):
    def __init__(self, *arguments):
        super().__init__(*arguments)
        self.damage = 60


class MovesThePlaceOnCancel(MockSession):
    def end(self, transfer, result, code=0):
        if result == wire.CANCELLED and transfer.handle:
            self.places[transfer.handle] += 1
        super().end(transfer, result, code)


class IgnoresCancel(MockSession):
    def _cancel(self, number):
        pass


class AnswersCancel(MockSession):
    def _cancel(self, number):
        if number not in self.open:
            self.request.send("error", id=number, code=wire.CODES["unknown_handle"], text="")
        super()._cancel(number)


class ForgetsOffsets(MockSession):
    def _get_packet(self, message):
        message.fields["offset"] = 0
        return super()._get_packet(message)


class TakesAnyRange(MockSession):
    def _get_packet(self, message):
        if message.packet > 3:
            message.fields["packet"] = 0
        return super()._get_packet(message)


class OpensTwice(MockSession):
    def _get_packet(self, message):
        self.names.clear()
        return super()._get_packet(message)


class NewHandles(MockSession):
    def open_mesh(self, message, file):
        self.names = {handle: None for handle in self.names}
        return super().open_mesh(message, file)


class FirstMeshIsZero(MockSession):
    def _get_next_packet(self, message):
        self.last = min(self.places, default=0)
        return super()._get_next_packet(message)


class NeverGoesBack(MockSession):
    async def transfer(self, transfer, until=None):
        before = self.places.get(transfer.handle, 0)
        await super().transfer(transfer, until)
        self.places[transfer.handle] = max(before, self.places.get(transfer.handle, 0))


class EndsOnce(MockSession):
    def end(self, transfer, result, code=0):
        super().end(transfer, result, code)
        if result == wire.END_OF_MESH:
            self.places.pop(transfer.handle)


class ClosesForUnknownTypes(MockSession):
    def handle(self, message):
        if message.name is None:
            raise EndOfSession("unknown_type")
        super().handle(message)


class PongsZero(MockSession):
    def handle(self, message):
        if message.name == "ping":
            message.fields["id"] = 0
        super().handle(message)


class KeepsOnAfterGoodbye(MockSession):
    def handle(self, message):
        if message.name != "goodbye":
            super().handle(message)


class TakesLongBodies(MockSession):
    def handle(self, message):
        if message.name == "ping" and "wrong" in message.fields:
            return
        super().handle(message)


class MindsCase(MockSession):
    def page(self, text, after, most):
        return super().page(text if text in "".join(self.meshes) else "no such mesh", after, most)


class ForgetsWhatRemains(MockSession):
    def page(self, text, after, most):
        page = super().page(text, after, most)
        return page[:4] + struct.pack("<I", 0) + page[8:]


class TellsAnotherGeneration(MockSession):
    def page(self, text, after, most):
        page = super().page(text, after, most)
        return page[:-70] + bytes([page[-70] ^ 1]) + page[-69:]


class TakesEverybody(MockSession):
    def refuse(self, message, code):
        super().refuse(message, "internal_error" if code == "not_joined" else code)


FAULTS = {
    EndsTwice: "end_of_mesh_as_often_as_it_is_asked", EndsWithoutCode: "every_packet_is_the_right_one",
    SkipsBytes: "every_packet_is_the_right_one", Damages: "every_packet_is_the_right_one",
    MovesThePlaceOnCancel: "cancel_of_what_waits_moves_nothing", IgnoresCancel: "cancel_of_what_runs",
    AnswersCancel: "cancel_of_what_is_not_open", ForgetsOffsets: "get_packet_in_the_same_session",
    TakesAnyRange: "beyond_the_end", OpensTwice: "get_packet_in_the_same_session", NewHandles: "opening_again",
    FirstMeshIsZero: "handle_0_is_the_mesh_asked_for_last", NeverGoesBack: "opening_again",
    EndsOnce: "end_of_mesh_as_often_as_it_is_asked", ClosesForUnknownTypes: "unknown_types_on_the_request_channel",
    PongsZero: "ping_at_any_time", KeepsOnAfterGoodbye: "goodbye", TakesLongBodies: "bodies_of_a_wrong_form",
    MindsCase: "filters", ForgetsWhatRemains: "pages", TellsAnotherGeneration: "the_list_and_the_directories_agree",
    TakesEverybody: "requests_before_join",
}


class Suite(unittest.TestCase):
    def test_a_proper_server(self):
        with Running() as server:
            results = server.results()
        self.assertEqual([f"{r.check.name}: {r.text}" for r in results if r.outcome == report.FAILED], [])
        passed = {mark for mark, (outcome, *_) in report.by_mark(results).items() if outcome == report.PASSED}
        self.assertLessEqual({"F-1", "S-4", "V-4", "H-1", "R-12", "K-2", "T-4", "L-3"}, passed)

    def test_faults_are_found(self):
        self.addCleanup(setattr, session, "TIMEOUT_S", session.TIMEOUT_S)
        session.TIMEOUT_S = 3  # what a faulty server never answers
        for kind, name in FAULTS.items():
            with self.subTest(fault=kind.__name__), Running(kind) as server:
                (result,) = server.results([name])
                self.assertEqual(result.outcome, report.FAILED)
                self.assertIn("expected", result.text)
                self.assertNotIn("Traceback", result.text)


if __name__ == "__main__":
    unittest.main()
