# SPDX-License-Identifier: MIT
"""Times and limits: connections that are silent or slow, a server that is full or ends.

The checks with an operator have a server of their own, so that its options can be short and its end harms no other check.
Those of the document's times need none.
"""

import time

import packets
import wire
from check_changes import await_notice, base_of, notices_of, old_mesh
from session import Channel, Failed, Session
from suite import checks, expect, expect_complete

_SMALL_WINDOW = 4096
_BIG = 12 << 20  # more than fits into the buffers of both kernels


def _big():
    return packets.make([_BIG, 500], "big")


@checks("N-1", "W-5", "H-5", "S-1")
def a_server_that_ends(context):
    with context.operator.server({"m": old_mesh(), "big": _big()}, drain_timeout=0.8) as server, \
            context.session(server.address, receive_buffer=_SMALL_WINDOW) as line, \
            context.session(server.address) as idle, context.session(server.address, join=False) as greeted, \
            context.session(server.address, greet=False) as silent:
        running = line.ask("get_base_mesh", name="big")
        line.until(lambda: running.chunks, "the first chunk")
        server.terminate()
        expect("the notice's handle", 0, await_notice(greeted, wire.DRAINING).handle)
        expect("the notice's handle", 0, await_notice(idle, wire.DRAINING).handle)
        silent.request.send(wire.message("hello", agent="late"))
        silent.expect_end("shutting_down")
        _unread_until(line, lambda: notices_of(line, wire.DRAINING))
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
        _unread_until(line, lambda: notices_of(line, wire.DRAINING))
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


@checks("W-1", "W-2", "W-4")
def times_of_the_document(context):
    """The waits side by side, on any server: one whose operator chose other times than the document's fails."""
    context.need_time(60)
    with context.session() as idle, context.session(join=False) as unjoined:
        at = time.monotonic()
        context.need_time(unjoined.hello_ok.seconds + 20)
        silent = Channel((idle.host, idle.hello_ok.data_port), "data")
        with context.session(greet=False) as nobody:
            nobody.expect_end("hello_timeout", timeout=30)
        _not_before("hello_timeout", 10, at)
        _says_join_timeout(context, silent, 30)
        unjoined.expect_end("join_timeout", timeout=unjoined.hello_ok.seconds + 20)
        _not_before("join_timeout", unjoined.hello_ok.seconds, at)
        time.sleep(max(0, 35 - (time.monotonic() - at)))
        idle.ping()


@checks("W-3")
def stalled_by_the_document(context):
    """On any server, as above."""
    context.need_time(60)
    mesh = context.need_big()
    with context.session(receive_buffer=_SMALL_WINDOW) as stalled:
        running = stalled.ask("get_base_mesh", name=mesh.name)
        stalled.until(lambda: running.chunks, "the first chunk", timeout=40)  # others may have the line before
        at = time.monotonic()
        data, stalled.data = stalled.data, None
        stalled.expect_end("stalled", timeout=30)
        stalled.data = data
        _not_before("stalled", 10, at)


def _not_before(what, seconds, since):
    took = time.monotonic() - since
    if took < seconds - 0.5:
        raise Failed(f"{what} after {seconds} seconds, if the operator has not chosen other times", f"{took:.1f} seconds")


@checks("W-3", "S-3")
def a_client_that_takes_nothing(context):
    with context.operator.server({"big": _big(), "m": old_mesh()}, stall_timeout=0.6, slots=1) as server, \
            context.session(server.address, receive_buffer=_SMALL_WINDOW) as stalled, \
            context.session(server.address) as other:
        running = stalled.ask("get_base_mesh", name="big")
        stalled.until(lambda: running.chunks, "the first chunk")
        base_of(other, "m")  # waits for the slot
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
    with context.operator.server({"m": old_mesh()}, stall_timeout=0.6) as server:
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
    with context.operator.server({"m": old_mesh()}, stall_timeout=0.3, hello_timeout=0.3, join_timeout=1) as server, \
            context.session(server.address) as line:
        base = base_of(line, "m")
        time.sleep(1.5)  # several times each time-out
        line.ping()
        expect("the session goes on", 1, line.finish(line.ask("get_next_packet", handle=base.opened.handle)).packet)


@checks("W-6", "H-5")
def too_many_sessions(context):
    for option in ("max_sessions", "max_sessions_per_address"):
        with context.operator.server({"m": old_mesh()}, **{option: 2}) as server, context.session(server.address) as one, \
                context.session(server.address) as two:
            with context.session(server.address, greet=False) as third:
                third.request.send(wire.message("hello", agent="third"))
                third.expect_end("too_many_sessions")
            with context.session(server.address, greet=False) as silent:
                silent.expect_end("too_many_sessions")
            base_of(one, "m")
            base_of(two, "m")
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
