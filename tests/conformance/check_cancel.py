# SPDX-License-Identifier: MIT
"""Cancel: of what runs, waits, has ended or never was. Whether an end was on its way already is the server's to say."""

import packets
import wire
from check_requests import directory_of
from suite import checks, expect, expect_complete

_SMALL_WINDOW = 4096


@checks("K-1", "K-2", "R-7")
def cancel_of_what_runs(context):
    mesh = context.need_big()
    with context.session(receive_buffer=_SMALL_WINDOW) as line:
        base = line.ask("get_base_mesh", name=mesh.name)
        line.until(lambda: base.chunks and base.opened, "the first chunk")
        line.cancel_unread(base)
        line.finish(base)
        expect("the end", "cancelled", base.outcome)
        expect("it ends before the whole packet came", True, 0 < base.next < base.total)
        line.settle()
        # The place did not move: the rest of the packet from where it stopped, or the same packet again.
        expect("total", directory_of(base.opened).levels[0].bytes, base.total)
        rest = line.ask("get_packet", generation=base.opened.generation, packet=0, offset=base.next)
        line.until(lambda: rest.chunks, "the first chunk of the rest")
        expect("where the rest begins", base.next, rest.first)
        line.cancel_unread(rest)
        if line.finish(rest).outcome == "cancelled":
            again = line.ask("get_next_packet", handle=base.opened.handle)
            line.until(lambda: again.chunks, "the first chunk again")
            expect("the place did not move: packet and offset", (0, 0), (again.packet, again.first))
            line.cancel_unread(again)
            line.finish(again)
        line.ping()


@checks("K-1", "K-2", "T-4", "R-11")
def cancelled_and_fetched_in_pieces(context):
    mesh = context.need_big()
    with context.session(receive_buffer=1 << 16) as line:
        base = line.ask("get_base_mesh", name=mesh.name)
        line.until(lambda: base.next and base.next > 300000, "some chunks")
        line.cancel(base)
        line.finish(base)
        rest = line.ask("get_packet", generation=base.opened.generation, packet=0, offset=base.next)
        if base.outcome == "cancelled":
            expect_complete(line.finish(rest, timeout=20))
            whole = bytes(base.data + rest.data)
            expect("bytes", base.total, len(whole))
            if mesh.file:
                expect("SHA-256", packets.sha256(mesh.file.packets[0]), packets.sha256(whole))
            following = line.ask("get_next_packet", handle=base.opened.handle)
            line.finish(following)
            expect("the place moved on", True, following.outcome == "end_of_mesh" or following.packet == 1)


@checks("K-1", "K-2", "R-4", "R-7")
def cancel_of_what_waits(context):
    mesh = context.need_big()
    with context.session(receive_buffer=_SMALL_WINDOW) as line:
        first = line.ask("get_base_mesh", name=mesh.name)
        line.until(lambda: first.chunks and first.opened, "the first chunk")
        waiting = [line.ask("get_next_packet", handle=first.opened.handle) for _ in range(3)]
        line.cancel(waiting[1])
        line.finish(waiting[1])
        expect("end of the one that waited", ("cancelled", 0, "open"),
               (waiting[1].outcome, waiting[1].chunks, first.outcome))
        line.cancel_unread(first, waiting[0], waiting[2])
        line.finish(first, *waiting)
        expect("ends", ["cancelled"] * 3, [r.outcome for r in (first, waiting[0], waiting[2])])
        line.settle()
        expect("one end each", 4, len(line.ends))


@checks("K-1", "K-2", "R-7")
def cancel_of_what_waits_moves_nothing(context):
    mesh = context.need_big()
    with context.opened(receive_buffer=_SMALL_WINDOW) as (line, base):
        running = line.ask("get_base_mesh", name=mesh.name)  # with one slot the others wait behind it
        line.until(lambda: running.chunks, "the first chunk")
        waiting = [line.ask("get_next_packet", handle=base.opened.handle) for _ in range(2)]
        line.cancel_unread(*waiting, running)
        line.finish(*waiting, running)
        came = sum(request.outcome == "complete" for request in waiting)  # a server with more slots may be quicker
        following = line.finish(line.ask("get_next_packet", handle=base.opened.handle))
        expect("the place", 1 + came, following.packet)


