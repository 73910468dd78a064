# SPDX-License-Identifier: MIT
"""The report of a run as Markdown: what was done, a table for each experiment, and verdicts. It measures nothing."""

import bounds
import network
import verdicts

_MODES = {"paper": "paper", "ours": "ours"}


def _show(value, digits=2):
    return "-" if value is None else f"{value:.{digits}f}"


def _table(headings, rows):
    lines = ["| " + " | ".join(headings) + " |", "| --- |" + " --: |" * (len(headings) - 1)]
    return "\n".join(lines + ["| " + " | ".join(row) + " |" for row in rows])


def _parameters(results):
    parameters = results["parameters"]
    delays = "at every scale" if parameters["delay_scale"] == 1 else f"divided by {parameters['delay_scale']:g}"
    repeats = "one run" if parameters["repeat"] == 1 else f"medians of {parameters['repeat']} runs"
    rows = [[f"{line.name}", f"{line.down_kbit:g} / {line.up_kbit:g}",
             f"{line.down_kbit * parameters['scale']:g} / {line.up_kbit * parameters['scale']:g}",
             f"{line.delay_ms / parameters['delay_scale']:g}", f"{line.queue_bytes:,}"]
            for line in (network.MODEM, network.DSL_1024, network.DSL_2048)]
    rows.append(["server's uplink", f"{network.UPLINK_KBIT} up", f"{parameters['uplink_kbit']:g} up", "0",
                 f"{network.UPLINK_QUEUE_BYTES:,}"])
    return f"""Scale {parameters['scale']:g}: all speeds times that, delays {delays}. {repeats.capitalize()} a cell, \
{parameters['jobs']} cells at a time; seed {parameters['seed']}; congestion control {parameters['congestion']}.

{_table(["line", "kbit/s down / up", "at this scale", "delay one way, ms", "queue, bytes"], rows)}

Paper mode: one slot, no quantum, one request open per client. Our mode: `{parameters['ours']}`, up to four requests \
open. Each cell is a \
fresh daemon in a network of its own: server, router and clients are network namespaces, rates are the kernel's tbf, \
delays rules_relay's.
"""


def _meshes(results):
    def packet(figure, levels):
        return f"{bounds.packet_of(figure, levels)}{'' if bounds.reached(figure, levels) else '*'}"

    rows = []
    for name, mesh in results["meshes"].items():
        sizes = [level["bytes"] for level in mesh["levels"]]
        rows.append([name, mesh["file"], str(len(sizes)), f"{sum(sizes):,}", ", ".join(f"{size:,}" for size in sizes),
                     " ".join(packet(figure, mesh["levels"]) for figure in bounds.FIGURES)])
    return f"""## Meshes

{_table(["mesh", "file", "packets", "bytes", "bytes of each", f"packet that brings {', '.join(bounds.FIGURES)}"], rows)}

Encoded bit for bit. An error with a star is reached by no level: then the end counts.
"""


def _five(values):
    return " / ".join(_show(value) for value in values)


def _experiment(figures, key, chart):
    experiment = figures.experiments[key]
    clients = figures.group(key, "all")
    crowd = len(clients) > 6
    groups = {}
    if crowd:
        for client in sorted(clients, key=lambda one: one.line.down_kbit):
            groups.setdefault(f"{client.line.name}, mean of ", []).append(client)
        groups = {f"{name}{len(members)}": members for name, members in groups.items()}
    else:
        groups = {f"{client.number}: {client.line.name}, {client.mesh}": [client] for client in clients}

    def mean_of(values):
        return sum(values) / len(values) if None not in values else None

    rows = [["bound of each", ""]
            + [_five([mean_of([figures.bound(client, figure) for client in members]) for figure in bounds.FIGURES])
               for members in groups.values()]
            + [_five([mean_of([figures.bound(client, figure) for client in clients]) for figure in bounds.FIGURES])]]
    shared = [figures.mean_bound(key, figure) for figure in bounds.FIGURES]
    rows.append(["bound of the mean", ""] + [""] * len(groups) + [_five([value for value, _ in shared])])
    for rule, mode in figures.rows(key):
        row = [rule, _MODES[mode]]
        for members in groups.values():
            row.append(_five([mean_of([figures.time(key, rule, mode, client, figure) for client in members])
                              for figure in bounds.FIGURES]))
        rows.append(row + [_five([figures.mean(key, rule, mode, figure) for figure in bounds.FIGURES])])
    binding = [figure for figure, (_, binds) in zip(bounds.FIGURES, shared) if binds]
    text = f"""## Experiment {key}: {experiment.title}

{_table(["rule", "mode", *groups, "mean"], rows)}

Seconds from a client's start to {' / '.join(bounds.FIGURES)}. \
All that they fetch takes the uplink {bounds.together(clients, figures.uplink_kbit, figures.meshes):.2f} s. \
{'The shared uplink binds the mean of: ' + ', '.join(binding) + '.' if binding else 'The shared uplink binds no mean.'}
"""
    if chart:
        text += f"\n![time to 5 % and to the end]({chart})\n"
    if crowd and chart:
        for figure in ("5 %", "end"):
            rows = [["bound", ""] + [_show(figures.bound(client, figure)) for client in clients]]
            rows += [[rule, _MODES[mode]] + [_show(time) for time in figures.times(key, rule, mode, figure)]
                     for rule, mode in figures.rows(key)]
            names = [f"{client.number}: {client.line.name}, {client.mesh}, at {client.arrival:.1f} s"
                     for client in clients]
            text += f"\nTo {figure}, each client:\n\n{_table(['rule', 'mode', *names], rows)}\n"
    return text


