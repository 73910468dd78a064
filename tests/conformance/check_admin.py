# SPDX-License-Identifier: MIT
"""The admin channel: its beginning, requests and answers, and ingests that succeed, fail and are cut off.

The checks of what is stored work on a server of their own, so that nobody's meshes are touched.
"""

import dataclasses
import json
import re
import struct

import packets
import wire
from admin import Admin
from suite import NotTried, checks, expect


def _small(seed="admin"):
    return packets.make([200, 300, 400], seed)


def _admin(context, server=None, **options):
    path = server.admin_socket if server else context.admin_socket
    if path is None:
        raise NotTried("needs --admin-socket")
    return Admin(path, on_code=context.meet, **options)


def _names(admin):
    return [mesh["name"] for mesh in admin.ask("admin_list")[0]["meshes"]]


@checks("A-1", "V-2", "F-1", "F-3", "S-4")
def first_frame(context):
    for data, code in ((wire.message("admin_hello", agent="", magic=b"PMCD"), "bad_magic"),
                       (wire.message("admin_hello", agent="", major=2), "unsupported_version"),
                       (wire.message("admin_list", id=1), "wrong_state"), (wire.message("hello", agent=""), "wrong_state"),
                       (struct.pack("<I", 1), "malformed"), (struct.pack("<I", wire.MAX_ADMIN + 1), "frame_too_long"),
                       (wire.frame(wire.TYPES["admin_hello"], wire.body_of("admin_hello", agent="") + b"\0"), "malformed")):
        with _admin(context, greet=False) as admin:
            admin.channel.send(data)
            admin.expect_end(code)
    with _admin(context, greet=False) as admin:
        admin.channel.send(wire.frame(wire.TYPES["admin_hello"], wire.body_of("admin_hello", minor=3, agent="") + b"new"))
        expect("the answer", "admin_hello_ok", admin.next().name)


@checks("A-1", "V-4", "H-3", "H-4", "F-3")
def frames_of_the_admin_channel(context):
    with _admin(context) as admin:
        for number in (0x0150, 0x015F, 0x0199):
            admin.channel.send(wire.frame(number, struct.pack("<I", 9)))
            answer = admin.next()
            expect("the answer", (9, wire.CODES["unknown_type"]), (answer.id, answer.code))
        admin.send("ping", id=0)
        expect("the answer", ("pong", 0), (lambda m: (m.name, m.id))(admin.next()))
        admin.send("goodbye")
        admin.expect_end(None)
    for name in ("admin_hello", "admin_hello_ok", "hello", "get_base_mesh"):
        with _admin(context) as admin:
            fields = {"id": 1, "name": "x"} if name == "get_base_mesh" else {"agent": ""}
            admin.send(name, **fields)
            admin.expect_end("wrong_state")
    for data in (wire.message("admin_list", id=0), wire.frame(wire.TYPES["admin_list"], b"\1\0\0"),
                 wire.frame(wire.TYPES["admin_status"], bytes(5))):
        with _admin(context) as admin:
            admin.channel.send(data)
            admin.expect_end("malformed")


@checks("A-8", "A-1")
def forms_of_the_requests_about_the_rule(context):
    terms = {"id": 1, "flags": 0, "version": 0}
    rule = {"rule": "fifo", "count": 0, "options": ()}
    for name, fields in (("admin_set_rule", {**terms, **rule, "flags": 4}),
                         ("admin_set_rule", {**terms, **rule, "version": 1}),
                         ("admin_set_rule", {**terms, **rule, "count": 65, "options": [("slots", "1")] * 65}),
                         ("admin_set_rule", {**terms, **rule, "count": 1}),
                         ("admin_revert", {**terms, "flags": 8, "change": 0}),
                         ("admin_revert", {**terms, "flags": 1, "version": 9, "change": 0}),
                         ("admin_weight", {"id": 1, "session": 1, "weight": 0}),
                         ("admin_weight", {"id": 1, "session": 1, "weight": 1_000_000_001}),
                         ("admin_explain", {"id": 0, "session": 1}), ("admin_history", {"id": 0, "most": 0})):
        with _admin(context) as admin:
            admin.channel.send(wire.message(name, **fields))
            admin.expect_end("malformed")


