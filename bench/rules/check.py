# SPDX-License-Identifier: MIT
"""The short run for CI: experiment 1 at scale 32 with a generated mesh, and assertions on what must be so whatever the
rule and however busy the machine is. How good a rule is, it does not judge."""

import json
import subprocess

import bounds
import experiments
import network
import shaping
from cells import CellError, Cells, Rule
from figures import Figures, describe

_SCALE = 32
_SPEED_SCALE = 2
_RULES = ("fifo", "fcsf")
_VERTICES = 20_000
_LEVELS = 9


class CheckError(Exception):
    pass


def _demand(condition, text):
    if not condition:
        raise CheckError(text)


def _check_shaping(programs, line):
    """The slowest line alone: its goodput, and the relay's delay and loss."""
    for measured in shaping.measure(programs["rules_relay"], line, network.UPLINK_KBIT * _SCALE, seconds=2):
        print(f"{measured.what}: {measured.goodput_kbit:.0f} kbit/s of {measured.nominal_kbit:.0f}, round trip "
              f"{measured.round_trip_ms:.1f} ms of {measured.least_round_trip_ms:.1f}", flush=True)
        _demand(0.75 <= measured.goodput_kbit / measured.nominal_kbit <= 1.02,
                f"{measured.what}: goodput {measured.goodput_kbit:.0f} kbit/s, nominal {measured.nominal_kbit:.0f}")
        _demand(measured.least_round_trip_ms <= measured.round_trip_ms <= measured.least_round_trip_ms + 40,
                f"{measured.what}: round trip {measured.round_trip_ms:.1f} ms, the relay makes it "
                f"{measured.least_round_trip_ms:g}")
    lost = [shaping.measure_loss(programs["rules_relay"], 0.1, 1000) for _ in range(2)]
    print(f"loss of 10 %: {lost[0]} and {lost[1]} of 1000", flush=True)
    _demand(60 <= lost[0] <= 140, f"of 1000 datagrams {lost[0]} were lost, not some 100")
    _demand(lost[0] == lost[1], f"the same seed lost {lost[0]} datagrams, then {lost[1]}")


def _check_speeds(programs, scratch, file):
    """A client alone on each kind of line: from the moment in which the daemon takes its speed for measured, what it
    takes it for is within a quarter of what the line carries."""
    (scratch / "speeds").mkdir()
    cells = Cells(programs, scratch / "speeds", _SPEED_SCALE)
    cells.ingest("large", file, _LEVELS)
    for line in (network.MODEM, network.DSL_1024):
        scaled = line.scaled(_SPEED_SCALE, 1)
        seen = []

        def watch(ask):
            for client in json.loads(ask("clients", "--json"))["clients"]:
                if client["speed_kbit"] is not None:
                    seen.append((client["bytes"], client["speed_kbit"]))

        client = experiments.Client(1, scaled, "large")
        cells.run(experiments.Experiment("speed", "one client alone", (client,)), Rule.parse("fifo"), "ours", watch)
        carried = shaping.carries(scaled, cells.uplink_kbit)
        _demand(len(seen) >= 3, f"{line.name}: the speed was seen only {len(seen)} times")
        wrong = [(count, speed) for count, speed in seen if abs(speed - carried) > carried / 4]
        print(f"{line.name}: carries {carried:.0f} kbit/s; measured for the first time after {seen[0][0]} bytes: "
              f"{seen[0][1]:.0f}, then {min(speed for _, speed in seen):.0f} to {max(speed for _, speed in seen):.0f}",
              flush=True)
        _demand(not wrong, f"{line.name}: carries {carried:.0f} kbit/s, but after {wrong[:1]} bytes it was measured so")


def _known(cells, rules):
    if rules is None:
        rules = [rule for rule in map(Rule.parse, _RULES) if cells.refusal(rule, "paper") is None]
        _demand(rules, f"the daemon knows none of {', '.join(_RULES)}")
    for rule in rules:
        refusal = cells.refusal(rule, "paper")
        _demand(refusal is None, f"{rule.text}: {refusal}")
    return rules


def run(programs, scratch, rules):
    """`rules`: None for those of fifo and fcsf that the daemon knows. Raises CheckError, and what cells raise."""
    cells = Cells(programs, scratch, _SCALE)
    rules = _known(cells, rules)
    file = scratch / "sphere.ply"
    made = subprocess.run([str(programs["bumpy_sphere"]), str(_VERTICES), str(file)], stdin=subprocess.DEVNULL,
                          capture_output=True, text=True, check=False)
    if made.returncode != 0:
        raise CellError(f"bumpy_sphere: {made.stderr.strip()}")
    cells.ingest("large", file, _LEVELS)
    experiment = experiments.make("1", (_SCALE, 1), 1, cells.meshes)
    _check_shaping(programs, experiment.clients[0].line)

    _check_speeds(programs, scratch, file)
    results = {"parameters": {"uplink_kbit": cells.uplink_kbit},
               "meshes": {name: {"levels": levels} for name, levels in cells.meshes.items()},
               "experiments": {"1": describe(experiment)},
               "cells": [cells.run(experiment, rule, "paper") for rule in rules]}
    levels = cells.meshes["large"]
    for cell in results["cells"]:
        for client, result in zip(experiment.clients, cell["clients"]):
            who = f"{cell['rule']}, client {client.number}"
            # That each packet was the right one, the client has looked at itself.
            _demand(result["ended"] == "complete", f"{who}: {result['ended']}: {result.get('why')}")
            _demand([packet["bytes"] for packet in result["packets"]] == [level["bytes"] for level in levels],
                    f"{who}: the packets are not those of the mesh")
            round_trip = 2 * client.line.delay_ms / 1000
            _demand(round_trip <= result["connected"] <= round_trip + 0.5,
                    f"{who}: connected after {result['connected']:.3f} s, a round trip takes {round_trip:.3f}")
            print(f"{who}, {client.line.name}: "
                  + ", ".join(f"{figure} {result['times'][figure]:.2f} s" for figure in bounds.FIGURES)
                  + f", bound of the end {bounds.own(client.line, cells.uplink_kbit, levels, 'end'):.2f} s", flush=True)
        for relay in cell["relays"]:
            _demand(relay is not None and relay["there"]["packets"] > 0 and relay["there"]["lost"] == 0,
                    f"{cell['rule']}: a relay counted {relay}")
    for key, rule, _, number, figure, time, bound in Figures(results).beaten():
        raise CheckError(f"experiment {key}, {rule}: client {number} had {figure} after {time:.3f} s, which is not "
                         f"possible before {bound:.3f} s: the lines are not shaped as they should be")
    print("all is as it should be")
