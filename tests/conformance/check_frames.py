# SPDX-License-Identifier: MIT
"""Frames: their lengths, how they are cut on the way, bodies of a wrong form, and unknown types."""

import struct
import time

import wire
from suite import checks, expect, expect_complete, expect_refused

_REQUESTS = {
    "get_mesh_list": {"filter": "", "after": "", "most": 0},
    "get_base_mesh": {"name": "x"},
    "get_next_packet": {"handle": 1},
    "get_packet": {"generation": 1, "packet": 0, "offset": 0},
}
_SMALL = {"ping": {}, "cancel": {}}
_UNKNOWN = (0x0000, 0x0021, 0x00FF, 0x0150, 0x015F, 0x7FFF, 0xFFFF)


def _length(number):
    return struct.pack("<I", number)


@checks("F-1", "H-5", "S-1")
def length_below_2_is_malformed(context):
    for length in (0, 1):
        for channel in ("request", "data"):
            with context.session() as line:
                getattr(line, channel).send(_length(length))
                line.expect_end("malformed", channel)
        with context.session(greet=False) as line:
            line.request.send(_length(length))
            line.expect_end("malformed")


@checks("F-1", "H-5", "S-1")
def length_over_the_limit_is_judged_at_once(context):
    for length in (wire.MAX_TO_SERVER + 1, 1 << 24, 1 << 31, (1 << 32) - 1):
        for channel in ("request", "data"):
            with context.session() as line:
                getattr(line, channel).send(_length(length))
                line.expect_end("frame_too_long", channel)
        with context.session(greet=False) as line:
            line.request.send(_length(length))
            line.expect_end("frame_too_long")


@checks("F-1", "V-4")
def longest_frame_is_taken(context):
    with context.session() as line:
        line.request.send(wire.frame(0x7ABC, struct.pack("<I", 5) + bytes(wire.MAX_TO_SERVER - 6)))
        line.until(lambda: line.refusals, "unknown_type")
        expect("id and code", (5, wire.CODES["unknown_type"]), (line.refusals[0].id, line.refusals[0].code))
        line.ping()


@checks("F-2", "H-2", "H-3")
def byte_by_byte(context):
    with context.session(greet=False) as line:
        _drip(line.request, wire.message("hello", agent="drip"))
        line.until(lambda: line.hello_ok, "hello_ok")
        line.connect_data()
        _drip(line.data, wire.message("join", token=line.hello_ok.token))
        line.until(lambda: line.join_ok, "join_ok")
        request, frame = line.prepare("get_base_mesh", name=context.mesh.name)
        _drip(line.request, frame + wire.message("ping", id=9))
        expect_complete(line.finish(request))
        line.until(lambda: line.pongs == [9], "pong 9")


def _drip(channel, data):
    for byte in data:
        channel.send(bytes([byte]))
        time.sleep(0.001)  # so that most of them travel alone


@checks("F-2", "R-1", "R-3", "S-3")
def many_frames_at_once(context):
    with context.session() as line:
        count = min(8, line.hello_ok.open_requests)
        asked = [line.prepare("get_base_mesh", name=context.mesh.name) for _ in range(count)]
        pings = [wire.message("ping", id=k) for k in range(200)]
        line.request.send(b"".join(frame for _, frame in asked) + b"".join(pings))
        for request, _ in asked:
            expect_complete(line.finish(request))
        line.until(lambda: len(line.pongs) == 200, "200 pongs")
        expect("pongs in their order", list(range(200)), line.pongs)


@checks("F-2")
def frames_cut_anywhere(context):
    frames = wire.message("ping", id=1) + wire.message("ping", id=2) + wire.message("ping", id=3)
    with context.session() as line:
        for cut in range(1, len(frames)):
            before = len(line.pongs)
            line.request.send(frames[:cut])
            line.request.send(frames[cut:])
            line.until(lambda b=before: len(line.pongs) == b + 3, "3 pongs")


@checks("F-3", "H-5")
def bodies_of_a_wrong_form(context):
    bodies = []
    for name, fields in (_REQUESTS | _SMALL).items():
        body = wire.body_of(name, id=7, **fields)
        bodies += [(name, body[:-1]), (name, body + b"\0"), (name, b"")]
    bodies += [("goodbye", b"\0"), ("get_base_mesh", struct.pack("<IB", 7, 9) + b"short"),
               ("get_mesh_list", struct.pack("<IB", 7, 255) + b"x")]
    for name, body in bodies:
        with context.session() as line:
            line.request.send(wire.frame(wire.TYPES[name], body))
            _ends_malformed(line, name, body)


def _ends_malformed(line, name, body, channel="request"):
    try:
        line.expect_end("malformed", channel)
    except Exception as wrong:
        wrong.args = (f"{name} with body {wire.hex_of(body)}: {wrong}",)
        raise


@checks("H-5")
def an_error_is_not_lost_behind_a_flood(context):
    for _ in range(5):
        with context.session() as line:
            line.request.send(wire.message("get_base_mesh", id=0, name="x") + wire.message("ping", id=1) * 5000)
            line.expect_end("malformed")


