# SPDX-License-Identifier: GPL-3.0-or-later
"""Bad input gets an exit code and a sentence, and leaves nothing behind: no output file, no half of a mesh."""

import pathlib
import socket
import struct
import threading
import unittest

import house


def ply(header_lines, body=b""):
    return "\n".join(["ply", *header_lines, "end_header", ""]).encode("ascii") + body


_TEXT_PLY = ["format ascii 1.0", "element vertex {vertices}", "property float x", "property float y",
             "property float z", "element face {faces}", "property list uchar int vertex_indices"]


def text_ply(vertices, faces, body):
    return ply([line.format(vertices=vertices, faces=faces) for line in _TEXT_PLY], body.encode("ascii"))


# file name: its bytes, and words that the message has to have.
BAD_MESHES = {
    "empty.ply": (b"", []),
    "empty.off": (b"", []),
    "garbage.ply": (bytes((i * 37 + 11) % 256 for i in range(5000)), []),
    "garbage.obj": (bytes((i * 91 + 3) % 256 for i in range(5000)), []),
    "wrong_format.off": (b"ply\nformat ascii 1.0\n", []),
    "truncated.off": (b"OFF\n4 4 0\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n3 0 1 2\n3 0 1 3\n", []),
    "truncated.ply": (ply([line.format(vertices=4, faces=4).replace("ascii", "binary_little_endian")
                           for line in _TEXT_PLY], struct.pack("<12f", *range(12)) + b"\x03\x00\x00"), []),
    "nan.off": (b"OFF\n4 4 0\n0 0 0\n1 nan 0\n0 1 0\n0 0 1\n3 0 2 1\n3 0 1 3\n3 1 2 3\n3 2 0 3\n", ["4"]),
    "infinite.obj": (b"v 0 0 0\nv 1 0 0\nv 0 inf 0\nf 1 2 3\n", ["3"]),
    "infinite.ply": (text_ply(3, 1, "0 0 0\n1 0 0\n0 1e999 0\n3 0 1 2\n"), []),
    "index.off": (b"OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 3\n", ["6"]),
    "index.obj": (b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 4\n", ["4"]),
    "negative_index.ply": (text_ply(3, 1, "0 0 0\n1 0 0\n0 1 0\n3 0 1 -1\n"), []),
    "huge.off": (b"OFF\n2147483648 2147483648 0\n0 0 0\n", []),
    "huge.ply": (text_ply(2147483648, 2147483648, "0 0 0\n"), []),
    "huge.stl": (b"\0" * 80 + struct.pack("<I", 2**31) + b"\0" * 50, []),
    "repeated_index.off": (b"OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 1\n", []),
    "three_faces_at_an_edge.off": (b"OFF\n5 3 0\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n0 -1 0\n3 0 1 2\n3 0 1 3\n3 0 1 4\n", []),
    "duplicate_face.off": (b"OFF\n3 2 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n3 0 1 2\n", []),
    "two_fans.off": (b"OFF\n5 2 0\n0 0 0\n1 0 0\n0 1 0\n-1 0 0\n0 -1 0\n3 0 1 2\n3 0 3 4\n", []),
}


class BadMeshes(house.HouseTest):
    def test_encode_refuses_and_writes_nothing(self):
        out = self.folder / "out.pmcd"
        for name, (content, words) in BAD_MESHES.items():
            with self.subTest(name):
                file = self.folder / name
                file.write_bytes(content)
                result = self.tool("encode", file, out, code=house.BAD_INPUT)
                self.assert_complains(result, name, *words)
                self.assertFalse(out.exists())

    def test_ingest_refuses_and_keeps_nothing(self):
        daemon = self.start_daemon()
        for name, (content, words) in BAD_MESHES.items():
            with self.subTest(name):
                file = self.folder / name
                file.write_bytes(content)
                result = self.ingest(daemon, file, code=house.BAD_INPUT)
                self.assert_complains(result, name, *words)
        self.assertEqual(self.names(daemon), [])

    def test_missing_file(self):
        missing = self.folder / "not_there.ply"
        self.assert_complains(self.tool("encode", missing, self.folder / "out.pmcd", code=house.BAD_INPUT),
                              "not_there.ply")
        self.assert_complains(self.tool("info", missing.with_suffix(".pmcd"), code=house.BAD_INPUT),
                              "not_there.pmcd")

    def test_an_output_that_cannot_be_written(self):
        mesh = house.write_ply(self.folder / "torus.ply", house.torus(12, 8))
        result = house.run("PMCTOOL", "encode", mesh, self.folder / "no" / "such" / "out.pmcd")
        self.assertNotEqual(result.returncode, house.DONE)
        self.assert_complains(result, "out.pmcd")


class DamagedFiles(house.HouseTest):
    def setUp(self):
        super().setUp()
        self.good = self.folder / "good.pmcd"
        mesh = house.write_ply(self.folder / "torus.ply", house.torus(30, 20, wobble=0.1))
        self.tool("encode", mesh, self.good)
        self.bytes = self.good.read_bytes()

    def refuse(self, content, *words):
        bad, out = self.folder / "bad.pmcd", self.folder / "out.ply"
        bad.write_bytes(content)
        result = self.tool("decode", bad, out, code=house.BAD_INPUT)
        self.assert_complains(result, "bad.pmcd", *words)
        self.assertFalse(out.exists())
        self.tool("info", bad, code=house.BAD_INPUT)

    def test_the_undamaged_file_is_fine(self):
        self.tool("decode", self.good, self.folder / "out.ply")

    def test_flipped_bits(self):
        size = len(self.bytes)
        for position in [*range(0, 64, 7), size // 3, size // 2, size - 1]:
            with self.subTest(position):
                damaged = bytearray(self.bytes)
                damaged[position] ^= 0x10
                self.refuse(bytes(damaged))

    def test_cut_short(self):
        for length in (0, 1, 4, 40, len(self.bytes) // 2, len(self.bytes) - 1):
            with self.subTest(length):
                self.refuse(self.bytes[:length])

    def test_bytes_after_the_end(self):
        self.refuse(self.bytes + b"\0")

    def test_two_packets_exchanged(self):
        levels = self.json_of("info", self.good)["levels"]
        sizes = [level["bytes"] for level in levels]
        start = len(self.bytes) - sum(sizes)
        offsets = [start + sum(sizes[:k]) for k in range(len(sizes) + 1)]
        packets = [self.bytes[a:b] for a, b in zip(offsets, offsets[1:])]
        packets[1], packets[2] = packets[2], packets[1]
        self.refuse(self.bytes[:start] + b"".join(packets))

    def test_a_packet_of_another_mesh(self):
        other = self.folder / "other.pmcd"
        mesh = house.write_ply(self.folder / "other.ply", house.torus(30, 20, wobble=0.3))
        self.tool("encode", mesh, other)
        theirs = other.read_bytes()
        ours_last = self.json_of("info", self.good)["levels"][-1]["bytes"]
        theirs_last = self.json_of("info", other)["levels"][-1]["bytes"]
        self.refuse(self.bytes[:-ours_last] + theirs[-theirs_last:])


class Usage(house.HouseTest):
    def test_usage_errors(self):
        mesh = house.write_ply(self.folder / "torus.ply", house.torus(12, 8))
        out = self.folder / "out.pmcd"
        for arguments in ((), ("frobnicate",), ("encode",), ("encode", mesh), ("encode", mesh, out, "--bits", "3"),
                          ("encode", mesh, out, "--bits", "25"), ("encode", mesh, out, "--bits", "many"),
                          ("encode", mesh, out, "--no-such-option")):
            with self.subTest(arguments=arguments):
                result = self.tool(*arguments, code=house.USAGE)
                self.assertNotEqual(result.stderr.strip(), "")
                self.assertFalse(out.exists())
        self.expect(house.run("PMCCTL"), house.USAGE)
        self.expect(house.run("PMCCTL", "frobnicate"), house.USAGE)

    def test_help_is_not_an_error(self):
        for program in ("PMCTOOL", "PMCCTL", "PMCD_DAEMON"):
            self.assertNotEqual(self.expect(house.run(program, "--help"), house.DONE).stdout, "")
            self.assertRegex(self.expect(house.run(program, "--version"), house.DONE).stdout, r"\d+\.\d+\.\d+")

    def test_compare_answers_no(self):
        one = house.write_ply(self.folder / "one.ply", house.torus(12, 8))
        two = house.write_ply(self.folder / "two.ply", house.torus(12, 8, wobble=0.01))
        three = house.write_ply(self.folder / "three.ply", house.torus(12, 9))
        self.tool("compare", one, one)
        self.assertNotEqual(self.tool("compare", one, two, code=house.NO).stdout, "")
        self.tool("compare", one, three, code=house.NO)
        self.tool("compare", one, self.folder / "none.ply", code=house.BAD_INPUT)


class Unreachable(house.HouseTest):
    def test_nobody_listens(self):
        (port,) = house.free_ports(1)
        for arguments in (("list", f"127.0.0.1:{port}"),
                          ("fetch", f"127.0.0.1:{port}", "torus", self.folder / "out.ply")):
            self.assert_complains(self.tool(*arguments, code=house.REFUSED), "127.0.0.1")
        self.assertFalse((self.folder / "out.ply").exists())
        self.assert_complains(self.expect(house.run("PMCCTL", "--socket", self.folder / "no.sock", "list"),
                                          house.REFUSED), "no.sock")

    def test_somebody_else_listens(self):
        """A server of another protocol that says something and closes: an error, not a wait for ever."""
        with socket.create_server(("127.0.0.1", 0)) as server:
            server.settimeout(house.TIMEOUT_S)
            port = server.getsockname()[1]

            def answer():
                connection, _ = server.accept()
                with connection:
                    connection.sendall(b"220 mail ready\r\n")

            thread = threading.Thread(target=answer)
            thread.start()
            self.tool("list", f"127.0.0.1:{port}", code=house.REFUSED)
            thread.join()

    def test_unknown_mesh_and_level(self):
        daemon = self.start_daemon()
        mesh = house.write_ply(self.folder / "torus.ply", house.torus(12, 8))
        self.ingest(daemon, mesh, "--name", "torus")
        out = self.folder / "out.ply"
        self.assert_complains(self.tool("fetch", daemon.address, "sphere", out, code=house.REFUSED), "sphere")
        self.assertFalse(out.exists())

    def test_daemon_configuration(self):
        self.expect(house.run("PMCD_DAEMON", "--no-such-option"), house.USAGE)
        config = pathlib.Path(self.folder, "pmcd.conf")
        config.write_text("request-port = many\n", encoding="utf-8")
        result = house.run("PMCD_DAEMON", "--config", config, "--check-config")
        self.assertNotEqual(result.returncode, house.DONE)
        self.assertIn("request-port", result.stderr + result.stdout)
        config.write_text(f"request-port = 7700\ndata-port = 7701\ndatabase = {self.folder}/m.db\n", encoding="utf-8")
        self.expect(house.run("PMCD_DAEMON", "--config", config, "--check-config"), house.DONE)


if __name__ == "__main__":
    unittest.main()