@checks("A-8", "A-6", "E-1")
def the_rule_and_its_changes(context):
    """On a server of its own, which begins with no live change."""

    def change(admin, rule, options=(), flags=0, version=0):
        return admin.ask("admin_set_rule", flags=flags, version=version, rule=rule, count=len(options), options=options)

    with context.operator.server({}) as server, _admin(context, server) as admin:
        rules, _ = admin.ask("admin_rules")
        names = [rule["name"] for rule in rules["rules"]]
        expect("rules of the paper", True, {"fifo", "lcfs", "spf", "fcsf"} <= set(names))
        before, _ = admin.ask("admin_rule")
        expect("the first version", 0, before["version"])
        expect("no such rule", "bad_rule", change(admin, "lottery")[1])
        expect("no such option", "bad_option", change(admin, "spf", [("colour", "blue")])[1])
        expect("no such value", "bad_option", change(admin, "spf", [("slots", "none")])[1])
        dry, _ = change(admin, "spf", [("quantum", "250")], flags=1)
        expect("a dry run", (False, "spf"), (dry["changed"], dry["after"]["rule"]))
        done, _ = change(admin, "spf", [("quantum", "250")], flags=2, version=0)
        expect("a change", (True, 1, "250"),
               (done["changed"], done["after"]["version"], done["after"]["options"]["quantum"]))
        expect("a lost update", "version_changed", change(admin, "lcfs", flags=2, version=0)[1])
        back, _ = admin.ask("admin_revert", flags=0, version=0, change=0)
        expect("back to the configuration", before["text"], back["after"]["text"])
        expect("no such change", "unknown_change", admin.ask("admin_revert", flags=0, version=0, change=99)[1])
        history, _ = admin.ask("admin_history", most=0)
        expect("history", [(2, None), (1, "spf")], [(one["number"], one["rule"]) for one in history["changes"]])
        expect("no such client", "unknown_client", admin.ask("admin_explain", session=4711)[1])
        expect("no such client", "unknown_client", admin.ask("admin_weight", session=4711, weight=2000)[1])
        with context.session(server.address):
            clients, _ = admin.ask("admin_clients")
            expect("clients", 1, len(clients["clients"]))
            number = clients["clients"][0]["client"]
            expect("the first weight", 1, admin.ask("admin_weight", session=number, weight=2500)[0]["before"])
            expect("the second", 2.5, admin.ask("admin_weight", session=number, weight=1000)[0]["before"])
            why, _ = admin.ask("admin_explain", session=number)
            expect("who has asked for nothing", (number, False, []), (why["client"], why["next"], why["requests"]))
        queue, _ = admin.ask("admin_queue")
        expect("the queue", (0, 0, [], 0), tuple(queue[key] for key in ("waiting", "running", "requests", "more")))


def _expect_mesh(document, name, file):
    levels = file.directory.levels
    expect("the mesh", {"name": name, "generation": f"{file.generation:016x}", "vertices": levels[-1].vertices,
                        "faces": levels[-1].faces, "packets": len(levels), "bytes": file.directory.all_bytes,
                        "lossless": False, "bits": 10, "scalar": "float32", "format_version": 0,
                        "box_min": [0, 0, 0], "box_max": [1, 1, 1]},
           {key: value for key, value in document.items() if key not in ("ingested_at", "levels")
            and key in ("name", "generation", "vertices", "faces", "packets", "bytes", "lossless", "bits", "scalar",
                        "format_version", "box_min", "box_max")})
    expect("ingested_at", True, bool(re.fullmatch(r"\d{4}-\d\d-\d\dT\d\d:\d\d:\d\d(\.\d+)?Z", document["ingested_at"])))


