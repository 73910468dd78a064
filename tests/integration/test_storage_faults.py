# SPDX-License-Identifier: GPL-3.0-or-later
"""Storage that refuses: full, locked, damaged, too small a memory.

The one whom it concerns is told why, the others go on, and the daemon stays up and says it in its log.
"""

import concurrent.futures
import contextlib
import pathlib
import resource
import sqlite3
import subprocess
import time
import unittest

import hollow
import house

_PAGE = 4096
_MIB = 1 << 20


class StorageTest(house.HouseTest):
    """A daemon may keep its database in another folder than the test's files."""

    def setUp(self):
        super().setUp()
        self.small = self.folder / "small.pmcd"
        self.mesh = house.write_ply(self.folder / "small.ply", house.torus(40, 30, wobble=0.1))
        self.tool("encode", self.mesh, self.small)

    def log(self, daemon):
        return daemon.log.read_text(encoding="utf-8")

    def refused(self, daemon, *arguments):
        """A command of pmcctl that the daemon's storage refuses; its text."""
        result = self.expect(daemon.ctl(*arguments), house.REFUSED)
        self.assert_complains(result)
        return result.stderr

    def assert_serves(self, daemon, name):
        out = self.folder / "served.ply"
        self.tool("fetch", daemon.address, name, out)
        self.assert_same_mesh(self.mesh, out)

    def assert_unavailable(self, daemon, name):
        result = self.tool("fetch", daemon.address, name, self.folder / "no.ply", code=house.REFUSED)
        self.assert_complains(result, "unavailable")


class FullDisk(StorageTest):
    def setUp(self):
        super().setUp()
        self.disk = self.folder / "disk"
        self.disk.mkdir()
        mounted = subprocess.run(["mount", "-t", "tmpfs", "-o", "size=6m", "tmpfs", self.disk], capture_output=True,
                                 text=True, check=False)
        if mounted.returncode != 0:
            self.skipTest(f"a small disk cannot be mounted here (that needs root): {mounted.stderr.strip()}")
        self.addCleanup(subprocess.run, ["umount", "--lazy", self.disk], check=True)
        self.daemon = house.Daemon(self.disk)
        self.daemon.log = self.folder / "pmcd.log"  # on another disk than the database
        self.enterContext(self.daemon)
        self.ingest(self.daemon, self.small, "--name", "small")

    def test_upload_that_does_not_fit(self):
        big = hollow.write(self.folder / "big.pmcd", [100, 8 * _MIB])
        text = self.refused(self.daemon, "ingest", big)
        self.assertIn("upload file: cannot be written: No space left on device", text)
        self.assert_goes_on()

    def test_commit_that_does_not_fit(self):
        """The upload finds room, the database with its log does not."""
        big = hollow.write(self.folder / "big.pmcd", [100, 4 * _MIB])
        text = self.refused(self.daemon, "ingest", big)
        self.assertIn("the disk of the database is full", text)
        self.assert_goes_on()

    def test_full_to_the_last_byte(self):
        """Even then meshes are served, and all is well when there is room again."""
        with open(self.disk / "filler", "wb", buffering=0) as filler, contextlib.suppress(OSError):
            while True:
                filler.write(bytes(_PAGE))
        text = self.refused(self.daemon, "ingest", self.small, "--name", "other")
        self.assertRegex(text, "No space left on device|disk of the database is full")
        self.assert_serves(self.daemon, "small")
        (self.disk / "filler").unlink()
        self.assert_goes_on()

    def assert_goes_on(self):
        self.assertIsNone(self.daemon.process.poll(), "the daemon lives")
        self.assert_serves(self.daemon, "small")
        self.assertIn("no_space", self.log(self.daemon))
        self.assertEqual(self.names(self.daemon), ["small"])
        self.ingest(self.daemon, self.small, "--name", "another")
        self.assert_serves(self.daemon, "another")
        with contextlib.closing(sqlite3.connect(self.disk / "meshes.db")) as database:
            self.assertEqual(database.execute("PRAGMA integrity_check").fetchone(), ("ok",))
            self.assertEqual(database.execute("SELECT count(*) FROM mesh").fetchone(), (2,))


class FileSizeLimit(StorageTest):
    """A limit on file sizes is as good as a full disk, and needs no root."""

    def test_upload_and_commit_beyond_it(self):
        daemon = self.start_daemon()
        self.ingest(daemon, self.small, "--name", "small")
        for payload, text in ((2 * _MIB, "upload file: cannot be written: File too large"),
                              (_MIB - _PAGE, "the disk of the database is full")):
            resource.prlimit(daemon.process.pid, resource.RLIMIT_FSIZE, (_MIB, resource.RLIM_INFINITY))
            big = hollow.write(self.folder / "big.pmcd", [100, payload])
            self.assertIn(text, self.refused(daemon, "ingest", big, "--replace"))
            self.assertIsNone(daemon.process.poll(), "the daemon lives")
            self.assert_serves(daemon, "small")
            resource.prlimit(daemon.process.pid, resource.RLIMIT_FSIZE, (resource.RLIM_INFINITY,) * 2)
            self.ingest(daemon, big, "--replace")
        self.assertEqual(self.log(daemon).count("refused: no_space"), 2)
        self.assertEqual(self.names(daemon), ["big", "small"])


