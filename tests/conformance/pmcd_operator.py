# SPDX-License-Identifier: MIT
"""The operator's hook for pmcd: starts daemons with given options and meshes, and does to them what operators do.

A server of another make needs a class with the same methods. Daemons listen on free ports of loopback, live in a folder
of their own, and are ended by their process id.
"""

import contextlib
import pathlib
import signal
import socket
import sqlite3
import subprocess
import tempfile
import time

from admin import Admin
from session import Channel
from suite import NotTried, Operator

_START_S = 20


class Server:
    """One running pmcd. Use as a context."""

    def __init__(self, program, meshes, options):
        self.program, self.meshes = program, meshes
        self.options = [text for name, value in options.items() for text in (f"--{name.replace('_', '-')}", str(value))]
        self.place = tempfile.TemporaryDirectory(prefix="pmcd-conformance-")
        self.folder = pathlib.Path(self.place.name)
        self.admin_socket, self.database = self.folder / "admin.sock", self.folder / "meshes.db"
        self.process, self.locks = None, []

    def __enter__(self):
        self._start()
        self.put_all()
        return self

    def _start(self):
        for _ in range(5):  # another process may take a port between our look and the daemon's
            ports = _free_ports(2)
            self.address = ("127.0.0.1", ports[0])
            with open(self.folder / "pmcd.log", "ab") as log:
                self.process = subprocess.Popen(
                    [self.program, "--database", self.database, "--request-port", str(ports[0]), "--data-port",
                     str(ports[1]), "--admin-socket", self.admin_socket, *self.options],
                    stdin=subprocess.DEVNULL, stdout=log, stderr=log)
            if self._is_up():
                return
        log = self.log.strip()[-300:]
        self.place.cleanup()
        raise NotTried(f"pmcd does not start: {log}")

    @property
    def log(self):
        return (self.folder / "pmcd.log").read_text(encoding="utf-8", errors="replace")

    def _is_up(self):
        deadline = time.monotonic() + _START_S
        while time.monotonic() < deadline and self.process.poll() is None:
            try:
                Admin(self.admin_socket).channel.close()
                Channel(self.address, "probe").close()
                return True
            except OSError:
                time.sleep(0.02)
        self._kill()
        return False

    def put_all(self):
        with Admin(self.admin_socket) as admin:
            for name, file in self.meshes.items():
                refused = admin.ingest(name, file)
                if refused:
                    raise NotTried(f"pmcd does not take {name}: {refused}")

    def put(self, name, file):
        """Stores or replaces a mesh."""
        with Admin(self.admin_socket) as admin:
            refused = admin.ingest(name, file, replace=True)
        if refused:
            raise NotTried(f"pmcd does not take {name}: {refused}")

    def remove(self, name):
        with Admin(self.admin_socket) as admin:
            admin.ask("admin_remove", name=name)

    def terminate(self):
        """Tells the server to end; returns at once."""
        self.process.send_signal(signal.SIGTERM)

    def crash(self):
        """Kills the server without a word, and starts it again over the same store, maybe on other ports."""
        self._kill()
        self._start()

    def damage(self, size):
        """Makes the stored packets of exactly `size` bytes unreadable: what stands there is shorter by one."""
        base = sqlite3.connect(self.database, timeout=5)
        try:
            changed = 0
            for table, column in _blob_columns(base):
                changed += base.execute(f'UPDATE "{table}" SET "{column}" = substr("{column}", 2)'
                                        f' WHERE length("{column}") = ?', (size,)).rowcount
            base.commit()
        finally:
            base.close()
        if not changed:
            raise NotTried(f"the database has no blob of {size} bytes")

    @contextlib.contextmanager
    def without_list(self):
        """Meanwhile the daemon finds no mesh table, so it cannot read the list; what it keeps of it stays known."""
        self._change("ALTER TABLE mesh RENAME TO away")
        try:
            yield
        finally:
            self._change("ALTER TABLE away RENAME TO mesh")

    def _change(self, statement):
        with contextlib.closing(sqlite3.connect(self.database, timeout=5)) as base, base:
            base.execute(statement)

    def lock(self):
        """Locks the database against the daemon's writes, until the server's end."""
        base = sqlite3.connect(self.database, timeout=5, isolation_level=None)
        base.execute("BEGIN IMMEDIATE")
        self.locks.append(base)

    def __exit__(self, *_):
        for base in self.locks:
            base.close()
        if self.process.poll() is None:
            self.terminate()
            try:
                self.process.wait(10)
            except subprocess.TimeoutExpired:
                self._kill()
        self.place.cleanup()

    def _kill(self):
        if self.process.poll() is None:
            self.process.kill()
        self.process.wait()


def _free_ports(count):
    sockets = [socket.create_server(("127.0.0.1", 0)) for _ in range(count)]
    try:
        return [one.getsockname()[1] for one in sockets]
    finally:
        for one in sockets:
            one.close()


def _blob_columns(base):
    for (table,) in base.execute("SELECT name FROM sqlite_master WHERE type = 'table' AND sql IS NOT NULL").fetchall():
        for _, column, kind, *_ in base.execute(f'PRAGMA table_info("{table}")').fetchall():
            if kind.upper() == "BLOB":
                yield table, column


class PmcdOperator(Operator):
    """The hook itself: `program` is the pmcd binary."""

    def __init__(self, program):
        self.program = program

    def server(self, meshes, **options):
        return Server(self.program, meshes, options)


