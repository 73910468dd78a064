# SPDX-License-Identifier: GPL-3.0-or-later
"""The figures of bench/codec/run as Markdown tables. A run is one mesh at one number of bits with one effort."""

import statistics

from meshes import LIST, SCANS
from programs import LOSSLESS

ERROR_GOAL = 1e-3


def table(headings, rows):
    """A Markdown table; the first column is text, the others are figures."""
    lines = ["| " + " | ".join(headings) + " |", "| --- |" + " --: |" * (len(headings) - 1)]
    return "\n".join(lines + ["| " + " | ".join(row) + " |" for row in rows])


def packet_bytes(run):
    return sum(level["bytes"] for level in run["pmcd"]["levels"])


def ratio(run, to):
    """All packets to Draco's file ("draco10", "draco7") or to the packed PLY ("xz_bytes")."""
    return packet_bytes(run) / (run["xz"][to] if to in run["xz"] else run[to]["bytes"])


def bytes_to_error(run, goal=ERROR_GOAL):
    """Of all packets up to the first level whose RMS error is at most `goal`; None if there is none."""
    so_far = 0
    for level in run["pmcd"]["levels"]:
        so_far += level["bytes"]
        if level["error_rms"] is not None and level["error_rms"] <= goal:
            return so_far
    return None


def thousands_a_second(vertices, seconds):
    return f"{vertices / seconds / 1000:,.0f}" if seconds else "-"


def _mean(values):
    values = list(values)
    return f"{statistics.mean(values):.3f}" if values else "-"


def _worst(runs, to):
    run = max(runs, key=lambda each: ratio(each, to))
    return f"{ratio(run, to):.3f} {run['mesh']}"


def _how(run):
    return [run["bits"], run["effort"] or "-"]


def _groups(runs):
    """Runs that belong together, in the order in which they came: same group of meshes, bits and effort."""
    together = {}
    for run in runs:
        together.setdefault((run["group"], run["bits"], run["effort"]), []).append(run)
    return sorted(together.items(), key=lambda item: [*dict.fromkeys(run["group"] for run in runs)].index(item[0][0]))


def _most(runs, what):
    return f"{max(run['pmcd'][what] / run['pmcd']['vertices'] for run in runs):.0f}"


def _total_speed(runs, *what):
    return thousands_a_second(sum(run["pmcd"]["vertices"] for run in runs),
                              sum(run["pmcd"][each] for run in runs for each in what))


def summary_rows(runs):
    for (group, _, _), chosen in _groups(runs):
        scans = [run for run in chosen if group == LIST and run["mesh"] in SCANS]
        yield [group, *_how(chosen[0]), str(len(chosen)), _mean(ratio(run, "draco10") for run in chosen),
               _worst(chosen, "draco10"), _mean(ratio(run, "draco10") for run in scans),
               _mean(ratio(run, "draco7") for run in chosen),
               _mean(run["pmcd"]["file_bytes"] / run["draco10"]["bytes"] for run in chosen),
               f"{sum(run['pmcd']['exact'] for run in chosen)} of {len(chosen)}",
               _total_speed(chosen, "encode_cpu_seconds"),
               _total_speed(chosen, "encode_cpu_seconds", "prove_cpu_seconds"),
               _total_speed(chosen, "decode_cpu_seconds"),
               _most(chosen, "encode_and_prove_peak_bytes"), _most(chosen, "decode_peak_bytes")]


def rate_rows(runs):
    for run in runs:
        pmcd = run["pmcd"]
        share = pmcd["bits_per_vertex"]
        yield [run["mesh"], f"{pmcd['vertices']:,}", _genus(pmcd), *_how(run),
               *(f"{share[part]:.2f}" for part in ("base", "connectivity", "geometry", "precision", "exactness")),
               f"{share['isolated'] + share['headers']:.2f}", f"{share['total']:.2f}",
               f"{8 * run['draco10']['bytes'] / pmcd['vertices']:.2f}", f"{packet_bytes(run):,}",
               f"{pmcd['file_bytes']:,}", f"{run['draco10']['bytes']:,}", f"{run['draco7']['bytes']:,}",
               f"{ratio(run, 'draco10'):.3f}", f"{ratio(run, 'draco7'):.3f}", "yes" if pmcd["exact"] else "NO"]


