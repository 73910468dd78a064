# SPDX-License-Identifier: MIT
"""Sessions: hello and join, tokens, states, ping, goodbye, and the loss of either channel."""

import struct

import wire
from session import Channel
from suite import checks, expect, expect_complete, expect_refused

_REQUESTS = (("get_mesh_list", {"filter": "", "after": "", "most": 0}), ("get_base_mesh", {"name": "x"}),
             ("get_next_packet", {"handle": 1}), ("get_packet", {"generation": 1, "packet": 0, "offset": 0}))
# Known frames that a client may not send on a request channel after hello.
_NOT_MINE = ("hello", "hello_ok", "error", "pong", "join", "join_ok", "notice", "mesh_opened", "chunk", "transfer_end",
             "admin_hello", "admin_hello_ok", "admin_list", "admin_show", "admin_remove", "admin_status", "ingest_begin",
             "ingest_ready", "ingest_data", "ingest_commit", "ingest_ok", "admin_answer", "admin_rules", "admin_rule",
             "admin_set_rule", "admin_history", "admin_revert", "admin_queue", "admin_clients", "admin_explain",
             "admin_weight")


def sample(name):
    """A right frame of this type."""
    values = {"u8": 0, "u16": 1, "u32": 1, "u64": 1, "str8": "abc", "str16": "abc", "rest": b"abc", "16": bytes(16),
              "options": ()}
    return wire.message(name, **{field: values[kind] for field, kind in wire.MESSAGES[name][1]
                                 if field not in ("magic", "major", "minor")})


@checks("H-2", "V-2")
def hello_and_join(context):
    with context.session() as line:
        ok = line.hello_ok
        expect("magic and major of hello_ok", (wire.MAGIC, wire.MAJOR), (ok.magic, ok.major))
        expect("magic and major of join_ok", (wire.MAGIC, wire.MAJOR), (line.join_ok.magic, line.join_ok.major))
        expect("data port, open requests and seconds are not 0", (True, True, True),
               (ok.data_port > 0, ok.open_requests > 0, ok.seconds > 0))
        expect("agent's length", True, len(ok.agent.encode()) <= wire.MAX_AGENT)
    with context.session() as other:
        expect("another token for another session", True, other.hello_ok.token != ok.token)
    with context.session(agent="") as line:
        line.ping()
    with context.session(agent="a" * wire.MAX_AGENT) as line:
        line.ping()


@checks("H-1")
def token_is_good_once(context):
    with context.session() as line:
        _refused_join(context, line, line.hello_ok.token)
        line.ping()
        expect_complete(line.finish(line.ask("get_base_mesh", name=context.mesh.name)))


@checks("H-1")
def unknown_token(context):
    with context.session(join=False) as line:
        wrong = bytes([line.hello_ok.token[0] ^ 1]) + line.hello_ok.token[1:]
        for token in (wrong, bytes(16), b"\xff" * 16):
            _refused_join(context, line, token)
        line.connect_data()
        line.join()
        line.ping()


@checks("H-1")
def token_dies_with_its_session(context):
    with context.session(join=False) as line:
        token = line.hello_ok.token
        line.send("goodbye")
        line.expect_end(None)
        _refused_join(context, line, token)


def _refused_join(context, line, token):
    channel = Channel((line.host, line.hello_ok.data_port), "data")
    try:
        channel.send(wire.message("join", token=token))
        answer = channel.next()
        expect("the answer to a wrong token", ("error", 0, wire.CODES["bad_token"]),
               answer and (answer.name, answer.fields.get("id"), answer.fields.get("code")))
        context.meet(answer.code)
        expect("the channel's end", None, channel.next())
    finally:
        channel.close()


@checks("H-2", "S-4", "K-3")
def requests_before_join(context):
    with context.session(join=False) as line:
        for name, fields in _REQUESTS:
            expect_refused(line.finish(line.ask(name, **fields)), "not_joined")
        line.send("cancel", id=4321)
        line.until(lambda: line.refusals, "not_joined for cancel")
        expect("the answer to cancel", (4321, wire.CODES["not_joined"]), (line.refusals[0].id, line.refusals[0].code))
        line.connect_data()
        line.join()
        expect_complete(line.finish(line.ask("get_base_mesh", 1, name=context.mesh.name)))


