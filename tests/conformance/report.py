# SPDX-License-Identifier: MIT
"""Runs checks and tells the results: by mark, by code, and as JSON."""

import dataclasses
import re
import time
import traceback

import wire
from session import Failed
from suite import NotTried

PASSED, FAILED, NOT_TRIED = "passed", "failed", "not tried"

# Every mark of docs/PROTOCOL.md that no check of a server can declare, and why.
ELSEWHERE = {
    "V-5": "a client's duty: scenarios of mock_server.py",
}
# Which group has to meet which codes when nothing is left untried; together they are all.
MET_BY_GROUP = {
    "frames": ("unsupported_version", "bad_magic", "frame_too_long", "malformed", "unknown_type", "bad_name", "unknown_mesh"),
    "session": ("wrong_state", "bad_token", "channel_lost", "not_joined"),
    "requests": ("duplicate_id", "too_many_requests", "unknown_handle", "bad_range"),
    "handles": (),
    "cancel": (),
    "list": ("internal_error",),
    "changes": ("unavailable", "mesh_changed"),
    "time": ("hello_timeout", "join_timeout", "too_many_sessions", "shutting_down", "stalled"),
    "admin": ("mesh_exists", "bad_directory", "bad_packet", "ingest_incomplete", "too_large", "storage_failed", "bad_rule",
              "bad_option", "version_changed", "unknown_client", "unknown_change"),
}


@dataclasses.dataclass
class Result:
    check: object
    outcome: str
    text: str
    seconds: float


def run(check, context):
    began = time.monotonic()
    context.running = check.name
    outcome, text = PASSED, ""
    try:
        check.function(context)
    except NotTried as why:
        outcome, text = NOT_TRIED, str(why)
    except Failed as wrong:
        outcome, text = FAILED, str(wrong)
    except Exception:  # the suite's own fault, or a server that cannot be reached: told, and the rest goes on
        outcome, text = FAILED, traceback.format_exc(limit=-3)
    return Result(check, outcome, text, time.monotonic() - began)


def _order(mark):
    letter, number = mark.split("-")
    return "FSVHNRKTLWEA".index(letter), int(number)


def by_mark(results):
    """{mark: (outcome, [texts])}, in the document's order: failed if one check failed, passed if one passed."""
    found = {}
    for mark in sorted({mark for result in results for mark in result.check.marks}, key=_order):
        mine = [result for result in results if mark in result.check.marks]
        outcomes = {result.outcome for result in mine}
        outcome = FAILED if FAILED in outcomes else PASSED if PASSED in outcomes else NOT_TRIED
        found[mark] = (outcome, [f"{r.check.name}: {r.text}" for r in mine if r.outcome == outcome and r.text],
                       sum(r.outcome == outcome for r in mine))
    return found


def tell(results, met):
    """Prints a line per mark, what went wrong, and the table of codes."""
    for mark, (outcome, texts, count) in by_mark(results).items():
        names = ", ".join(text.partition(":")[0] for text in texts)
        print(f"{mark:5} {outcome}: " + (f"{count} check{'s' * (count != 1)}" if outcome == PASSED else names))
    for mark, why in ELSEWHERE.items():
        print(f"{mark:5} {NOT_TRIED}: {why}")
    for result in results:
        if result.outcome != PASSED:
            text = re.sub(r"\n", "\n    ", result.text.strip())
            print(f"\n{result.check.name} ({', '.join(result.check.marks)}) {result.outcome}:\n    {text}")
    print("\ncode                      met by")
    for name, number in wire.CODES.items():
        checks = sorted(met.get(number, ()))
        told = ", ".join(checks[:3]) + (f" and {len(checks) - 3} more" if len(checks) > 3 else "")
        print(f"{number:3} {name:21} {told or '-'}")
    count = {outcome: sum(r.outcome == outcome for r in results) for outcome in (PASSED, FAILED, NOT_TRIED)}
    print(f"\n{len(results)} checks: " + ", ".join(f"{number} {outcome}" for outcome, number in count.items()))


def as_json(results, met):
    return {
        "marks": {mark: {"outcome": outcome, "texts": texts} for mark, (outcome, texts, _) in by_mark(results).items()},
        "checks": [{"name": r.check.name, "group": r.check.group, "marks": r.check.marks, "outcome": r.outcome,
                    "text": r.text, "seconds": round(r.seconds, 3)} for r in results],
        "codes": {name: sorted(met.get(number, ())) for name, number in wire.CODES.items()},
    }
