# SPDX-License-Identifier: MIT
"""Time, and what needs an operator: meshes that change, a server that ends, its limits, damage in its store.

Every check but times_of_the_document has a server of its own, so that its options can be short and its end harms no other
check.
"""

import time

import packets
import wire
from check_requests import fetch_all
from session import Channel, Failed, Session
from suite import NotTried, checks, expect, expect_complete, expect_refused

_SMALL_WINDOW = 4096
_BIG = 12 << 20  # more than fits into the buffers of both kernels


def _old():
    return packets.make([300, 400, 500, 600], "old")


def _big():
    return packets.make([_BIG, 500], "big")


def _notices(line, kind):
    return [n for n in line.notices if n.kind == kind]


def _await_notice(line, kind):
    line.until(lambda: _notices(line, kind), f"a notice of kind {kind}")
    return _notices(line, kind)[0]


def _base(line, name):
    return expect_complete(line.finish(line.ask("get_base_mesh", name=name)))


@checks("R-13", "N-2", "R-9", "T-4")
def replaced_while_it_is_fetched(context):
    old, new = _old(), packets.make([350, 450], "new")
    with context.operator.server({"m": old}) as server, context.session(server.address) as line, \
            context.session(server.address) as bystander:
        base = _base(line, "m")
        server.put("m", new)
        notice = _await_notice(line, wire.MESH_RETIRED)
        expect("the notice's handle", base.opened.handle, notice.handle)
        expect("seconds", True, notice.seconds > 0)
        expect("SHA-256 of the old packets", [packets.sha256(p) for p in old.packets],
               [packets.sha256(p) for p in fetch_all(line, base)])
        again = line.finish(line.ask("get_packet", generation=old.generation, packet=2, offset=100))
        expect("old packet 2 from 100", old.packets[2][100:], bytes(again.data))
        fresh = _base(line, "m")
        expect("another handle and generation", (True, new.generation),
               (fresh.opened.handle != base.opened.handle, fresh.opened.generation))
        expect("SHA-256 of the new packets", [packets.sha256(p) for p in new.packets],
               [packets.sha256(p) for p in fetch_all(line, fresh)])
        expect("the old handle goes on", "complete",
               line.finish(line.ask("get_packet", generation=old.generation, packet=1, offset=0)).outcome)
        other = _base(bystander, "m")
        expect("others see the new one", new.generation, other.opened.generation)
        bystander.settle()
        expect("notices to whom they do not concern", 0, len(bystander.notices))


@checks("R-13", "N-2", "R-5")
def removed_while_it_is_fetched(context):
    old = _old()
    with context.operator.server({"m": old, "n": packets.make([100], "n")}) as server, \
            context.session(server.address) as line, context.session(server.address) as late:
        base = _base(line, "m")
        server.remove("m")
        expect("the notice's handle", base.opened.handle, _await_notice(line, wire.MESH_RETIRED).handle)
        expect_refused(late.finish(late.ask("get_base_mesh", name="m")), "unknown_mesh")
        expect_refused(line.finish(line.ask("get_base_mesh", name="m")), "unknown_mesh")
        expect("SHA-256 of the old packets", [packets.sha256(p) for p in old.packets],
               [packets.sha256(p) for p in fetch_all(line, base)])


@checks("R-13", "R-12")
def mesh_changed_when_the_grace_time_is_over(context):
    old = _old()
    with context.operator.server({"m": old}, grace_time=0.5) as server, context.session(server.address) as line:
        base = _base(line, "m")
        server.put("m", packets.make([350, 450], "new"))
        _await_notice(line, wire.MESH_RETIRED)
        deadline = time.monotonic() + 8
        while True:
            request = line.finish(line.ask("get_packet", generation=old.generation, packet=1, offset=0))
            if request.outcome == "mesh_changed":
                break
            expect("old packet 1", old.packets[1], bytes(request.data))
            if time.monotonic() > deadline:
                raise Failed("R-13 mesh_changed when the grace time of 0.5 s is over", "the old mesh after 8 s")
            time.sleep(0.05)
        expect_refused(line.finish(line.ask("get_next_packet", handle=base.opened.handle)), "mesh_changed")
        expect("a new handle", True, _base(line, "m").opened.handle != base.opened.handle)


@checks("R-12", "R-13")
def mesh_changed_in_a_new_session(context):
    old = _old()
    with context.operator.server({"m": old}, grace_time=0.2) as server:
        with context.session(server.address) as line:
            _base(line, "m")
        server.put("m", packets.make([350, 450], "new"))
        deadline = time.monotonic() + 8
        while True:
            with context.session(server.address) as line:
                request = line.finish(line.ask("get_packet", generation=old.generation, packet=1, offset=0))
                if request.outcome == "mesh_changed":
                    return
            if time.monotonic() > deadline:
                raise Failed("R-12 mesh_changed", request.outcome)
            time.sleep(0.05)


