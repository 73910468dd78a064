#!/usr/bin/python3
# SPDX-License-Identifier: MIT
"""Fits the networks that decide whether a gate's face stays (codec/conquest/symbol_network.h) to gates that dump_gates
wrote, and writes them into codec/conquest/symbol_weights.cpp. The patches' numbers there are kept.

usage: train.py GATES SYMBOL_WEIGHTS_CPP [STEPS]
"""
import pathlib
import sys

import numpy as np

INPUTS, UNITS, GATE, CORNERS, STATES, PARENTS = 32, 8, 13, 600, 64, 29
SCALE = 1024
GATES = np.dtype([("kind", "u1"), ("null", "u1"), ("state", "u1"), ("parent", "u1"), ("corner", "<u2", 5),
                  ("input", "<f4", INPUTS), ("weight", "<f4")])


def gate_features():
    """What a unit sees of each state and of each parent."""
    of_state = np.zeros((STATES, GATE), np.float32)
    for s in range(STATES):
        front, beside, tags = s // 16, s // 4 % 4, s % 4
        of_state[s, :7] = front > 0, front == 2, front == 3, beside % 2, beside // 2, tags % 2, tags // 2
    of_parent = np.zeros((PARENTS, GATE), np.float32)
    for p in range(PARENTS):
        symbol = 0 if p < 2 else 1 + (p - 2) // 5 if p < 22 else 5
        if symbol < 5:
            of_parent[p, 7 + symbol] = 1
        of_parent[p, 12] = 0.3 * (p if p < 2 else (p - 2) % 5)
    return of_state, of_parent


OF_STATE, OF_PARENT = gate_features()


def fit(gates, steps, rng):
    weights = {
        "hidden": rng.normal(0, 0.3, (INPUTS, UNITS)), "gate": rng.normal(0, 0.3, (GATE, UNITS)),
        "bias": np.zeros(UNITS), "output": rng.normal(0, 0.3, UNITS), "linear": np.zeros(INPUTS),
        "corner": np.zeros(CORNERS + 1), "state": np.zeros(STATES), "parent": np.zeros(PARENTS)}
    weights = {k: v.astype(np.float32) for k, v in weights.items()}
    moments = {k: (np.zeros_like(v), np.zeros_like(v)) for k, v in weights.items()}
    batch, count, step = 1024, len(gates), 0
    loss_sum, loss_count = 0.0, 0
    while True:
        order = rng.permutation(count)
        for at in range(0, count - batch + 1, batch):
            done = step / steps
            if done >= 1:
                weights["corner"][CORNERS] = 0
                return weights
            g = gates[order[at:at + batch]]
            x = g["input"]
            f = OF_STATE[g["state"]] + OF_PARENT[g["parent"]]
            unit = np.maximum(x @ weights["hidden"] + f @ weights["gate"] + weights["bias"], 0)
            score = (unit @ weights["output"] + x @ weights["linear"] + weights["corner"][g["corner"]].sum(1)
                     + weights["state"][g["state"]] + weights["parent"][g["parent"]])
            share = 1 / (1 + np.exp2(-np.clip(score, -30, 30)))
            truth = g["null"].astype(np.float32)
            loss_sum -= float((g["weight"] * np.log2(np.maximum(np.where(truth > 0, share, 1 - share), 1e-9))).sum())
            loss_count += float(g["weight"].sum())
            error = (g["weight"] * (share - truth) / batch).astype(np.float32)
            back = error[:, None] * weights["output"] * (unit > 0)
            slope = {
                "hidden": x.T @ back, "gate": f.T @ back, "bias": back.sum(0), "output": unit.T @ error,
                "linear": x.T @ error,
                "corner": np.bincount(g["corner"].ravel(), np.repeat(error, 5), CORNERS + 1),
                "state": np.bincount(g["state"], error, STATES), "parent": np.bincount(g["parent"], error, PARENTS)}
            slope["corner"][CORNERS] = 0
            step += 1
            rate = 0.004 * (1 - done) + 0.00005
            fix = (1 - 0.999 ** step) ** 0.5 / (1 - 0.9 ** step)
            for k, w in weights.items():
                first, second = moments[k]
                d = slope[k].astype(np.float32)
                first += 0.1 * (d - first)
                second += 0.001 * (d * d - second)
                w -= rate * (fix * first / (np.sqrt(second) + 1e-8) + 1e-4 * w)
        print(f"  {step} steps, {loss_sum / loss_count:.4f} bits a gate", flush=True)
        loss_sum, loss_count = 0.0, 0


def braces(array):
    if array.ndim == 1:
        return "{{" + ", ".join(str(int(x)) for x in array) + "}}"
    return "{{" + ",\n".join(braces(row) for row in array) + "}}"


def text_of(weights):
    parts = []
    for name in ("hidden", "gate", "bias", "output", "linear", "corner", "state", "parent"):
        stored = np.clip(np.round(weights[name] * SCALE), -32767, 32767).astype(int)
        parts.append(f"// {name}\n" + braces(stored[:CORNERS] if name == "corner" else stored))
    return "{" + ",\n".join(parts) + "}"


def main():
    gates = np.fromfile(sys.argv[1], GATES)
    path = pathlib.Path(sys.argv[2])
    steps = int(sys.argv[3]) if len(sys.argv) > 3 else 60000
    rng = np.random.default_rng(1)
    networks = []
    for kind in (0, 1):
        chosen = gates[gates["kind"] == kind]
        print(f"kind {kind}: {len(chosen)} gates")
        networks.append(text_of(fit(chosen, steps, rng)))
    text = path.read_text(encoding="utf-8")
    head = text[:text.index("    // face\n")]
    path.write_text(head + "    // face\n{{" + ",\n".join(networks) + "}}\n};\n\n}  // namespace pmcd::codec\n", encoding="utf-8")


main()
