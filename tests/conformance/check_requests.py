# SPDX-License-Identifier: MIT
"""Requests and transfers: opening, the place in the mesh, get_packet at any offset, refusals, and the bytes."""

import packets
import wire
from session import Failed
from suite import NotTried, checks, expect, expect_complete, expect_refused


def fetch_all(line, base):
    """All packets of an opened mesh, the base that came with it included."""
    found = [bytes(base.data)]
    while True:
        request = line.finish(line.ask("get_next_packet", handle=base.opened.handle))
        if request.outcome == "end_of_mesh":
            return found
        expect_complete(request)
        expect("the packet's number", len(found), request.packet)
        expect("the handle", base.opened.handle, request.handle)
        found.append(bytes(request.data))


def compare(mesh, directory, found):
    """Every packet against the directory and, if it is known, the file: SHA-256 of each."""
    expect("number of packets", len(directory.levels), len(found))
    for number, (level, packet) in enumerate(zip(directory.levels, found, strict=True)):
        try:
            packets.check_packet(packet, level, number)
        except packets.BadFile as wrong:
            raise Failed("T-4 the packets that the directory announced", wrong) from wrong
    if mesh.file is None:
        return
    expect("SHA-256 of the directory", packets.sha256(mesh.file.directory.raw), packets.sha256(directory.raw))
    for number, (mine, theirs) in enumerate(zip(mesh.file.packets, found, strict=True)):
        expect(f"SHA-256 of packet {number}", packets.sha256(mine), packets.sha256(theirs))


def directory_of(opened):
    directory = packets.read_directory(opened.directory)
    expect("bytes of the directory", len(directory.raw), len(opened.directory))
    expect("generation of mesh_opened and of its directory", directory.generation, opened.generation)
    return directory


@checks("T-1", "T-2", "T-3", "T-4", "R-5", "R-7", "R-8")
def every_packet_is_the_right_one(context):
    for mesh in filter(None, (context.mesh, context.second)):
        with context.opened(mesh) as (line, base):
            expect("the base packet's number", 0, base.packet)
            compare(mesh, directory_of(base.opened), fetch_all(line, base))


@checks("R-8", "R-3")
def end_of_mesh_as_often_as_it_is_asked(context):
    with context.opened() as (line, base):
        fetch_all(line, base)
        for handle in (base.opened.handle, 0) * 3:
            request = line.finish(line.ask("get_next_packet", handle=handle))
            expect("the end", ("end_of_mesh", 0), (request.outcome, request.chunks))
        for number in (1, 2, 3):  # ids are free again after their end
            line.finish(line.ask("get_next_packet", number, handle=0))


@checks("R-1", "H-5", "S-1")
def an_id_that_is_open(context):
    mesh = context.need_big()
    for kind, fields in (("get_base_mesh", {"name": mesh.name}), ("get_next_packet", {"handle": 0}),
                         ("get_packet", {"generation": 1, "packet": 0, "offset": 0}),
                         ("get_mesh_list", {"filter": "", "after": "", "most": 0})):
        with context.session(receive_buffer=4096) as line:
            running = line.ask("get_base_mesh", 5, name=mesh.name)  # not read, so it cannot end
            line.until(lambda one=running: one.opened and one.chunks, "the first chunk")
            line.request.send(wire.message(kind, id=5, **fields))
            line.expect_end("duplicate_id")


@checks("R-1", "R-3")
def any_id_but_0(context):
    with context.session() as line:
        for number in (1, 0xFFFFFFFF, 0x80000000, 1):
            expect_complete(line.finish(line.ask("get_base_mesh", number, name=context.mesh.name)))


@checks("R-2", "R-3")
def more_requests_than_allowed(context):
    with context.opened() as (line, base):
        count = line.hello_ok.open_requests + 1
        asked = [line.prepare("get_packet", generation=base.opened.generation, packet=0, offset=0) for _ in range(count)]
        line.request.send(b"".join(frame for _, frame in asked))
        line.finish(*(request for request, _ in asked))
        # How many were still open when the last came is a race that a fast server wins: then none is refused.
        refused = [request for request, _ in asked if request.outcome != "complete"]
        expect("what is refused", {"too_many_requests"}, {r.outcome for r in refused} or {"too_many_requests"})
        line.ping()
        expect_complete(line.finish(line.ask("get_base_mesh", name=context.mesh.name)))


@checks("R-2", "K-3")
def one_request_more_while_all_wait(context):
    mesh = context.need_big()
    with context.session(receive_buffer=4096) as line, context.session() as other:
        first = line.ask("get_base_mesh", name=mesh.name)  # not read for now, so it cannot end
        rest = [line.ask("get_base_mesh", name=mesh.name) for _ in range(line.hello_ok.open_requests - 1)]
        line.send("cancel", id=999999)  # does not count as open
        more = [line.ask("get_mesh_list", filter="", after="", most=1), line.ask("get_next_packet", handle=0)]
        _read_only_requests(line, lambda: all(r.error for r in more))
        expect("what is refused", ["too_many_requests"] * 2, [r.outcome for r in more])
        expect("what goes on", {"open"}, {r.outcome for r in (first, *rest)})
        other.ping()


