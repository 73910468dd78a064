# SPDX-License-Identifier: GPL-3.0-or-later
"""The codec bench: its generated meshes are what they say, and its figures are counted as its tables say.

The programs are told by CODEC_BENCH and BUMPY_SPHERE; ctest sets them. Draco and Matplotlib are not needed.
"""

import json
import os
import pathlib
import re
import struct
import subprocess
import sys
import tempfile
import unittest

sys.dont_write_bytecode = True
sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "bench" / "codec"))
# pylint: disable=wrong-import-position
import meshes
import programs
import report
from plate import HOLES, Plate


def read_ply(data):
    """Vertices and faces of a binary PLY as the bench writes it."""
    header, _, body = data.partition(b"end_header\n")
    vertices, faces = (int(re.search(rb"element %s (\d+)" % name, header)[1]) for name in (b"vertex", b"face"))
    positions = list(struct.iter_unpack("<3f", body[:12 * vertices]))
    triangles = [face[1:] for face in struct.iter_unpack("<B3i", body[12 * vertices:])]
    assert len(triangles) == faces
    return positions, triangles


def genus(positions, faces):
    """Of a closed surface in one piece; None if it is not closed or not oriented."""
    edges = {edge for a, b, c in faces for edge in ((a, b), (b, c), (c, a))}
    if len(edges) != 3 * len(faces) or any((b, a) not in edges for a, b in edges):
        return None
    return 1 - (len(positions) - len(edges) // 2 + len(faces)) // 2


def volume(positions, faces):
    def determinant(a, b, c):
        return (a[0] * (b[1] * c[2] - b[2] * c[1]) + a[1] * (b[2] * c[0] - b[0] * c[2])
                + a[2] * (b[0] * c[1] - b[1] * c[0]))
    return sum(determinant(*(positions[v] for v in face)) for face in faces) / 6


class PlateTest(unittest.TestCase):
    def test_closed_thick_and_full_of_holes(self):
        data = Plate().ply()
        positions, faces = read_ply(data)
        self.assertEqual((HOLES, genus(positions, faces)), (200, 200))
        self.assertEqual(len(positions), 19282)
        # 20 by 10, 0.6 thick, less 200 holes of radius 0.15 to 0.35.
        self.assertGreater(volume(positions, faces), 60)
        self.assertLess(volume(positions, faces), 120)
        self.assertEqual(data, Plate().ply())

    def test_neither_planes_nor_columns(self):
        positions, _ = read_ply(Plate().ply())
        heights = [position[2] for position in positions]
        self.assertGreater(len(set(heights)), len(positions) // 3)


class Programs(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory(prefix="codec-bench-test-")
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)

    def sphere(self, vertices):
        path = self.folder / f"{vertices}.ply"
        done = subprocess.run([os.environ["BUMPY_SPHERE"], str(vertices), path], check=True, capture_output=True, text=True,
                              timeout=60)
        return path, json.loads(done.stdout)

    def bench(self, *arguments, code=0):
        done = subprocess.run([os.environ["CODEC_BENCH"], *map(str, arguments)], capture_output=True, text=True, timeout=300,
                              check=False)
        self.assertEqual(done.returncode, code, done.stdout + done.stderr)
        return json.loads(done.stdout) if code == 0 else done.stderr

    def test_bumpy_sphere(self):
        path, facts = self.sphere(4000)
        positions, faces = read_ply(path.read_bytes())
        self.assertEqual((len(positions), facts["vertices"], genus(positions, faces)), (4002, 4002, 0))
        self.assertGreater(volume(positions, faces), 2)
        self.assertGreater(facts["irregular_share"], 0.4)
        self.assertLess(facts["irregular_share"], 0.7)
        most = max(max(p[k] for p in positions) - min(p[k] for p in positions) for k in range(3))
        self.assertAlmostEqual(facts["extent"], most, places=5)
        # Ten times as many vertices have edges shorter by the root of ten.
        _, finer = self.sphere(40000)
        self.assertAlmostEqual(facts["mean_edge"] / finer["mean_edge"], 10 ** 0.5, delta=0.1)

    def test_figures_of_a_mesh(self):
        path, _ = self.sphere(1000)
        packets = self.folder / "packets.pmcd"
        result = self.bench(path, "--bits", 10, "--repeat", 1, "--errors", "--effort", "default", "--write-packets",
                            packets)
        self.assertEqual(result["file_bytes"], packets.stat().st_size)
        self.assertEqual(result["components"], 1)
        self.assertEqual(result["boundary_edges"], 0)
        levels = result["levels"]
        self.assertEqual(levels[-1]["vertices"], 1002)
        self.assertLess(sum(level["bytes"] for level in levels), result["file_bytes"])
        self.assertGreater(levels[0]["error_rms"], 20 * levels[-1]["error_rms"])
        self.assertGreater(levels[-1]["error_rms"], 0)
        bits = result["bits_per_vertex"]
        self.assertAlmostEqual(sum(bits[part] for part in bits if part != "total"), bits["total"])
        self.assertAlmostEqual(bits["total"] * 1002 / 8, sum(level["bytes"] for level in levels))
        for what in ("encode", "prove", "decode"):
            self.assertGreater(result[what + "_cpu_seconds"], 0)
        unmeasured = self.bench(path, "--bits", 10, "--repeat", 1)
        self.assertEqual([level["error_rms"] for level in unmeasured["levels"]], [None] * len(levels))
        best = self.bench(path, "--bits", 10, "--repeat", 1, "--effort", "best")
        self.assertLessEqual(best["bits_per_vertex"]["total"], bits["total"])
        self.assertIn("no effort nonsense", self.bench(path, "--effort", "nonsense", code=1))

    def test_xz_and_digits(self):
        def ply(*coordinates):
            count = len(coordinates) // 3
            return (b"ply\nelement vertex %d\nproperty float x\nelement face 0\nend_header\n" % count
                    + struct.pack(f"<{len(coordinates)}f", *coordinates))
        for coordinates, digits in (((0, 1, -2), 1), ((0.5, 0.25, 0.125), 3), ((1.2345, 0, 99.9), 5),
                                    ((0.123456, -65432.1, 1e-20), 6), ((1 / 3, 0, 0), 8)):
            (self.folder / "mesh.ply").write_bytes(ply(*coordinates))
            figures = programs.measure_xz(self.folder)
            self.assertEqual(figures["digits"], digits, coordinates)
            self.assertEqual(figures["ply_bytes"], len(ply(*coordinates)))
            self.assertGreater(figures["xz_bytes"], 0)


class Tables(unittest.TestCase):
    @staticmethod
    def run_of(mesh, group, levels, draco, file_bytes):
        total = sum(size for size, _ in levels)
        parts = dict.fromkeys(("base", "connectivity", "geometry", "precision", "exactness", "isolated"), 0)
        return {"mesh": mesh, "group": group, "bits": "12", "effort": "", "xz": {},
                "draco10": {"bytes": draco, "encode_seconds": 1, "decode_seconds": 0, "error_rms": 1e-4},
                "draco7": {"bytes": 2 * draco, "encode_seconds": 1, "decode_seconds": 1},
                "pmcd": {"vertices": 100, "faces": 196, "components": 1, "isolated_vertices": 0, "boundary_edges": 0,
                         "exact": True, "file_bytes": file_bytes, "encode_cpu_seconds": 0.05, "prove_cpu_seconds": 0.05,
                         "decode_cpu_seconds": 0.025, "encode_and_prove_peak_bytes": 40000, "decode_peak_bytes": 20000,
                         "bits_per_vertex": parts | {"headers": 8 * total / 100, "total": 8 * total / 100},
                         "levels": [{"bytes": size, "vertices": 100, "error_rms": error, "error_max": error}
                                    for size, error in levels]}}

    def test_bytes_to_an_error(self):
        run = self.run_of("dino", meshes.LIST, [(100, 1e-1), (50, 1e-3), (25, None), (10, 0)], 200, 300)
        self.assertEqual(report.bytes_to_error(run), 150)
        self.assertEqual(report.bytes_to_error(run, 1e-4), 185)
        self.assertEqual(report.bytes_to_error(run, 1), 100)
        unmeasured = self.run_of("dino", meshes.LIST, [(100, None)], 200, 300)
        self.assertIsNone(report.bytes_to_error(unmeasured))

    def test_summary(self):
        runs = [self.run_of("dino", meshes.LIST, [(100, 1e-1), (50, 0)], 100, 160),
                self.run_of("bones", meshes.TOPOLOGY, [(300, 0)], 100, 310),
                self.run_of("dragon", meshes.LIST, [(50, 0)], 100, 60)]
        listed, topology = report.summary_rows(runs)
        # Mean ratio, worst, the scans alone, to -cl 7, the whole file; then exactness, speed and memory.
        self.assertEqual(listed, ["the list", "12", "-", "2", "1.000", "1.500 dino", "0.500", "0.500", "1.100", "2 of 2",
                                  "2", "1", "4", "400", "200"])
        self.assertEqual(topology[:6], ["high genus or many components", "12", "-", "1", "3.000", "3.000 bones"])
        self.assertEqual(topology[6], "-")
        text = report.report(runs, 1, "a machine")
        self.assertIn("| dino | 100 | 0 | 12 | - |", text)
        # Encoding alone, the proof, both, decoding; memory.
        self.assertIn("| dino | 12 | - | 0.050 | 2 | 0.050 | 1 | 0.025 | 4 | 400 | 200 |", text)

    def test_choice_of_meshes(self):
        every = meshes.choose([], os.fspath(self.folder_with(
            "dino.off", "fandisk.off", "armadillo.off", "bunny00.off", "diplodocus.off", "horse.ply", "nefertiti.obj",
            "venus-original.off", "rocker-arm.obj", "fertility.off", "femur.off", "screwdriver.ply", "spot.obj",
            "dragon_vrip.ply.gz", "1002_tray_bottom.STL", "bones.off")))
        self.assertEqual([sum(mesh.group == group for mesh in every) for group in (meshes.LIST, meshes.TOPOLOGY)], [19, 3])
        folder = self.folder_with("dino.off", "other.obj")
        chosen = meshes.choose(["dino", "dino.off", "other.obj", str(folder / "other.obj"), "camel", "plate200"], folder)
        self.assertEqual([(mesh.name, mesh.group) for mesh in chosen],
                         [("dino", meshes.LIST)] * 2 + [("other", meshes.OTHERS)] * 2
                         + [("camel", meshes.LIST), ("plate200", meshes.TOPOLOGY)])
        for missing in ("spot", "absent.ply"):
            with self.assertRaisesRegex(meshes.MeshError, "there is no .*" + missing.partition(".")[0]):
                meshes.choose([missing], folder)
        with self.assertRaisesRegex(meshes.MeshError, "PMCD_TEST_MESHES"):
            meshes.choose(["dino"], None)

    def folder_with(self, *names):
        folder = tempfile.TemporaryDirectory(prefix="codec-bench-test-")
        self.addCleanup(folder.cleanup)
        for name in names:
            pathlib.Path(folder.name, name).write_bytes(b"")
        return pathlib.Path(folder.name)


if __name__ == "__main__":
    unittest.main()
