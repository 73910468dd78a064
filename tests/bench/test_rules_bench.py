# SPDX-License-Identifier: MIT
"""The rules bench: its bounds and verdicts are counted as its report says, and its crowd follows from the seed. Nothing
is measured; bench/rules/run --check does that."""

import pathlib
import sys
import unittest
import xml.etree.ElementTree

sys.dont_write_bytecode = True
sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "bench" / "rules"))
# pylint: disable=wrong-import-position
import bounds
import chart
import experiments
import network
import report
import verdicts
from cells import Rule
from figures import Figures, describe


def levels(*sizes, errors=None):
    errors = errors or [1.0 / (10 ** number) for number in range(len(sizes))]
    return [{"bytes": size, "error_rms": error} for size, error in zip(sizes, errors)]


MESHES = {"large": levels(200, 2_000, 20_000, 100_000, 150_000), "medium": levels(200, 10_000, 90_000),
          "small": levels(200, 5_000, 15_000)}
FAST = network.Line("fast", 8000, 8000, 10, 32000)


def client(number, line=FAST, mesh="large", arrival=0.0):
    return experiments.Client(number, line, mesh, arrival)


class PacketTest(unittest.TestCase):
    def test_first_packet_with_the_error(self):
        mesh = levels(1, 1, 1, 1, errors=[2.0, 0.2, 0.1, 0.01])
        self.assertEqual([bounds.packet_of(figure, mesh) for figure in bounds.FIGURES], [0, 1, 2, 3, 3])

    def test_an_error_that_is_not_reached_is_the_end(self):
        mesh = levels(1, 1, 1, errors=[1.0, 0.3, 0.04])
        self.assertEqual(bounds.packet_of("1 %", mesh), 2)
        self.assertFalse(bounds.reached("1 %", mesh))
        self.assertTrue(bounds.reached("5 %", mesh))

    def test_errors_that_were_not_measured(self):
        mesh = levels(1, 1, errors=[None, None])
        self.assertEqual(bounds.packet_of("10 %", mesh), 1)


class OwnBoundTest(unittest.TestCase):
    def test_counted_by_hand(self):
        # 100 ms of handshake; one chunk of 100,000 bytes and its head of 34 in 70 segments on a line of 1,000,000 bytes
        # a second, of which 4 ms go through at once.
        mesh = levels(100_000)
        wire = 100_034 + 70 * 52 - 4_000
        self.assertAlmostEqual(bounds.own(FAST, 1e6, mesh, "end"), 0.1 + wire / 1e6)

    def test_the_slower_of_line_and_uplink(self):
        alone = bounds.own(FAST, 1e6, MESHES["large"], "end")
        through = bounds.own(FAST, 800, MESHES["large"], "end")
        self.assertGreater(through - 0.1, 9.9 * (alone - 0.1))

    def test_later_packets_have_later_bounds(self):
        times = [bounds.own(FAST, 2000, MESHES["large"], figure) for figure in bounds.FIGURES]
        self.assertEqual(times, sorted(times))


class MeanBoundTest(unittest.TestCase):
    def test_one_client_has_its_own(self):
        value, binds = bounds.mean([client(1)], 2000, MESHES, "end")
        self.assertAlmostEqual(value, bounds.own(FAST, 2000, MESHES["large"], "end"), places=2)
        self.assertFalse(binds)

    def test_two_on_one_uplink(self):
        # One after the other: the second waits for the first.
        one = bounds.own(FAST, 2000, MESHES["large"], "end")
        value, binds = bounds.mean([client(1), client(2)], 2000, MESHES, "end")
        self.assertTrue(binds)
        self.assertAlmostEqual(value, 1.5 * one, delta=0.1)

    def test_the_small_one_first(self):
        small, large = (bounds.own(FAST, 2000, MESHES[name], "end") for name in ("small", "large"))
        value, _ = bounds.mean([client(1), client(2, mesh="small")], 2000, MESHES, "end")
        self.assertAlmostEqual(value, (small + small + large) / 2, delta=0.1)

    def test_who_comes_later_does_not_disturb(self):
        apart = [client(1), client(2, arrival=100.0)]
        value, binds = bounds.mean(apart, 2000, MESHES, "end")
        self.assertAlmostEqual(value, bounds.own(FAST, 2000, MESHES["large"], "end"), places=2)
        self.assertFalse(binds)


class CrowdTest(unittest.TestCase):
    def test_follows_from_the_seed(self):
        first, again, other = (experiments.make("4", (8, 1), seed, MESHES) for seed in (1, 1, 2))
        self.assertEqual(first, again)
        self.assertNotEqual(first, other)

    def test_who_stalls(self):
        for seed in range(20):
            stays, leaves = (experiments.make(key, (8, 1), seed, MESHES) for key in ("4", "4-left"))
            self.assertEqual(len(stays.clients), 20)
            stalling = [one for one in stays.clients if one.stall_after is not None]
            self.assertEqual([(one.mesh, one.stall_after) for one in stalling], [("large", 3)])
            self.assertNotEqual(stalling[0].line.name, network.MODEM.name)
            left = [one for one in leaves.clients if one.leave_after is not None]
            self.assertEqual([one.number for one in left], [stalling[0].number])
            arrivals = [one.arrival for one in stays.clients]
            self.assertEqual((arrivals, arrivals[0]), (sorted(arrivals), 0))
            self.assertLess(arrivals[-1], 80 / 8)

    def test_first_requests_meet(self):
        made = experiments.make("1", (8, 1), 1, MESHES)
        asks = [one.arrival + 9 * one.line.delay_ms / 1000 for one in made.clients]
        self.assertLess(max(asks) - min(asks), 0.06)