def _read_only_requests(line, true):
    """Waits for `true()` while the data channel is left unread."""
    data, line.data = line.data, None
    try:
        line.until(true, "answers on the request channel")
    finally:
        line.data = data


@checks("R-1", "R-2", "H-5")
def an_id_that_is_open_beyond_the_limit(context):
    mesh = context.need_big()
    with context.session(receive_buffer=4096) as line:
        running = line.ask("get_base_mesh", name=mesh.name)
        line.until(lambda: running.chunks, "the first chunk")
        for _ in range(line.hello_ok.open_requests - 1):
            line.ask("get_base_mesh", name=mesh.name)
        line.send("get_base_mesh", id=running.id, name=mesh.name)
        line.expect_end("duplicate_id")


@checks("R-5", "R-3")
def unknown_mesh(context):
    with context.session() as line:
        expect_refused(line.finish(line.ask("get_base_mesh", name=context.mesh.name + "?")), "unknown_mesh")
        line.settle()
        expect("ends", 1, len(line.ends))


@checks("R-6")
def handles_not_given(context):
    with context.session() as line:
        for handle in (0, 1, 77, 0xFFFFFFFF):
            expect_refused(line.finish(line.ask("get_next_packet", handle=handle)), "unknown_handle")
        base = line.finish(line.ask("get_base_mesh", name=context.mesh.name))
        for handle in (base.opened.handle + 1, base.opened.handle ^ 0x80000000):
            expect_refused(line.finish(line.ask("get_next_packet", handle=handle)), "unknown_handle")


@checks("R-6")
def handle_0_is_the_mesh_asked_for_last(context):
    second = context.need_second()
    with context.opened() as (line, one):
        two = line.finish(line.ask("get_base_mesh", name=second.name))

        def asked_last(expected):
            request = line.finish(line.ask("get_next_packet", handle=0))
            expect("the mesh of handle 0", expected.opened.handle, request.handle)

        asked_last(two)
        line.finish(line.ask("get_next_packet", handle=one.opened.handle))
        line.finish(line.ask("get_packet", generation=two.opened.generation, packet=0, offset=0))
        asked_last(two)
        line.finish(line.ask("get_base_mesh", name=context.mesh.name))
        asked_last(one)
        for kind, fields in (("get_base_mesh", {"name": "no such mesh"}), ("get_next_packet", {"handle": 4711}),
                             ("get_packet", {"generation": two.opened.generation, "packet": 4711, "offset": 0})):
            expect_refused(line.finish(line.ask(kind, **fields)), "unknown_mesh", "unknown_handle", "bad_range")
        line.finish(line.ask("get_base_mesh", name=context.mesh.name))
        expect_refused(line.finish(line.ask("get_base_mesh", name="no such mesh")), "unknown_mesh")
        asked_last(one)  # what was refused does not count


@checks("R-6", "F-2", "S-2")
def base_and_next_in_one_segment(context):
    with context.session() as line:
        base, first = line.prepare("get_base_mesh", name=context.mesh.name)
        following, second = line.prepare("get_next_packet", handle=0)
        line.request.send(first + second)
        expect_complete(line.finish(base))
        expect_complete(line.finish(following))
        expect("packet and handle", (1, base.opened.handle), (following.packet, following.handle))


@checks("R-9", "R-7")
def opening_again(context):
    with context.opened() as (line, base):
        expect("packet", 1, line.finish(line.ask("get_next_packet", handle=0)).packet)
        again = expect_complete(line.finish(line.ask("get_base_mesh", name=context.mesh.name)))
        expect("handle and generation", (base.opened.handle, base.opened.generation, base.data),
               (again.opened.handle, again.opened.generation, again.data))
        expect("packet", 1, line.finish(line.ask("get_next_packet", handle=0)).packet)


@checks("R-4", "R-7")
def one_handle_in_order(context):
    with context.opened() as (line, base):
        asked = [line.prepare("get_next_packet", handle=base.opened.handle) for _ in range(line.hello_ok.open_requests)]
        line.request.send(b"".join(frame for _, frame in asked))
        line.finish(*(request for request, _ in asked))
        expect("the ends in the order of asking", [r.id for r, _ in asked], line.ends[-len(asked):])
        came = [r.packet for r, _ in asked if r.outcome == "complete"]
        expect("packets", list(range(1, 1 + len(came))), came)


