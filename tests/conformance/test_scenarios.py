#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""pmctool against the scripted server: every scenario with each of its values; and the scripted server itself.

PMCTOOL names the client. A scenario's `client`, `exit`, `result`, `prints` and `lacks` say how pmctool is called and what it
must do; the server only looks at `sessions`.
"""

import concurrent.futures
import json
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile
import unittest

import packets
import wire
from session import Session

_HERE = pathlib.Path(__file__).resolve().parent
_PROGRAM = _HERE / "mock_server.py"
_SCENARIOS = sorted((_HERE / "scenarios").glob("*.json"))
_AT_ONCE = 4  # most of the time both sides wait
_TIMEOUT_S = 60


class Mock:
    """A run of the scripted server. Use as a context; finish() gives its exit code and output."""

    def __init__(self, *arguments, program=_PROGRAM):
        self.process = subprocess.Popen([sys.executable, program, *map(str, arguments)], text=True,
                                        stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
        first = self.process.stdout.readline()
        self.text = "" if first.startswith("listening on ") else first
        self.address = first.removeprefix("listening on ").strip()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.process.kill()
        self.process.wait()
        self.process.stdout.close()

    def finish(self, timeout=30):
        text, _ = self.process.communicate(timeout=timeout)
        return self.process.returncode, self.text + text


def _values(scenario):
    """The lists of --value arguments that play all values of a scenario."""
    choices = scenario.get("values", {})
    return [["--value", f"{name}={json.dumps(value)}"] for name, values in choices.items() for value in values] or [[]]


def _bytes_of(source, scenario, path):
    mesh = scenario["meshes"][source]
    return packets.make(mesh, source).data if isinstance(mesh, list) else (path.parent / mesh).read_bytes()


def _play(path, values, program=_PROGRAM):
    """Complaints about one scenario, played once with pmctool."""
    scenario = json.loads(path.read_text(encoding="utf-8"))
    exits = scenario["exit"] if isinstance(scenario["exit"], list) else [scenario["exit"]]
    with tempfile.TemporaryDirectory(prefix="pmcd-scenario-") as folder, \
            Mock("--scenario", path, "--timeout", 20, *values, program=program) as mock:
        out = pathlib.Path(folder) / "out.pmcd"
        words = {"$server": mock.address, "$out": str(out)}
        client = subprocess.run([os.environ["PMCTOOL"], *(words.get(word, word) for word in scenario["client"])],
                                capture_output=True, text=True, timeout=_TIMEOUT_S, check=False)
        code, text = mock.finish()
        wrong = []
        if code != 0:
            wrong.append(f"the scripted server ends with {code}")
        if client.returncode not in exits:
            wrong.append(f"pmctool ends with {client.returncode}, not {scenario['exit']}")
        if client.returncode == 0 and "result" in scenario and (
                not out.exists() or out.read_bytes() != _bytes_of(scenario["result"], scenario, path)):
            wrong.append("what pmctool wrote is not the mesh")
        wrong += [f"pmctool does not print {word}" for word in scenario.get("prints", ()) if word not in client.stdout]
        wrong += [f"pmctool prints {word}" for word in scenario.get("lacks", ()) if word in client.stdout]
        if client.returncode != 0 and not client.stderr.strip():
            wrong.append("pmctool does not say why")
        if wrong:
            wrong.append(f"-- pmctool said:\n{client.stdout}{client.stderr}-- the scripted server said:\n{text}")
    return [f"{path.stem} {' '.join(values)}: " + "\n".join(wrong)] if wrong else []


class Pmctool(unittest.TestCase):
    def test_every_scenario(self):
        plays = [(path, values) for path in _SCENARIOS
                 for values in _values(json.loads(path.read_text(encoding="utf-8")))
                 if not sys.argv[1:] or path.stem in sys.argv[1:]]
        self.assertTrue(plays)
        with concurrent.futures.ThreadPoolExecutor(_AT_ONCE) as pool:
            complaints = [one for found in pool.map(lambda play: _play(*play), plays) for one in found]
        self.assertFalse(complaints, "\n\n" + "\n\n".join(complaints))


class Folder(unittest.TestCase):
    def test_the_folder_is_complete_in_itself(self):
        with tempfile.TemporaryDirectory(prefix="pmcd-folder-") as folder:
            copy = shutil.copytree(_HERE, pathlib.Path(folder) / "copy")
            for path in sorted((copy / "scenarios").glob("*.json")):
                with self.subTest(path.stem), Mock("--scenario", path, program=copy / "mock_server.py") as mock:
                    self.assertRegex(mock.address, r":\d+$", mock.text)
            self.assertEqual(_play(copy / "scenarios" / "lost_line.json", [], copy / "mock_server.py"), [])

    def test_its_mesh_is_the_golden_one(self):
        name = "sphere-12.pmcd"  # the target remake_golden copies it
        self.assertEqual((_HERE / "scenarios" / name).read_bytes(), (_HERE.parent / "golden" / name).read_bytes())


class ScriptedServer(unittest.TestCase):
    def scenario(self, *steps, **more):
        folder = tempfile.TemporaryDirectory(prefix="pmcd-scenario-")
        self.addCleanup(folder.cleanup)
        path = pathlib.Path(folder.name) / "scenario.json"
        path.write_text(json.dumps({"meshes": {"m": [100, 200]}, "sessions": [list(steps)], **more}), encoding="utf-8")
        return "--scenario", path, "--timeout", 2

    def session(self, mock):
        host, _, port = mock.address.rpartition(":")
        line = Session((host, int(port)))
        self.addCleanup(line.close)
        return line

    def test_the_right_client(self):
        with Mock(*self.scenario({"greet": True}, {"expect": "get_base_mesh", "where": {"name": "m"}}, {"serve": True},
                                 {"default": True})) as mock:
            line = self.session(mock)
            base = line.finish(line.ask("get_base_mesh", name="m"))
            self.assertEqual(bytes(base.data), packets.make([100, 200], "m").packets[0])
            line.send("goodbye")
            self.assertEqual(mock.finish()[0], 0)

    def test_a_client_that_sends_something_else(self):
        for kind, fields in (("get_base_mesh", {"name": "n"}), ("get_next_packet", {"handle": 1})):
            with Mock(*self.scenario({"greet": True}, {"expect": "get_base_mesh", "where": {"name": "m"}})) as mock:
                self.session(mock).ask(kind, **fields)
                code, text = mock.finish()
                self.assertEqual(code, 1, text)
                self.assertIn("the client did something else: session 1, step 2", text)

    def test_a_client_that_sends_nothing_or_leaves(self):
        for leave in (False, True):
            with Mock(*self.scenario({"greet": True}, {"expect": "get_base_mesh"})) as mock:
                line = self.session(mock)
                if leave:
                    line.close()
                self.assertEqual(mock.finish()[0], 1)

    def test_a_client_that_goes_on_where_it_should_end(self):
        with Mock(*self.scenario({"greet": True}, {"expect": "get_base_mesh"}, {"raw": "ffffffff"}, {"gone": True})) as mock:
            line = self.session(mock)
            line.ask("get_base_mesh", name="m")
            line.ask("get_next_packet", handle=0)
            self.assertEqual(mock.finish()[0], 1)

    def test_a_wrong_scenario(self):
        for steps in ([{"dance": True}], [{"greet": True, "wait": 1}], [{}]):
            with Mock(*self.scenario(*steps)) as mock:
                self.assertEqual(mock.finish()[0], 2)

    def test_pieces(self):
        with Mock(*self.scenario({"greet": True}, {"send": "notice", "pieces": 1, "fields": {
                "kind": wire.DRAINING, "handle": 0, "seconds": 5, "text": "the end"}}, {"default": True})) as mock:
            line = self.session(mock)
            line.until(lambda: line.notices, "the notice")
            self.assertEqual((line.notices[0].kind, line.notices[0].text), (wire.DRAINING, "the end"))


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
