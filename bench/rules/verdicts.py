# SPDX-License-Identifier: MIT
"""What was expected of the rules, judged by the figures of a run. A sentence holds, does not hold, or has no figure;
the numbers stand beside it."""

import dataclasses

_DRAGGED = 0.8    # of the slowest client's time: the others are dragged along
_OWN_SPEED = 2    # times the bound: a client has its speed
_FAVOURED = 0.9   # times as long as under fifo: more than one run differs from another


@dataclasses.dataclass
class Verdict:
    text: str
    holds: bool | None  # None: not measured, or a client did not end
    numbers: str


def _ratio(over, under):
    return over / under if over is not None and under else None


def _judged(text, values, holds):
    """`values`: what to print, name to figure; not measured if there is none, not held if one is missing."""
    present = {name: value for name, value in values.items() if value is not None}
    numbers = ", ".join(f"{name} {value:.2f}" for name, value in present.items())
    missing = [name for name, value in values.items() if value is None]
    if missing:
        numbers += f"{'; ' if numbers else ''}no figure for {', '.join(missing)}"
    return Verdict(text, None if missing else holds(values), numbers)


def paper(figures):
    """The paper's findings, in paper mode."""
    def named(name):
        return next((rule for rule in figures.rules("paper") if rule.split("+")[0] == name), name)

    fifo, lcfs, spf, fcsf = (named(name) for name in ("fifo", "lcfs", "spf", "fcsf"))

    def dragged(rule):
        slow = figures.last("1", rule, "paper") if "1" in figures.experiments else None
        fast = figures.mean("1", rule, "paper", "end", "fast") if slow else None
        return _ratio(fast, slow)

    def small(rule, key):
        if key not in figures.experiments:
            return None
        client = min(figures.group(key, "all"),
                     key=lambda one: sum(level["bytes"] for level in figures.meshes[one.mesh]))
        return _ratio(figures.time(key, rule, "paper", client, "end"), figures.bound(client, "end"))

    def fast(rule, key):
        if key not in figures.experiments:
            return None
        return _ratio(figures.mean(key, rule, "paper", "end", "fast"), figures.mean_bound(key, "end", "fast")[0])

    yield _judged(f"fifo and lcfs drag all clients to the slowest one's time (experiment 1: the fast clients' mean end "
                  f"is at least {_DRAGGED:.0%} of the last one's)",
                  {"fifo": dragged(fifo), "lcfs": dragged(lcfs)}, lambda v: min(v.values()) >= _DRAGGED)
    yield _judged(f"spf favours the small mesh (experiments 2 and 3: its end in bounds is at most {_FAVOURED:g} times "
                  "that under fifo)",
                  {f"{name}, experiment {key}": small(rule, key) for key in ("2", "3")
                   for name, rule in (("spf", spf), ("fifo", fifo))},
                  lambda v: all(v[f"spf, experiment {key}"] <= _FAVOURED * v[f"fifo, experiment {key}"]
                                for key in ("2", "3")))
    yield _judged(f"fcsf gives the fast clients their speed (experiments 1 and 2: their mean end is at most "
                  f"{_OWN_SPEED:g} times its bound)",
                  {f"{name}, experiment {key}": fast(rule, key) for key in ("1", "2")
                   for name, rule in (("fcsf", fcsf), ("fifo", fifo))},
                  lambda v: max(v["fcsf, experiment 1"], v["fcsf, experiment 2"]) <= _OWN_SPEED)


# What is expected of a rule in our mode: heading, the most that the ratio may be.
LIMITS = ({f"5 %, exp. {key}": 0.5 for key in "124"} | {f"fast end, exp. {key}": 1.15 for key in "1234"}
          | {f"last end, exp. {key}": 1.1 for key in "1234"} | {"stall": 1.05})
EXPECTATIONS = [
    ("mean time to 5 % error over all clients, against fcsf in paper mode, is halved in experiments 1, 2 and 4", "5 %"),
    ("mean completion of the fast clients is within 15 % of the bound", "fast end"),
    ("the slowest client ends no later than under fifo in paper mode plus 10 %", "last end"),
    ("a stalled client costs the others under 5 %", "stall"),
]


def ours(figures):
    """For each rule in our mode its ratio for each of LIMITS, None where it was not measured. The stall's: the others'
    mean end when one stalls, against that when the same one leaves."""
    table = {}
    fcsf = next((rule for rule in figures.rules("paper") if rule.split("+")[0] == "fcsf"), "fcsf")
    for rule in figures.rules("ours"):
        row = dict.fromkeys(LIMITS)
        for key in figures.experiments:
            if key == "4-left":
                continue
            if f"5 %, exp. {key}" in row:
                row[f"5 %, exp. {key}"] = _ratio(figures.mean(key, rule, "ours", "5 %"),
                                                 figures.mean(key, fcsf, "paper", "5 %"))
            row[f"fast end, exp. {key}"] = _ratio(figures.mean(key, rule, "ours", "end", "fast"),
                                                  figures.mean_bound(key, "end", "fast")[0])
            row[f"last end, exp. {key}"] = _ratio(figures.last(key, rule, "ours"), figures.last(key, "fifo", "paper"))
        if "4-left" in figures.experiments:
            row["stall"] = _ratio(figures.mean("4", rule, "ours", "end"), figures.mean("4-left", rule, "ours", "end"))
        table[rule] = row
    return table


def best(table):
    """The rule that meets most of the limits; of several the one with the least sum of ratios to their limits. None if
    nothing was measured."""
    def worth(row):
        measured = {name: ratio / LIMITS[name] for name, ratio in row.items() if ratio is not None}
        return sum(share <= 1 for share in measured.values()), -sum(measured.values())

    rules = [rule for rule, row in table.items() if any(ratio is not None for ratio in row.values())]
    return max(rules, key=lambda rule: worth(table[rule])) if rules else None


def expected(table, rule):
    """The four expectations, judged for one rule."""
    for text, kind in EXPECTATIONS:
        row = {name: ratio for name, ratio in table[rule].items() if name.startswith(kind)}
        yield _judged(text, row, lambda v: all(ratio <= LIMITS[name] for name, ratio in v.items()))
