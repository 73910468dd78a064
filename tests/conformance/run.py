#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Tests a server at HOST:PORT against the statements of docs/PROTOCOL.md, with nothing but the Python standard library.

Exit codes: 0 every check that was tried passed, 1 a check failed, 2 wrong usage or no server there.
"""

import argparse
import importlib
import json
import sys

import packets
import report
import suite
from session import Failed, Session

GROUPS = ("frames", "session", "requests", "handles", "cancel", "list", "changes", "time", "admin")


def load_checks():
    for group in GROUPS:
        importlib.import_module(f"check_{group}")
    return suite.ALL


def address_of(text):
    host, _, port = text.rpartition(":")
    if not host or not port.isdigit():
        raise argparse.ArgumentTypeError(f"{text} is not HOST:PORT")
    return host.strip("[]"), int(port)


def arguments(argv):
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("server", type=address_of, metavar="HOST:PORT", help="the request channel")
    parser.add_argument("--mesh", required=True, metavar="NAME", help="a mesh that the server holds")
    parser.add_argument("--packets", metavar="FILE.pmcd", help="what `pmctool encode` wrote for it")
    parser.add_argument("--second-mesh", metavar="NAME", help="another one")
    parser.add_argument("--second-packets", metavar="FILE.pmcd")
    parser.add_argument("--big-mesh", metavar="NAME", help="one whose first packet has 16 MiB or more, to cancel")
    parser.add_argument("--big-packets", metavar="FILE.pmcd")
    parser.add_argument("--admin-socket", metavar="FILE", help="Unix socket of the admin channel")
    parser.add_argument("--group", action="append", choices=GROUPS, help="only these checks")
    parser.add_argument("--only", action="append", metavar="MARK", help="only checks of this statement, such as R-10")
    parser.add_argument("--check", action="append", metavar="NAME", help="only this check")
    parser.add_argument("--slow", action="store_true", help="also the checks that wait for half a minute or longer")
    parser.add_argument("--json", action="store_true", help="the results as one JSON document")
    return parser.parse_args(argv)


def _mesh(name, path):
    return suite.Mesh(name, packets.PacketFile.load(path) if path else None) if name else None


def run_checks(context, groups=None, marks=None, names=None):
    """Results of the chosen checks against `context`."""
    chosen = [check for check in load_checks()
              if (not groups or check.group in groups) and (not marks or set(marks) & set(check.marks))
              and (not names or check.name in names)]
    return [report.run(check, context) for check in chosen]


def main(argv):
    options = arguments(argv)
    try:
        context = suite.Context(options.server, _mesh(options.mesh, options.packets),
                                _mesh(options.second_mesh, options.second_packets),
                                _mesh(options.big_mesh, options.big_packets), admin_socket=options.admin_socket,
                                seconds=120 if options.slow else 20)
        Session(options.server).close()
    except (OSError, packets.BadFile, Failed) as wrong:
        print(f"run.py: {wrong}", file=sys.stderr)
        return 2
    results = run_checks(context, options.group, options.only, options.check)
    if not results:
        print("run.py: there is no such check", file=sys.stderr)
        return 2
    if options.json:
        print(json.dumps(report.as_json(results, context.met), indent=1))
    else:
        report.tell(results, context.met)
    return 1 if any(result.outcome == report.FAILED for result in results) else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
