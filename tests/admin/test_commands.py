# SPDX-License-Identifier: GPL-3.0-or-later
"""pmcctl's commands about rule, queue and clients: what they send, print and answer as exit code, and which arguments
they refuse before any daemon is asked. The lines themselves are tested in tests/admin/*_test.cpp.
"""

import json
import unittest

from played_daemon import PlayedDaemon, Refusal, fields_of, pmcctl

DONE, USAGE, REFUSED = 0, 2, 4

_BEFORE = {"rule": "fifo", "text": "fifo slots=1", "version": 3}
_AFTER = {"rule": "fcsf", "text": "fcsf burst=2 slots=1", "version": 4}
_CHANGE = {"changed": True, "dry_run": False, "warnings": [], "before": _BEFORE, "after": _AFTER}

# command line: message, its fields, an answer, a line that is printed
_COMMANDS = [
    ("rules", "admin_rules", {}, {"rules": [{"name": "fifo", "summary": "First come."}]}, "fifo  First come."),
    ("rule", "admin_rule", {}, _AFTER, "version  4"),
    ("history", "admin_history", {"most": 0}, {"changes": [{"number": 4, "rule": "fcsf", "options": "burst=2"}]},
     "     4  -             -    -  fcsf burst=2"),
    ("history --most 5", "admin_history", {"most": 5}, {"changes": []}, "number  changed_at  uid  pid  rule"),
    ("queue", "admin_queue", {}, {"text": "fifo", "waiting": 2, "running": 1}, "2 waiting, 1 running"),
    ("clients", "admin_clients", {}, {"uplink_kbit": 5000}, "uplink: 5.00 Mbit/s"),
    ("explain 18446744073709551615", "admin_explain", {"session": 2 ** 64 - 1},
     {"client": 7, "address": "a", "summary": "is next"}, "client 7 (a): is next"),
    ("weight 7 2.5", "admin_weight", {"session": 7, "weight": 2500}, {"client": 7, "before": 1, "weight": 2.5},
     "client 7: weight 1 -> 2.5"),
    ("set-rule fcsf --option burst=2 --option quantum=500", "admin_set_rule",
     {"flags": 0, "version": 0, "rule": "fcsf", "count": 2, "options": [("burst", "2"), ("quantum", "500")]}, _CHANGE,
     "rule: fifo slots=1 -> fcsf burst=2 slots=1"),
    ("set-rule --option a=b=c fcsf --dry-run --if-version 0", "admin_set_rule",
     {"flags": 3, "version": 0, "rule": "fcsf", "count": 1, "options": [("a", "b=c")]}, _CHANGE,
     "rule: fifo slots=1 -> fcsf burst=2 slots=1"),
    ("set-rule fcsf --if-version 9", "admin_set_rule",
     {"flags": 2, "version": 9, "rule": "fcsf", "count": 0, "options": []}, _CHANGE,
     "rule: fifo slots=1 -> fcsf burst=2 slots=1"),
    ("revert 0", "admin_revert", {"flags": 0, "version": 0, "change": 0}, _CHANGE,
     "rule: fifo slots=1 -> fcsf burst=2 slots=1"),
    ("revert 3 --dry-run --if-version 4", "admin_revert", {"flags": 3, "version": 4, "change": 3}, _CHANGE,
     "rule: fifo slots=1 -> fcsf burst=2 slots=1"),
]

_REFUSED_HERE = [
    ("set-rule", "rule is required, or --keep"), ("set-rule --option uplink=5", "rule is required, or --keep"),
    ("setrule fcsf", 'there is no command "setrule"'), ("help", 'there is no command "help"'),
    ("set-rule fcsf --option burst", '"burst" is not NAME=VALUE'),
    ("set-rule fcsf --option =2", '"=2" is not NAME=VALUE'),
    ("set-rule fcsf --option a=1 --option a=2", "option a is given twice"),
    ("set-rule fcsf --if-version -1", "--if-version"), ("set-rule fcsf gain", "gain"),
    ("set-rule " + "x" * 256, "no name of a rule"),
    ("set-rule fcsf " + " ".join(f"--option a{n}=1" for n in range(65)), "more than 64 options"),
    ("revert", "number is required"), ("revert -1", "number"), ("revert last", "number"),
    ("history --most -1", "--most"), ("history --most 4294967296", '"4294967296" is no whole number, or too large'), ("explain", "client is required"),
    ("explain bunny", "client"), ("weight 7", "weight is required"), ("weight 7 0", "0.001 to 1000000"),
    ("weight 7 1000000.001", "0.001 to 1000000"), ("weight 7 0.0001", "0.001 to 1000000"),
    ("watch --interval 0", "--interval"),
    ("watch --interval nan", '"nan" is no number from 0.1 to 3600'), ("watch --count -1", "--count"), ("queue 7", "7"),
]


