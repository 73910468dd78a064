# SPDX-License-Identifier: MIT
"""pmcsim as a person uses it: its output, its files, and its exit codes. The program is told as the first argument."""

import json
import pathlib
import re
import subprocess
import sys
import tempfile
import unittest
import xml.etree.ElementTree

PROGRAM = sys.argv[1]
ROOT = pathlib.Path(__file__).resolve().parents[2]
PLAN = {"lines": [{"name": "dsl", "down_kbit": 8192, "up_kbit": 2048, "rtt_ms": 40}],
        "clients": [{"line": "dsl", "mesh": "horse"}]}
CROWD = ("run", "--rules", "all", "--option", "slots=auto", "--clients", "40", "--stall", "0.1", "--seed", "5")


def pmcsim(*arguments):
    return subprocess.run([PROGRAM, *arguments], capture_output=True, text=True, check=False, timeout=120)


class Program(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)

    def plan(self, **fields):
        """The name of a file with PLAN, and with those fields."""
        file = self.folder / "plan.json"
        file.write_text(json.dumps({**PLAN, **fields}))
        return str(file)

    def document(self, *arguments):
        result = pmcsim(*arguments, "--json", "-")
        self.assertEqual((result.returncode, result.stderr), (0, ""))
        return json.loads(result.stdout)

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
        plan = self.plan(uplink_kbit=2048, open=1, clients=[
            {"line": "dsl", "mesh": "horse"}, {"arrives": 1, "line": "dsl", "mesh": "hand", "joins_after": 2},
            {"arrives": 2, "line": "dsl", "mesh": "bunny", "stalls_after": 8}])
        for network in ("fluid", "packets"):
            run, = self.document("run", "--plan", plan, "--network", network, "--each")["runs"]
            first, second, third = run["clients"]
            self.assertEqual([row["mesh"] for row in run["clients"]], ["horse", "hand", "bunny"])
            self.assertEqual([row["begins"] for row in run["clients"]], [0, 1, 2])
            self.assertAlmostEqual(first["first_level"], 5 * 0.04, delta=0.003)
            self.assertTrue(2.039 < second["first_level"] < 2.2, second["first_level"])
            self.assertEqual((third["stalls"], third["complete"], run["dropped"]), (True, None, 1))

    def test_options_count_where_the_plan_says_nothing(self):
        scenario = self.document("run", "--plan", self.plan(), "--uplink", "100", "--open", "2")["scenario"]
        self.assertEqual((scenario["uplink_kbit"], scenario["open_requests"]), (100, 2))
        self.assertEqual(self.document("run", "--plan", self.plan(uplink_kbit=None), "--uplink", "100")["scenario"],
                         {**scenario, "open_requests": 4})

    def test_options_and_a_plan_that_says_it_too_are_refused(self):
        meshes = self.folder / "meshes.csv"
        meshes.write_text("name,level,bytes,vertices,error\nhorse,0,1000,8,0\n")
        for option, value, field, said in (
                ("--uplink", "100", "uplink_kbit", 2048), ("--uplink", "256", "uplink_kbit", 2048),
                ("--open", "2", "open", 1),
                ("--meshes", str(meshes), "meshes", [{"name": "horse", "levels": [{"bytes": 9, "vertices": 4}]}])):
            plan = self.plan(**{field: said})
            self.fails(2, f"pmcsim: {plan}: has a \"{field}\", so {option} cannot count: leave one of them out\n",
                       "run", "--plan", plan, option, value)
            self.assertEqual(pmcsim("run", "--plan", plan).returncode, 0)

    def test_a_plan_is_not_misread(self):
        plan = self.plan(clients=[*PLAN["clients"], {"line": "dsl", "mesh": "horse", "leavs_after": 3}])
        self.fails(1, f"pmcsim: {plan}: clients[1] has a \"leavs_after\", which means nothing here\n",
                   "run", "--plan", plan)
        plan = self.plan(lines=[{"name": "dsl"}])
        self.fails(1, f"pmcsim: {plan}: lines[0] has no \"down_kbit\"\n", "run", "--plan", plan)

    def test_a_plan_takes_each_field_that_pmcctl_shows_of_a_mesh(self):
        source = (ROOT / "daemon" / "net" / "admin_json.cpp").read_text(encoding="utf-8")
        functions = (re.search(rf"{name}\(.*?\n}}\n", source, re.DOTALL)[0] for name in ("mesh_object", "show_json"))
        mesh, level = (dict.fromkeys(re.findall(r'\{"(\w+)", ', function)) for function in functions)
        self.assertLessEqual({"name", "box_min", "ingested_at"}, mesh.keys())
        self.assertLessEqual({"bytes", "error_rms", "crc32c"}, level.keys())
        plan = self.plan(meshes=[{**mesh, "name": "horse", "levels": [{**level, "bytes": 300, "vertices": 8}]}])
        self.assertEqual(self.document("run", "--plan", plan)["scenario"]["meshes"],
                         [{"name": "horse", "bytes": 300, "packets": 1}])

    def test_rules_with_options_of_their_own(self):
        crowd, names = ("run", *CROWD[3:]), ["gain", "gain+until=5", "fcsf+burst=2"]
        several = self.document(*crowd, "--rules", "gain, gain+until=5 ,fcsf+burst=2")["runs"]
        self.assertEqual([run["rule"] for run in several], names)
        alone = [self.document(*crowd, "--rule", rule, *option)["runs"][0] for rule, *option in (
            ["gain"], ["gain", "--option", "until=5"], ["fcsf", "--option", "burst=2"])]
        self.assertEqual(several, alone)
        self.assertNotEqual(several[0]["complete"], several[1]["complete"])
        rows = pmcsim(*crowd, "--rules", ",".join(names)).stdout.splitlines()
        self.assertEqual([sum(text in row for row in rows) for text in ("until=5", "burst=2")], [2, 2])
        self.assertEqual(self.document("paper", "--rules", "fifo, spf")["runs"][1]["rule"], "spf")

    def test_what_the_link_carries_is_not_what_the_daemon_is_told(self):
        chart = self.folder / "chart.svg"
        for arguments, link in ((("run", "--clients", "3", "--uplink", "1024.5"), "1024.5"),
                                (("run", "--clients", "3", "--uplink", "1024", "--scale", "2"), "2048"),
                                (("run", "--plan", self.plan(uplink_kbit=4096), "--option", "uplink=512"), "4096")):
            result = pmcsim(*arguments, "--chart", str(chart))
            title, told = result.stdout.splitlines()[:2]
            self.assertTrue(title.endswith(f"; the server's link carries {link} kbit/s"), title)
            self.assertEqual(told, "(uplink= in a policy is not that, but what the daemon is told of it; 0: it measures)")
            self.assertIn(title, chart.read_text())
        self.assertIn("--option uplink=KBIT", pmcsim("run", "--help").stdout)

    def test_lateness_is_drawn_from_the_seed(self):
        def late(seed):
            return pmcsim(*CROWD[:-1], seed, "--network", "packets", "--late-ms", "1", "--json", "-").stdout
        self.assertEqual(late("5"), late("5"))
        self.assertNotEqual(late("5"), late("6"))

    def test_lateness_is_not_for_the_fluid(self):
        self.fails(2, "pmcsim: --late-ms 0.2: processes wake up late with --network packets only, not with fluid\n",
                   "run", "--late-ms", "0.2")
        self.fails(2, "--late-ms 3:", "paper", "--network", "fluid", "--late-ms", "3")
        self.assertEqual(pmcsim("run", "--clients", "3", "--late-ms", "0").returncode, 0)

    def test_help_says_how_it_ends(self):
        for command in ((), ("run",), ("paper",)):
            text = pmcsim(*command, "--help").stdout
            self.assertIn("Exit status: 0", text.strip().splitlines()[-1])
            self.assertEqual("Examples:" in text, command != ())

    def test_a_command_that_there_is_not(self):
        self.fails(2, "pmcsim: there is no command \"foo\"; pmcsim --help lists them\n", "foo")
        self.fails(2, "there is no command \"foo\"", "foo", "--rule", "fifo")
        self.fails(2, "pmcsim: there is no option \"--rule\" before a command;", "--rule", "fifo")
        self.fails(2, "foo", "run", "foo")
        self.fails(2, "A subcommand is required")

    def test_output_that_cannot_be_written(self):
        for arguments in (("run", "--clients", "3"), ("run", "--clients", "3", "--json", "-"), ("--help",)):
            with open("/dev/full", "w", encoding="utf-8") as full:
                result = subprocess.run([PROGRAM, *arguments], stdout=full, stderr=subprocess.PIPE, text=True,
                                        check=False, timeout=120)
            self.assertEqual((result.returncode, result.stderr), (1, "pmcsim: standard output: cannot be written\n"))

    def test_usage(self):
        self.fails(2, "--experiment", "paper", "--experiment", "5")
        self.fails(2, "--clients", "run", "--clients", "0")
        self.fails(2, "rule: \"best\" is none of: fifo", "run", "--rule", "best")
        self.fails(2, "option quantum: \"x\" is not milliseconds", "run", "--option", "quantum=x")
        self.fails(2, "line \"dsl\": has no =", "run", "--line", "dsl")
        self.fails(2, "--line is given 1 times", "paper", "--line", "dsl=1000/1000/10")
        self.fails(2, "arrivals \"now\"", "run", "--arrivals", "now")
        self.fails(1, "cannot be opened", "run", "--plan", str(self.folder / "none.json"))
        self.fails(2, "--plan", "run", "--plan", "p.json", "--clients", "3")
        self.fails(2, "--network", "run", "--network", "pipes")
        self.fails(1, "cannot be opened", "run", "--meshes", str(self.folder / "none.json"))
        self.fails(1, "cannot be written", "run", "--json", str(self.folder))


if __name__ == "__main__":
    unittest.main(argv=[sys.argv[0], *sys.argv[2:]])
