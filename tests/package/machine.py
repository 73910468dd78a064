# SPDX-License-Identifier: GPL-3.0-or-later
"""A throw-away Debian with a booted systemd, for the tests of the installed package.

BaseTree makes the system once, with the host's own apt sources, and keeps it in a folder; Machine puts a writable layer
over it and boots that with systemd-nspawn, without any network but its own loopback. Needs root. Whatever a machine
mounted or started is gone after its context, or at the end of this process. It knows nothing of pmcd.
"""

import atexit
import hashlib
import os
import pathlib
import shutil
import subprocess
import tempfile
import time

TOOLS = ("dpkg-deb", "mmdebstrap", "mount", "nsenter", "pgrep", "systemd-nspawn")
# What the tests look with, and what a package with a unit expects of a system.
_BASE = ("ca-certificates", "dbus", "man-db", "procps", "systemd", "systemd-sysv")
_SOURCES = ("/etc/apt/sources.list", "/etc/apt/sources.list.d")
_ENVIRONMENT = ["env", "-i", "PATH=/usr/sbin:/usr/bin:/sbin:/bin", "LC_ALL=C.UTF-8", "DEBIAN_FRONTEND=noninteractive"]


class Unavailable(Exception):
    """This host cannot make such a machine; the text says why."""


def wait_for(what, seconds, condition):
    """Waits until `condition()` is true and returns what it returned; says `what` did not come if it takes too long."""
    deadline = time.monotonic() + seconds
    while not (result := condition()):
        if time.monotonic() > deadline:
            raise TimeoutError(f"{what}: not within {seconds} s")
        time.sleep(0.05)
    return result


def check_host():
    if os.geteuid() != 0:
        raise Unavailable("a machine is booted by root only")
    missing = [tool for tool in TOOLS if not shutil.which(tool)]
    if missing:
        raise Unavailable(f"missing: {', '.join(missing)}; scripts/install-dependencies --package installs them")


def _codename():
    for line in pathlib.Path("/etc/os-release").read_text(encoding="utf-8").splitlines():
        if line.startswith("VERSION_CODENAME="):
            return line.partition("=")[2].strip('"')
    raise Unavailable("/etc/os-release names no release of Debian")


def _sources(codename):
    """The host's apt sources of this release, as mmdebstrap takes them."""
    listed, folder = map(pathlib.Path, _SOURCES)
    files = [listed, *(sorted(folder.iterdir()) if folder.is_dir() else [])]
    found = [file for file in files
             if file.suffix in (".list", ".sources") and file.is_file()
             and codename in file.read_text(encoding="utf-8", errors="replace")]
    if not found:
        raise Unavailable(f"apt has no source of {codename}")
    return found


def _mounts(*kinds):
    """Where file systems of these kinds are mounted."""
    lines = pathlib.Path("/proc/self/mounts").read_text(encoding="utf-8").splitlines()
    return [pathlib.Path(line.split()[1]) for line in lines if line.split()[2] in kinds]


def base_tree(cache, packages):
    """The folder of a Debian of the host's release with systemd and `packages`; made if `cache` does not have it."""
    check_host()
    codename = _codename()
    wanted = ",".join(sorted({*_BASE, *packages}))
    tree = pathlib.Path(cache) / f"{codename}-{hashlib.sha256(wanted.encode()).hexdigest()[:12]}"
    if tree.is_dir():
        return tree
    tree.parent.mkdir(parents=True, exist_ok=True)
    partial = pathlib.Path(tempfile.mkdtemp(prefix=f"{tree.name}.", dir=tree.parent))
    try:
        made = subprocess.run(["mmdebstrap", "--quiet", "--mode=root", "--variant=apt", f"--include={wanted}", codename,
                               partial, *_sources(codename)], stdin=subprocess.DEVNULL, capture_output=True, text=True,
                              timeout=900, check=False)
        if made.returncode != 0:
            raise Unavailable("mmdebstrap made no system: " + made.stderr.strip()[-2000:])
        if not tree.is_dir():  # another run may have been quicker
            partial.rename(tree)
    finally:
        shutil.rmtree(partial, ignore_errors=True)
    return tree


