# SPDX-License-Identifier: GPL-3.0-or-later
"""pmcctl watch: snapshots where there is no terminal, a picture where there is one, and a terminal that
is left as it was found however the program ends. What stands in a picture is tested in watch_text_test.cpp.
"""

import fcntl
import json
import os
import pty
import select
import signal
import struct
import subprocess
import termios
import time
import unittest

from played_daemon import PMCCTL, PlayedDaemon, Refusal, pmcctl

_RULE = {"text": "fifo slots=1", "version": 4, "uplink_kbit": 5000}
_CLIENTS = {"uplink_kbit": 5000, "clients": [{"client": n, "mesh": "bunny", "running": 1} for n in range(1, 31)]}
_QUEUE = {"waiting": 0, "running": 30, "requests": []}
_ANSWERS = {"admin_rule": _RULE, "admin_clients": _CLIENTS, "admin_queue": _QUEUE}

_ENTER, _LEAVE = b"\x1b[?1049h\x1b[?25l\x1b[?7l", b"\x1b[?7h\x1b[?25h\x1b[?1049l"


class Terminal:
    """pmcctl watch on a terminal of a size, as its session's leader, so that ^C comes from the terminal."""

    def __init__(self, daemon, *arguments, rows=12, columns=40, interval=0.1, term="xterm"):
        self.pid, self.fd = pty.fork()
        if self.pid == 0:
            fcntl.ioctl(1, termios.TIOCSWINSZ, struct.pack("HHHH", rows, columns, 0, 0))
            os.execve(PMCCTL, [PMCCTL, "--socket", daemon.path, "watch", "--interval", str(interval), *arguments],
                      os.environ | {"TERM": term})
        self.seen, self.status = b"", None

    def resize(self, rows, columns):
        fcntl.ioctl(self.fd, termios.TIOCSWINSZ, struct.pack("HHHH", rows, columns, 0, 0))

    def read(self, until=None, patience_s=20):
        """Until these bytes were seen since the last call, or without any to the end."""
        seen, end = b"", time.monotonic() + patience_s
        while until is None or until not in seen:
            if not select.select([self.fd], [], [], max(0, end - time.monotonic()))[0]:
                raise AssertionError(f"{until} did not come, but {seen[-500:]}")
            try:
                piece = os.read(self.fd, 65536)
            except OSError:  # the other side is closed
                piece = b""
            if not piece:
                if until is not None:
                    raise AssertionError(f"it ended before {until}, after {seen[-500:]}")
                break
            seen += piece
        self.seen += seen
        return seen

    def end(self):
        """Reads to the end; its exit code, or minus the signal."""
        self.read()
        self.status = os.waitstatus_to_exitcode(os.waitpid(self.pid, 0)[1])
        return self.status

    def __enter__(self):
        return self

    def __exit__(self, *_):
        if self.status is None:
            os.kill(self.pid, signal.SIGKILL)
            os.waitpid(self.pid, 0)
        os.close(self.fd)


def pictures(seen):
    """The lines of each picture that was drawn. The terminal itself writes a line end as two bytes, behind ours."""
    return [[line.removesuffix(b"\x1b[K").decode() for line in part.partition(b"\x1b[J")[0].split(b"\r\r\n")]
            for part in seen.split(b"\x1b[H")[1:]]


class NoTerminal(unittest.TestCase):
    def test_snapshots_each_over_a_connection_of_its_own(self):
        with PlayedDaemon(_ANSWERS) as daemon:
            begun = time.monotonic()
            ended = pmcctl("watch", "--interval", "0.3", "--count", "3", daemon=daemon)
            self.assertGreater(time.monotonic() - begun, 0.55)
            self.assertEqual((ended.returncode, ended.stderr), (0, ""))
            self.assertNotIn("\x1b", ended.stdout)
            snapshots = ended.stdout.split("\n\nfifo ")
            self.assertEqual(len(snapshots), 3)
            self.assertEqual([s.count("bunny") for s in snapshots], [30, 30, 30])
            self.assertEqual(daemon.lines, 3)
            self.assertEqual([m.name for m in daemon.asked], ["admin_rule", "admin_clients", "admin_queue"] * 3)
            self.assertEqual([m.id for m in daemon.asked], [1, 2, 3] * 3)

    def test_json_is_a_document_a_line(self):
        with PlayedDaemon(_ANSWERS) as daemon:
            ended = pmcctl("watch", "--json", "--interval", "0.1", "--count", "2", daemon=daemon)
            self.assertEqual([json.loads(line) for line in ended.stdout.splitlines()],
                             [{"rule": _RULE, "clients": _CLIENTS, "queue": _QUEUE}] * 2)

    def test_a_refusal_ends_it(self):
        with PlayedDaemon(_ANSWERS | {"admin_queue": Refusal("internal_error", "not now")}) as daemon:
            ended = pmcctl("watch", daemon=daemon)
            self.assertEqual((ended.returncode, ended.stdout), (4, ""))
            self.assertEqual(ended.stderr, "pmcctl watch: not now [internal_error]\n")

    def test_a_snapshot_is_there_at_once(self):
        with PlayedDaemon(_ANSWERS) as daemon:
            with subprocess.Popen([PMCCTL, "--socket", daemon.path, "watch", "--interval", "60"],
                                  stdout=subprocess.PIPE) as running:
                came = select.select([running.stdout], [], [], 20)[0]
                line = running.stdout.readline() if came else b"nothing"
                running.kill()
                self.assertTrue(line.startswith(b"fifo slots=1  version 4"), line)


