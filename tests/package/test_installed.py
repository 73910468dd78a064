# SPDX-License-Identifier: GPL-3.0-or-later
"""The package as a stranger gets it: installed with apt under a booted systemd, used, killed, stopped, removed, purged.

PMCD_DEB names the package. PMCD_TEST_TREES names a folder where the system that machines are made of is kept from one run
to the next (default: build/trees). Needs root and what scripts/install-dependencies --package installs; without that the
tests are skipped and say why. Each test has a machine of its own; packaging/test-package runs them all.
"""

import json
import os
import pathlib
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import unittest

import machine

_REPOSITORY = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(_REPOSITORY / "tests" / "integration"))
import house  # noqa: E402 (needs the line above)

CONFIG = "/etc/pmcd/pmcd.conf"
DATABASE = "/var/lib/pmcd/meshes.db"
SOCKET = "/run/pmcd/admin.sock"
UNIT = "/lib/systemd/system/pmcd.service"
# systemd-analyze's threshold is the score times ten.
MOST_EXPOSURE = 2.0


def package():
    path = os.environ.get("PMCD_DEB")
    if not path:
        raise unittest.SkipTest("PMCD_DEB names no package: run packaging/test-package")
    return pathlib.Path(path)


def control_field(name):
    return subprocess.run(["dpkg-deb", "--field", package(), name], check=True, capture_output=True,
                          text=True).stdout.strip()


def names_in(relation):
    """The packages that a control field names, of alternatives the first, without versions."""
    return [part.split("|")[0].split("(")[0].strip() for part in relation.split(",") if part.strip()]


class PackageFile(unittest.TestCase):
    def test_the_other_pmcd_is_excluded(self):
        self.assertIn("pcp", names_in(control_field("Conflicts")))

    def test_its_files(self):
        listing = subprocess.run(["dpkg-deb", "--contents", package()], check=True, capture_output=True, text=True).stdout
        files = {line.split()[5].removeprefix(".") for line in listing.splitlines() if not line.startswith("d")}
        self.assertLessEqual({"/usr/sbin/pmcd", "/usr/bin/pmcctl", "/usr/bin/pmctool", CONFIG, UNIT,
                              "/usr/lib/sysusers.d/pmcd.conf", "/usr/share/man/man8/pmcd.8.gz",
                              "/usr/share/man/man1/pmcctl.1.gz", "/usr/share/man/man1/pmctool.1.gz"}, files)
        stray = [file for file in files if re.match(r"/usr/(include|lib/(?!sysusers\.d))|/etc/(?!pmcd/)", file)]
        self.assertEqual(stray, [])