@checks("N-1", "W-5", "H-5", "S-1")
def a_server_that_ends(context):
    with context.operator.server({"m": _old(), "big": _big()}, drain_timeout=0.8) as server, \
            context.session(server.address, receive_buffer=_SMALL_WINDOW) as line, \
            context.session(server.address) as idle, context.session(server.address, join=False) as greeted, \
            context.session(server.address, greet=False) as silent:
        running = line.ask("get_base_mesh", name="big")
        line.until(lambda: running.chunks, "the first chunk")
        server.terminate()
        expect("the notice's handle", 0, _await_notice(greeted, wire.DRAINING).handle)
        expect("the notice's handle", 0, _await_notice(idle, wire.DRAINING).handle)
        silent.request.send(wire.message("hello", agent="late"))
        silent.expect_end("shutting_down")
        _unread_until(line, lambda: _notices(line, wire.DRAINING))
        for one in (idle, greeted):
            one.expect_end("shutting_down")
        data, line.data = line.data, None
        line.expect_end("shutting_down")
        line.data = data


@checks("W-5", "N-1")
def a_running_transfer_may_end(context):
    with context.operator.server({"big": _big()}, drain_timeout=30) as server, \
            context.session(server.address, receive_buffer=_SMALL_WINDOW) as line:
        running = line.ask("get_base_mesh", name="big")
        waiting = line.ask("get_next_packet", handle=0)
        line.until(lambda: running.chunks and running.opened, "the first chunk")
        server.terminate()
        _unread_until(line, lambda: _notices(line, wire.DRAINING))
        line.widen()
        expect_complete(line.finish(running, timeout=25))
        line.expect_end("shutting_down")
        expect("a waiting request does not begin", 0, waiting.chunks)


def _unread_until(line, true):
    data, line.data = line.data, None
    try:
        line.until(true, "a notice")
    finally:
        line.data = data


@checks("W-1")
def connections_that_say_nothing(context):
    with context.operator.server({}, hello_timeout=0.4, join_timeout=0.4) as server:
        for begin in (b"", b"\x14", wire.message("hello", agent="slow")[:-1]):
            with context.session(server.address, greet=False) as line:
                line.request.send(begin)
                line.expect_end("hello_timeout")
        with context.session(server.address, greet=False) as drip:
            deadline = time.monotonic() + 5
            for byte in wire.message("hello", agent="a" * 60):
                drip.request.send(bytes([byte]))
                if drip.pump(0.05) or drip.request.closed or time.monotonic() > deadline:
                    break
            drip.expect_end("hello_timeout")


@checks("W-1")
def data_connections_that_say_nothing(context):
    with context.operator.server({}, hello_timeout=0.4) as server, context.session(server.address) as line:
        for begin in (b"", wire.message("join", token=line.hello_ok.token)[:-1]):
            channel = Channel((line.host, line.hello_ok.data_port), "data")
            channel.send(begin)
            _says_join_timeout(context, channel, 10)
        line.ping()


def _says_join_timeout(context, channel, timeout):
    answer = channel.next(timeout)
    expect("the answer", ("error", 0, wire.CODES["join_timeout"]),
           answer and (answer.name, answer.fields.get("id"), answer.fields.get("code")))
    context.meet(answer.code)
    expect("the channel's end", None, channel.next(timeout))
    channel.close()


@checks("W-2", "H-1", "H-5")
def a_session_that_does_not_join(context):
    with context.operator.server({}, join_timeout=1) as server, context.session(server.address, join=False) as line:
        line.ping()
        line.expect_end("join_timeout")
        channel = Channel((line.host, line.hello_ok.data_port), "data")
        channel.send(wire.message("join", token=line.hello_ok.token))
        expect("a token that is too old", wire.CODES["bad_token"], channel.next().fields.get("code"))
        channel.close()


@checks("W-1", "W-2", "W-3", "W-4")
def times_of_the_document(context):
    """The waits side by side, on any server; it fails on one whose operator chose other times than the document's."""
    context.need_time(60)
    big, began = context.need_big(), time.monotonic()
    with context.session(greet=False) as silent, context.session(join=False) as unjoined, context.session() as idle, \
            context.session(receive_buffer=_SMALL_WINDOW) as stalled:
        channel = Channel((idle.host, idle.hello_ok.data_port), "data")
        running = stalled.ask("get_base_mesh", name=big.name)
        stalled.until(lambda: running.chunks, "the first chunk", timeout=40)  # others may have the line before
        data, stalled.data = stalled.data, None
        silent.expect_end("hello_timeout", timeout=20)
        expect("not before 10 seconds", True, time.monotonic() - began > 9.5)
        _says_join_timeout(context, channel, 20)
        stalled.expect_end("stalled", timeout=30)
        stalled.data = data
        unjoined.expect_end("join_timeout", timeout=unjoined.hello_ok.seconds + 10)
        expect("a token is good for its time", True, time.monotonic() - began > unjoined.hello_ok.seconds - 0.5)
        idle.ping()