@checks("A-6", "A-7", "A-1")
def answers(context):
    file = _small()
    with context.operator.server({"b": file, "a": _small("other")}) as server, _admin(context, server) as admin:
        expect("names", ["a", "b"], _names(admin))
        _expect_mesh(admin.ask("admin_list")[0]["meshes"][1], "b", file)
        shown = admin.ask("admin_show", name="b")[0]
        _expect_mesh(shown, "b", file)
        expect("levels", [{"level": k, "bytes": level.bytes, "vertices": level.vertices, "faces": level.faces,
                           "bits": level.bits, "error_rms": None, "error_max": None, "crc32c": f"{level.crc:08x}"}
                          for k, level in enumerate(file.directory.levels)], shown["levels"])
        status = admin.ask("admin_status")[0]
        expect("fields of the status", [], [name for name in (
            "version", "protocol", "rule", "slots", "sessions", "session_limit", "waiting", "running", "meshes",
            "damaged_meshes", "listen", "request_port", "data_port", "started_at", "uptime_seconds", "cache_bytes",
            "cache_limit_bytes", "cache_hits", "cache_misses") if name not in status])
        expect("damaged meshes", [], admin.ask("admin_list")[0]["damaged"])
        expect("meshes and port", (2, server.address[1]), (status["meshes"], status["request_port"]))
        expect("removed", {"removed": "b", "generation": f"{file.generation:016x}"},
               {k: v for k, v in admin.ask("admin_remove", name="b")[0].items() if k in ("removed", "generation")})
        expect("names", ["a"], _names(admin))
        for request in ("admin_remove", "admin_show"):
            expect("an unknown mesh", "unknown_mesh", admin.ask(request, name="b")[1])
            expect("a name that is none", True, admin.ask(request, name="a/b")[1] == "unknown_mesh")


@checks("A-2", "A-3", "A-5")
def ingests(context):
    file, other = _small(), packets.make([64, 700001], "large")
    with context.operator.server({}) as server, _admin(context, server) as admin:
        number, refused = admin.begin("m", file)
        expect("ingest_begin", None, refused)
        admin.send_packets(number, file, step=37)
        admin.send("ping", id=1)
        expect("pong", "pong", admin.next().name)
        with _admin(context, server) as second:
            expect("names before ingest_ok", [], _names(second))
        expect("ingest_commit", None, admin.commit(number))
        expect("generation, replaced", (file.generation, 0), (admin.last.generation, admin.last.replaced))
        with context.session(server.address) as line:
            base = line.finish(line.ask("get_base_mesh", name="m"))
            expect("the base packet", file.packets[0], bytes(base.data))
        expect("a name that is taken", "mesh_exists", admin.ingest("m", other))
        expect("replace", None, admin.ingest("m", other, replace=True))
        expect("generation, replaced", (other.generation, 1), (admin.last.generation, admin.last.replaced))
        expect("a bad name", "bad_name", admin.ingest("a/b", file))
        expect("names", ["m"], _names(admin))


@checks("A-2", "A-3", "A-4")
def ingests_that_are_wrong(context):
    file = _small()
    whole = [(k, 0, content) for k, content in enumerate(file.packets)]
    damaged = bytearray(file.packets[1])
    damaged[100] ^= 1
    with context.operator.server({}) as server, _admin(context, server) as admin:
        for what, parts, code in (
                ("too few packets", whole[:2], "ingest_incomplete"), ("none", [], "ingest_incomplete"),
                ("a gap", [(0, 0, file.packets[0]), (1, 1, file.packets[1][1:]), whole[2]], "ingest_incomplete"),
                ("out of order", [whole[1], whole[0], whole[2]], "ingest_incomplete"),
                ("too early", [(0, 0, file.packets[0][:-1]), whole[1], whole[2]], "ingest_incomplete"),
                ("damaged", [whole[0], (1, 0, bytes(damaged)), whole[2]], "bad_packet"),
                ("another packet", [whole[0], (1, 0, packets.make([200, 300], 9).packets[1]), whole[2]], "bad_packet")):
            number, refused = admin.begin("m", file)
            expect("ingest_begin", None, refused)
            for packet, offset, content in parts:
                admin.data(number, packet, offset, content)
            expect(what, code, admin.commit(number))
            expect(f"after {what}: nothing is answered for what was on its way, names", [], _names(admin))
        for raw in (b"P", b"PMCD", file.directory.raw[:-1], file.directory.raw + b"\0",
                    file.directory.raw[:20] + b"\1" + file.directory.raw[21:]):
            expect("a wrong directory", "bad_directory", admin.begin("m", file, directory=raw)[1])
        expect("ingest afterwards", None, admin.ingest("m", file))


