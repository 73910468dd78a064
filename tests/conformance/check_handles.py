# SPDX-License-Identifier: MIT
"""Handles: which one a request belongs to, how many a session may have, and what one that is live no more answers."""

import time

import packets
from suite import checks, expect, expect_complete, expect_refused

_MOST = 1024


def _made(seed):
    return packets.make([300, 400, 500], seed)


def _open(line, name):
    return expect_complete(line.finish(line.ask("get_base_mesh", name=name)))


def _take(line, file, number):
    return line.finish(line.ask("get_packet", generation=file.generation, packet=number, offset=0))


@checks("R-10", "R-9")
def one_content_under_two_names(context):
    file = _made("twins")
    with context.operator.server({"a": file, "b": file}) as server, context.session(server.address) as line:
        first, second = _open(line, "b"), _open(line, "a")
        expect("a handle for each name", True, first.opened.handle != second.opened.handle)
        for number in (2, 1):
            request = expect_complete(_take(line, file, number))
            expect("the handle given out first", first.opened.handle, request.handle)
            expect("mesh_opened for a handle that is there", None, request.opened)
        expect("the place of the other", 1, line.finish(line.ask("get_next_packet", handle=second.opened.handle)).packet)


@checks("R-12", "R-13")
def stored_again_under_another_name(context):
    file = _made("again")
    with context.operator.server({"a": file}, grace_time=0.3) as server, context.session(server.address) as line:
        held = _open(line, "a")
        server.remove("a")
        server.put("b", file)
        line.until(lambda: line.notices, "the notice of the removal")
        time.sleep(1)  # the grace time and more
        request = expect_complete(line.finish(line.ask("get_next_packet", handle=held.opened.handle)))
        expect("packet 1", file.packets[1], bytes(request.data))
        with context.session(server.address) as other:
            expect("packet 2", file.packets[2], bytes(expect_complete(_take(other, file, 2)).data))


@checks("R-14", "R-2")
def more_handles_than_allowed(context):
    many = {f"m{number:04}": packets.make([100], number) for number in range(_MOST + 2)}
    with context.operator.server(many) as server, context.session(server.address) as line:
        first, *others, over, further = many
        handle = _open(line, first).opened.handle
        for name in others:
            _open(line, name)
        for _ in range(2):
            request = line.finish(line.ask("get_base_mesh", name=over))
            expect_refused(request, "too_many_requests")
            expect("mesh_opened of a refused request", None, request.opened)
        expect_refused(_take(line, many[further], 0), "too_many_requests")
        expect("the first handle goes on", handle, _open(line, first).opened.handle)
        expect("by its content too", handle, expect_complete(_take(line, many[first], 0)).handle)


@checks("E-1", "R-10")
def a_handle_that_is_live_no_more(context):
    file = packets.make([3001, 3002, 3003], "broken")
    with context.operator.server({"m": file}, cache_size=0) as server:
        server.damage(3002)
        with context.session(server.address) as line:
            held = _open(line, "m")
            expect_refused(_take(line, file, 1), "unavailable")
            for handle in (held.opened.handle, 0, held.opened.handle):
                expect_refused(line.finish(line.ask("get_next_packet", handle=handle)), "unavailable", "unknown_handle")
            request = expect_complete(_take(line, file, 2))
            expect("a handle of its own", True, request.opened is not None
                   and request.opened.handle not in (0, held.opened.handle))
            expect("packet 2", file.packets[2], bytes(request.data))
            expect_refused(line.finish(line.ask("get_next_packet", handle=held.opened.handle)), "unavailable",
                           "unknown_handle")
