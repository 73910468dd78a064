# SPDX-License-Identifier: MIT
"""The figures of a run, looked up: medians over its repeats, means over groups of clients, and their bounds. Works on
what the JSON file holds, so that a report can be written again from it."""

import statistics

import bounds
from experiments import Client, Experiment
from network import MODEM, Line


def describe(experiment):
    """An experiment as it goes into the JSON file."""
    return {"title": experiment.title, "clients": [
        {"number": client.number, "line": vars(client.line), "mesh": client.mesh, "arrival": client.arrival,
         "stall_after": client.stall_after, "leave_after": client.leave_after} for client in experiment.clients]}


def _read(key, described):
    return Experiment(key, described["title"], tuple(
        Client(**{**client, "line": Line(**client["line"])}) for client in described["clients"]))


class Figures:
    def __init__(self, results):
        self.results = results
        self.uplink_kbit = results["parameters"]["uplink_kbit"]
        self.meshes = {name: mesh["levels"] for name, mesh in results["meshes"].items()}
        self.experiments = {key: _read(key, described) for key, described in results["experiments"].items()}
        self._cells = {}
        for cell in results["cells"]:
            self._cells.setdefault((cell["experiment"], cell["rule"], cell["mode"]), []).append(
                {client["number"]: client for client in cell["clients"]})

    def rows(self, key):
        """The (rule, mode) pairs that were run, in the order of the run."""
        return [(rule, mode) for of, rule, mode in self._cells if of == key]

    def rules(self, mode):
        return list(dict.fromkeys(rule for _, rule, of in self._cells if of == mode))

    def group(self, key, name):
        """`all`: who stays and does not stall; `fast`: of these, all but the modems."""
        clients = [client for client in self.experiments[key].clients
                   if client.stall_after is None and client.leave_after is None]
        return clients if name == "all" else [client for client in clients if client.line.name != MODEM.name]

    def endings(self, key, rule, mode, client):
        """How the client ended in each repeat."""
        return [run[client.number]["ended"] for run in self._cells[key, rule, mode]]

    def time(self, key, rule, mode, client, figure):
        """Median over the repeats, in seconds from the client's start; None if it did not come that far each time."""
        runs = self._cells.get((key, rule, mode), [])
        times = [run[client.number]["times"][figure] for run in runs]
        return statistics.median(times) if times and None not in times else None

    def times(self, key, rule, mode, figure, group="all"):
        return [self.time(key, rule, mode, client, figure) for client in self.group(key, group)]

    def mean(self, key, rule, mode, figure, group="all"):
        times = self.times(key, rule, mode, figure, group)
        return statistics.mean(times) if times and None not in times else None

    def last(self, key, rule, mode):
        """How long the client took that took longest."""
        times = self.times(key, rule, mode, "end")
        return max(times) if times and None not in times else None

    def bound(self, client, figure):
        return bounds.own(client.line, self.uplink_kbit, self.meshes[client.mesh], figure)

    def mean_bound(self, key, figure, group="all"):
        """The least mean, and whether the shared uplink makes it more than the mean of the clients' own bounds."""
        return bounds.mean(self.group(key, group), self.uplink_kbit, self.meshes, figure)

    def beaten(self):
        """Where a client was faster than can be: (experiment, rule, mode, client number, figure, time, bound)."""
        return [(key, rule, mode, client.number, figure, time, bound)
                for key, rule, mode in self._cells for client in self.experiments[key].clients
                for figure in bounds.FIGURES
                for time, bound in [(self.time(key, rule, mode, client, figure), self.bound(client, figure))]
                if time is not None and time < bound]

    def dropped(self):
        """Clients that the daemon dropped though they did not stall: (experiment, rule, mode, number, why)."""
        return [(key, rule, mode, number, client.get("why", client["ended"]))
                for (key, rule, mode), runs in self._cells.items() for run in runs for number, client in run.items()
                if client["ended"] in ("dropped", "interrupted")]
