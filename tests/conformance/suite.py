# SPDX-License-Identifier: MIT
"""What a check of the suite is: a function that names the statements it checks, and ways to say what is wrong.

A check gets a Context (the server, its meshes, the operator's hook). It returns, or raises Failed, or NotTried.
"""

import contextlib
import dataclasses

import session
import wire
from session import Failed


class NotTried(Exception):
    """The check cannot be done here; the text says why."""


@dataclasses.dataclass
class Check:
    name: str
    marks: tuple
    group: str
    function: object


ALL = []


def checks(*marks):
    """Declares a function as a check of these statements; its module's name, less `check_`, is its group."""
    def register(function):
        group = function.__module__.removeprefix("check_")
        ALL.append(Check(function.__name__, marks, group, function))
        return function
    return register


def expect(what, expected, got):
    """Fails unless both are equal."""
    if expected != got:
        raise Failed(f"{what}: {shown(expected)}", shown(got))


def shown(value):
    return wire.hex_of(value) if isinstance(value, (bytes, bytearray)) else str(value)


@dataclasses.dataclass
class Mesh:
    """A mesh that the server holds; `file` is its PacketFile if the caller knows it."""
    name: str
    file: object = None


class Operator:
    """What only somebody beside the server can do. This one can do nothing; a server of your own can have another."""

    def server(self, meshes, **options):
        """A server of the check's own with `meshes` (name: PacketFile) and `options`, as a context manager.

        Options are those of pmcd with underscores: stall_timeout=0.5. The server has address, admin_socket,
        put(name, file), remove(name), terminate(), crash(), damage(size), lock(), without_list() (see pmcd_operator.py).
        """
        raise NotTried("needs an operator's hook: a server with other options or meshes that change")


@dataclasses.dataclass
class Context:
    """What a check works with. `met` collects which codes came, by check."""
    address: tuple
    mesh: Mesh
    second: Mesh | None = None
    big: Mesh | None = None
    operator: Operator = dataclasses.field(default_factory=Operator)
    admin_socket: str | None = None
    met: dict = dataclasses.field(default_factory=dict)
    running: str = ""
    seconds: float = 20  # what one check may take

    def meet(self, code):
        self.met.setdefault(code, set()).add(self.running)

    @contextlib.contextmanager
    def session(self, address=None, **options):
        """A session with the server (or with the one at `address`), closed at the end."""
        made = session.Session(address or self.address, on_code=self.meet, **options)
        try:
            yield made
        finally:
            made.close()

    @contextlib.contextmanager
    def opened(self, mesh=None, **options):
        """A session and its finished get_base_mesh of `mesh`."""
        with self.session(**options) as line:
            base = line.finish(line.ask("get_base_mesh", name=(mesh or self.mesh).name))
            expect_complete(base)
            yield line, base

    def need_time(self, seconds):
        if self.seconds < seconds:
            raise NotTried(f"takes {seconds} seconds: --slow")

    def need_second(self):
        if self.second is None:
            raise NotTried("needs --second-mesh")
        return self.second

    def need_big(self):
        """The mesh whose packets are too long to vanish into buffers."""
        if self.big is None:
            raise NotTried("needs --big-mesh: a mesh with a packet of at least 16 MiB")
        return self.big


def expect_complete(request):
    expect(f"{request} ends", "complete", request.outcome)
    return request


def expect_refused(request, *codes):
    """The request ended by one of these codes, in either form, and without a chunk."""
    if request.outcome not in codes:
        raise Failed(f"{request} ends with {' or '.join(codes)}", request.outcome)
    expect(f"chunks of {request}", 0, request.chunks)
    return request
