# SPDX-License-Identifier: MIT
"""One cell of the matrix: a fresh daemon with one rule in a network of its own, and the clients of one experiment. And
what all cells share: the meshes, encoded once. It judges nothing."""

import dataclasses
import json
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import threading
import time

import bounds
import network

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "serve"))
# pylint: disable=wrong-import-position
from servers import Pmcd, ServerError

MODES = {"paper": "paper mode", "ours": "our mode"}
_OPEN = {"paper": 1, "ours": 4}
_LOOK_SECONDS = 0.02
_END_SECONDS = 20


class CellError(Exception):
    pass


class Stopped(Exception):
    """The run is to end."""


@dataclasses.dataclass(frozen=True)
class Rule:
    """A distribution rule with its options."""
    text: str  # as the user wrote it
    name: str
    options: tuple

    @classmethod
    def parse(cls, text):
        name, *options = text.split("+")
        if not (re.fullmatch(r"[a-z][a-z0-9_-]*", name)
                and all(re.fullmatch(r"[\w-]+=[^=]+", option) for option in options)):
            raise ValueError(f"\"{text}\" is not NAME or NAME+OPTION=VALUE+...")
        return cls(text, name, tuple(options))


class Cells:
    """The programs, meshes and figures that all cells have in common. `scratch` is removed by whoever made it."""

    def __init__(self, programs, scratch, scale, *, quantum_ms=250, aging=None, congestion=None, seed=1):
        self.programs = programs
        self.scratch = scratch
        self.uplink_kbit = network.UPLINK_KBIT * scale
        uplink = f"{self.uplink_kbit:g}"
        self.ours = ["--slots", "auto", "--quantum", f"{quantum_ms:g}", "--uplink", uplink]
        if aging is not None:
            self.ours += ["--aging", f"{aging:g}"]
        self.congestion = congestion
        self.seed = seed
        self.meshes = {}
        self.stop = threading.Event()
        (scratch / "ingest").mkdir()

    def ingest(self, name, file, levels):
        """Encodes a mesh and keeps what the daemon says of its levels."""
        folder = self.scratch / "ingest"
        with Pmcd(self.programs["pmcd"], folder, None, []) as pmcd:
            self._pmcctl(pmcd, "ingest", "--name", name, "--levels", levels, file)
            self.meshes[name] = json.loads(self._pmcctl(pmcd, "show", name, "--json"))["levels"]
        (folder / "ready.sock").unlink()

    def _pmcctl(self, pmcd, *words):
        command = [str(self.programs["pmcctl"]), "--socket", pmcd.admin_socket, *map(str, words)]
        done = subprocess.run(command, stdin=subprocess.DEVNULL, capture_output=True, text=True, check=False)
        if done.returncode != 0:
            raise CellError(f"{' '.join(command)}: {(done.stderr or done.stdout).strip()}")
        return done.stdout

    def daemon_options(self, rule, mode):
        """How the daemon is told. Paper mode says no more than the daemon of the paper knew."""
        options = ["--rule", rule.name]
        for option in rule.options:
            options += ["--rule-option", option]
        return options + (["--slots", "1", "--quantum", "0"] if mode == "paper" else self.ours)

    def refusal(self, rule, mode):
        """What the daemon has against the rule in this mode, or None."""
        done = subprocess.run([str(self.programs["pmcd"]), "--check-config", "--database",
                               str(self.scratch / "none.db"), *self.daemon_options(rule, mode)],
                              stdin=subprocess.DEVNULL, capture_output=True, text=True, check=False)
        return None if done.returncode == 0 else (done.stderr or done.stdout).strip()

    def run(self, experiment, rule, mode, watch=None):
        """The figures of one cell, as they go into the JSON file. `watch` is called again and again while the clients
        fetch, with a function that asks pmcctl."""
        with tempfile.TemporaryDirectory(prefix="cell-", dir=self.scratch) as folder:
            folder = pathlib.Path(folder)
            for file in (self.scratch / "ingest").glob("meshes.db*"):
                shutil.copy(file, folder)
            lines = [client.line for client in experiment.clients]
            with network.Network(self.programs["rules_relay"], lines, self.uplink_kbit, self.congestion,
                                 self.seed) as net:
                options = self.daemon_options(rule, mode) + ["--listen", network.SERVER_ADDRESS]
                with Pmcd(self.programs["pmcd"], folder, None, options, network.inside(net.server)) as pmcd:
                    look = None if watch is None else lambda: watch(lambda *words: self._pmcctl(pmcd, *words))
                    clients = self._run_clients(experiment, mode, net, pmcd.port, look)
                congestion = network.congestion_control(net)
                relays = net.close()
        return {"experiment": experiment.key, "rule": rule.text, "mode": mode, "congestion": congestion,
                "load": os.getloadavg()[0], "clients": clients, "relays": relays}

    def _patience(self, experiment):
        """Longer than the clients can need, one after the other."""
        alone = sum(bounds.own(client.line, self.uplink_kbit, self.meshes[client.mesh], "end")
                    for client in experiment.clients)
        return 60 + 2 * alone + max(client.arrival for client in experiment.clients)

    def _run_clients(self, experiment, mode, net, port, look):
        begin = time.monotonic() + 0.2 + 0.01 * len(experiment.clients)
        deadline = begin + self._patience(experiment)
        running = []
        try:
            for client, namespace in zip(experiment.clients, net.clients):
                words = ["--start-at", f"{begin + client.arrival:.6f}", "--address", network.SERVER_ADDRESS, "--port",
                         str(port), "--mesh", client.mesh, "--open", str(_OPEN[mode])]
                if client.stall_after is not None:
                    words += ["--stall-after-packet", str(client.stall_after)]
                if client.leave_after is not None:
                    words += ["--leave-after-packet", str(client.leave_after)]
                running.append(subprocess.Popen(
                    [*network.inside(namespace), str(self.programs["rules_client"]), *words], stdin=subprocess.DEVNULL,
                    stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, start_new_session=True))
            # The one that stalls is not waited for.
            waited = [process for process, client in zip(running, experiment.clients) if client.stall_after is None]
            while any(process.poll() is None for process in waited):
                if self.stop.is_set():
                    raise Stopped()
                if time.monotonic() > deadline:
                    break
                if look is not None:
                    look()
                time.sleep(_LOOK_SECONDS)
            for process in running:
                process.terminate()
            return [self._client_figures(client, process) for client, process in zip(experiment.clients, running)]
        finally:
            for process in running:
                if process.poll() is None:
                    process.kill()
                process.communicate()

    def _client_figures(self, client, process):
        try:
            output, errors = process.communicate(timeout=_END_SECONDS)
        except subprocess.TimeoutExpired:
            raise CellError(f"client {client.number} did not end when it was told to") from None
        if process.returncode != 0 or not output:
            raise CellError(f"client {client.number} ended with exit code {process.returncode}: {errors.strip()}")
        result = json.loads(output)
        levels = self.meshes[client.mesh]
        times = {packet["packet"]: packet["time"] for packet in result["packets"]}
        result["times"] = {figure: times.get(bounds.packet_of(figure, levels)) for figure in bounds.FIGURES}
        result["number"] = client.number
        return result


__all__ = ["MODES", "CellError", "Cells", "Rule", "ServerError", "Stopped"]