class Machine:
    """A booted system over `tree`, which stays as it is. Use as a context; `root` is its file system."""

    def __init__(self, tree):
        self._tree = tree
        self._folder = None
        self._mounted = False
        self._nspawn = None
        self._cgroup = None
        self._leader = None

    def __enter__(self):
        # unittest leaves contexts open when it is interrupted.
        atexit.register(self.__exit__)
        try:
            self._mount()
            self._boot()
        except BaseException:
            self.__exit__()
            raise
        return self

    def _mount(self):
        self._folder = pathlib.Path(tempfile.mkdtemp(prefix="pmcd-machine-"))
        for name in ("upper", "work", "root"):
            (self._folder / name).mkdir()
        options = f"lowerdir={self._tree},upperdir={self._folder / 'upper'},workdir={self._folder / 'work'}"
        subprocess.run(["mount", "-t", "overlay", "overlay", "-o", options, self.root], check=True)
        self._mounted = True

    def _boot(self):
        self._make_cgroup()
        # systemd enforces the device policy and the firewall of units with BPF programs.
        command = ["systemd-nspawn", "--register=no", "--keep-unit", "--quiet", f"--directory={self.root}",
                   "--private-network", "--console=pipe", "--system-call-filter=bpf",
                   "--capability=CAP_BPF,CAP_NET_ADMIN,CAP_PERFMON", "--boot"]
        if self._cgroup:
            command = ["sh", "-c", 'echo $$ >"$0/cgroup.procs" && exec "$@"', self._cgroup, *command]
        with open(self._folder / "boot.log", "wb") as log:
            self._nspawn = subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=log, stderr=log,
                                            env=os.environ | {"SYSTEMD_NSPAWN_UNIFIED_HIERARCHY": "1"})
        wait_for("the machine's first process", 30, self._find_leader)
        wait_for("the end of the boot", 60, lambda: self._state() in ("running", "degraded"))
        if self._state() != "running":
            raise RuntimeError("the machine booted with failed units:\n" + self.run("systemctl", "--failed").stdout)

    def _make_cgroup(self):
        """A control group of the machine's own: two machines started from one group would share theirs."""
        for hierarchy in _mounts("cgroup2"):
            self._cgroup = hierarchy / self._folder.name
            self._cgroup.mkdir()
            break

    def _find_leader(self):
        if self._nspawn.poll() is not None:
            raise RuntimeError("systemd-nspawn ended: " + self.boot_log())
        children = subprocess.run(["pgrep", "--parent", str(self._nspawn.pid)], capture_output=True, text=True,
                                  check=False).stdout.split()
        self._leader = children[0] if children else None
        return self._leader

    def _state(self):
        if self._nspawn.poll() is not None:
            raise RuntimeError("systemd-nspawn ended: " + self.boot_log())
        return self.run("systemctl", "is-system-running").stdout.strip()

    @property
    def root(self):
        return self._folder / "root"

    def boot_log(self):
        return (self._folder / "boot.log").read_text(encoding="utf-8", errors="replace")

    def run(self, *command, user=None, seconds=120):
        """Runs a command inside to its end, as root or as `user`; returns the CompletedProcess with text output."""
        become = ["setpriv", f"--reuid={user}", f"--regid={user}", "--init-groups"] if user else []
        return subprocess.run(
            ["nsenter", f"--target={self._leader}", "--mount", "--pid", "--uts", "--ipc", "--net", "--cgroup", "--root",
             "--wdns=/", *_ENVIRONMENT, *become, *map(str, command)], stdin=subprocess.DEVNULL, capture_output=True,
            text=True, timeout=seconds, check=False)

    def __exit__(self, *_):
        atexit.unregister(self.__exit__)
        if self._nspawn:
            self._stop()
        if self._cgroup:
            self._remove_cgroup()
        if self._mounted:
            subprocess.run(["umount", self.root], check=True)
        if self._folder:
            shutil.rmtree(self._folder)

    def _stop(self):
        self._nspawn.terminate()
        try:
            self._nspawn.wait(timeout=30)
        except subprocess.TimeoutExpired:
            self._nspawn.kill()  # the machine's first process dies with it
            self._nspawn.wait()

    def _remove_cgroup(self):
        """systemd-nspawn leaves empty groups behind, also in the older hierarchies, where it makes one of the same name.

        A group can be removed when its processes are reaped.
        """
        groups = [hierarchy / self._cgroup.name for hierarchy in _mounts("cgroup2", "cgroup")]
        folders = [pathlib.Path(path) for group in groups for path, _, _ in os.walk(group, topdown=False)]

        def removed():
            for folder in folders:
                try:
                    folder.rmdir()
                except FileNotFoundError:
                    pass
                except OSError:
                    return False
            return True

        wait_for("the end of the machine's processes", 30, removed)