@checks("H-3", "S-4")
def ping_at_any_time(context):
    with context.session(join=False) as line:
        for number in (0, 1, 0x80000000, 0xFFFFFFFF):
            line.ping(number)
        line.connect_data()
        line.join()
        request = line.ask("get_base_mesh", name=context.mesh.name)
        line.ping(request.id)
        line.ping(0)
        expect_complete(line.finish(request))


@checks("H-4", "S-1", "R-3")
def goodbye(context):
    with context.session(join=False) as line:
        line.send("goodbye")
        line.expect_end(None)
        expect("errors", [], line.fatal)
    with context.session() as line:
        line.send("goodbye")
        line.expect_end(None)
        expect("errors", [], line.fatal)


@checks("H-4")
def goodbye_with_requests_under_way(context):
    with context.session() as line:
        asked = [line.prepare("get_base_mesh", name=context.mesh.name)[1] for _ in range(3)]
        line.request.send(b"".join(asked) + wire.message("goodbye"))
        line.expect_end(None)
        expect("errors", [], line.fatal)


@checks("S-1")
def request_channel_lost(context):
    with context.session() as line:
        line.request.socket.close()
        line.request.closed = "closed"
        line.expect_end(None)


@checks("S-1")
def data_channel_lost(context):
    with context.session() as line:
        line.data.socket.close()
        line.data.closed = "closed"
        line.expect_end("channel_lost")


@checks("S-4")
def first_frame_of_the_request_channel(context):
    for name in wire.TYPES:
        if name in ("hello",):
            continue
        with context.session(greet=False) as line:
            line.request.send(sample(name))
            line.expect_end("wrong_state")
    with context.session(greet=False) as line:
        line.request.send(wire.frame(0x7ABC, struct.pack("<I", 1)))
        line.expect_end("wrong_state")


@checks("S-4", "H-5", "S-1")
def known_frames_at_the_wrong_time(context):
    for join in (False, True):
        for name in _NOT_MINE:
            with context.session(join=join) as line:
                line.request.send(sample(name))
                line.expect_end("wrong_state")


@checks("S-4", "H-2", "H-5")
def frames_on_the_data_channel(context):
    for name in (*wire.TYPES, None):
        if name == "join":
            continue
        with context.session(join=False) as line:
            line.connect_data()
            line.data.send(sample(name) if name else wire.frame(0x7ABC, struct.pack("<I", 1)))
            line.until(lambda one=line: one.data.closed, "the data channel's end")
            expect(f"error for {name} before join", [("data", wire.CODES["wrong_state"])], line.fatal)
    for name in wire.TYPES:
        with context.session() as line:
            line.data.send(sample(name))
            line.expect_end("wrong_state", "data")


@checks("S-3")
def sessions_know_nothing_of_each_other(context):
    with context.opened() as (one, base), context.session() as two:
        expect_refused(two.finish(two.ask("get_next_packet", handle=base.opened.handle)), "unknown_handle")
        first = one.ask("get_base_mesh", 500, name=context.mesh.name)
        second = two.ask("get_base_mesh", 500, name=context.mesh.name)
        expect_complete(one.finish(first))
        expect_complete(two.finish(second))
        expect("the same bytes", bytes(first.data), bytes(second.data))
        two.request.send(struct.pack("<I", 0))
        two.expect_end("malformed")
        one.ping()


@checks("S-2", "S-3", "R-4")
def several_meshes_at_once(context):
    second = context.need_second()
    with context.session() as line:
        opened = [line.ask("get_base_mesh", name=mesh.name) for mesh in (context.mesh, second, context.mesh)]
        line.finish(*opened)
        expect("one handle a mesh", (True, False), (opened[0].opened.handle == opened[2].opened.handle,
                                                    opened[0].opened.handle == opened[1].opened.handle))
        rest = [line.ask("get_next_packet", handle=opened[k % 2].opened.handle) for k in range(6)]
        line.finish(*rest)
        for k in (0, 1):
            packets = [r.packet for r in rest[k::2] if r.outcome == "complete"]
            expect("packets of one handle in their order", list(range(1, len(packets) + 1)), packets)
            ends = [r.outcome for r in rest[k::2]]
            expect("ends of one handle", ["complete"] * len(packets) + ["end_of_mesh"] * (3 - len(packets)), ends)
