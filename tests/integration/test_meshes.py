# SPDX-License-Identifier: GPL-3.0-or-later
"""The straight way with real meshes, out of the folder that PMCD_TEST_MESHES names; skipped as a whole without it."""

import os
import pathlib
import unittest

import house


@unittest.skipUnless(os.environ.get("PMCD_TEST_MESHES"), "PMCD_TEST_MESHES is not set: no real meshes to fetch")
class RealMeshes(house.HouseTest):
    def test_real_meshes(self):
        """Genus, boundary, isolated vertices, both byte orders, text: each comes back as it was."""
        daemon = self.start_daemon()
        for file in ("fertility.off", "rocker-arm.obj", "screwdriver.ply", "bun_zipper.ply", "mountain.obj",
                     "bones.off"):
            original = pathlib.Path(os.environ["PMCD_TEST_MESHES"], file)
            self.assertTrue(original.is_file(), f"{original} is missing")
            name = original.stem
            self.ingest(daemon, original, "--name", name)
            files, listed = self.fetch_and_check(daemon, name, original)
            self.assertGreaterEqual(len(files), 8 if listed["vertices"] > 5000 else 3, name)


if __name__ == "__main__":
    unittest.main()