class RuleTest(unittest.TestCase):
    def test_options(self):
        self.assertEqual(Rule.parse("fcsf+burst=2+x=y"), Rule("fcsf+burst=2+x=y", "fcsf", ("burst=2", "x=y")))
        for text in ("", "fcsf+", "fcsf+burst", "Fifo", "a b"):
            with self.assertRaises(ValueError, msg=text):
                Rule.parse(text)


def results(ends):
    """A made-up run. `ends`: (experiment, rule, mode) to a client's end as a function of it; 5 % is half of it."""
    made = {key: experiments.make(key, (8, 1), 1, MESHES) for key in ("1", "2", "3", "4", "4-left")}
    cells = []
    for (key, rule, mode), end in ends.items():
        clients = []
        for one in made[key].clients:
            stays = one.stall_after is None and one.leave_after is None
            times = dict.fromkeys(bounds.FIGURES, end(one) / 2) | {"end": end(one) if stays else None}
            clients.append({"number": one.number, "times": times, "ended": "complete" if stays else "stalled"})
        cells.append({"experiment": key, "rule": rule, "mode": mode, "clients": clients})
    parameters = {"scale": 8, "delay_scale": 1, "ours": "--slots auto", "repeat": 1, "seed": 1, "jobs": 1,
                  "uplink_kbit": 2048, "congestion": "reno"}
    return {"machine": "a machine", "version": "pmcd 0", "commit": "none", "parameters": parameters,
            "meshes": {name: {"file": f"{name}.off", "levels": mesh} for name, mesh in MESHES.items()},
            "experiments": {key: describe(experiment) for key, experiment in made.items()}, "cells": cells}


def made_up():
    ends = {}
    for key in ("1", "2", "3", "4", "4-left"):
        for rule in ("fifo", "lcfs", "spf", "fcsf"):
            if key != "4-left":
                ends[key, rule, "paper"] = lambda one, rule=rule: (
                    20 if one.line.name == "modem" else 2.5 if rule == "fcsf" else 19)
        for rule in ("fifo", "srpt"):
            slower = 1.0 if key == "4-left" else 1.02 if rule == "srpt" else 1.5
            ends[key, rule, "ours"] = lambda one, slower=slower: (21 if one.line.name == "modem" else 2) * slower
    return ends


class VerdictTest(unittest.TestCase):
    def test_paper(self):
        verdict = list(verdicts.paper(Figures(results(made_up()))))
        self.assertTrue(verdict[0].holds)
        self.assertIn("0.95", verdict[0].numbers)
        self.assertFalse(verdict[1].holds)  # spf is as fifo here

    def test_ours(self):
        table = verdicts.ours(Figures(results(made_up())))
        self.assertAlmostEqual(table["srpt"]["stall"], 1.02)
        self.assertAlmostEqual(table["fifo"]["stall"], 1.5)
        self.assertAlmostEqual(table["srpt"]["last end, exp. 1"], 21 * 1.02 / 20)
        self.assertEqual(verdicts.best(table), "srpt")
        holds = [verdict.holds for verdict in verdicts.expected(table, "srpt")]
        self.assertEqual((holds[2], holds[3]), (True, True))

    def test_what_was_not_run_is_not_judged(self):
        only = {key: end for key, end in made_up().items() if key == ("1", "fifo", "paper")}
        figures = Figures(results(only))
        self.assertEqual([verdict.holds for verdict in verdicts.paper(figures)], [None, None, None])
        self.assertEqual(verdicts.ours(figures), {})

    def test_a_client_that_does_not_end_is_no_figure(self):
        data = results(made_up())
        cell = next(cell for cell in data["cells"] if (cell["experiment"], cell["mode"]) == ("1", "ours"))
        cell["clients"][0] |= {"ended": "dropped", "why": "closed"}
        cell["clients"][0]["times"]["end"] = None
        figures = Figures(data)
        self.assertIsNone(verdicts.ours(figures)[cell["rule"]]["last end, exp. 1"])
        self.assertEqual(figures.dropped(), [("1", cell["rule"], "ours", 1, "closed")])
        self.assertIn("client 1 did not end: closed", report.write(figures, {}))

    def test_who_beats_the_bound_is_found(self):
        data = results(made_up())
        data["cells"][0]["clients"][2]["times"]["end"] = 0.001
        self.assertIn(("1", "fifo", "paper", 3, "end"), [found[:5] for found in Figures(data).beaten()])


class PaperTest(unittest.TestCase):
    def test_charts_are_well_formed(self):
        figures = Figures(results(made_up()))
        for key in figures.experiments:
            root = xml.etree.ElementTree.fromstring(chart.draw(figures, key))
            texts = [element.text for element in root.iter("{http://www.w3.org/2000/svg}text")]
            self.assertIn("srpt", texts)

    def test_tables_are_whole(self):
        text = report.write(Figures(results(made_up())), {"1": "report-1.svg"})
        lines = text.splitlines()
        for above, below in zip(lines, lines[1:]):
            if above.startswith("|") and below.startswith("|"):
                self.assertEqual(above.count("|"), below.count("|"), below)
        self.assertIn("report-1.svg", text)


if __name__ == "__main__":
    unittest.main()
