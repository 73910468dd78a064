# SPDX-License-Identifier: GPL-3.0-or-later
"""The straight way: a mesh is ingested, served and fetched level by level until the client holds the original."""

import concurrent.futures
import json
import unittest

import house


class Fetch(house.HouseTest):
    def test_every_level_up_to_the_original(self):
        daemon = self.start_daemon()
        original = house.write_ply(self.folder / "torus.ply", house.torus(80, 40, wobble=0.1))
        self.ingest(daemon, original, "--name", "torus")
        self.assertEqual(self.names(daemon), ["torus"])

        files, listed = self.fetch_and_check(daemon, "torus", original)
        self.assertEqual(listed["vertices"], 3200)
        self.assertGreaterEqual(len(files), 4)
        counts = [house.ply_counts(file) for file in files]
        self.assertEqual(counts[-1], (3200, 6400))
        self.assertLessEqual(counts[0][0], 100, "the base mesh is small")
        for (coarse_vertices, coarse_faces), (fine_vertices, fine_faces) in zip(counts, counts[1:]):
            self.assertLessEqual(coarse_vertices, fine_vertices)
            self.assertLessEqual(coarse_faces, fine_faces)
        for vertices, faces in counts:
            self.assertEqual(faces, 2 * vertices, "a torus stays a torus on every level")

    def test_one_level_of_many(self):
        daemon = self.start_daemon()
        original = house.write_ply(self.folder / "torus.ply", house.torus(60, 30))
        self.ingest(daemon, original, "--name", "torus")
        files, _ = self.fetch_and_check(daemon, "torus", original)
        for level in (0, 2):
            part = self.folder / f"part{level}.ply"
            self.tool("fetch", daemon.address, "torus", part, "--level", level)
            self.assert_same_mesh(files[level], part)

    def test_ingest_tells_its_times_apart(self):
        daemon = self.start_daemon()
        original = house.write_ply(self.folder / "torus.ply", house.torus(60, 30))
        packets = self.folder / "packets.pmcd"
        self.tool("encode", original, packets)

        def seconds(file):
            done, = json.loads(self.expect(daemon.ctl("--json", "ingest", file), house.DONE).stdout)["ingested"]
            parts = [done[what + "_seconds"] for what in ("encode", "prove", "measure")]
            self.assertLessEqual(sum(parts), done["seconds"])
            return parts

        self.assertGreater(min(seconds(original)), 0)
        self.assertEqual(seconds(packets), [0, 0, 0], "stored as it is")

    def test_two_clients_at_once(self):
        daemon = self.start_daemon()
        originals = {"torus": house.write_ply(self.folder / "torus.ply", house.torus(90, 60, wobble=0.2)),
                     "sheet": house.write_ply(self.folder / "sheet.ply", house.sheet(70, 60))}
        for name, file in originals.items():
            self.ingest(daemon, file, "--name", name)
        self.assertEqual(self.names(daemon), ["sheet", "torus"])
        with concurrent.futures.ThreadPoolExecutor() as clients:
            runs = [clients.submit(self.tool, "fetch", daemon.address, name, self.folder / f"{name}{number}.ply")
                    for number in range(2) for name in originals]
            for run in runs:
                run.result()
        for name, file in originals.items():
            for number in range(2):
                self.assert_same_mesh(file, self.folder / f"{name}{number}.ply")

    def test_the_snapped_mesh_with_bits(self):
        daemon = self.start_daemon()
        original = house.write_ply(self.folder / "torus.ply", house.torus(60, 30, wobble=0.1))
        packets, snapped, fetched = (self.folder / name for name in ("torus.pmcd", "snapped.ply", "fetched.ply"))
        self.tool("encode", original, packets, "--bits", 10)
        self.tool("decode", packets, snapped)
        self.ingest(daemon, original, "--name", "torus", "--bits", 10)
        self.tool("fetch", daemon.address, "torus", fetched)
        self.assert_same_mesh(snapped, fetched)
        self.tool("compare", original, fetched, code=house.NO)

    def test_list_with_a_filter(self):
        daemon = self.start_daemon()
        sheet = house.write_ply(self.folder / "sheet.ply", house.sheet(4, 3))
        for name in ("Bunny", "bunny-small", "torus"):
            self.ingest(daemon, sheet, "--name", name)

        def listed(text):
            return [mesh["name"] for mesh in self.json_of("list", daemon.address, "--filter", text)["meshes"]]

        self.assertEqual(listed("BUNNY"), ["Bunny", "bunny-small"])
        self.assertEqual(listed("small"), ["bunny-small"])
        self.assertEqual(listed("dragon"), [])
        self.assertEqual(listed(""), ["Bunny", "bunny-small", "torus"])
        self.assertNotIn("torus", self.tool("list", daemon.address, "--filter", "un").stdout)
        self.assert_complains(self.tool("list", daemon.address, "--filter", "x" * 129, code=house.USAGE), "128")

    def test_every_format_in_and_out(self):
        mesh = house.torus(20, 12)
        ply = house.write_ply(self.folder / "torus.ply", mesh)
        packets = self.folder / "torus.pmcd"
        self.tool("encode", ply, packets)
        for suffix in ("ply", "obj", "off", "stl"):
            out, again, back = (self.folder / f"{name}.{suffix}" for name in ("out", "again", "back"))
            self.tool("decode", packets, out)
            self.tool("compare", ply, out)
            self.tool("encode", out, again.with_suffix(".pmcd"))
            self.tool("decode", again.with_suffix(".pmcd"), back)
            self.assert_same_mesh(ply, back)

    def test_what_list_show_and_info_say_agrees(self):
        daemon = self.start_daemon()
        original = house.write_ply(self.folder / "sheet.ply", house.sheet(40, 30))
        packets = self.folder / "sheet.pmcd"
        self.tool("encode", original, packets)
        self.ingest(daemon, original, "--name", "sheet")
        info = self.json_of("info", packets)
        self.assertEqual([level["level"] for level in info["levels"]], list(range(len(info["levels"]))))
        self.assertEqual(info["levels"][-1]["vertices"], 41 * 31)
        self.assertEqual(info["levels"][-1]["faces"], 2 * 40 * 30)
        self.assertAlmostEqual(info["levels"][-1]["error_max"], 0)
        for level in info["levels"]:
            self.assertGreater(level["bytes"], 0)
            self.assertLessEqual(level["error_rms"], level["error_max"] + 1e-12)
        listed = self.json_of("list", daemon.address)["meshes"][0]
        self.assertEqual(listed["vertices"], 41 * 31)
        self.assertEqual(listed["faces"], 2 * 40 * 30)
        self.assertEqual(listed["packets"], len(info["levels"]))


if __name__ == "__main__":
    unittest.main()
