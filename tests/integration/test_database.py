# SPDX-License-Identifier: GPL-3.0-or-later
"""The operator's side: what is ingested stays, can be replaced and removed, and outlives the daemon, however it ends."""

import json
import random
import subprocess
import time
import unittest

import house


class Database(house.HouseTest):
    def setUp(self):
        super().setUp()
        self.small = house.write_ply(self.folder / "small.ply", house.torus(30, 20))
        self.large = house.write_ply(self.folder / "large.ply", house.torus(60, 40, wobble=0.1))

    def fetched(self, daemon, name):
        out = self.folder / "fetched.ply"
        self.tool("fetch", daemon.address, name, out)
        return out

    def test_restart_keeps_meshes(self):
        with house.Daemon(self.folder) as daemon:
            self.ingest(daemon, self.small, "--name", "a")
            self.ingest(daemon, self.large, "--name", "b", "--bits", "12")
            before = self.json_of("list", daemon.address)["meshes"]
            self.assertEqual(daemon.stop(), 0, "SIGTERM ends the daemon in order")
        with house.Daemon(self.folder) as daemon:
            self.assertEqual(self.names(daemon), ["a", "b"])
            self.assertEqual(self.json_of("list", daemon.address)["meshes"], before)
            self.assert_same_mesh(self.small, self.fetched(daemon, "a"))

    def test_a_confirmed_mesh_survives_a_killed_daemon(self):
        with house.Daemon(self.folder) as daemon:
            self.ingest(daemon, self.small, "--name", "a")
            daemon.kill()
        with house.Daemon(self.folder) as daemon:
            self.assert_same_mesh(self.small, self.fetched(daemon, "a"))

    def test_ingests_killed_at_random_times_leave_whole_meshes_or_none(self):
        """pmcctl and pmcd are killed; nothing confirmed is lost, nothing half is there, the database opens.

        The daemon's own tests do this more often, with a client made for it; here are the programs that people run.
        """
        ingests = 30
        with house.Daemon(self.folder) as daemon:
            start = time.monotonic()
            self.ingest(daemon, self.large, "--name", "whole")
            usual_seconds = time.monotonic() - start
        order = random.Random(7)
        confirmed, cut = {"whole"}, 0
        victims = ["client", "client", "daemon"]
        for first in range(0, ingests, len(victims)):
            with house.Daemon(self.folder) as daemon:
                for number, victim in enumerate(victims[:ingests - first], first):
                    name = f"m{number}"
                    ingest = subprocess.Popen(
                        [house.program("PMCCTL"), "--socket", daemon.admin_socket, "ingest", self.large, "--name",
                         name], stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
                    time.sleep(order.uniform(0, 2.5 * usual_seconds))
                    if victim == "client":
                        ingest.kill()
                    else:
                        daemon.kill()
                    if ingest.wait(timeout=house.TIMEOUT_S) == house.DONE:
                        confirmed.add(name)
                    else:
                        cut += 1
        # Both outcomes came up, else the times were chosen badly.
        self.assertGreater(len(confirmed), 3)
        self.assertGreater(cut, 3)
        with house.Daemon(self.folder) as daemon:
            present = set(self.names(daemon))
            self.assertLessEqual(confirmed, present)
            whole = self.fetched(daemon, "whole")
            self.assert_same_mesh(self.large, whole)
            content = whole.read_bytes()
            for name in present:
                self.assertEqual(self.fetched(daemon, name).read_bytes(), content, name)

    def test_replace(self):
        daemon = self.start_daemon()
        self.ingest(daemon, self.small, "--name", "a")
        first = json.loads(self.expect(daemon.ctl("--json", "show", "a"), house.DONE).stdout)
        refused = self.ingest(daemon, self.large, "--name", "a", code=house.REFUSED)
        self.assert_complains(refused, "a", "--replace")
        self.assert_same_mesh(self.small, self.fetched(daemon, "a"))

        self.ingest(daemon, self.large, "--name", "a", "--replace")
        second = json.loads(self.expect(daemon.ctl("--json", "show", "a"), house.DONE).stdout)
        self.assertNotEqual(first["generation"], second["generation"])
        self.assertEqual(self.names(daemon), ["a"])
        self.assert_same_mesh(self.large, self.fetched(daemon, "a"))

    def test_remove(self):
        daemon = self.start_daemon()
        self.ingest(daemon, self.small, "--name", "a")
        self.ingest(daemon, self.small, "--name", "b")
        self.expect(daemon.ctl("remove", "a"), house.DONE)
        self.assertEqual(self.names(daemon), ["b"])
        self.expect(daemon.ctl("remove", "a"), house.REFUSED)
        self.expect(daemon.ctl("show", "a"), house.REFUSED)
        self.tool("fetch", daemon.address, "a", self.folder / "gone.ply", code=house.REFUSED)
        self.assertFalse((self.folder / "gone.ply").exists())

    def test_several_files_in_one_ingest_are_named_after_themselves(self):
        daemon = self.start_daemon()
        self.ingest(daemon, self.small, self.large)
        self.assertEqual(self.names(daemon), ["large", "small"])
        self.assert_same_mesh(self.small, self.fetched(daemon, "small"))
        self.assert_same_mesh(self.large, self.fetched(daemon, "large"))

    def test_effort_changes_the_packets_and_not_the_mesh(self):
        daemon = self.start_daemon()
        self.ingest(daemon, self.small, "--name", "best", "--effort", "best")
        self.assert_same_mesh(self.small, self.fetched(daemon, "best"))
        refused = self.ingest(daemon, self.small, "--name", "other", "--effort", "nonsense", code=house.USAGE)
        self.assertIn("--effort: nonsense", refused.stderr)
        self.assertEqual(self.names(daemon), ["best"])

    def test_two_daemons_do_not_share_a_socket(self):
        daemon = self.start_daemon()
        second = subprocess.run(
            [house.program("PMCD_DAEMON"), "--database", self.folder / "other.db", "--request-port",
             str(daemon.request_port), "--data-port", str(daemon.data_port), "--admin-socket",
             self.folder / "other.sock"], capture_output=True, text=True, timeout=20, check=False)
        self.assertNotEqual(second.returncode, 0)
        self.assertIn(str(daemon.request_port), second.stderr + second.stdout)


if __name__ == "__main__":
    unittest.main()
