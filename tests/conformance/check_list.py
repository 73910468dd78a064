# SPDX-License-Identifier: MIT
"""The mesh list: its form, pages, filters, and that it says what mesh_opened says."""

import math
import struct

import packets
import wire
from session import Failed
from suite import checks, expect, expect_complete, expect_refused

_ENTRY = struct.Struct("<QIIIQBBB6d")


def page(line, text="", after="", most=0):
    """(matches, remaining, meshes) of one page, its form checked."""
    request = line.finish(line.ask("get_mesh_list", filter=text, after=after, most=most))
    expect_complete(request)
    expect("handle and packet of a list", (0, 0), (request.handle, request.packet))
    data = bytes(request.data)
    try:
        return _read(data)
    except (struct.error, UnicodeDecodeError) as wrong:
        raise Failed("L-1 a page of the mesh list", f"{wire.hex_of(data, 200)}: {wrong}") from wrong


def _read(data):
    matches, remaining, count = struct.unpack_from("<III", data)
    at, meshes = 12, []
    for _ in range(count):
        end = at + 1 + data[at]
        name = data[at + 1:end].decode("utf-8")
        meshes.append((name, *_ENTRY.unpack_from(data, end)))
        at = end + _ENTRY.size
        flags, box = meshes[-1][6], meshes[-1][9:]
        if not wire.is_mesh_name(name) or flags > 3 or not all(map(math.isfinite, box)):
            raise Failed("L-1 a mesh name, two flags, and a finite box", meshes[-1])
    expect("bytes behind the last mesh", 0, len(data) - at)
    names = [mesh[0].encode() for mesh in meshes]
    expect("names in ascending order", sorted(set(names)), names)
    expect("at most a page", True, count <= wire.MAX_PAGE)
    return matches, remaining, meshes


def names_of(meshes):
    return [mesh[0] for mesh in meshes]


def everything(line, text="", most=0):
    """All meshes that match, page by page."""
    found, after = [], ""
    while True:
        matches, remaining, meshes = page(line, text, after, most)
        found += meshes
        expect("matches is what came, and what remains", matches, len(found) + remaining)
        if remaining == 0:
            return found
        expect("a page that is not the last holds meshes", True, bool(meshes))
        after = meshes[-1][0]


@checks("L-1", "L-3")
def pages(context):
    with context.session() as line:
        whole = everything(line)
        expect(f"{context.mesh.name} is in the list", True, context.mesh.name in names_of(whole))
        for most in (1, 2, 1000, 1001, 65535):
            expect(f"the list in pages of {most}", whole, everything(line, most=most))
            expect(f"meshes on a page of {most}", min(most, len(whole), wire.MAX_PAGE), len(page(line, most=most)[2]))
        expect("behind the last", (len(whole), 0, []), page(line, after=whole[-1][0]))
        expect("behind a name that is not there", whole[:1], page(line, after=" ", most=1)[2])


@checks("L-2", "L-3")
def filters(context):
    with context.session() as line:
        whole = everything(line)
        texts = {"no such mesh anywhere", ".", " ", "x" * wire.MAX_NAME}
        for name in names_of(whole)[:8] + [context.mesh.name]:
            texts |= {name, name.upper(), name.lower(), name.swapcase(), name[1:], name[:-1], name[1:3], name[:1]}
        for text in sorted(t for t in texts if len(t.encode()) <= wire.MAX_NAME):
            expected = [mesh for mesh in whole if _folded(text) in _folded(mesh[0])]
            expect(f"meshes with {text!r}", expected, everything(line, text))
            expect(f"meshes with {text!r}, one a page", expected[:2], everything(line, text, 1)[:2])


def _folded(text):
    """A to Z without case, all other bytes as they are."""
    return bytes(byte + 32 if 65 <= byte <= 90 else byte for byte in text.encode())


@checks("L-2")
def case_of_other_letters_counts(context):
    names = ("Ärger", "ärger", "AERGER", "İz", "[a", "{a")
    files = {name: packets.make([100], number) for number, name in enumerate(names)}
    with context.operator.server(files) as server, context.session(server.address) as line:
        for text, expected in (("ä", ["ärger"]), ("Ä", ["Ärger"]), ("aerger", ["AERGER"]),
                               ("rG", ["AERGER", "Ärger", "ärger"]), ("[", ["[a"]), ("{", ["{a"]), ("i", []), ("İ", ["İz"])):
            expect(f"names with {text}", expected, names_of(page(line, text)[2]))


@checks("L-1", "L-3")
def more_meshes_than_a_page(context):
    one = packets.make([64, 64], 5)
    with context.operator.server({f"{name:05}": one for name in range(1003)}) as server, \
            context.session(server.address) as line:
        matches, remaining, meshes = page(line)
        expect("matches, and all of them told", (1003, 1003), (matches, remaining + len(meshes)))
        for most in (1000, 1001, 65535):
            matches, remaining, meshes = page(line, most=most)
            expect("matches, remaining, count", (1003, 3, 1000), (matches, remaining, len(meshes)))
        expect("names", [f"{name:05}" for name in range(1003)], names_of(everything(line)))
        server.remove("00500")
        expect("what follows a name that is gone", "00501", page(line, after="00500", most=1)[2][0][0])


@checks("L-2", "L-3")
def filter_and_after_of_any_bytes(context):
    with context.session() as line:
        whole = everything(line)
        for text in (b"\xff", b"\x00", "\u202e".encode(), b"\xc3"):
            expected = [name for name in names_of(whole) if text in name.encode()]
            expect(f"meshes with {text.hex()}", expected, names_of(page(line, text)[2]))
        expect("meshes behind ff", [], page(line, after=b"\xff")[2])


@checks("L-3", "F-3")
def filter_and_after_too_long(context):
    with context.session() as line:
        page(line, text="x" * wire.MAX_NAME, after="y" * wire.MAX_NAME)
    for fields in ({"filter": "x" * 129}, {"after": "x" * 129}, {"filter": "x" * 255}, {"after": "x" * 255}):
        with context.session() as line:
            line.send("get_mesh_list", **{"id": 3, "filter": "", "after": "", "most": 1, **fields})
            line.expect_end("malformed")


@checks("E-1", "R-3")
def a_list_that_cannot_be_read(context):
    with context.operator.server({"m": packets.make([100], "m")}) as server, context.session(server.address) as line:
        with server.without_list():  # nobody has asked for the list yet, so the server has to read it
            for text in ("", "m"):
                request = line.finish(line.ask("get_mesh_list", filter=text, after="", most=0))
                expect_refused(request, "internal_error")
        expect("the request was all that ended; names", ["m"], names_of(everything(line)))
        expect_complete(line.finish(line.ask("get_base_mesh", name="m")))


@checks("L-1", "R-5")
def the_list_and_the_directories_agree(context):
    for mesh in filter(None, (context.mesh, context.second)):
        with context.opened(mesh) as (line, base):
            directory = packets.read_directory(base.opened.directory)
            entry = next(one for one in everything(line, mesh.name) if one[0] == mesh.name)
            last = directory.levels[-1]
            expect("the entry", (mesh.name, base.opened.generation, last.vertices, last.faces, len(directory.levels),
                                 directory.all_bytes, directory.flags, directory.bits, directory.raw[4], *directory.box),
                   entry)