class OnATerminal(unittest.TestCase):
    def test_pictures_fit_and_the_terminal_is_left(self):
        with PlayedDaemon(_ANSWERS) as daemon, Terminal(daemon, "--count", "2") as terminal:
            self.assertEqual(terminal.end(), 0)
            self.assertTrue(terminal.seen.startswith(_ENTER))
            live, _, last = terminal.seen.rpartition(_LEAVE)
            self.assertTrue(last.startswith(b"fifo slots=1  version 4"), last)
            self.assertEqual(last.count(b"bunny"), 30, "the last look stays, whole")
            drawn = pictures(live)
            self.assertGreaterEqual(len(drawn), 1)
            for lines in drawn:
                self.assertEqual(len(lines), 12)
                self.assertLessEqual(max(map(len, lines)), 40)
                self.assertIn("... and 25 more", lines)

    def test_a_single_look_needs_no_screen(self):
        with PlayedDaemon(_ANSWERS) as daemon, Terminal(daemon, "--count", "1", interval=60) as terminal:
            self.assertEqual(terminal.end(), 0)
            self.assertNotIn(b"\x1b", terminal.seen)
            self.assertEqual(terminal.seen.count(b"bunny"), 30)

    def test_ctrl_c_ends_it_well(self):
        with PlayedDaemon(_ANSWERS) as daemon, Terminal(daemon) as terminal:
            terminal.read(b"\x1b[J")
            os.write(terminal.fd, b"\x03")
            self.assertEqual(terminal.end(), 0)
            self.assertTrue(terminal.seen.endswith(_LEAVE))

    def test_ctrl_c_while_the_daemon_is_silent(self):
        with PlayedDaemon(dict(_ANSWERS)) as daemon, Terminal(daemon) as terminal:
            terminal.read(b"\x1b[J")
            daemon.answers["admin_clients"] = None
            time.sleep(0.5)  # it has asked meanwhile, and waits
            self.assertEqual(daemon.asked[-1].name, "admin_clients")
            begun = time.monotonic()
            os.write(terminal.fd, b"\x03")
            self.assertEqual(terminal.end(), 0)
            self.assertLess(time.monotonic() - begun, 5)
            self.assertTrue(terminal.seen.endswith(_LEAVE))

    def test_other_signals_restore_it_too(self):
        for number in (signal.SIGTERM, signal.SIGHUP, signal.SIGQUIT):
            with self.subTest(number), PlayedDaemon(_ANSWERS) as daemon, Terminal(daemon) as terminal:
                terminal.read(b"\x1b[J")
                os.kill(terminal.pid, number)
                self.assertEqual(terminal.end(), -number)
                self.assertTrue(terminal.seen.endswith(_LEAVE))

    def test_stopped_and_continued(self):
        with PlayedDaemon(_ANSWERS) as daemon, Terminal(daemon) as terminal:
            terminal.read(b"\x1b[J")
            os.write(terminal.fd, b"\x1a")
            terminal.read(_LEAVE)
            self.assertTrue(os.WIFSTOPPED(os.waitpid(terminal.pid, os.WUNTRACED)[1]))
            os.kill(terminal.pid, signal.SIGCONT)
            terminal.read(_ENTER)
            terminal.read(b"\x1b[J")

    def test_another_size_is_another_picture_at_once(self):
        with PlayedDaemon(_ANSWERS) as daemon, Terminal(daemon, interval=3600) as terminal:
            terminal.read(b"\x1b[J")
            # Again and again: it may come at any moment, also between a picture and the rest behind it.
            for rows in list(range(12, 20)) * 25:
                terminal.resize(rows, 60)
                self.assertEqual(len(pictures(terminal.read(b"\x1b[J"))[-1]), rows)

    def test_a_daemon_that_goes_is_told_on_the_terminal_that_was(self):
        with PlayedDaemon(_ANSWERS) as daemon, Terminal(daemon) as terminal:
            terminal.read(b"\x1b[J")
            daemon.go()
            self.assertEqual(terminal.end(), 4)
            self.assertIn(b"no daemon answers", terminal.seen.rpartition(_LEAVE)[2])

    def test_a_terminal_without_escapes_gets_none(self):
        with PlayedDaemon(_ANSWERS) as daemon, Terminal(daemon, "--count", "1", term="dumb") as terminal:
            self.assertEqual(terminal.end(), 0)
            self.assertNotIn(b"\x1b", terminal.seen)
            self.assertIn(b"fifo slots=1  version 4", terminal.seen)


if __name__ == "__main__":
    unittest.main()