def _genus(pmcd):
    """The sum over the components of a closed mesh; "-" with boundary, where vertices and faces do not tell."""
    if pmcd["boundary_edges"]:
        return "-"
    euler = pmcd["vertices"] - pmcd["isolated_vertices"] - pmcd["faces"] // 2
    return str(pmcd["components"] - euler // 2)


def level_rows(runs):
    for run in runs:
        levels = run["pmcd"]["levels"]
        reached = bytes_to_error(run)
        yield [run["mesh"], *_how(run), str(len(levels)), f"{levels[0]['bytes']:,}", f"{levels[0]['vertices']:,}",
               _error(levels[0]["error_rms"]), f"{reached:,}" if reached is not None else "-",
               f"{100 * reached / packet_bytes(run):.1f} %" if reached is not None else "-",
               _error(levels[-1]["error_rms"]), _error(levels[-1]["error_max"]),
               _error(run["draco10"]["error_rms"])]


def _error(value):
    return "-" if value is None else "0" if value == 0 else f"{value:.2e}"


def lossless_rows(runs):
    for run in runs:
        xz = run["xz"]
        yield [run["mesh"], run["effort"] or "-", str(xz["digits"] or "double"), f"{xz['ply_bytes']:,}",
               f"{xz['xz_bytes']:,}", f"{run['draco10']['bytes']:,}", f"{packet_bytes(run):,}",
               f"{run['pmcd']['file_bytes']:,}", f"{ratio(run, 'xz_bytes'):.3f}", f"{ratio(run, 'draco10'):.3f}"]


def lossless_summary_rows(runs):
    for (group, _, effort), chosen in _groups(runs):
        for name, part in (("decimals of up to 6 digits", [r for r in chosen if (r["xz"]["digits"] or 99) <= 6]),
                           ("elsewhere", [r for r in chosen if (r["xz"]["digits"] or 99) > 6])):
            if part:
                yield [f"{group}, {name}", effort or "-", str(len(part)),
                       _mean(ratio(run, "xz_bytes") for run in part), _worst(part, "xz_bytes"),
                       _mean(ratio(run, "draco10") for run in part), _worst(part, "draco10")]


def speed_rows(runs):
    for run in runs:
        pmcd, vertices = run["pmcd"], run["pmcd"]["vertices"]
        yield [run["mesh"], *_how(run), f"{pmcd['encode_cpu_seconds']:.3f}",
               thousands_a_second(vertices, pmcd["encode_cpu_seconds"]), f"{pmcd['prove_cpu_seconds']:.3f}",
               thousands_a_second(vertices, pmcd["encode_cpu_seconds"] + pmcd["prove_cpu_seconds"]),
               f"{pmcd['decode_cpu_seconds']:.3f}", thousands_a_second(vertices, pmcd["decode_cpu_seconds"]),
               f"{pmcd['encode_and_prove_peak_bytes'] / vertices:.0f}", f"{pmcd['decode_peak_bytes'] / vertices:.0f}",
               *(thousands_a_second(vertices, run[draco][what]) for draco in ("draco10", "draco7")
                 for what in ("encode_seconds", "decode_seconds"))]


def report(runs, repeat, machine):
    text = f"""Measured by `bench/codec/run` on {machine}.

## In short

{table(["meshes", "bits", "effort", "count", "ratio, mean", "ratio, worst", "scans, mean", "to -cl 7, mean",
        "file, mean", "exact", "encode kV/s", "encode, prove kV/s", "decode kV/s", "encode, prove B/v, most",
        "decode B/v, most"],
       summary_rows(runs))}

Ratio: bytes of all packets / bytes of `draco_encoder -cl 10 -qp BITS` (`-qp 0` for lossless); its mean is over meshes,
each with the same weight. Scans: {", ".join(SCANS)}.
File: the same with the whole .pmcd file, directory included. Speed is all vertices over all seconds. Effort -: none was
asked for, the encoder's default.

## Rate

{table(["mesh", "vertices", "genus", "bits", "effort", "base", "connectivity", "geometry", "precision", "exactness",
        "rest", "pmcd bpv", "Draco bpv", "packets B", ".pmcd file B", "Draco -cl 10 B", "Draco -cl 7 B", "ratio",
        "to -cl 7", "exact"], rate_rows(runs))}

bpv: bits of all packets (of Draco's whole file) a vertex of the mesh as imported; the parts are bpv too. Rest: isolated
vertices and headers of packets. Exact: pmctool decoded the file to the original (with bits: to the original snapped to
the lattice). Draco merges vertices at equal positions and leaves out isolated ones.

## Levels

{table(["mesh", "bits", "effort", "packets", "first packet B", "its vertices", "its RMS",
        f"B to RMS {ERROR_GOAL:g}", "of all", "last RMS", "last max", "Draco RMS"], level_rows(runs))}

Errors are distances from original vertices to the level's surface, relative to the diagonal of the bounding box. B to
RMS: all packets up to the first level at or below it; nothing is interpolated. Draco's error is measured in the same way.
"""
    lossless = [run for run in runs if run["bits"] == LOSSLESS]
    if lossless:
        text += f"""
## Lossless

{table(["meshes", "effort", "count", "to xz, mean", "to xz, worst", "to Draco, mean", "to Draco, worst"],
       lossless_summary_rows(lossless))}

{table(["mesh", "effort", "digits", "binary PLY B", "xz -9e B", "Draco -qp 0 B", "packets B", ".pmcd file B", "to xz",
        "to Draco"], lossless_rows(lossless))}

The PLY holds positions and faces only. Digits: the fewest significant decimal digits that give back each coordinate.
"""
    return text + f"""
## Speed and memory

{table(["mesh", "bits", "effort", "encode s", "encode kV/s", "prove s", "encode, prove kV/s", "decode s", "decode kV/s",
        "encode, prove B/v", "decode B/v", "-cl 10 encode kV/s", "-cl 10 decode kV/s", "-cl 7 encode kV/s",
        "-cl 7 decode kV/s"], speed_rows(runs))}

kV/s: thousand vertices a second. pmcd: CPU time of the codec alone on one core, median of {repeat}. Encoding is planning
and writing, as it is for Draco; proving, which pmcd never leaves out and Draco does not do, is decoding all levels and
comparing the last one with the mesh, without the errors of levels. "Encode, prove" is both, one after the other: what a
mesh costs before it is stored. Decoding is all levels and one copy of the last mesh. Draco: the milliseconds that its
tools print for the codec alone, median of {repeat}. B/v: the codec's peak of resident memory a vertex, output included,
above what was there before; for encoding and proving the input mesh is counted too.
"""