@checks("F-3", "V-1", "V-2")
def hellos_of_a_wrong_form(context):
    good = wire.body_of("hello", agent="abc")
    for body in (good[:-1], good + b"\0", good[:8], wire.body_of("hello", agent="a" * (wire.MAX_AGENT + 1)),
                 wire.body_of("hello", agent=b"\xff\xfe"), wire.body_of("hello", agent="a\nb")):
        with context.session(greet=False) as line:
            line.request.send(wire.frame(wire.TYPES["hello"], body))
            _ends_malformed(line, "hello", body)
    for body in (b"", b"PM", b"XXX", b"PMCD", wire.MAGIC + b"\1\0", wire.MAGIC + b"\2\0\0"):  # too short for magic and version
        with context.session(greet=False) as line:
            line.request.send(wire.frame(wire.TYPES["hello"], body))
            _ends_malformed(line, "hello", body)
    for body in (b"XXXX", b"PMCA\1\0\0"):
        with context.session(greet=False) as line:
            line.request.send(wire.frame(wire.TYPES["hello"], body))
            line.expect_end("bad_magic")
    for change in (lambda body: body[:-1], lambda body: body + b"\0", lambda body: body[:8]):
        with context.session(join=False) as line:
            line.connect_data()
            body = change(wire.body_of("join", token=line.hello_ok.token))
            line.data.send(wire.frame(wire.TYPES["join"], body))
            line.until(lambda one=line: one.data.closed, "the data channel's end")
            expect("error on the data channel", [("data", wire.CODES["malformed"])], line.fatal)


@checks("R-1", "F-3")
def id_0_is_malformed(context):
    for name, fields in _REQUESTS.items():
        with context.session() as line:
            line.send(name, id=0, **fields)
            line.expect_end("malformed")


@checks("V-4")
def unknown_types_on_the_request_channel(context):
    with context.session(join=False) as line:
        for joined in (False, True):
            if joined:
                line.connect_data()
                line.join()
            for number in _UNKNOWN:
                for body, answered in ((b"", 0), (b"\1\2\3", 0), (b"\x78\x56\x34\x12", 0x12345678),
                                       (b"\xff\xff\xff\xff more", 0xFFFFFFFF)):
                    line.refusals.clear()
                    line.request.send(wire.frame(number, body))
                    line.until(lambda: line.refusals, f"an answer to type {number:#06x}")
                    expect(f"the answer to type {number:#06x}, body {wire.hex_of(body)}",
                           (answered, wire.CODES["unknown_type"]), (line.refusals[0].id, line.refusals[0].code))
        line.ping()
        expect_complete(line.finish(line.ask("get_base_mesh", name=context.mesh.name)))


@checks("V-4", "S-4", "H-5")
def unknown_types_on_the_data_channel(context):
    with context.session() as line:
        for number in _UNKNOWN:
            line.data.send(wire.frame(number, struct.pack("<I", 99)))
        line.until(lambda: len(line.refusals) == len(_UNKNOWN), "an unknown_type for each")
        expect("ids and codes", {(99, wire.CODES["unknown_type"])}, {(e.id, e.code) for e in line.refusals})
        expect_complete(line.finish(line.ask("get_base_mesh", name=context.mesh.name)))


@checks("V-1")
def later_minor_versions_may_bring_more(context):
    with context.session(greet=False) as line:
        for minor, extra in ((1, b"\1\2\3"),):
            line.request.send(wire.frame(wire.TYPES["hello"], wire.body_of("hello", minor=minor, agent="new") + extra))
        line.until(lambda: line.hello_ok, "hello_ok")
        expect("major", wire.MAJOR, line.hello_ok.major)
        line.connect_data()
        line.data.send(wire.frame(wire.TYPES["join"], wire.body_of("join", minor=65535, token=line.hello_ok.token)
                                  + bytes(100)))
        line.until(lambda: line.join_ok, "join_ok")
        expect_complete(line.finish(line.ask("get_base_mesh", name=context.mesh.name)))


@checks("V-1", "F-3")
def only_hellos_may_bring_more(context):
    with context.session(greet=False) as line:
        line.say_hello(minor=9)
        line.connect_data()
        line.join(minor=9)
        line.request.send(wire.frame(wire.TYPES["ping"], struct.pack("<I", 1) + b"new"))
        line.expect_end("malformed")


@checks("V-2", "V-3")
def another_version_or_magic(context):
    for fields, code in (({"major": 2}, "unsupported_version"), ({"major": 0}, "unsupported_version"),
                         ({"major": 65535, "minor": 65535}, "unsupported_version"), ({"magic": b"PMCA"}, "bad_magic"),
                         ({"magic": b"pmcd"}, "bad_magic"), ({"magic": b"HTTP", "major": 9}, "bad_magic")):
        with context.session(greet=False) as line:
            line.request.send(wire.message("hello", **{"agent": "", **fields}))
            line.expect_end(code)
        # Judged before any other field: what follows may be anything.
        for rest in (b"", bytes(200)):
            with context.session(greet=False) as line:
                head = wire.body_of("hello", **{"agent": "", **fields})[:8]
                line.request.send(wire.frame(wire.TYPES["hello"], head + rest))
                line.expect_end(code)
        with context.session(join=False) as line:
            line.connect_data()
            line.data.send(wire.message("join", **{"token": line.hello_ok.token, **fields}))
            line.until(lambda one=line: one.data.closed, "the data channel's end")
            expect(f"error for join with {fields}", [("data", wire.CODES[code])], line.fatal)


@checks("S-4", "R-5")
def names_that_are_none(context):
    names = [b"", b"a/b", b"/", b".", b"..", b" a", b"a ", b"\xff", b"a\x00b", b"a\nb", b"x" * 129, b"\xc0\xaf",
             "‮abc".encode(), b"\xed\xa0\x80", "﻿a".encode(), "\ufffe".encode()]
    with context.session() as line:
        for name in names:
            expect_refused(line.finish(line.ask("get_base_mesh", name=name)), "bad_name")
        for name in (b"no such mesh", b"x" * 128, "méšh".encode(), b"..."):
            expect_refused(line.finish(line.ask("get_base_mesh", name=name)), "unknown_mesh")
        line.ping()