class Installed(unittest.TestCase):
    """Each test begins with the package just installed on a machine of its own."""

    @classmethod
    def setUpClass(cls):
        try:
            machine.check_host()
            depends = names_in(control_field("Depends")) + names_in(control_field("Pre-Depends"))
            cls.tree = machine.base_tree(os.environ.get("PMCD_TEST_TREES") or _REPOSITORY / "build" / "trees", depends)
        except machine.Unavailable as reason:
            raise unittest.SkipTest(str(reason)) from reason
        folder = tempfile.TemporaryDirectory(prefix="pmcd-test-")
        cls.addClassCleanup(folder.cleanup)
        cls.mesh = house.write_ply(pathlib.Path(folder.name, "torus.ply"), house.torus(40, 25, wobble=0.1))

    def setUp(self):
        self.machine = self.enterContext(machine.Machine(self.tree))
        for file in (package(), self.mesh):
            shutil.copy(file, self.machine.root / "srv" / file.name)
        self.apt("install", f"/srv/{package().name}")

    def run_ok(self, *command, user=None):
        result = self.machine.run(*command, user=user)
        self.assertEqual(result.returncode, 0, f"{command}\n{result.stdout}\n{result.stderr}\n{self.journal()}")
        return result.stdout

    def apt(self, action, what):
        return self.run_ok("apt-get", "--quiet", "--yes", action, what)

    def journal(self, *options):
        return self.machine.run("journalctl", "--unit=pmcd", "--output=cat", "--quiet", *options).stdout

    def show(self, name):
        """A property of the service, as systemd has it."""
        return self.machine.run("systemctl", "show", "pmcd", f"--property={name}", "--value").stdout.strip()

    def wait_for_property(self, name, value):
        machine.wait_for(f"{name}={value}", 30, lambda: self.show(name) == value)

    def mode(self, path):
        return self.run_ok("stat", "--format=%U:%G %a", path).strip()

    def assert_serves_the_mesh(self):
        """Fetches the mesh anew and compares it with the file it was made of."""
        self.run_ok("pmctool", "fetch", "127.0.0.1", "torus", "/srv/fetched.ply")
        self.run_ok("pmctool", "compare", "/srv/torus.ply", "/srv/fetched.ply")
        self.run_ok("rm", "/srv/fetched.ply")

    def test_it_is_up_at_once_and_has_no_rights(self):
        self.assertEqual(self.show("ActiveState"), "active")
        self.assertEqual(self.show("UnitFileState"), "enabled")
        self.assertEqual(self.show("StatusText"), "serving on 127.0.0.1, request port 7621, data port 7622")
        # A host may allow fewer descriptors than the unit asks for.
        warnings = self.journal("--priority=warning").splitlines()
        self.assertEqual([line for line in warnings if "descriptors allow" not in line], [])

        status = dict(line.split(":\t", 1) for line in
                      self.run_ok("cat", f"/proc/{self.show('MainPID')}/status").splitlines())
        number = self.run_ok("id", "--user", "pmcd").strip()
        self.assertEqual(set(status["Uid"].split()), {number})
        self.assertLess(int(number), 1000, "a system user")
        self.assertEqual({int(status[name], 16) for name in ("CapPrm", "CapEff", "CapBnd", "CapAmb")}, {0})
        self.assertEqual((status["NoNewPrivs"], status["Seccomp"]), ("1", "2"))
        self.assertRegex(self.run_ok("getent", "passwd", "pmcd"), r":/usr/sbin/nologin\n$")

    def test_modes(self):
        self.assertEqual(self.mode("/var/lib/pmcd"), "pmcd:pmcd 750")
        self.assertEqual(self.mode(DATABASE), "pmcd:pmcd 640")
        self.assertEqual(self.mode("/run/pmcd"), "pmcd:pmcd 750")
        self.assertEqual(self.mode(SOCKET), "pmcd:pmcd 660")
        self.assertEqual(self.mode(CONFIG), "root:root 644")

    def test_the_limit_of_descriptors_is_raised(self):
        """As far as the host allows: the unit asks for 65536, the daemon takes the hard limit it was given."""
        limits = self.run_ok("cat", f"/proc/{self.show('MainPID')}/limits")
        soft, hard = re.search(r"Max open files\s+(\d+)\s+(\d+)", limits).groups()
        self.assertEqual(soft, hard)
        self.assertEqual(self.show("LimitNOFILE"), "65536")
        self.assertGreaterEqual(int(hard), 4096)

    def test_systemd_finds_no_fault_with_the_unit(self):
        verified = self.machine.run("systemd-analyze", "verify", UNIT)
        self.assertEqual((verified.returncode, verified.stdout, verified.stderr), (0, "", ""))
        judged = self.machine.run("systemd-analyze", "security", f"--threshold={MOST_EXPOSURE * 10:.0f}", "--no-pager",
                                  "pmcd.service")
        score = re.search(r"Overall exposure level for pmcd.service: ([\d.]+)", judged.stdout)
        self.assertEqual(judged.returncode, 0, judged.stdout)
        self.assertLessEqual(float(score[1]), MOST_EXPOSURE)
        print(f"systemd-analyze security: {score[1]}", file=sys.stderr)

    def test_a_mesh_outlives_a_killed_daemon(self):
        self.run_ok("pmcctl", "ingest", "/srv/torus.ply")
        self.assert_serves_the_mesh()
        before = self.show("MainPID")
        self.run_ok("systemctl", "kill", "--signal=KILL", "--kill-who=main", "pmcd")
        self.wait_for_property("NRestarts", "1")
        self.wait_for_property("ActiveState", "active")
        self.assertNotEqual(self.show("MainPID"), before)
        self.assert_serves_the_mesh()
        self.assertEqual(self.mode(SOCKET), "pmcd:pmcd 660")

    def test_stop_is_in_order(self):
        self.run_ok("pmcctl", "ingest", "/srv/torus.ply")
        self.run_ok("systemctl", "stop", "pmcd")
        self.assertEqual(self.show("ActiveState"), "inactive")
        self.assertEqual((self.show("Result"), self.show("ExecMainStatus")), ("success", "0"))
        # Sent together with STOPPING=1.
        self.assertRegex(self.show("StatusText"), "^draining")
        self.assertFalse((self.machine.root / SOCKET[1:]).exists())
        self.run_ok("systemctl", "start", "pmcd")
        self.assert_serves_the_mesh()

    def test_only_root_and_the_group_may_command_it(self):
        self.run_ok("useradd", "--create-home", "--user-group", "alice")
        refused = self.machine.run("pmcctl", "status", user="alice")
        self.assertEqual(refused.returncode, house.REFUSED, refused.stderr)
        self.run_ok("usermod", "--append", "--groups", "pmcd", "alice")
        status = json.loads(self.run_ok("pmcctl", "--json", "status", user="alice"))
        self.assertEqual(status["meshes"], 0)
        # Who it was is what the log is for; in a user namespace of its own the daemon could not tell.
        number = self.run_ok("id", "--user", "alice").strip()
        self.assertRegex(self.journal(), rf"admin uid {number} pid \d+: status: done")

    def test_a_fault_in_the_config_file_is_told_and_keeps_it_down(self):
        good = self.run_ok("cat", CONFIG)
        line = len(good.splitlines()) + 1
        config = self.machine.root / CONFIG[1:]
        config.write_text(good + "slots = none\n", encoding="utf-8")
        self.assertNotEqual(self.machine.run("systemctl", "restart", "pmcd").returncode, 0)
        self.wait_for_property("ActiveState", "failed")
        self.assertIn(f'{CONFIG}:{line}: slots: "none" is not 1 to 1024, or auto', self.journal())
        self.assertIn("status=2", self.show("ExecStartPre"), "it was the check that failed, not the start")
        config.write_text(good, encoding="utf-8")
        self.run_ok("systemctl", "reset-failed", "pmcd")
        self.run_ok("systemctl", "start", "pmcd")

    def test_every_default_of_the_config_file_may_be_uncommented(self):
        """And the service writes where they say."""
        config = self.machine.root / CONFIG[1:]
        config.write_text(re.sub(r"^#(?=[a-z-]+ = )", "", config.read_text(encoding="utf-8"), flags=re.MULTILINE),
                          encoding="utf-8")
        self.run_ok("systemctl", "restart", "pmcd")
        self.run_ok("pmcctl", "ingest", "/srv/torus.ply")
        self.assert_serves_the_mesh()

    def test_remove_keeps_the_meshes_and_purge_does_not(self):
        self.run_ok("pmcctl", "ingest", "/srv/torus.ply")
        root = self.machine.root
        self.apt("remove", "pmcd")
        self.assertEqual(self.show("ActiveState"), "inactive")
        self.assertFalse((root / "usr/sbin/pmcd").exists())
        self.assertTrue((root / DATABASE[1:]).is_file())
        self.assertTrue((root / CONFIG[1:]).is_file())

        self.apt("install", f"/srv/{package().name}")
        self.assert_serves_the_mesh()

        self.apt("purge", "pmcd")
        self.assertEqual(self.show("LoadState"), "not-found")
        left = self.run_ok("find", "/etc", "/lib/systemd", "/run", "/usr", "/var/lib", "-xdev", "-name", "*pmcd*", "-not",
                           "-path", "/run/systemd/propagate*")
        self.assertEqual(left, "")
        self.run_ok("id", "pmcd")
        self.assertEqual(self.machine.run("systemctl", "is-system-running").stdout.strip(), "running")


if __name__ == "__main__":
    # Machines are cleared away also when somebody loses patience.
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    unittest.main(verbosity=2)
