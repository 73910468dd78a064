#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""The worked example of docs/FORMAT.md: the coded part of a small base packet, read step by step.

usage: example.py FILE.pmcd FORMAT.md            is it the example that the document has?
       example.py --write FILE.pmcd FORMAT.md    puts it there, after the stream or the golden packets were changed
"""
import sys

import base_models
import stream
from check import check_level, read_base
from container import split_file

START, END = "```\n# coded: ", "\n```\n"


class Trace:
    """Lines of what was read, the decisions that it took, its value, and the state behind it."""

    def __init__(self):
        self.lines = []
        self.bits = []
        self.inside = 0

    def line(self, what, value, reader):
        self.lines.append(f"{what:36} {self.shortened():32} {value:>5}  {reader.range:016x} {reader.code:016x}".rstrip())
        self.bits = []

    def shortened(self):
        """Decisions, four and more of a kind as one with their count."""
        runs = []
        for bit in self.bits:
            if runs and runs[-1][0] == bit:
                runs[-1][1] += 1
            else:
                runs.append([bit, 1])
        return " ".join(f"{bit}*{count}" if count > 3 else " ".join([bit] * count) for bit, count in runs)

    def around(self, cls, name, describe):
        plain = getattr(cls, name)

        def read(model, reader, *arguments):
            self.inside += 1
            value = plain(model, reader, *arguments)
            self.inside -= 1
            self.line(describe(*arguments), value, reader)
            return value

        setattr(cls, name, read)

    def attach(self):
        plain_bit, plain_raw = stream.Reader.bit, stream.Reader.raw

        def bit(reader, model):
            value = plain_bit(reader, model)
            self.bits.append(str(value))
            return value

        def raw(reader, count):
            value = plain_raw(reader, count)
            if self.inside:
                if count:
                    self.bits.append(f"raw({count})={value}")
            else:
                self.line(f"raw({count})", value, reader)
            return value

        stream.Reader.bit, stream.Reader.raw = bit, raw
        self.around(stream.Unsigned, "read", lambda: "unsigned integer")
        self.around(base_models.NumberModel, "read", lambda e, s, most: f"number, e = {e:.6g}, s = {s:.6g}")
        self.around(base_models.OddsModel, "read", lambda odds: f"log odds {odds:.6g}")


def example(path):
    with open(path, "rb") as file:
        packet = split_file(file.read())[0]
    trace = Trace()
    plain = stream.Reader.__init__

    def start(reader, data):
        plain(reader, data)
        trace.lines.append(f"# coded: {data.hex(' ')}")
        trace.lines.append(f"# {'read':34} {'decisions':32} {'value':>5}  {'range':16} code")
        trace.line("start", "", reader)

    stream.Reader.__init__ = start
    trace.attach()
    state, reader = read_base(packet)
    check_level(state, reader, packet)
    for v, point in enumerate(state.mesh.points):
        trace.lines.append(f"# vertex {v}: point {' '.join(map(str, point))}")
    trace.lines.append("# faces: " + ", ".join(" ".join(map(str, face)) for face in state.mesh.faces))
    return "```\n" + "\n".join(trace.lines) + END


def main():
    arguments = [a for a in sys.argv[1:] if a != "--write"]
    if len(arguments) != 2:
        sys.exit(__doc__)
    wanted = example(arguments[0])
    with open(arguments[1], encoding="utf-8") as file:
        text = file.read()
    at = text.index(START)
    end = text.index(END, at) + len(END)
    if text[at:end] == wanted:
        return
    if "--write" not in sys.argv:
        sys.exit(f"{arguments[1]} has another example than {arguments[0]}; run this with --write")
    with open(arguments[1], "w", encoding="utf-8") as file:
        file.write(text[:at] + wanted + text[end:])


if __name__ == "__main__":
    main()
