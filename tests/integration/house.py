# SPDX-License-Identifier: GPL-3.0-or-later
"""A real daemon on loopback, the real tools, and meshes made on the spot, for the tests beside this file.

The programs are told by PMCD_DAEMON, PMCCTL and PMCTOOL; ctest sets them. A daemon listens on free ports, keeps its
database and its socket in a folder of the test, and is ended by its process id.
"""

import json
import math
import os
import pathlib
import random
import signal
import socket
import struct
import subprocess
import sys
import tempfile
import time
import unittest

_TESTS = pathlib.Path(__file__).resolve().parents[1]
COMPARER = _TESTS / "tools" / "compare_meshes.py"
TIMEOUT_S = 120

# Exit codes of pmctool and pmcctl.
DONE, NO, USAGE, BAD_INPUT, REFUSED = 0, 1, 2, 3, 4


def program(variable):
    path = os.environ.get(variable)
    if not path:
        raise RuntimeError(f"{variable} is not set: run these tests through ctest, or name the program in it")
    return path


def run(variable, *arguments):
    """Runs one of the tools to its end; returns the CompletedProcess with text output."""
    return subprocess.run([program(variable), *map(str, arguments)], capture_output=True, text=True, timeout=TIMEOUT_S,
                          check=False)


def run_or_raise(variable, *arguments):
    """As run(), for what a class sets up before there is a test that could fail; returns what was printed."""
    result = run(variable, *arguments)
    if result.returncode != DONE:
        raise RuntimeError(f"{result.args}\n{result.stdout}\n{result.stderr}")
    return result.stdout


def free_ports(count):
    """Ports that were free a moment ago on every address, and that the kernel gives to no connection of its own choice:
    tests run side by side, and one of them may connect from any port of the ephemeral range."""
    found = []
    while len(found) < count:
        port = random.randrange(10_000, 32_768)
        with socket.socket() as probe:
            try:
                probe.bind(("", port))
            except OSError:
                continue
        if port not in found:
            found.append(port)
    return found


class Daemon:
    """One run of pmcd over the database in `folder`. Use as a context; stop() and kill() may come before its end."""

    def __init__(self, folder, *options):
        self.folder = pathlib.Path(folder)
        self.admin_socket = self.folder / "admin.sock"
        self.log = self.folder / "pmcd.log"
        self.options = options
        self.process = None

    def __enter__(self):
        for _ in range(5):  # another process may take a port between our look and the daemon's
            self.request_port, self.data_port = free_ports(2)
            with open(self.log, "ab") as log:
                self.process = subprocess.Popen(
                    [program("PMCD_DAEMON"), "--database", self.folder / "meshes.db", "--request-port",
                     str(self.request_port), "--data-port", str(self.data_port), "--admin-socket", self.admin_socket,
                     *self.options], stdin=subprocess.DEVNULL, stdout=log, stderr=log)
            if self._is_up():
                return self
        raise RuntimeError("pmcd did not start: " + self.log.read_text(encoding="utf-8"))

    def _is_up(self):
        deadline = time.monotonic() + 20
        while time.monotonic() < deadline and self.process.poll() is None:
            if run("PMCTOOL", "list", self.address).returncode == DONE and self.ctl("list").returncode == DONE:
                return True
            time.sleep(0.05)
        self.kill()
        return False

    def __exit__(self, *_):
        code = self.stop()
        if code:  # what a sanitizer has found, for instance
            raise RuntimeError(f"pmcd ended with {code}: " + self.log.read_text(encoding="utf-8"))

    @property
    def address(self):
        return f"127.0.0.1:{self.request_port}"

    def stop(self):
        """SIGTERM, and the exit code; None if it had ended before."""
        if self.process.poll() is not None:
            return None
        self.process.send_signal(signal.SIGTERM)
        try:
            return self.process.wait(timeout=20)
        except subprocess.TimeoutExpired:
            self.kill()
            raise

    def kill(self):
        if self.process.poll() is None:
            self.process.kill()
            self.process.wait()

    def ctl(self, *arguments):
        return run("PMCCTL", "--socket", self.admin_socket, *arguments)


def torus(rings, sides, wobble=0.0):
    """Vertices and faces of a closed torus; `wobble` makes its surface uneven."""
    vertices = []
    for i in range(rings):
        for j in range(sides):
            u, v = 2 * math.pi * i / rings, 2 * math.pi * j / sides
            radius = 1 + wobble * math.sin(5 * u + 3 * v)
            vertices.append(((3 + radius * math.cos(v)) * math.cos(u), (3 + radius * math.cos(v)) * math.sin(u),
                             radius * math.sin(v)))
    faces = []
    for i in range(rings):
        for j in range(sides):
            a, b = i * sides + j, (i + 1) % rings * sides + j
            c, d = (i + 1) % rings * sides + (j + 1) % sides, i * sides + (j + 1) % sides
            faces += [(a, b, c), (a, c, d)]
    return vertices, faces


