# SPDX-License-Identifier: MIT
"""Meshes that are replaced, removed or damaged while somebody has them. Every check has a server of its own."""

import time

import packets
import wire
from check_requests import fetch_all
from session import Failed
from suite import checks, expect, expect_complete, expect_refused


def old_mesh():
    return packets.make([300, 400, 500, 600], "old")


def notices_of(line, kind):
    return [n for n in line.notices if n.kind == kind]


def await_notice(line, kind):
    line.until(lambda: notices_of(line, kind), f"a notice of kind {kind}")
    return notices_of(line, kind)[0]


def base_of(line, name):
    return expect_complete(line.finish(line.ask("get_base_mesh", name=name)))


@checks("R-13", "N-2", "R-9", "T-4")
def replaced_while_it_is_fetched(context):
    old, new = old_mesh(), packets.make([350, 450], "new")
    with context.operator.server({"m": old}) as server, context.session(server.address) as line, \
            context.session(server.address) as bystander:
        base = base_of(line, "m")
        server.put("m", new)
        notice = await_notice(line, wire.MESH_RETIRED)
        expect("the notice's handle", base.opened.handle, notice.handle)
        expect("seconds", True, notice.seconds > 0)
        expect("SHA-256 of the old packets", [packets.sha256(p) for p in old.packets],
               [packets.sha256(p) for p in fetch_all(line, base)])
        again = line.finish(line.ask("get_packet", generation=old.generation, packet=2, offset=100))
        expect("old packet 2 from 100", old.packets[2][100:], bytes(again.data))
        fresh = base_of(line, "m")
        expect("another handle and generation", (True, new.generation),
               (fresh.opened.handle != base.opened.handle, fresh.opened.generation))
        expect("SHA-256 of the new packets", [packets.sha256(p) for p in new.packets],
               [packets.sha256(p) for p in fetch_all(line, fresh)])
        expect("the old handle goes on", "complete",
               line.finish(line.ask("get_packet", generation=old.generation, packet=1, offset=0)).outcome)
        other = base_of(bystander, "m")
        expect("others see the new one", new.generation, other.opened.generation)
        bystander.settle()
        expect("notices to whom they do not concern", 0, len(bystander.notices))


@checks("R-13", "N-2", "R-5")
def removed_while_it_is_fetched(context):
    old = old_mesh()
    with context.operator.server({"m": old, "n": packets.make([100], "n")}) as server, \
            context.session(server.address) as line, context.session(server.address) as late:
        base = base_of(line, "m")
        server.remove("m")
        expect("the notice's handle", base.opened.handle, await_notice(line, wire.MESH_RETIRED).handle)
        expect_refused(late.finish(late.ask("get_base_mesh", name="m")), "unknown_mesh")
        expect_refused(line.finish(line.ask("get_base_mesh", name="m")), "unknown_mesh")
        expect("SHA-256 of the old packets", [packets.sha256(p) for p in old.packets],
               [packets.sha256(p) for p in fetch_all(line, base)])


@checks("R-13", "R-12")
def mesh_changed_when_the_grace_time_is_over(context):
    old = old_mesh()
    with context.operator.server({"m": old}, grace_time=0.5) as server, context.session(server.address) as line:
        base = base_of(line, "m")
        server.put("m", packets.make([350, 450], "new"))
        await_notice(line, wire.MESH_RETIRED)
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
        expect("a new handle", True, base_of(line, "m").opened.handle != base.opened.handle)


@checks("R-12", "R-13")
def mesh_changed_in_a_new_session(context):
    old = old_mesh()
    with context.operator.server({"m": old}, grace_time=0.2) as server:
        with context.session(server.address) as line:
            base_of(line, "m")
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


@checks("E-1", "R-3", "S-3")
def a_mesh_that_cannot_be_read(context):
    broken = packets.make([3001, 3002, 3003], "broken")
    with context.operator.server({"broken": broken, "m": old_mesh()}, cache_size=0) as server:
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
            base_of(line, "m")
            line.ping()
