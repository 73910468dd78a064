# SPDX-License-Identifier: GPL-3.0-or-later
"""The manual pages and the shipped config file say what the programs' --help says: each option and no other, and the
same defaults; the unit and the package's version fit them.

The programs are told by PMCD_DAEMON, PMCCTL and PMCTOOL; ctest sets them. It judges names and defaults, not prose.
"""

import os
import pathlib
import re
import subprocess
import tempfile
import unittest

_REPOSITORY = pathlib.Path(__file__).resolve().parents[2]
_PACKAGING = _REPOSITORY / "packaging"
_PAGES = {"PMCD_DAEMON": "pmcd.8", "PMCCTL": "pmcctl.1", "PMCTOOL": "pmctool.1"}


def output_of(variable, *arguments):
    program = os.environ.get(variable)
    if not program:
        raise RuntimeError(f"{variable} is not set: run this through ctest, or name the program in it")
    return subprocess.run([program, *arguments], check=True, capture_output=True, text=True, timeout=60).stdout


def options_in_help(text):
    """The long options that a --help lists."""
    return set(re.findall(r"^ +(?:-\w,)?--([a-z][a-z-]*)", text, re.MULTILINE))


def commands_in_help(text):
    listed = text.partition("\nSubcommands:\n")[2].partition("\n\n")[0]
    return re.findall(r"^  ([\w-]+)", listed, re.MULTILINE)


def options_by_command(variable):
    """What the program's --help lists, by command; "" is the program itself. Each command has --help."""
    top = output_of(variable, "--help")
    return {"": options_in_help(top)} | {command: options_in_help(output_of(variable, command, "--help")) - {"help"}
                                         for command in commands_in_help(top)}


def options_in_page(page):
    """The options that an mdoc page lists, by command: in the section `.Ss PROGRAM COMMAND`, else ""."""
    found = {"": set()}
    command = ""
    for line in page.splitlines():
        if heading := re.match(r"\.S[sh] (?:pmc\w+ ([\w-]+))?", line):
            command = heading[1] or ""
            found.setdefault(command, set())
        elif line.startswith(".It "):
            found[command] |= set(options_mentioned(line))
    return found


def options_mentioned(page):
    return re.findall(r"\bFl Fl ([a-z][a-z-]*)", page)


def defaults_in_help(text):
    """The defaults of the options that may stand in the config file; they end the option's text, in parentheses."""
    listed = text.partition("also in the config file")[2].partition("\n\n")[0]
    entries = re.split(r"^ +--", listed, flags=re.MULTILINE)[1:]
    found = {}
    for entry in entries:
        default = re.search(r"\(([^()]*)\)$", " ".join(entry.split()))
        found[entry.split()[0]] = default[1] if default else None
    return found


class Pages(unittest.TestCase):
    def test_each_lists_the_options_of_its_program_and_no_other(self):
        for variable, name in _PAGES.items():
            page = (_PACKAGING / "man" / name).read_text(encoding="utf-8")
            in_help, in_page = options_by_command(variable), options_in_page(page)
            self.assertIn("help", in_help[""])
            for command in sorted(in_help.keys() | in_page.keys()):
                with self.subTest(page=name, command=command):
                    self.assertEqual(in_page.get(command), in_help.get(command))
            with self.subTest(page=name):
                self.assertLessEqual(set(options_mentioned(page)), set().union(*in_help.values()))

    def test_the_daemons_page_has_its_defaults(self):
        page = (_PACKAGING / "man" / "pmcd.8").read_text(encoding="utf-8")
        defaults = defaults_in_help(output_of("PMCD_DAEMON", "--help"))
        self.assertIn("database", defaults)
        for option, default in defaults.items():
            entry = re.search(rf"^\.It Fl Fl {option} .*\n((?:(?!\.It |\.El).*\n)*)", page, re.MULTILINE)
            said = re.search(r"Default:\s+(?:\.Pa )?(\S+?)[.,]?\s", entry[1] if entry else "")
            with self.subTest(option):
                self.assertEqual(said and said[1], default)


class ConfigFile(unittest.TestCase):
    def setUp(self):
        self.text = (_PACKAGING / "pmcd.conf").read_text(encoding="utf-8")

    def test_it_shows_every_option_with_its_default(self):
        shown = dict(re.findall(r"^#([a-z-]+) = (.*)$", self.text, re.MULTILINE))
        defaults = defaults_in_help(output_of("PMCD_DAEMON", "--help"))
        self.assertEqual(shown, {option: default for option, default in defaults.items() if default is not None})
        # What has no default is shown by an example, which stays a comment when "#NAME" is uncommented.
        examples = set(re.findall(r"^# ([a-z-]+) = ", self.text, re.MULTILINE))
        self.assertEqual(examples, {option for option, default in defaults.items() if default is None})

    def test_it_changes_nothing_as_it_is(self):
        for line in self.text.splitlines():
            self.assertTrue(not line or line.startswith("#"), line)

    def test_it_is_good_with_every_default_uncommented(self):
        with tempfile.TemporaryDirectory() as folder:
            path = pathlib.Path(folder, "pmcd.conf")
            path.write_text(re.sub(r"^#(?=[a-z-]+ = )", "", self.text, flags=re.MULTILINE), encoding="utf-8")
            output_of("PMCD_DAEMON", "--config", str(path), "--check-config")


class Unit(unittest.TestCase):
    def test_ending_in_order_fits_into_the_time_that_systemd_gives(self):
        """The daemon ends within twice its drain-timeout and a second; the documents say how far that goes."""
        unit = (_PACKAGING / "debian" / "pmcd.service").read_text(encoding="utf-8")
        given_s = int(re.search(r"^TimeoutStopSec=(\d+)$", unit, re.MULTILINE)[1])
        drain_s = float(defaults_in_help(output_of("PMCD_DAEMON", "--help"))["drain-timeout"])
        self.assertLess(2 * drain_s + 1, given_s)
        for name in ("man/pmcd.8", "pmcd.conf"):
            self.assertIn(f"with more than {(given_s - 1) // 2}",
                          (_PACKAGING / name).read_text(encoding="utf-8").lower())


class Version(unittest.TestCase):
    def test_the_packages_version_is_the_programs(self):
        changelog = (_PACKAGING / "debian" / "changelog").read_text(encoding="utf-8")
        version = re.match(r"pmcd \(([\d.]+)\)", changelog)[1]
        for variable, page in _PAGES.items():
            self.assertEqual(output_of(variable, "--version").strip(), f"{page.split('.')[0]} {version}")


if __name__ == "__main__":
    unittest.main()