def _offsets(size):
    return sorted({0, 1, size // 3, size // 2, size - 2, size - 1} & set(range(size)))


@checks("R-10", "R-11", "R-7", "T-4")
def get_packet_in_the_same_session(context):
    with context.opened() as (line, base):
        whole = fetch_all(line, base)
        for number, packet in enumerate(whole):
            for offset in _offsets(len(packet)):
                _take(line, base.opened.generation, number, offset, packet, opens=False)
                following = line.finish(line.ask("get_next_packet", handle=base.opened.handle))
                if number + 1 < len(whole):
                    expect("packet that follows", (number + 1, whole[number + 1]),
                           (following.packet, bytes(following.data)))
                else:
                    expect("what follows", "end_of_mesh", following.outcome)


def _take(line, generation, number, offset, packet, opens):
    request = line.ask("get_packet", generation=generation, packet=number, offset=offset)
    expect("a new handle is due", opens, request.opens)
    expect_complete(line.finish(request))
    what = f"get_packet {number} from {offset}"
    expect(f"{what}: first offset, total, packet", (offset, len(packet), number),
           (request.first, request.total, request.packet))
    expect(f"{what}: SHA-256", packets.sha256(packet[offset:]), packets.sha256(request.data))
    expect(f"{what}: mesh_opened", opens, request.opened is not None)
    return request


@checks("R-10", "R-11", "T-4")
def get_packet_in_a_new_session(context):
    with context.opened() as (line, base):
        whole = fetch_all(line, base)
    for number in sorted({0, len(whole) // 2, len(whole) - 1}):
        for offset in (0, len(whole[number]) // 2, len(whole[number]) - 1):
            with context.session() as line:
                request = _take(line, base.opened.generation, number, offset, whole[number], opens=True)
                expect("directory", base.opened.directory, request.opened.directory)
                expect("generation", base.opened.generation, request.opened.generation)
                line.settle(0.05)
                following = line.finish(line.ask("get_next_packet", handle=0))
                if number + 1 < len(whole):
                    expect("packet that follows", (number + 1, whole[number + 1]),
                           (following.packet, bytes(following.data)))
                else:
                    expect("what follows", "end_of_mesh", following.outcome)
                again = expect_complete(line.finish(line.ask("get_base_mesh", name=context.mesh.name)))
                expect("the same handle", request.opened.handle, again.opened.handle)


@checks("T-4", "R-11")
def one_packet_in_pieces_of_several_sessions(context):
    with context.opened() as (line, base):
        whole = fetch_all(line, base)
    number = max(range(len(whole)), key=lambda k: len(whole[k]))
    parts, step = bytearray(), max(1, len(whole[number]) // 3)
    while len(parts) < len(whole[number]):
        with context.session() as line:
            request = line.finish(line.ask("get_packet", generation=base.opened.generation, packet=number,
                                           offset=len(parts)))
            parts += request.data[:step]
    expect("SHA-256 of the pieces", packets.sha256(whole[number]), packets.sha256(parts))


@checks("R-12", "E-1")
def beyond_the_end(context):
    with context.opened() as (line, base):
        directory = directory_of(base.opened)
        count, sizes = len(directory.levels), [level.bytes for level in directory.levels]
        wrong = [(count, 0), (0xFFFFFFFF, 0), (0, sizes[0]), (0, sizes[0] + 1), (0, (1 << 64) - 1),
                 (count - 1, sizes[-1]), (count - 1, 1 << 63), (0xFFFFFFFF, (1 << 64) - 1)]
        for number, offset in wrong:
            request = line.ask("get_packet", generation=base.opened.generation, packet=number, offset=offset)
            expect_refused(line.finish(request), "bad_range")
        following = line.finish(line.ask("get_next_packet", handle=base.opened.handle))
        if count > 1:
            expect("the place did not move", 1, following.packet)
        else:
            expect("the place did not move", "end_of_mesh", following.outcome)
    with context.session() as line:
        for number, offset in wrong:
            request = line.ask("get_packet", generation=base.opened.generation, packet=number, offset=offset)
            expect_refused(line.finish(request), "bad_range")
            expect("mesh_opened of a refused request", None, request.opened)
        line.ping()


@checks("R-12", "E-1")
def generation_that_is_not_there(context):
    with context.opened() as (line, base):
        for generation in (base.opened.generation ^ 1, 0, (1 << 64) - 1):
            request = line.ask("get_packet", generation=generation, packet=0, offset=0)
            expect_refused(line.finish(request), "mesh_changed")
        expect("the place did not move", 1, line.finish(line.ask("get_next_packet", handle=base.opened.handle)).packet)


@checks("R-3", "R-2")
def a_flood_of_requests(context):
    with context.session() as line:
        asked = [line.prepare("get_base_mesh", name=context.mesh.name) for _ in range(300)]
        line.request.send(b"".join(frame for _, frame in asked))
        line.finish(*(request for request, _ in asked), timeout=20)
        outcomes = {request.outcome for request, _ in asked}
        expect("outcomes", True, outcomes <= {"complete", "too_many_requests"} and "complete" in outcomes)
        line.settle()
        expect("ends, one each", len(asked), len(line.ends))
        if "too_many_requests" not in outcomes:
            raise NotTried("the server was quicker than 300 requests")