@checks("R-5", "R-10", "K-1", "K-2")
def a_mesh_is_opened_before_its_request_waits(context):
    mesh, second = context.need_big(), context.need_second()
    with context.opened(second) as (_, base):
        generation = base.opened.generation
    with context.session(receive_buffer=_SMALL_WINDOW) as line:
        running = line.ask("get_base_mesh", name=mesh.name)
        line.until(lambda: running.chunks, "the first chunk")
        waiting = [line.ask("get_base_mesh", name=context.mesh.name),
                   line.ask("get_packet", generation=generation, packet=0, offset=1)]
        line.cancel_unread(*waiting, running)
        line.finish(*waiting, running)
        line.settle()
        expect("mesh_opened", [True, True], [request.opened is not None for request in waiting])


@checks("K-2", "R-9")
def cancel_of_a_mesh_that_is_opened_again(context):
    mesh = context.need_big()
    with context.session(receive_buffer=_SMALL_WINDOW) as line:
        base = line.ask("get_base_mesh", name=mesh.name)
        line.until(lambda: base.chunks and base.opened, "the first chunk")
        line.cancel_unread(base)
        line.finish(base)
        expect_complete(line.finish(line.ask("get_packet", generation=base.opened.generation, packet=1, offset=0)))
        line.narrow()
        again = line.ask("get_base_mesh", name=mesh.name)
        line.until(lambda: again.chunks, "the first chunk")
        line.cancel_unread(again)
        if line.finish(again).outcome == "cancelled":
            following = line.finish(line.ask("get_next_packet", handle=0))
            if len(directory_of(base.opened).levels) == 2:
                expect("the place did not move", "end_of_mesh", following.outcome)
            else:
                expect("the place did not move", 2, following.packet)


@checks("K-3", "H-5")
def cancel_of_id_0(context):
    with context.session() as line:
        line.send("cancel", id=0)
        line.expect_end("malformed")


@checks("K-3", "K-1", "R-3")
def cancel_of_what_is_not_open(context):
    with context.opened() as (line, base):
        for number in (base.id, 424242, 0xFFFFFFFF):
            line.send("cancel", id=number)
        line.ping()
        line.settle()
        expect("ends, errors, refusals", (1, [], []), (len(line.ends), line.fatal, line.refusals))
        expect("packet", 1, line.finish(line.ask("get_next_packet", handle=0)).packet)


@checks("K-1", "K-3", "R-3")
def cancel_in_one_segment_with_its_request(context):
    with context.session() as line:
        kinds = [("get_base_mesh", {"name": context.mesh.name}), ("get_mesh_list", {"filter": "", "after": "", "most": 0}),
                 ("get_next_packet", {"handle": 0})]
        line.finish(line.ask("get_base_mesh", name=context.mesh.name))
        for _ in range(10):
            for kind, fields in kinds:
                request, frame = line.prepare(kind, **fields)
                request.cancelled = True
                line.request.send(frame + wire.message("cancel", id=request.id) * 3)
                line.finish(request)
                expect("the end", True, request.outcome in ("cancelled", "complete", "end_of_mesh"))
        line.settle()
        expect("one end each", 31, len(line.ends))
        line.ping()


@checks("K-1", "R-7")
def cancel_does_not_move_the_place(context):
    with context.opened() as (line, base):
        place = 1
        last = len(directory_of(base.opened).levels)
        for _ in range(20):
            request, frame = line.prepare("get_next_packet", handle=base.opened.handle)
            request.cancelled = True
            line.request.send(frame + wire.message("cancel", id=request.id))
            line.finish(request)
            if request.outcome == "complete":
                expect("packet", place, request.packet)
                place += 1
            elif request.outcome == "end_of_mesh":
                expect("the end only behind the last packet", last, place)
        following = line.finish(line.ask("get_next_packet", handle=base.opened.handle))
        if place < last:
            expect("the place", place, following.packet)
        else:
            expect("the end", "end_of_mesh", following.outcome)


@checks("K-2", "R-4", "S-3")
def a_cancelled_transfer_leaves_the_others(context):
    mesh = context.need_big()
    with context.session(receive_buffer=_SMALL_WINDOW) as slow, context.session() as other:
        running = slow.ask("get_base_mesh", name=mesh.name)
        slow.until(lambda: running.chunks, "the first chunk")
        slow.cancel_unread(running)
        slow.finish(running)
        expect("the end", "cancelled", running.outcome)
        expect_complete(other.finish(other.ask("get_base_mesh", name=context.mesh.name)))
        expect_complete(slow.finish(slow.ask("get_base_mesh", name=context.mesh.name)))
