# SPDX-License-Identifier: MIT
"""bench/sim/validate on figures that pmcsim made itself: right as they are, wrong when one of them is moved. The script
and the program are told as the first arguments."""

import copy
import importlib.machinery
import importlib.util
import json
import pathlib
import subprocess
import sys
import tempfile
import types
import unittest

SCRIPT, PROGRAM = sys.argv[1:3]
LOADER = importlib.machinery.SourceFileLoader("validate", SCRIPT)
validate = importlib.util.module_from_spec(importlib.util.spec_from_loader("validate", LOADER))
sys.modules["validate"] = validate  # its dataclasses look themselves up
LOADER.exec_module(validate)

LINE = {"name": "dsl", "down_kbit": 8192, "up_kbit": 2048, "delay_ms": 20, "queue_bytes": 32000, "loss": 0}
LEVELS = [{"bytes": size, "vertices": vertices, "error_rms": error}
          for size, vertices, error in ((300, 60, 0.02), (5000, 600, 0.0015), (9000, 2000, 0.0005), (90000, 9000, 0.0))]


def results():
    """As bench/rules/run writes them: two clients, one of which stalls behind packet 2."""
    clients = [{"number": number, "line": LINE, "mesh": "m", "arrival": 0.1 * number, "stall_after": stall,
                "leave_after": None} for number, stall in ((1, None), (2, 2))]
    made = {"parameters": {"uplink_kbit": 2048, "ours": "--slots auto --quantum 250 --uplink 2048"},
            "meshes": {"m": {"file": "m.off", "levels": LEVELS}},
            "experiments": {"1": {"title": "two clients", "clients": clients}}, "cells": []}
    for mode in ("paper", "ours"):
        told, = validate.simulate(types.SimpleNamespace(program=PROGRAM, seeds=1, late=0), made, made["experiments"]["1"],
                                  validate.Rule.parse("gain+until=5"), mode, [])
        made["cells"].append({"experiment": "1", "rule": "gain+until=5", "mode": mode, "clients": [
            {"number": number, "times": times, "connected": 0.04, "joined": 0.16} for number, times in told.items()]})
    return made


class Validate(unittest.TestCase):
    def run_on(self, *files, options=()):
        with tempfile.TemporaryDirectory() as folder:
            paths = [pathlib.Path(folder) / f"{number}.json" for number, _ in enumerate(files)]
            for path, made in zip(paths, files):
                path.write_text(json.dumps(made), encoding="utf-8")
            return subprocess.run([sys.executable, SCRIPT, *paths, "--program", PROGRAM, *options], check=False,
                                  capture_output=True, text=True, timeout=120)

    def test_what_pmcsim_said_itself_is_right(self):
        result = self.run_on(results(), options=["--seeds", "1"])
        self.assertEqual((result.returncode, result.stderr), (0, ""))
        self.assertIn("0.00 ms late", result.stdout)
        # The one that stalls is not asked for what it did not get.
        self.assertIn("| gain+until=5 | paper mode | 8 of 8 | 100 % | ", result.stdout)
        self.assertIn("16 of 16 times are; with a single run of pmcsim 100.0 % of them.", result.stdout)

    def test_a_time_that_is_moved_is_wrong_and_named(self):
        moved = results()
        moved["cells"][1]["clients"][0]["times"]["end"] += 0.5
        result = self.run_on(moved, options=["--clients"])
        self.assertEqual(result.returncode, 1)
        self.assertIn("| gain+until=5 | paper mode | 8 of 8 |", result.stdout)
        self.assertIn("| gain+until=5 | our mode | 7 of 8 **no** |", result.stdout)
        self.assertIn("- gain+until=5, our mode, client 1, end: ", result.stdout)
        # Another run in which it was not makes a range that it lies within.
        both = self.run_on(moved, results())
        self.assertEqual(both.returncode, 0)
        self.assertIn("agree so well in 93.8 % of their times.", both.stdout)

    def test_what_never_came_is_no_time(self):
        never = results()
        never["cells"][0]["clients"][0]["times"]["end"] = None
        self.assertEqual(self.run_on(never).returncode, 1)

    def test_lateness_comes_from_connecting(self):
        late = results()
        for cell in late["cells"]:
            for client in cell["clients"]:
                client["connected"] = 0.043
        self.assertIn("1.00 ms late", self.run_on(late).stdout)

    def test_near_enough(self):
        self.assertTrue(validate.within((1.0,), (1.19,)))
        self.assertFalse(validate.within((1.0,), (1.21,)))
        self.assertTrue(validate.within((10.9,), (10.0,)))
        self.assertFalse(validate.within((11.1,), (10.0,)))
        self.assertTrue(validate.within((5.0, 9.0), (7.0,)))
        self.assertFalse(validate.within((None,), (7.0,)))
        self.assertTrue(validate.within((None, 2.0), (None,)))

    def test_files_that_do_not_belong_together_are_refused(self):
        other = copy.deepcopy(results())
        other["parameters"]["ours"] = "--slots 4"
        result = self.run_on(results(), other)
        self.assertEqual(result.returncode, 1)
        self.assertIn("different options", result.stderr)


if __name__ == "__main__":
    unittest.main(argv=[sys.argv[0], *sys.argv[3:]])