class LockedDatabase(StorageTest):
    def other(self):
        database = sqlite3.connect(self.folder / "meshes.db", isolation_level=None)
        self.addCleanup(database.close)
        return database

    def test_writers_get_the_reason_and_readers_do_not_notice(self):
        daemon = self.start_daemon()
        self.ingest(daemon, self.small, "--name", "small")
        other = self.other()
        for begin in ("BEGIN IMMEDIATE", "BEGIN EXCLUSIVE"):
            other.execute(begin)
            # While an ingest waits for the lock, sessions are served.
            waiting = subprocess.Popen(
                [house.program("PMCCTL"), "--socket", daemon.admin_socket, "ingest", self.small, "--name", "other"],
                stderr=subprocess.PIPE, stdout=subprocess.DEVNULL, text=True)
            self.assert_serves(daemon, "small")
            _, text = waiting.communicate(timeout=house.TIMEOUT_S)
            self.assertEqual(waiting.returncode, house.REFUSED)
            self.assertIn("another process keeps the database locked", text)
            self.assertIn("another process keeps the database locked", self.refused(daemon, "remove", "small"))
            self.assert_serves(daemon, "small")
            other.execute("ROLLBACK")
        self.assertIn("database_locked", self.log(daemon))
        self.assertEqual(self.names(daemon), ["small"])
        self.ingest(daemon, self.small, "--name", "other")
        self.expect(daemon.ctl("remove", "small"), house.DONE)
        self.assert_serves(daemon, "other")

    def test_a_start_on_a_locked_database_says_why_it_fails(self):
        with house.Daemon(self.folder):
            pass
        other = self.other()
        other.execute("PRAGMA locking_mode = EXCLUSIVE")
        other.execute("BEGIN EXCLUSIVE")
        ended = subprocess.run(
            [house.program("PMCD_DAEMON"), "--database", self.folder / "meshes.db", "--request-port", "0",
             "--data-port", "0", "--admin-socket", self.folder / "admin.sock"], capture_output=True, text=True,
            timeout=house.TIMEOUT_S, check=False)
        self.assertEqual(ended.returncode, 1)
        self.assertIn("database_locked: another process keeps the database locked", ended.stderr)


class DamagedDatabase(StorageTest):
    def damage(self, change):
        """Two meshes in a database; `change` gets its file's bytes and where the last packet of "bad" is in them."""
        with house.Daemon(self.folder) as daemon:
            bad = house.write_ply(self.folder / "bad.ply", house.torus(90, 60, wobble=0.2))
            self.tool("encode", bad, self.folder / "bad.pmcd")
            self.ingest(daemon, self.small, "--name", "small")
            self.ingest(daemon, self.folder / "bad.pmcd")
            self.assertEqual(daemon.stop(), 0)
        self.assertFalse((self.folder / "meshes.db-wal").exists(), "an orderly end leaves one file")
        file = self.folder / "meshes.db"
        content = bytearray(file.read_bytes())
        packet = (self.folder / "bad.pmcd").read_bytes()[-3 * _PAGE:]
        # Somewhere in it is the start of a page, so some piece of it is whole.
        start = next(content.find(packet[at:at + 64]) for at in range(0, 2 * _PAGE, 64)
                     if packet[at:at + 64] in content)
        change(content, start)
        file.write_bytes(content)

    def assert_only_that_mesh_is_ill(self, error):
        daemon = self.start_daemon()
        self.assertEqual(self.names(daemon), ["bad", "small"])
        self.assert_unavailable(daemon, "bad")
        self.assert_serves(daemon, "small")
        self.assertRegex(self.log(daemon), f'error: mesh "bad".*: {error}')
        # It can be replaced by a good one.
        self.ingest(daemon, self.small, "--name", "bad", "--replace")
        self.assert_serves(daemon, "bad")
        self.assertIsNone(daemon.process.poll())

    def test_flipped_bits_in_a_packet(self):
        def change(content, start):
            content[start + 10] ^= 0x10

        self.damage(change)
        self.assert_only_that_mesh_is_ill("database_corrupt")

    def test_a_page_that_leads_nowhere(self):
        def change(content, start):
            page = start // _PAGE * _PAGE
            content[page:page + 4] = b"\xff\xff\xff\xf0"  # of an overflow page: the number of the next one

        self.damage(change)
        self.assert_only_that_mesh_is_ill("database_corrupt")

    def test_a_missing_packet(self):
        daemon = self.start_daemon()
        self.ingest(daemon, self.small, "--name", "bad")
        self.ingest(daemon, self.small, "--name", "small")
        with contextlib.closing(sqlite3.connect(self.folder / "meshes.db")) as database, database:
            deleted = database.execute("DELETE FROM packet WHERE level = 1 AND mesh = "
                                       "(SELECT id FROM mesh WHERE name = 'bad')").rowcount
        self.assertEqual(deleted, 1)
        self.assertEqual(self.names(daemon), ["bad", "small"])
        self.assert_unavailable(daemon, "bad")
        self.assertRegex(self.refused(daemon, "show", "bad"), r"packet 1 of mesh \d+ is missing in the database")
        self.assertIn('mesh "bad": missing_packet: packet 1 of mesh', self.log(daemon))
        self.assert_serves(daemon, "small")
        self.ingest(daemon, self.small, "--name", "bad", "--replace")
        self.assert_serves(daemon, "bad")


    def test_a_row_that_no_pmcd_wrote(self):
        with house.Daemon(self.folder) as daemon:
            self.ingest(daemon, self.small, "--name", "bad")
            self.ingest(daemon, self.small, "--name", "small")
        with contextlib.closing(sqlite3.connect(self.folder / "meshes.db")) as database, database:
            database.execute("UPDATE mesh SET vertices = -1 WHERE name = 'bad'")
        daemon = self.start_daemon()
        reason = "the database is damaged: vertices is out of range in the database"
        self.assertEqual(self.names(daemon), ["small"])
        listed = self.expect(daemon.ctl("list"), house.DONE)
        self.assertIn("small", listed.stdout)
        self.assertIn(f'mesh "bad" is damaged: {reason}; ingest it again with --replace, or remove it', listed.stderr)
        self.assertIn(f'error: mesh "bad" is not listed: database_corrupt: {reason}', self.log(daemon))
        self.assertRegex(self.expect(daemon.ctl("status"), house.DONE).stdout, r"damaged_meshes +1\n")
        self.assert_unavailable(daemon, "bad")
        self.assert_serves(daemon, "small")
        self.expect(daemon.ctl("remove", "bad"), house.DONE)
        self.assertRegex(self.expect(daemon.ctl("status"), house.DONE).stdout, r"damaged_meshes +0\n")
        self.ingest(daemon, self.small, "--name", "bad")
        self.assert_serves(daemon, "bad")