@checks("A-2", "S-4")
def one_ingest_at_a_time(context):
    file = _small()
    with context.operator.server({}) as server:
        for what in ("begin", "data", "commit"):
            with _admin(context, server) as admin:
                number, refused = admin.begin("m", file)
                expect("ingest_begin", None, refused)
                expect("another request meanwhile", [], _names(admin))
                if what == "begin":
                    admin.send("ingest_begin", id=number + 9, flags=0, name="n", directory=file.directory.raw)
                elif what == "data":
                    admin.send("ingest_data", id=number + 9, packet=0, offset=0, bytes=file.packets[0])
                else:
                    admin.send("ingest_commit", id=number + 9)
                admin.expect_end("wrong_state")
        with _admin(context, server) as admin:
            admin.send("ingest_begin", id=1, flags=2, name="m", directory=file.directory.raw)
            admin.expect_end("malformed")


@checks("A-6", "A-1")
def an_answer_of_several_frames(context):
    names = [f"{number:04}" + "x" * 120 for number in range(900)]
    with context.operator.server({name: packets.make([60], name) for name in names}) as server, \
            _admin(context, server) as admin:
        document = admin.ask("admin_list")[0]
        expect("more than a frame takes", True, len(json.dumps(document)) > wire.MAX_CHUNK)
        expect("names", names, [mesh["name"] for mesh in document["meshes"]])
        expect("the next answer", names, _names(admin))


@checks("A-3")
def an_ingest_that_is_cut_off(context):
    file = _small()
    with context.operator.server({}) as server:
        for goodbye in (False, True):
            with _admin(context, server) as admin:
                number, _ = admin.begin("m", file)
                admin.send_packets(number, file)
                if goodbye:
                    admin.send("goodbye")
                    admin.expect_end(None)
        with _admin(context, server) as admin:
            expect("names", [], _names(admin))
            expect("ingest afterwards", None, admin.ingest("m", file))


@checks("A-3")
def what_is_confirmed_survives_a_crash(context):
    file = _small()
    with context.operator.server({}) as server:
        with _admin(context, server) as admin:
            expect("ingest", None, admin.ingest("m", file))
            number, _ = admin.begin("half", _small("half"))
            admin.data(number, 0, 0, _small("half").packets[0])
            admin.send("ping", id=1)
            expect("pong", "pong", admin.next().name)
            server.crash()
        with _admin(context, server) as admin:
            expect("names", ["m"], _names(admin))
        with context.session(server.address) as line:
            base = line.finish(line.ask("get_base_mesh", name="m"))
            expect("the base packet", file.packets[0], bytes(base.data))


@checks("A-3", "E-1")
def storage_that_refuses(context):
    with context.operator.server({"a": _small("a")}) as server:
        server.lock()
        with _admin(context, server) as admin:
            expect("ingest into a locked database", "storage_failed", admin.ingest("m", _small()))
            expect("names", ["a"], _names(admin))


@checks("A-2", "E-1")
def a_mesh_that_is_too_large(context):
    file = _small()
    levels = [dataclasses.replace(level, bytes=0xFFFFFFFF) for level in file.directory.levels]
    raw = packets.write_directory(file.directory.flags, file.directory.bits, file.generation, levels)
    with context.operator.server({}) as server, _admin(context, server) as admin:
        expect("ingest_begin", "too_large", admin.begin("m", file, directory=raw)[1])
        expect("ingest afterwards", None, admin.ingest("m", file))
