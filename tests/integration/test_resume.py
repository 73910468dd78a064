# SPDX-License-Identifier: GPL-3.0-or-later
"""Lines that break, programs that are killed, meshes that change: pmctool fetch ends with the original all the same."""

import json
import pathlib
import signal
import subprocess
import tempfile
import time
import unittest
from unittest import mock

import house
from proxy import Line, Proxy, ranges

_JOIN_OK, _CHUNK_HEADER, _TRANSFER_END = 14, 34, 13  # bytes of these on the data channel, frame header included


class Resume(house.HouseTest):
    @classmethod
    def setUpClass(cls):
        """Encodes the mesh of all the tests once: with sanitizers that takes longer than most of them."""
        folder = tempfile.TemporaryDirectory(prefix="pmcd-test-")
        cls.addClassCleanup(folder.cleanup)
        mesh = house.write_ply(pathlib.Path(folder.name) / "torus.ply", house.torus(160, 100, wobble=0.2))
        cls.original = pathlib.Path(folder.name) / "original.pmcd"
        house.run_or_raise("PMCTOOL", "encode", mesh, cls.original)
        info = json.loads(house.run_or_raise("PMCTOOL", "info", cls.original, "--json"))
        cls.sizes = [level["bytes"] for level in info["levels"]]
        # On the data channel, up to the bytes of packet 1. Before, the directory may still be on its way on the other.
        cls.behind_base = _JOIN_OK + _CHUNK_HEADER + cls.sizes[0] + _TRANSFER_END + _CHUNK_HEADER
        cls.directory_size = cls.original.stat().st_size - sum(cls.sizes)

    def setUp(self):
        super().setUp()
        self.assertGreater(sum(self.sizes), 50_000)
        self.daemon = self.start_daemon()
        self.ingest(self.daemon, self.original, "--name", "torus")
        self.out = self.folder / "out.pmcd"
        self.part = self.folder / "out.pmcd.part"

    def fetch(self, address, *options, code=house.DONE):
        return self.tool("fetch", address, "torus", self.out, *options, code=code)

    def start_fetch(self, address, *options):
        process = subprocess.Popen([house.program("PMCTOOL"), "fetch", address, "torus", self.out, *options],
                                   stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        self.addCleanup(process.communicate)
        self.addCleanup(process.kill)
        return process

    def wait_for(self, condition, what):
        deadline = time.monotonic() + 30
        while not condition():
            self.assertLess(time.monotonic(), deadline, what)
            time.sleep(0.01)

    def assert_original(self):
        self.assertEqual(self.out.read_bytes(), self.original.read_bytes())
        self.assertFalse(self.part.exists(), "goes away on success")

    def assert_each_byte_once(self, proxy):
        self.assertEqual(ranges(proxy.chunks), {packet: [(0, size)] for packet, size in enumerate(self.sizes)})

    def assert_goes_on_behind(self, part, chunks):
        """What the connection brought is all that the partial file lacked."""
        packet, first, _ = chunks[0]
        self.assertEqual(self.directory_size + sum(self.sizes[:packet]) + first, len(part))
        self.assertEqual(sum(end - begin for _, begin, end in chunks), self.original.stat().st_size - len(part))

    def part_bytes(self, size):
        """The first bytes of the original, as a partial file has them."""
        return self.original.read_bytes()[:size]

    def stop_in_the_middle(self, proxy, how):
        """Starts a fetch whose line is held, waits until its bytes are in the partial file, and ends it by a signal."""
        process = self.start_fetch(proxy.address)
        self.assertTrue(proxy.held.wait(30))
        self.wait_for(lambda: self.part.exists() and self.part.stat().st_size > self.directory_size + self.sizes[0],
                      "the partial file does not grow")
        process.send_signal(how)
        _, errors = process.communicate(timeout=30)
        return process.returncode, errors

    def held_proxy(self):
        return Proxy(self.daemon, data_lines=[Line(limit=sum(self.sizes) * 2 // 3, hold=True)])

    def test_a_line_that_is_cut_again_and_again(self):
        limits = [_JOIN_OK - 1, self.behind_base + 1, _JOIN_OK + _CHUNK_HEADER - 1, _JOIN_OK + _CHUNK_HEADER + 1,
                  _JOIN_OK, _JOIN_OK + _CHUNK_HEADER + 7, 100, 1000, 1001, 4096, 9000, _JOIN_OK + _CHUNK_HEADER, 20_000]
        with Proxy(self.daemon, data_lines=[Line(limit) for limit in limits]) as proxy:
            done = self.fetch(proxy.address)
        self.assert_original()
        self.assert_each_byte_once(proxy)
        self.assertEqual(len(proxy.chunks), len(limits) + 1)
        self.assertEqual(done.stderr.count("; trying again in "), len(limits), done.stderr)
        self.assertIn(f"{sum(self.sizes)} bytes in ", done.stdout)

    def test_a_line_that_is_cut_at_every_boundary(self):
        """Just before, at and just behind the end of a packet, and of its transfer_end."""
        for around in (-1, 0, 1, _TRANSFER_END - 1, _TRANSFER_END):
            with self.subTest(around=around):
                limit = self.behind_base + self.sizes[1] + around
                with Proxy(self.daemon, data_lines=[Line(limit)]) as proxy:
                    self.fetch(proxy.address)
                self.assert_original()
                self.assert_each_byte_once(proxy)

    def test_a_request_channel_that_is_cut(self):
        """Two in a row at most: each cut without a byte of the mesh since the one before doubles the pause."""
        for limits in ([1, 20], [60], [200], [60 + self.directory_size]):
            with self.subTest(limits=limits):
                with Proxy(self.daemon, request_lines=[Line(limit) for limit in limits]) as proxy:
                    done = self.fetch(proxy.address)
                self.assert_original()
                self.assertEqual(done.stderr.count("; trying again in "), len(limits), done.stderr)
                self.out.unlink()

    def test_no_second_try_if_none_is_wanted(self):
        with Proxy(self.daemon, data_lines=[Line(9000)]) as proxy:
            done = self.fetch(proxy.address, "--give-up-after", "0", code=house.REFUSED)
            self.assert_complains(done, "lost", "--resume", self.part)
            kept = self.part.read_bytes()
            self.assertGreater(len(kept), 5000)
            self.assertEqual(kept, self.part_bytes(len(kept)))
            self.fetch(proxy.address, "--resume")
        self.assert_original()
        self.assert_each_byte_once(proxy)

    def test_ctrl_c_says_how_to_go_on(self):
        with self.held_proxy() as proxy:
            code, errors = self.stop_in_the_middle(proxy, signal.SIGINT)
            self.assertEqual(code, 128 + signal.SIGINT)
            self.assertIn("stopped by SIGINT", errors)
            self.assertIn("--resume", errors)
            kept = self.part.read_bytes()
            self.assertEqual(kept, self.part_bytes(len(kept)))
            refused = self.fetch(proxy.address, code=house.USAGE)
            self.assert_complains(refused, self.part, "--resume", "delete")
            self.assertEqual(self.part.read_bytes(), kept, "not touched")
            proxy.released.set()
            before = len(proxy.chunks)
            self.fetch(proxy.address, "--resume")
        self.assert_original()
        self.assert_goes_on_behind(kept, proxy.chunks[before])

    def test_kill_9_of_pmctool(self):
        with self.held_proxy() as proxy:
            code, _ = self.stop_in_the_middle(proxy, signal.SIGKILL)
            self.assertEqual(code, -signal.SIGKILL)
            kept = self.part.read_bytes()
            self.assertEqual(kept, self.part_bytes(len(kept)), "a prefix of the file")
            proxy.released.set()
            before = len(proxy.chunks)
            done = self.fetch(proxy.address, "--resume")
        self.assert_original()
        self.assertIn("resuming behind ", done.stderr)
        self.assert_goes_on_behind(kept, proxy.chunks[before])

    def test_kill_9_of_the_daemon(self):
        ports = [self.daemon.request_port, self.daemon.data_port]
        with self.held_proxy() as proxy:
            process = self.start_fetch(proxy.address)
            self.assertTrue(proxy.held.wait(30))
            self.daemon.kill()
            proxy.released.set()
            with mock.patch.object(house, "free_ports", return_value=ports):
                self.start_daemon()
            _, errors = process.communicate(timeout=60)
            self.assertEqual(process.returncode, 0, errors)
        self.assertIn("trying again in ", errors)
        self.assert_original()
        self.assert_each_byte_once(proxy)

    def test_another_level_and_format_from_the_same_part(self):
        with self.held_proxy() as proxy:
            self.stop_in_the_middle(proxy, signal.SIGTERM)
        rough, wanted = self.folder / "out.ply", self.folder / "wanted.ply"
        self.part.rename(self.folder / "out.ply.part")
        levels = self.folder / "levels"
        self.tool("fetch", self.daemon.address, "torus", rough, "--resume", "--level", 1, "--each-level", levels)
        self.tool("fetch", self.daemon.address, "torus", wanted, "--level", 1)
        self.assertEqual(rough.read_bytes(), wanted.read_bytes())
        self.assertEqual(len(list(levels.iterdir())), 2, "those that were there already too")

    def test_a_part_that_is_damaged(self):
        good = self.part_bytes(self.directory_size + sum(self.sizes[:3]) + 20)
        for name, at in (("directory", 20), ("packet 1", self.directory_size + self.sizes[0] + 60),
                         ("beginning of packet 3", len(good) - 18), ("nothing", None)):
            with self.subTest(damaged=name):
                bad = bytearray(good)
                if at is not None:
                    bad[at] ^= 0xff
                self.part.write_bytes(bad)
                self.fetch(self.daemon.address, "--resume")
                self.assert_original()
        self.part.write_bytes(b"")
        self.fetch(self.daemon.address, "--resume")
        self.assert_original()
        self.part.symlink_to(self.folder / "elsewhere")
        self.assert_complains(self.fetch(self.daemon.address, "--resume", code=house.BAD_INPUT), "symbolic link")
        self.assertFalse((self.folder / "elsewhere").exists())

    def test_a_part_that_is_whole_asks_for_nothing(self):
        self.part.write_bytes(self.original.read_bytes())
        self.daemon.stop()
        self.fetch(self.daemon.address, "--resume")
        self.assert_original()

    def test_without_a_part_it_begins(self):
        self.fetch(self.daemon.address, "--resume")
        self.assert_original()

    def test_a_mesh_that_changed_meanwhile(self):
        self.part.write_bytes(self.part_bytes(self.directory_size + self.sizes[0] + 30))
        other = house.write_ply(self.folder / "sheet.ply", house.sheet(40, 30))
        self.ingest(self.daemon, other, "--name", "torus", "--replace")
        done = self.fetch(self.daemon.address, "--resume")
        self.assertIn('"torus" on the server is another mesh than what came so far', done.stderr)
        self.assertIn("beginning anew", done.stderr)
        decoded = self.folder / "decoded.ply"
        self.tool("decode", self.out, decoded)
        self.assert_same_mesh(other, decoded)
        self.assertFalse(self.part.exists())

    def test_the_part_of_another_mesh(self):
        other = house.write_ply(self.folder / "sheet.ply", house.sheet(40, 30))
        self.ingest(self.daemon, other, "--name", "sheet")
        self.part.write_bytes(self.part_bytes(self.directory_size + self.sizes[0] + 30))
        done = self.tool("fetch", self.daemon.address, "sheet", self.out, "--resume")
        self.assertIn("beginning anew", done.stderr)
        decoded = self.folder / "decoded.ply"
        self.tool("decode", self.out, decoded)
        self.assert_same_mesh(other, decoded)

    def test_a_fetch_that_never_began_leaves_nothing(self):
        self.tool("fetch", self.daemon.address, "nothing", self.out, code=house.REFUSED)
        self.assertFalse(self.part.exists())


if __name__ == "__main__":
    unittest.main()
