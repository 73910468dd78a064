#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Runs the suite against a real pmcd with the operator's hook, for ctest: against_pmcd.py [--slow] GROUP...

PMCD_DAEMON and PMCTOOL name the programs. The meshes: a torus that `pmctool encode` packs on the spot, a golden file, and a
made one that is too large for buffers. Here nothing may be left untried, and each group has to meet its codes.
"""

import math
import os
import pathlib
import subprocess
import sys
import tempfile

import packets
import report
import run
import suite
import wire
from pmcd_operator import PmcdOperator

_GOLDEN = pathlib.Path(__file__).resolve().parents[1] / "golden" / "sphere-12.pmcd"
# What may stay untried: a race that a fast server wins, and without --slow half a minute of waiting.
_MAY_STAY = {"a_flood_of_requests"}
_SLOW = {"a_client_that_takes_too_little", "times_of_the_document", "stalled_by_the_document"}


def _torus(path, rings=60, sides=40):
    """A closed torus in OFF."""
    lines = ["OFF", f"{rings * sides} {2 * rings * sides} 0"]
    for i in range(rings):
        for j in range(sides):
            u, v = 2 * math.pi * i / rings, 2 * math.pi * j / sides
            radius = 3 + math.cos(v) * (1 + 0.2 * math.sin(5 * u))
            lines.append(f"{radius * math.cos(u)} {radius * math.sin(u)} {math.sin(v)}")
    for i in range(rings):
        for j in range(sides):
            a, b = i * sides + j, (i + 1) % rings * sides + j
            c, d = (i + 1) % rings * sides + (j + 1) % sides, i * sides + (j + 1) % sides
            lines += [f"3 {a} {b} {c}", f"3 {a} {c} {d}"]
    path.write_text("\n".join(lines) + "\n", encoding="ascii")
    return path


def _encoded(folder):
    path = folder / "torus.pmcd"
    subprocess.run([os.environ["PMCTOOL"], "encode", _torus(folder / "torus.off"), path], check=True, timeout=60,
                   stdout=subprocess.DEVNULL)
    return packets.PacketFile.load(path)


def _missed(groups, met):
    return [code for group in groups for code in report.MET_BY_GROUP[group] if wire.CODES[code] not in met]


def main(argv):
    groups = [group for group in argv if group != "--slow"] or list(run.GROUPS)
    may_stay = _MAY_STAY if "--slow" in argv else _MAY_STAY | _SLOW
    promised = [code for codes in report.MET_BY_GROUP.values() for code in codes]
    if sorted(promised) != sorted(wire.CODES):
        raise SystemExit(f"codes that no group, or more than one, has to meet: {set(wire.CODES) ^ set(promised)}")
    operator = PmcdOperator(os.environ["PMCD_DAEMON"])
    with tempfile.TemporaryDirectory(prefix="pmcd-conformance-") as folder:
        meshes = {"torus": _encoded(pathlib.Path(folder)), "Sphere of 12 bits": packets.PacketFile.load(_GOLDEN),
                  "big": packets.make([24 << 20, 500], "big")}
    with operator.server(meshes) as server:
        first, second, big = (suite.Mesh(name, file) for name, file in meshes.items())
        context = suite.Context(server.address, first, second, big, operator, str(server.admin_socket),
                                seconds=120 if "--slow" in argv else 20)
        results = run.run_checks(context, groups)
    report.tell(results, context.met)
    slow = sorted(results, key=lambda result: -result.seconds)[:8]
    print("slowest: " + ", ".join(f"{result.check.name} {result.seconds:.1f} s" for result in slow))
    untried = [r for r in results if r.outcome == report.NOT_TRIED and r.check.name not in may_stay]
    failed = [r for r in results if r.outcome == report.FAILED]
    missed = _missed(groups, context.met)
    if missed:
        print(f"codes that were not met: {', '.join(missed)}")
    return 1 if failed or untried or missed or not results else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
