# SPDX-License-Identifier: GPL-3.0-or-later
"""The daemon is killed at each system call that writes, one run for each; then another daemon opens the same folder.

Nothing that was confirmed may be lost, nothing half may be there, and the socket file that is left is replaced. strace
sends SIGKILL at the entry of the n-th call of a kind, so each run ends with all calls before it done and this one not.
strace counts for each thread by itself: the thread that comes to its n-th call first is the one that is hit. Where two
threads make the same calls (write: log lines here, uploads there), the runs with the log switched off hit the other.

As ctest runs it, a sample of the calls is tried for some seconds, another one in each run, and at least one call of
each kind. The seed of the sample is printed and stands in each failure; PMCD_SEED repeats it. PMCD_LONG_TESTS=1 goes on
until all are tried.
"""

import collections
import contextlib
import itertools
import os
import random
import re
import secrets
import shutil
import signal
import sqlite3
import subprocess
import time
import unittest

import house

_SAMPLE_S = 8 if os.environ.get("PMCD_SANITIZE") else 25
_PATIENCE_S = 20
# How often a thread wakes another is a matter of chance, so a call may not come up again, but not so many of a kind.
_CHANCES = 5
# Calls that write, or make, change or remove files. Those of the last group are not expected, so they share their runs.
# "?": a kind that some machines do not have.
_KINDS = ["pwrite64", "write", "fdatasync", "ftruncate", "?unlink,unlinkat", "openat", "sendmsg", "bind",
          "?chmod,fchmod,fchmodat",
          "fsync,fallocate,writev,pwritev,?pwritev2,sendto,?mkdir,mkdirat,?rename,?renameat,renameat2,?link,linkat,"
          "?symlink,symlinkat,?copy_file_range,sync_file_range,msync"]

# What a step asks of pmcctl, and the meshes that are there when it is done, as name: file.
Step = collections.namedtuple("Step", "arguments after")
# A way through the daemon's life: the folder that it starts in, what is there then, and the steps.
Story = collections.namedtuple("Story", "name folder before steps options")
Point = collections.namedtuple("Point", "story kind number")


def in_turn(queues):
    """The first of each queue, then the second of each, and so on: where one is longer, its rest stands at the end."""
    for row in itertools.zip_longest(*queues):
        yield from (item for item in row if item is not None)


def in_order_of(seed, points):
    """All points; of each kind a first one before a second of any, and within a kind the stories take turns too. What
    the seed decides of two calls does not depend on the others, as their number is not quite the same in each run."""
    def draw(*what):
        return random.Random("/".join(map(str, (seed, *what)))).random()

    queues = collections.defaultdict(lambda: collections.defaultdict(list))
    for point in points:
        queues[point.kind][point.story.name].append(point)
    kinds = []
    for kind in sorted(queues, key=draw):
        stories = sorted(queues[kind], key=lambda story: draw(kind, story))
        kinds.append(list(in_turn(sorted(queues[kind][story], key=lambda point: draw(kind, story, point.number))
                                  for story in stories)))
    return list(in_turn(kinds))


def strace(folder, *options):
    """The start of a command: the program is our child, strace its grandchild."""
    return ["strace", "-D", "-f", "-qq", "-o", folder / "trace", *options]


