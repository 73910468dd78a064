# SPDX-License-Identifier: MIT
"""pmcsim as a person uses it: its output, its files, and its exit codes. The program is told as the first argument."""

import json
import pathlib
import subprocess
import sys
import tempfile
import unittest
import xml.etree.ElementTree

PROGRAM = sys.argv[1]
CROWD = ("run", "--rules", "all", "--option", "slots=auto", "--clients", "40", "--stall", "0.1", "--seed", "5")


def pmcsim(*arguments):
    return subprocess.run([PROGRAM, *arguments], capture_output=True, text=True, check=False, timeout=120)


class Program(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)

    def fails(self, code, message, *arguments):
        result = pmcsim(*arguments)
        self.assertEqual((result.returncode, result.stdout), (code, ""))
        self.assertIn(message, result.stderr)

    def test_a_run_repeats_to_the_byte(self):
        chart = self.folder / "chart.svg"
        once, charts = [], []
        for _ in range(2):
            result = pmcsim(*CROWD, "--json", "-", "--chart", str(chart))
            self.assertEqual((result.returncode, result.stderr), (0, ""))
            once.append(result.stdout)
            charts.append(chart.read_bytes())
        self.assertEqual(once[0], once[1])
        self.assertEqual(charts[0], charts[1])
        self.assertNotEqual(once[0], pmcsim(*CROWD[:-1], "6", "--json", "-").stdout)

    def test_chart(self):
        chart = self.folder / "chart.svg"
        self.assertEqual(pmcsim(*CROWD, "--chart", str(chart)).returncode, 0)
        root = xml.etree.ElementTree.parse(chart).getroot()
        self.assertEqual(len(root.findall("{http://www.w3.org/2000/svg}polyline")), 8)

    def test_paper_experiments(self):
        for experiment, clients in ((1, 3), (2, 3), (3, 3), (4, 20)):
            for mode, text in (("paper", "fifo aging=0 quantum=0 slots=1 uplink=0"),
                               ("ours", "fifo aging=0 quantum=250 slots=auto uplink=0")):
                result = pmcsim("paper", "--experiment", str(experiment), "--mode", mode, "--rules", "fifo", "--json", "-")
                run, = json.loads(result.stdout)["runs"]
                self.assertEqual(run["policy"], text)
                self.assertEqual(len(run["clients"]), clients)
                unfinished = [row for row in run["clients"] if row["complete"] is None]
                self.assertEqual([row["stalls"] for row in unfinished], [True] if experiment == 4 else [])
                self.assertEqual(run["dropped"], len(unfinished))

    def test_what_is_printed(self):
        result = pmcsim("paper", "--experiment", "2", "--rules", "fifo,fcsf")
        for text in ("packet 0", "10 % error", "5 % error", "1 % error", "complete", "median", "p95", "p99", "fairness",
                     "link use", "fast-dsl", "bunny"):
            self.assertIn(text, result.stdout)

    def test_meshes_from_a_file(self):
        meshes = self.folder / "meshes.csv"
        meshes.write_text("name,level,bytes,vertices,error\ncube,0,1000,8,0\n")
        result = pmcsim("run", "--clients", "3", "--meshes", str(meshes), "--each")
        self.assertEqual(result.returncode, 0)
        self.assertEqual(result.stdout.count("cube"), 3)
        meshes.write_text("name,level,bytes,vertices,error\ncube,0,none,8,0\n")
        self.fails(1, "line 2: bytes is \"none\"", "run", "--meshes", str(meshes))

    def test_a_plan_runs_over_both_networks(self):
        plan = self.folder / "plan.json"
        plan.write_text(json.dumps({
            "uplink_kbit": 2048, "open": 1, "lines": [{"name": "dsl", "down_kbit": 8192, "up_kbit": 2048, "rtt_ms": 40}],
            "clients": [{"line": "dsl", "mesh": "horse"}, {"arrives": 1, "line": "dsl", "mesh": "hand", "joins_after": 2},
                        {"arrives": 2, "line": "dsl", "mesh": "bunny", "stalls_after": 8}]}))
        for network in ("fluid", "packets"):
            result = pmcsim("run", "--plan", str(plan), "--network", network, "--each", "--json", "-")
            self.assertEqual((result.returncode, result.stderr), (0, ""))
            run, = json.loads(result.stdout)["runs"]
            first, second, third = run["clients"]
            self.assertEqual([row["mesh"] for row in run["clients"]], ["horse", "hand", "bunny"])
            self.assertEqual([row["begins"] for row in run["clients"]], [0, 1, 2])
            self.assertAlmostEqual(first["first_level"], 5 * 0.04, delta=0.003)
            self.assertTrue(2.039 < second["first_level"] < 2.2, second["first_level"])
            self.assertEqual((third["stalls"], third["complete"], run["dropped"]), (True, None, 1))

    def test_lateness_is_drawn_from_the_seed(self):
        def late(seed):
            return pmcsim(*CROWD[:-1], seed, "--network", "packets", "--late-ms", "1", "--json", "-").stdout
        self.assertEqual(late("5"), late("5"))
        self.assertNotEqual(late("5"), late("6"))

    def test_usage(self):
        self.assertIn("Examples:", pmcsim("run", "--help").stdout)
        self.assertIn("Examples:", pmcsim("paper", "--help").stdout)
        self.fails(2, "--experiment", "paper", "--experiment", "5")
        self.fails(2, "--clients", "run", "--clients", "0")
        self.fails(1, "rule: \"best\" is none of: fifo", "run", "--rule", "best")
        self.fails(1, "option quantum: \"x\" is not milliseconds", "run", "--option", "quantum=x")
        self.fails(1, "line \"dsl\": has no =", "run", "--line", "dsl")
        self.fails(1, "--line is given 1 times", "paper", "--line", "dsl=1000/1000/10")
        self.fails(1, "arrivals \"now\"", "run", "--arrivals", "now")
        self.fails(1, "cannot be opened", "run", "--plan", str(self.folder / "none.json"))
        self.fails(2, "--plan", "run", "--plan", "p.json", "--clients", "3")
        self.fails(2, "--network", "run", "--network", "pipes")
        self.fails(1, "cannot be opened", "run", "--meshes", str(self.folder / "none.json"))
        self.fails(1, "cannot be written", "run", "--json", str(self.folder))


if __name__ == "__main__":
    unittest.main(argv=[sys.argv[0], *sys.argv[2:]])
