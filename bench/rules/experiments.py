# SPDX-License-Identifier: MIT
"""Who fetches what in each experiment: the clients, their lines, their meshes, and when they come. All of it follows
from the scale and the seed; nothing is measured here."""

import dataclasses
import random

import bounds
from network import DSL_1024, DSL_2048, MODEM, Line

# Name: file in the folder of test meshes, file out of Debian's libcgal-demo, and levels as the paper encodes: 4 to 9.
# With the first: 271, 146 and 28 kB, bit for bit.
MESHES = {
    "large": ("nefertiti.obj", "refined_elephant", 9),
    "medium": ("armadillo.off", "man", 6),
    "small": ("fertility.off", "knot1", 4),
}
_CROWD = {MODEM: 3, DSL_1024: 7, DSL_2048: 10}
_CROWD_SECONDS = 80  # in which they arrive, at scale 1
_APART_SECONDS = 0.01


@dataclasses.dataclass(frozen=True)
class Client:
    number: int
    line: Line
    mesh: str
    arrival: float = 0
    stall_after: int | None = None  # packet
    leave_after: int | None = None  # packet


@dataclasses.dataclass(frozen=True)
class Experiment:
    key: str
    title: str
    clients: tuple


def _until_first_request(line):
    """Seconds from a client's start until its first request is at the server: two connections, hello and join, some
    800 bytes both ways."""
    return bounds.DELAYS_TO_REQUEST * line.delay_ms / 1000 + 800 * 8 / (line.up_kbit * 1000)


def _three(lines, meshes, scale, first=1):
    """Clients that start so that their first requests meet at the server, in the order of their numbers: who is sooner
    ready to ask because his line is shorter has nothing to do with the rule."""
    lines = [line.scaled(*scale) for line in lines]
    longest = max(map(_until_first_request, lines))
    return tuple(Client(first + n, line, mesh, longest - _until_first_request(line) + n * _APART_SECONDS)
                 for n, (line, mesh) in enumerate(zip(lines, meshes)))


def _crowd(scale, seed, meshes, stays):
    """Twenty clients in a row of arrivals; one that is fast and fetches the large mesh takes nothing more before its
    last packet, or, if not `stays`, leaves there."""
    chance = random.Random(seed)
    lines = [line for line, count in _CROWD.items() for _ in range(count)]
    chance.shuffle(lines)
    names = [list(MESHES)[number % len(MESHES)] for number in range(len(lines))]
    chance.shuffle(names)
    arrivals = sorted(chance.uniform(0, _CROWD_SECONDS / scale[0]) for _ in lines)
    # The one nearest to the middle of the row; if no fast one has the large mesh by chance, a fast one gets it.
    middle = len(lines) // 2
    fast = sorted((n for n in range(len(lines)) if lines[n] != MODEM), key=lambda n: abs(n - middle))
    stalling = next((n for n in fast if names[n] == "large"), fast[0])
    names[stalling] = "large"
    behind = len(meshes["large"]) - 2
    clients = [Client(n + 1, line.scaled(*scale), name, arrival - arrivals[0])
               for n, (line, name, arrival) in enumerate(zip(lines, names, arrivals))]
    clients[stalling] = dataclasses.replace(clients[stalling], **{"stall_after" if stays else "leave_after": behind})
    return tuple(clients)


def make(key, scale, seed, meshes):
    """The experiment of that key. `meshes`: name to levels, as the daemon describes them. `scale`: that of
    speeds and that of delays."""
    if key == "1":
        return Experiment(key, "clients 1, 2 and 3 fetch the same mesh",
                          _three((MODEM, DSL_1024, DSL_2048), ("large",) * 3, scale))
    if key == "2":
        return Experiment(key, "three meshes, three speeds",
                          _three((MODEM, DSL_1024, DSL_2048), ("medium", "large", "small"), scale))
    if key == "3":
        return Experiment(key, "three meshes, clients 3 to 5 of one speed",
                          _three((DSL_2048,) * 3, ("small", "medium", "large"), scale, first=3))
    if key == "4":
        return Experiment(key, "twenty clients come one after the other, one of them stalls",
                          _crowd(scale, seed, meshes, stays=True))
    if key == "4-left":
        return Experiment(key, "the same twenty clients, the one that would stall leaves instead",
                          _crowd(scale, seed, meshes, stays=False))
    raise ValueError(f"there is no experiment {key}")