class Commands(unittest.TestCase):
    def test_what_they_send_and_print(self):
        for line, name, fields, answer, printed in _COMMANDS:
            with self.subTest(line), PlayedDaemon({name: answer}) as daemon:
                ended = pmcctl(*line.split(), daemon=daemon)
                self.assertEqual((ended.returncode, ended.stderr), (DONE, ""))
                self.assertEqual([fields_of(message) for message in daemon.asked], [(name, fields)])
                self.assertNotEqual(daemon.asked[0].id, 0)
                self.assertIn(printed, ended.stdout.splitlines())

    def test_keep(self):
        present = {"rule": "gain", "version": 7, "options": {"until": "5", "slots": "auto", "quantum": "250", "uplink": "0"},
                   "sources": {"rule": "default", "slots": "live change", "quantum": "config file", "uplink": "default"}}
        for line, rule, version, options in (
                ("--keep --option uplink=9", "gain", 7, [("uplink", "9"), ("slots", "auto"), ("until", "5")]),
                ("gain --keep --option until=0", "gain", 7, [("until", "0"), ("slots", "auto")]),
                ("fair --keep --if-version 6", "fair", 6, [("slots", "auto")])):
            with self.subTest(line), PlayedDaemon({"admin_rule": present, "admin_set_rule": _CHANGE}) as daemon:
                ended = pmcctl("set-rule", *line.split(), daemon=daemon)
                self.assertEqual((ended.returncode, ended.stderr), (DONE, ""))
                self.assertEqual([m.name for m in daemon.asked], ["admin_rule", "admin_set_rule"])
                sent = daemon.asked[1].fields
                self.assertEqual((sent["rule"], sent["flags"], sent["version"]), (rule, 2, version))
                self.assertEqual(sent["options"][:1] + sorted(sent["options"][1:]), options)

    def test_json_is_the_document(self):
        for line, name, _, answer, _ in _COMMANDS:
            with self.subTest(line), PlayedDaemon({name: answer}) as daemon:
                ended = pmcctl(*line.split(), "--json", daemon=daemon)
                self.assertEqual((ended.returncode, ended.stderr), (DONE, ""))
                self.assertEqual(json.loads(ended.stdout), answer)

    def test_a_refusal_is_told_with_its_code(self):
        for line, name, code in (("set-rule best", "admin_set_rule", "bad_rule"),
                                 ("set-rule fifo --option a=1", "admin_set_rule", "bad_option"),
                                 ("set-rule fifo --if-version 2", "admin_set_rule", "version_changed"),
                                 ("revert 99", "admin_revert", "unknown_change"),
                                 ("explain 99", "admin_explain", "unknown_client"),
                                 ("weight 99 2", "admin_weight", "unknown_client")):
            with self.subTest(line), PlayedDaemon({name: Refusal(code, "not so")}) as daemon:
                ended = pmcctl(*line.split(), daemon=daemon)
                self.assertEqual((ended.returncode, ended.stdout), (REFUSED, ""))
                self.assertEqual(ended.stderr, f"pmcctl {line.split()[0]}: not so [{code}]\n")
                ended = pmcctl(*line.split(), "--json", daemon=daemon)
                self.assertEqual((ended.returncode, ended.stderr), (REFUSED, ""))
                self.assertEqual(json.loads(ended.stdout)["error"]["name"], code)

    def test_warnings_go_to_stderr(self):
        answer = _CHANGE | {"warnings": ["a restart forgets it: --rule stands on the command line", "two"]}
        for line, name in (("set-rule fcsf", "admin_set_rule"), ("revert 3", "admin_revert")):
            with self.subTest(line), PlayedDaemon({name: answer}) as daemon:
                ended = pmcctl(*line.split(), daemon=daemon)
                self.assertEqual(ended.stdout, "rule: fifo slots=1 -> fcsf burst=2 slots=1\n")
                self.assertEqual(ended.stderr, "pmcctl: warning: a restart forgets it: --rule stands on the command "
                                               "line\npmcctl: warning: two\n")

    def test_arguments_that_no_daemon_is_asked_about(self):
        for line, told in _REFUSED_HERE:
            with self.subTest(line):
                ended = pmcctl(*line.split())
                self.assertEqual((ended.returncode, ended.stdout), (USAGE, ""))
                self.assertIn(told, ended.stderr)
                self.assertNotIn("no daemon answers", ended.stderr)

    def test_no_daemon(self):
        for line, *_ in [*_COMMANDS, ("watch --count 1",)]:
            with self.subTest(line):
                ended = pmcctl(*line.split())
                self.assertEqual((ended.returncode, ended.stdout), (REFUSED, ""))
                self.assertIn("no daemon answers on /nonexistent/admin.sock", ended.stderr)

    def test_an_answer_that_is_none(self):
        with PlayedDaemon({"admin_rule": [1, 2]}) as daemon:
            ended = pmcctl("rule", daemon=daemon)
            self.assertEqual((ended.returncode, ended.stdout), (REFUSED, ""))
            self.assertIn("is not a JSON object", ended.stderr)


class Help(unittest.TestCase):
    def test_each_command_has_one_line(self):
        listed = pmcctl("--help").stdout.partition("\nSubcommands:\n")[2].splitlines()
        commands = [line.split()[0] for line in listed if line.strip()]
        self.assertEqual(commands, ["ingest", "list", "show", "remove", "status", "rules", "rule", "set-rule", "history",
                                    "revert", "queue", "clients", "explain", "weight", "watch"])
        for line in listed:
            self.assertLessEqual(len(line), 120)

    def test_set_rule_gives_examples(self):
        text = pmcctl("set-rule", "--help").stdout
        self.assertIn("pmcctl set-rule fcsf --option burst=2 --option quantum=500", text)
        self.assertIn("--option NAME=VALUE", text)


if __name__ == "__main__":
    unittest.main()