class KilledWrites(house.HouseTest):
    def setUp(self):
        super().setUp()
        try:
            probe = subprocess.run([*strace(self.folder, "-e", "trace=none"), "true"], capture_output=True, text=True,
                                   timeout=house.TIMEOUT_S, check=False)
        except FileNotFoundError:
            self.skipTest("strace is not installed")
        if probe.returncode != 0:
            self.skipTest(f"strace may not trace here: {probe.stderr.strip()}")
        meshes = {"a1": house.torus(24, 16), "a2": house.torus(28, 18, wobble=0.1),
                  "b": house.torus(20, 12, wobble=0.1), "c": house.sheet(12, 9)}
        for name, mesh in meshes.items():
            file = house.write_ply(self.folder / f"{name}.ply", mesh)
            self.tool("encode", file, self.pmcd(name))
            self.tool("decode", self.pmcd(name), self.folder / f"{name}.decoded.ply")
        self.generation = {name: self.json_of("info", self.pmcd(name))["generation"] for name in meshes}
        self.stories = [self.fresh("info"), self.fresh("off"), self.restarted()]

    def pmcd(self, name):
        return self.folder / f"{name}.pmcd"

    def ingest_step(self, file, name, after):
        return Step(("ingest", self.pmcd(file), "--name", name, "--replace"), after)

    def fresh(self, log_level):
        """From no database at all; the steps of a mesh's life."""
        folder = self.folder / "empty"
        folder.mkdir(exist_ok=True)
        steps = [self.ingest_step("a1", "a", {"a": "a1"}), self.ingest_step("b", "b", {"a": "a1", "b": "b"}),
                 self.ingest_step("a2", "a", {"a": "a2", "b": "b"}), Step(("remove", "b"), {"a": "a2"})]
        return Story(f"fresh, log {log_level}", folder, {}, steps, ("--log-level", log_level))

    def restarted(self):
        """From what a killed daemon left: a log to recover, a retired mesh to collect, a socket file."""
        folder = self.folder / "left"
        folder.mkdir()
        with house.Daemon(folder) as daemon:
            self.ingest(daemon, self.pmcd("a1"), "--name", "a")
            self.ingest(daemon, self.pmcd("b"), "--name", "b")
            with contextlib.closing(sqlite3.connect(folder / "meshes.db")) as database, database:
                database.execute("UPDATE mesh SET retired_at = 1 WHERE name = 'b'")
            daemon.kill()
        self.assertTrue((folder / "meshes.db-wal").exists())
        self.assertTrue((folder / "admin.sock").is_socket())
        (folder / "admin.sock").unlink()  # a copy of the folder cannot have it; made anew by leave_socket()
        steps = [self.ingest_step("c", "c", {"a": "a1", "c": "c"}), Step(("remove", "a"), {"c": "c"})]
        return Story("restarted", folder, {"a": "a1"}, steps, ())

    @staticmethod
    def leave_socket(path):
        """A socket file on which nobody answers."""
        with contextlib.closing(house.socket.socket(house.socket.AF_UNIX)) as left:
            left.bind(str(path))

    def play(self, story, folder, *trace):
        """One run of the daemon under strace in a copy of the story's folder, through all steps and to its end, unless
        it is killed. What meshes may be there now, and whether it was killed."""
        shutil.copytree(story.folder, folder)
        if story.before:
            self.leave_socket(folder / "admin.sock")
        environment = dict(os.environ)  # a leak check cannot run under strace
        environment["ASAN_OPTIONS"] = environment.get("ASAN_OPTIONS", "") + ":detect_leaks=0"
        with open(folder / "pmcd.log", "ab") as log:
            victim = subprocess.Popen(
                [*strace(folder, *trace), house.program("PMCD_DAEMON"), "--database", folder / "meshes.db",
                 "--request-port", "0", "--data-port", "0", "--admin-socket", folder / "admin.sock", *story.options],
                stdin=subprocess.DEVNULL, stdout=log, stderr=log, env=environment)
        try:
            return self.act(story, folder, victim)
        finally:
            if victim.poll() is None:
                victim.kill()
                victim.wait()

    def act(self, story, folder, victim):
        def ctl(*arguments):
            return house.run("PMCCTL", "--socket", folder / "admin.sock", *arguments)

        deadline = time.monotonic() + _PATIENCE_S
        while ctl("list").returncode != house.DONE:
            if victim.poll() is not None:
                return [story.before], self.how_it_ended(victim)
            self.assertLess(time.monotonic(), deadline, "the daemon does not come up")
            time.sleep(0.005)
        there = story.before
        for step in story.steps:
            result = ctl(*step.arguments)
            if result.returncode != house.DONE:
                # It is being killed: the step may have been done or not, nobody was told.
                return [there, step.after], self.how_it_ended(victim)
            there = step.after
        victim.send_signal(signal.SIGTERM)
        return [there], self.how_it_ended(victim)

    def how_it_ended(self, victim):
        code = victim.wait(timeout=_PATIENCE_S)
        self.assertIn(code, (0, -signal.SIGKILL))
        return code != 0

    def verify(self, folder, allowed):
        """Another daemon finds one of the `allowed` states, each mesh whole, and leaves a tidy folder."""
        socket_left = (folder / "admin.sock").exists()
        log_before = (folder / "pmcd.log").read_text(encoding="utf-8")
        with house.Daemon(folder) as daemon:
            listed = {mesh["name"]: mesh["generation"] for mesh in self.json_of("list", daemon.address)["meshes"]}
            states = [{name: self.generation[file] for name, file in state.items()} for state in allowed]
            self.assertIn(listed, states)
            for name, file in allowed[states.index(listed)].items():
                out = folder / "fetched.ply"
                self.tool("fetch", daemon.address, name, out)
                self.assertEqual(out.read_bytes(), (self.folder / f"{file}.decoded.ply").read_bytes(), name)
                out.unlink()
            self.ingest(daemon, self.pmcd("c"), "--name", "after")
            self.assert_collected(folder, len(listed) + 1)
            self.assertEqual(daemon.stop(), 0)
        log = daemon.log.read_text(encoding="utf-8")[len(log_before):]
        self.assertEqual("stale socket file is replaced" in log, socket_left, log)
        self.assertEqual({file.name for file in folder.iterdir()} - {"trace"},
                         {"meshes.db", "meshes.db.lock", "pmcd.log"})

    def assert_collected(self, folder, meshes):
        deadline = time.monotonic() + _PATIENCE_S
        with contextlib.closing(sqlite3.connect(f"file:{folder / 'meshes.db'}?mode=ro", uri=True)) as database:
            while database.execute("SELECT count(*) FROM mesh").fetchone() != (meshes,):
                self.assertLess(time.monotonic(), deadline, "what an earlier run has left is deleted at the start")
                time.sleep(0.005)
            self.assertEqual(database.execute("SELECT sum(packets) FROM mesh").fetchone(),
                             database.execute("SELECT count(*) FROM packet").fetchone())
            self.assertEqual(database.execute("PRAGMA integrity_check").fetchone(), ("ok",))

    def points(self, story):
        """Each call of each kind that the story makes when it is not disturbed, as far as one thread makes them."""
        folder = self.folder / "count"
        allowed, killed = self.play(story, folder, "-e", "trace=" + ",".join(_KINDS))
        self.assertFalse(killed)
        calls = collections.Counter(re.findall(r"^(\d+) +(\w+)\(", (folder / "trace").read_text(errors="replace"),
                                               re.MULTILINE))
        self.verify(folder, allowed)
        shutil.rmtree(folder)
        for kind in _KINDS:
            names = kind.replace("?", "").split(",")
            most = max((count for (_, name), count in calls.items() if name in names), default=0)
            yield from (Point(story, kind, number) for number in range(1, most + 1))

    def test_killed_at_any_call_that_writes(self):
        seed = os.environ.get("PMCD_SEED") or secrets.token_hex(4)
        print(f"PMCD_SEED={seed}", flush=True)
        with self.subTest(PMCD_SEED=seed):
            points = in_order_of(seed, [point for story in self.stories for point in self.points(story)])
            self.kill_at(points, everything=bool(os.environ.get("PMCD_LONG_TESTS")))

    def kill_at(self, points, everything):
        """At the points in their order, and when the time of a sample is over, only at those of kinds not yet hit."""
        found = collections.Counter(point.kind for point in points)
        tried, killed = collections.Counter(), collections.Counter()
        start = time.monotonic()
        for number, point in enumerate(points):
            late = not everything and time.monotonic() - start > _SAMPLE_S
            if late and (killed[point.kind] or tried[point.kind] >= _CHANCES):
                continue
            with self.subTest(story=point.story.name, kind=point.kind, number=point.number):
                folder = self.folder / f"run{number}"
                tried[point.kind] += 1
                allowed, hit = self.play(point.story, folder, "-e", f"trace={point.kind}", "-e",
                                         f"inject={point.kind}:signal=SIGKILL:when={point.number}")
                if hit:
                    killed[point.kind] += 1
                self.verify(folder, allowed)
                shutil.rmtree(folder)
        by_kind = ", ".join(f"{kind} {tried[kind]}/{found[kind]}" for kind in sorted(found))
        print(f"{tried.total()} of {len(points)} calls that write tried, {killed.total()} killed, in "
              f"{time.monotonic() - start:.0f} s: {by_kind}", flush=True)
        self.assertEqual(killed.keys(), found.keys(), "each kind of call is hit once at least")
        self.assertGreater(killed.total(), 0.8 * tried.total())


class Order(unittest.TestCase):
    def test_each_kind_and_each_story_in_turn_and_repeatable(self):
        stories = [Story(name, None, {}, [], ()) for name in ("one", "two")]
        points = [Point(story, kind, number) for story in stories for kind, most in (("a", 30), ("b", 7), ("c", 1))
                  for number in range(1, most + 1)]
        order = in_order_of("7", points)
        self.assertCountEqual(order, points)
        self.assertEqual(order, in_order_of("7", reversed(points)))
        self.assertNotEqual(order, in_order_of("8", points))
        for first, last in ((0, 3), (3, 6)):
            self.assertEqual({point.kind for point in order[first:last]}, {"a", "b", "c"})
        for kind in "abc":
            self.assertEqual({point.story.name for point in order[:6] if point.kind == kind}, {"one", "two"})
        more = [Point(story, "a", 31) for story in stories]
        for story in stories:
            def numbers(some):
                return [point.number for point in some if point.story is story and point.kind == "a"]
            self.assertEqual(numbers(order), [number for number in numbers(in_order_of("7", points + more))
                                              if number != 31])


if __name__ == "__main__":
    unittest.main()