@checks("W-3", "S-3")
def a_client_that_takes_nothing(context):
    with context.operator.server({"big": _big(), "m": _old()}, stall_timeout=0.6, slots=1) as server, \
            context.session(server.address, receive_buffer=_SMALL_WINDOW) as stalled, \
            context.session(server.address) as other:
        running = stalled.ask("get_base_mesh", name="big")
        stalled.until(lambda: running.chunks, "the first chunk")
        _base(other, "m")  # waits for the slot
        data, stalled.data = stalled.data, None
        stalled.expect_end("stalled")
        stalled.data = data


@checks("W-3")
def a_client_that_takes_too_little(context):
    context.need_time(45)
    with context.operator.server({"big": _big()}, min_rate=1 << 20) as server, \
            context.session(server.address, receive_buffer=_SMALL_WINDOW) as line:
        running, began = line.ask("get_base_mesh", name="big"), time.monotonic()
        while not line.request.closed and time.monotonic() < began + 45:
            for message in line.data.read(2048) if line.data.closed is None else []:
                line.deal(line.data, message)
            time.sleep(0.1)
            line.pump_request()
        line.data.close()
        line.expect_end("stalled")
        expect("not before 30 seconds", True, time.monotonic() - began > 29)
        expect("some of it came", True, running.chunks > 0)


@checks("W-3")
def answers_that_are_not_taken(context):
    with context.operator.server({"m": _old()}, stall_timeout=0.6) as server:
        line = Session(server.address, on_code=context.meet)
        try:
            line.request.socket.settimeout(0.05)
            ping, deadline = wire.message("ping", id=1) * 400, time.monotonic() + 8
            while time.monotonic() < deadline:
                try:
                    line.request.socket.sendall(ping)
                except TimeoutError:
                    continue  # the server takes no more: it waits for its answers to be taken
                except ConnectionError:
                    return  # and has given up
            raise Failed("W-3 the end of a session whose pongs nobody reads", "8 s of pings")
        finally:
            line.close()


@checks("W-4", "H-3")
def silence_with_nothing_under_way(context):
    with context.operator.server({"m": _old()}, stall_timeout=0.3, hello_timeout=0.3, join_timeout=1) as server, \
            context.session(server.address) as line:
        base = _base(line, "m")
        time.sleep(1.5)  # several times each time-out
        line.ping()
        expect("the session goes on", 1, line.finish(line.ask("get_next_packet", handle=base.opened.handle)).packet)


@checks("W-6", "H-5")
def too_many_sessions(context):
    for option in ("max_sessions", "max_sessions_per_address"):
        with context.operator.server({"m": _old()}, **{option: 2}) as server, context.session(server.address) as one, \
                context.session(server.address) as two:
            with context.session(server.address, greet=False) as third:
                third.request.send(wire.message("hello", agent="third"))
                third.expect_end("too_many_sessions")
            with context.session(server.address, greet=False) as silent:
                silent.expect_end("too_many_sessions")
            _base(one, "m")
            _base(two, "m")
            two.send("goodbye")
            two.expect_end(None)
            _when_there_is_room(context, server)


def _when_there_is_room(context, server):
    deadline = time.monotonic() + 5
    while True:
        try:
            with context.session(server.address) as again:
                return again.ping()
        except Failed:
            if time.monotonic() > deadline:
                raise
            time.sleep(0.05)


@checks("E-1", "R-3", "S-3")
def a_mesh_that_cannot_be_read(context):
    broken = packets.make([3001, 3002, 3003], "broken")
    with context.operator.server({"broken": broken, "m": _old()}, cache_size=0) as server:
        server.damage(3002)
        with context.session(server.address) as line:
            base = line.finish(line.ask("get_base_mesh", name="broken"))
            if base.outcome == "complete":
                behind = [line.prepare("get_next_packet", handle=base.opened.handle) for _ in range(3)]
                line.request.send(b"".join(frame for _, frame in behind))
                line.finish(*(request for request, _ in behind))
                for request, _ in behind:
                    expect_refused(request, "unavailable")
            else:
                expect_refused(base, "unavailable")
            again = line.finish(line.ask("get_base_mesh", name="broken"))
            if again.opened:
                expect("another handle", True, again.opened.handle != base.opened.handle)
            _base(line, "m")
            line.ping()