def sheet(columns, rows):
    """A hilly square with a boundary."""
    vertices = [(x / columns, y / rows, 0.1 * math.sin(7 * x / columns) * math.cos(5 * y / rows))
                for y in range(rows + 1) for x in range(columns + 1)]
    faces = []
    for y in range(rows):
        for x in range(columns):
            a = y * (columns + 1) + x
            b, c, d = a + 1, a + columns + 2, a + columns + 1
            faces += [(a, b, c), (a, c, d)]
    return vertices, faces


def write_ply(path, mesh):
    """Binary little-endian PLY with float coordinates."""
    vertices, faces = mesh
    header = ("ply\nformat binary_little_endian 1.0\n"
              f"element vertex {len(vertices)}\nproperty float x\nproperty float y\nproperty float z\n"
              f"element face {len(faces)}\nproperty list uchar int vertex_indices\nend_header\n")
    body = b"".join(struct.pack("<3f", *vertex) for vertex in vertices)
    body += b"".join(struct.pack("<B3i", 3, *face) for face in faces)
    pathlib.Path(path).write_bytes(header.encode("ascii") + body)
    return pathlib.Path(path)


def ply_counts(path):
    """Vertices and faces that a PLY file's header claims."""
    header = pathlib.Path(path).read_bytes().split(b"end_header")[0].decode("ascii").splitlines()
    counts = {line.split()[1]: int(line.split()[2]) for line in header if line.startswith("element ")}
    return counts["vertex"], counts["face"]


def write_off(path, mesh):
    vertices, faces = mesh
    lines = ["OFF", f"{len(vertices)} {len(faces)} 0"]
    lines += [" ".join(repr(x) for x in vertex) for vertex in vertices]
    lines += ["3 " + " ".join(map(str, face)) for face in faces]
    pathlib.Path(path).write_text("\n".join(lines) + "\n", encoding="ascii")
    return pathlib.Path(path)


class HouseTest(unittest.TestCase):
    """A test with a folder of its own in `self.folder` and assertions about the tools."""

    def setUp(self):
        folder = tempfile.TemporaryDirectory(prefix="pmcd-test-")
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)

    def start_daemon(self, *options):
        daemon = Daemon(self.folder, *options)
        self.enterContext(daemon)
        return daemon

    def expect(self, result, code):
        self.assertEqual(result.returncode, code, f"{result.args}\n{result.stdout}\n{result.stderr}")
        return result

    def tool(self, *arguments, code=DONE):
        return self.expect(run("PMCTOOL", *arguments), code)

    def json_of(self, *arguments):
        return json.loads(self.tool(*arguments, "--json").stdout)

    def ingest(self, daemon, *arguments, code=DONE):
        return self.expect(daemon.ctl("ingest", *arguments), code)

    def names(self, daemon):
        """The names of the meshes that the daemon offers, sorted."""
        return sorted(mesh["name"] for mesh in self.json_of("list", daemon.address)["meshes"])

    def assert_same_mesh(self, first, second):
        """The same mesh up to numbering, by the comparer in plain Python, which shares no code with pmcd."""
        result = subprocess.run([sys.executable, COMPARER, first, second], capture_output=True, text=True,
                                timeout=TIMEOUT_S, check=False)
        self.expect(result, DONE)

    def fetch_and_check(self, daemon, name, original):
        """Fetches every level of `name`, checks each, and that the last is `original`."""
        levels = self.folder / f"{name}.levels"
        last = self.folder / f"{name}.fetched.ply"
        self.tool("fetch", daemon.address, name, last, "--each-level", levels)
        self.assert_same_mesh(original, last)
        self.tool("compare", original, last)

        listed = next(mesh for mesh in self.json_of("list", daemon.address)["meshes"] if mesh["name"] == name)
        files = sorted(levels.iterdir())
        self.assertEqual(len(files), listed["packets"])
        self.assert_same_mesh(files[-1], last)
        return files, listed

    def assert_complains(self, result, *words):
        """An error message on stderr that has these words, and is not a stack of internals."""
        for word in words:
            self.assertIn(str(word).lower(), result.stderr.lower(), result.args)
        self.assertNotRegex(result.stderr, r"terminate called|Assertion|std::|Traceback")
