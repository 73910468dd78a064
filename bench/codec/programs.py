# SPDX-License-Identifier: GPL-3.0-or-later
"""Runs the programs that are measured: pmcd's own, Draco's and xz. Returns figures, makes no tables."""

import datetime
import json
import lzma
import os
import pathlib
import platform
import re
import statistics
import struct
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parents[2]
LOSSLESS = "lossless"


def progress(text):
    print(text, file=sys.stderr, flush=True)


def execute(*command, accepted=(0,)):
    """Runs a program; returns its output and its exit code. Ends this one with the output if it is not accepted."""
    command = [str(word) for word in command]
    with tempfile.TemporaryFile() as output:
        code = subprocess.run(command, stdin=subprocess.DEVNULL, stdout=output, stderr=subprocess.STDOUT,
                              check=False).returncode
        output.seek(0)
        text = output.read().decode("utf-8", errors="replace")
    if code not in accepted:
        sys.exit(f"{' '.join(command)}\nended with exit code {code}:\n{text}")
    return text, code


def build_release(*targets):
    """Brings these programs in build/release up to date; returns the build folder."""
    progress("Building the release programs")
    for command in (["cmake", "--preset", "release"],
                    ["cmake", "--build", "--preset", "release", "--target", *targets]):
        subprocess.run(command, cwd=ROOT, check=True, stdout=sys.stderr)
    return ROOT / "build" / "release"


def codec_bench(build, path, bits, effort, repeat, *options):
    lattice = [] if bits == LOSSLESS else ["--bits", bits]
    trying = ["--effort", effort] if effort else []
    return json.loads(execute(build / "bench/codec/codec_bench", path, "--repeat", repeat, *lattice, *trying,
                              *options)[0])


def measure_pmcd(build, path, bits, effort, repeat, scratch):
    """Leaves the mesh as it was imported in mesh.ply."""
    packets, expected, back = scratch / "mesh.pmcd", scratch / "expected.ply", scratch / "back.ply"
    result = codec_bench(build, path, bits, effort, repeat, "--errors", "--write-packets", packets,
                         "--write-expected", expected, "--write-mesh", scratch / "mesh.ply")
    execute(build / "client/tool/pmctool", "decode", packets, back)
    # Without bits the last level has to be the file itself; with bits, its vertices snapped to the lattice.
    reference = path if bits == LOSSLESS else expected
    result["exact"] = execute(build / "client/tool/pmctool", "compare", reference, back, accepted=(0, 1))[1] == 0
    if result["file_bytes"] != packets.stat().st_size:
        sys.exit(f"{packets} has {packets.stat().st_size} bytes, not {result['file_bytes']}")
    return result


def _draco_seconds(text, what):
    match = re.search(rf"\((\d+) ms to {what}\)", text)
    if not match:
        sys.exit(f"draco does not say how long it took to {what}:\n{text}")
    return int(match[1]) / 1000


def measure_draco(bits, level, repeat, scratch):
    """The mesh that pmcd encoded, in its own order, as draco takes it: bare triangles and positions. Leaves what came
    back in draco.ply."""
    source, coded, back = scratch / "mesh.ply", scratch / "mesh.drc", scratch / "draco.ply"
    quantization = "0" if bits == LOSSLESS else bits
    encode, decode = [], []
    for _ in range(repeat):
        text, _ = execute("draco_encoder", "-i", source, "-o", coded, "-cl", level, "-qp", quantization)
        encode.append(_draco_seconds(text, "encode"))
        text, _ = execute("draco_decoder", "-i", coded, "-o", back)
        decode.append(_draco_seconds(text, "decode"))
    return {"bytes": coded.stat().st_size, "encode_seconds": statistics.median(encode),
            "decode_seconds": statistics.median(decode)}


def draco_error(build, scratch):
    """The RMS error of what measure_draco left, measured as that of pmcd's levels; None if it is no mesh for pmcd."""
    text, code = execute(build / "client/tool/pmctool", "compare", "--json", scratch / "mesh.ply", scratch / "draco.ply",
                         accepted=(0, 1, 3))
    if code == 3:
        return None
    return json.loads(text)["distance"]["a_to_b"]["rms"] if code else 0


def measure_xz(scratch):
    """The binary PLY of the mesh that pmcd encoded, positions and faces only, plain and as `xz -9e` packs it."""
    data = (scratch / "mesh.ply").read_bytes()
    packed = lzma.compress(data, preset=9 | lzma.PRESET_EXTREME)
    return {"ply_bytes": len(data), "xz_bytes": len(packed), "digits": _decimal_digits(data)}


def _decimal_digits(ply):
    """The fewest significant decimal digits that give back each float32 coordinate; None for double."""
    header, _, body = ply.partition(b"end_header\n")
    if b"property double x" in header:
        return None
    vertices = int(re.search(rb"element vertex (\d+)", header)[1])
    digits = 1
    for value, in struct.iter_unpack("<f", body[:12 * vertices]):
        while digits < 9 and struct.unpack("<f", struct.pack("<f", float(f"{value:.{digits}g}")))[0] != value:
            digits += 1
    return digits


def machine():
    info = pathlib.Path("/proc/cpuinfo").read_text(encoding="utf-8")
    model = re.search(r"model name\s*: (.*)", info)
    load = os.getloadavg()
    return (f"{datetime.date.today()}, {model[1] if model else platform.machine()}, {os.cpu_count()} cores, "
            f"load {load[0]:.1f} at the end")