def _says(verdict):
    return {True: "**yes**", False: "**no**", None: "no figure"}[verdict.holds]


def _verdicts(figures):
    text = "## Expected, and what came out\n"
    if figures.rules("paper"):
        rows = [[verdict.text, _says(verdict), verdict.numbers] for verdict in verdicts.paper(figures)]
        text += f"\nPaper mode:\n\n{_table(['expected', 'holds', 'figures'], rows)}\n"
    table = verdicts.ours(figures)
    if not table:
        return text
    shown = [name for name in verdicts.LIMITS if any(row[name] is not None for row in table.values())]
    if shown:
        rows = [["at most", *[f"{verdicts.LIMITS[name]:g}" for name in shown]]]
        for rule, row in table.items():
            rows.append([rule, *[_show(row[name]) if row[name] is None or row[name] <= verdicts.LIMITS[name]
                                 else f"**{row[name]:.2f}**" for name in shown]])
        text += f"""
Our mode, each rule; over the limit in bold:

{_table(["rule", *shown], rows)}

*5 %*: mean time to 5 % error of all clients, against fcsf in paper mode. *fast end*: mean end of all clients but the
modems, against the bound of their mean. *last end*: the longest time that a client took, against that of fifo in paper
mode. *stall*: mean end of the others when one stalls, against that when it leaves at the same packet.
"""
    rule = verdicts.best(table)
    if rule:
        rows = [[verdict.text, _says(verdict), verdict.numbers] for verdict in verdicts.expected(table, rule)]
        text += f"""
Best of these rules, by how many limits it keeps: **{rule}**. Chance has a part in it: in one run of eight daemons that
were the same, means differed by up to 3 % in experiments 1 to 3 (5 % error of experiment 2: 11 %) and 9 % in experiment
4, and the stall's ratio was 1.02 to 1.07; cells beside which a load ran are left out of that. Rules that differ by less
are not told apart by one run; here a cell had {figures.results['parameters']['repeat']}.

"""
        text += _table(["expected", "holds", "figures"], rows) + "\n"
    return text


def _notes(figures):
    lines = [f"- experiment {key}, {rule}, {_MODES[mode]} mode: client {number} was faster than its bound for "
             f"{figure}: {time:.3f} s, bound {bound:.3f} s"
             for key, rule, mode, number, figure, time, bound in figures.beaten()]
    lines += [f"- experiment {key}, {rule}, {_MODES[mode]} mode: client {number} did not end: {why}"
              for key, rule, mode, number, why in figures.dropped()]
    # A run by itself keeps well below one.
    busy = [f"{cell['experiment']} {cell['rule']} {_MODES[cell['mode']]}" for cell in figures.results["cells"]
            if cell.get("load", 0) > figures.results["parameters"]["jobs"]]
    if busy:
        lines.append(f"- something else ran on the machine, which disturbs the times: {', '.join(busy)}")
    return "## What went wrong\n\n" + "\n".join(lines) + "\n" if lines else ""


def shaping_table(rows):
    return _table(["line", "nominal kbit/s", "less headers", "TCP goodput", "of it", "round trip, ms", "at least"],
                  [[row["what"], f"{row['nominal_kbit']:g}", _show(row["expected_kbit"], 1),
                    _show(row["goodput_kbit"], 1), f"{100 * row['goodput_kbit'] / row['expected_kbit']:.1f} %",
                    _show(row["round_trip_ms"], 1), _show(row["least_round_trip_ms"], 1)] for row in rows])


def write(figures, charts):
    """`charts`: experiment to the file name of its chart."""
    results = figures.results
    parts = [f"# Distribution rules on real links\n\nMeasured by `bench/rules/run` on {results['machine']}; "
             f"{results['version']}, commit {results['commit']}.\n", _parameters(results), _meshes(results)]
    if results.get("shaping"):
        parts.append(f"## Shaping\n\nEach line alone, without pmcd:\n\n{shaping_table(results['shaping'])}\n")
    parts += [_experiment(figures, key, charts.get(key)) for key in figures.experiments]
    parts.append(f"""## Bounds

A client's bound: {bounds.DELAYS_TO_REQUEST + 1} one-way delays (connect, hello, connect, join and request wait for
each other), then the bytes of the data channel up to that packet, in the fewest frames, at the rate of the client's
line or of the uplink, whichever is slower. Each {network.SEGMENT_BYTES} bytes have {network.HEADER_BYTES} of IP and TCP
before them, on the uplink also {network.ETHERNET_BYTES} of Ethernet; what tbf lets through at once is taken off.

The bound of the mean is at least as strict: the k-th client to be ready cannot be so before the k-th of these bounds,
nor before the k-th on an uplink that serves the shortest rest first.
""")
    parts += [_verdicts(figures), _notes(figures)]
    return "\n".join(part for part in parts if part)
