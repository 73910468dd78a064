# SPDX-License-Identifier: GPL-3.0-or-later
"""A daemon's admin socket that answers what a test says, and remembers what it was asked. It judges the form of every
frame by docs/PROTOCOL.md, through tests/conformance/wire.py, and knows nothing of rules.
"""

import json
import os
import pathlib
import socket
import subprocess
import sys
import tempfile
import threading

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "conformance"))

import wire  # noqa: E402

PMCCTL = os.environ.get("PMCCTL") or sys.exit("PMCCTL is not set: run this through ctest, or name the program in it")


class Refusal:
    def __init__(self, code, text):
        self.code, self.text = code, text


class PlayedDaemon:
    """answers: {message: document, Refusal, or None for silence}. `asked`: the Messages in order; `lines`: how many
    connections said hello; `wrong`: what was not of the protocol."""

    def __init__(self, answers):
        self.answers, self.asked, self.lines, self.wrong = answers, [], 0, []
        self._folder = tempfile.TemporaryDirectory()
        self.path = os.path.join(self._folder.name, "admin.sock")
        self._listener = socket.socket(socket.AF_UNIX)
        self._listener.bind(self.path)
        self._listener.listen()
        self._peers = []
        threading.Thread(target=self._accept, daemon=True).start()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.go()
        self._folder.cleanup()
        if self.wrong:
            raise AssertionError(self.wrong)

    def go(self):
        """No connection is taken any more, and those that are there end."""
        self._listener.close()
        for peer in self._peers:
            try:
                peer.shutdown(socket.SHUT_RDWR)
            except OSError:
                pass

    def _accept(self):
        while True:
            try:
                peer, _ = self._listener.accept()
            except OSError:
                return
            self._peers.append(peer)
            threading.Thread(target=self._serve, args=(peer,), daemon=True).start()

    def _serve(self, peer):
        try:
            with peer, peer.makefile("rb") as stream:
                while head := stream.read(4):
                    content = stream.read(int.from_bytes(head, "little"))
                    self._answer(peer, wire.parse(int.from_bytes(content[:2], "little"), content[2:]))
        except OSError:
            pass
        except Exception as wrong:  # told by the thread of the test
            self.wrong.append(repr(wrong))

    def _answer(self, peer, message):
        if message.name == "admin_hello":
            self.lines += 1
            return peer.sendall(wire.message("admin_hello_ok", agent="played"))
        self.asked.append(message)
        answer = self.answers[message.name]
        if isinstance(answer, Refusal):
            peer.sendall(wire.message("error", id=message.id, code=wire.CODES[answer.code], text=answer.text))
        elif answer is not None:
            text = json.dumps(answer).encode()
            middle = len(text) // 2  # an answer may come in pieces
            peer.sendall(wire.message("admin_answer", id=message.id, last=0, text=text[:middle])
                         + wire.message("admin_answer", id=message.id, last=1, text=text[middle:]))


def fields_of(message):
    """Name and fields of a message, but for its id."""
    return message.name, {name: value for name, value in message.fields.items() if name != "id"}


def pmcctl(*arguments, daemon=None):
    """Runs it to its end."""
    socket_path = daemon.path if daemon else "/nonexistent/admin.sock"
    return subprocess.run([PMCCTL, "--socket", socket_path, *arguments], capture_output=True, text=True, timeout=60)