class Memory(StorageTest):
    def bytes_mapped(self, daemon):
        status = pathlib.Path(f"/proc/{daemon.process.pid}/status").read_text(encoding="ascii")
        return int(status.split("VmSize:")[1].split()[0]) * 1024

    def test_an_ingest_that_the_daemon_cannot_hold(self):
        daemon = self.start_daemon()
        self.ingest(daemon, self.small, "--name", "small")
        mapped = self.bytes_mapped(daemon)
        if mapped > 1 << 40:
            self.skipTest("the daemon is built with a sanitizer, which maps more than any limit allows")
        # The first cannot be mapped; the second can, but SQLite finds no room for its row.
        for room, payloads in ((32 * _MIB, [100, 80 * _MIB]), (120 * _MIB, [100, 80 * _MIB])):
            resource.prlimit(daemon.process.pid, resource.RLIMIT_AS, (mapped + room, resource.RLIM_INFINITY))
            big = hollow.write(self.folder / "big.pmcd", payloads)
            text = self.refused(daemon, "ingest", big)
            self.assertRegex(text, "Cannot allocate memory|out of memory")
            self.assertIsNone(daemon.process.poll(), "the daemon lives")
            self.assert_serves(daemon, "small")
            self.ingest(daemon, self.small, "--name", "small", "--replace")
        self.assertEqual(self.log(daemon).count("refused: out_of_memory"), 2)
        self.assertEqual(self.names(daemon), ["small"])


class ManyAtOnce(StorageTest):
    def test_a_hundred_ingests_at_once(self):
        count = 100
        daemon = self.start_daemon()
        start = time.monotonic()
        with concurrent.futures.ThreadPoolExecutor(count) as pool:
            results = list(pool.map(lambda i: daemon.ctl("ingest", self.small, "--name", f"m{i}"), range(count)))
        for result in results:
            self.expect(result, house.DONE)
        self.assertEqual(self.names(daemon), sorted(f"m{i}" for i in range(count)))
        self.assert_serves(daemon, "m0")
        self.assert_serves(daemon, f"m{count - 1}")
        print(f"{count} ingests at once: {time.monotonic() - start:.1f} s", flush=True)

    def test_a_hundred_replacements_of_one_mesh_leave_one(self):
        daemon = self.start_daemon()
        with concurrent.futures.ThreadPoolExecutor(100) as pool:
            results = list(pool.map(lambda _: daemon.ctl("ingest", self.small, "--name", "m", "--replace"), range(100)))
        for result in results:
            self.expect(result, house.DONE)
        self.assertEqual(self.names(daemon), ["m"])
        self.assert_serves(daemon, "m")
        deadline = time.monotonic() + house.TIMEOUT_S
        with contextlib.closing(sqlite3.connect(self.folder / "meshes.db")) as database:
            while database.execute("SELECT count(*) FROM mesh").fetchone() != (1,):
                self.assertLess(time.monotonic(), deadline, "meshes that nobody holds are deleted")
                time.sleep(0.05)


if __name__ == "__main__":
    unittest.main()
