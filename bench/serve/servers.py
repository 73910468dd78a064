# SPDX-License-Identifier: MIT
"""The two servers that bench/serve/run compares, each started on a core of its own with its files in a scratch folder,
and what the kernel says of a process: CPU time and memory. It measures nothing itself."""

import os
import pathlib
import re
import signal
import socket
import subprocess
import time

_PATIENCE_SECONDS = 20


class ServerError(Exception):
    pass


def on_core(core):
    """What a child does before it becomes the program; None leaves the choice of the core to the kernel."""
    return (lambda: os.sched_setaffinity(0, {core})) if core is not None else None


def cpu_seconds(process):
    """User and system time of all threads of a process so far."""
    fields = pathlib.Path(f"/proc/{process}/stat").read_text(encoding="ascii").rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def memory_bytes(process):
    """Resident memory of a process: all of it, its share, and what belongs to it alone."""
    text = pathlib.Path(f"/proc/{process}/smaps_rollup").read_text(encoding="ascii")
    kib = {name: int(value) for name, value in re.findall(r"^(\w+):\s+(\d+) kB", text, re.MULTILINE)}
    return {"rss": kib["Rss"] * 1024, "pss": kib["Pss"] * 1024,
            "private": (kib["Private_Clean"] + kib["Private_Dirty"]) * 1024}


def _wait(condition, process, what):
    deadline = time.monotonic() + _PATIENCE_SECONDS
    while time.monotonic() < deadline:
        answer = condition()
        if answer:
            return answer
        if process.poll() is not None:
            raise ServerError(f"{what} ended with exit code {process.returncode}: {' '.join(process.args)}")
        time.sleep(0.01)
    raise ServerError(f"{what} was not ready after {_PATIENCE_SECONDS} seconds: {' '.join(process.args)}")


def _stop(process):
    process.send_signal(signal.SIGTERM)
    try:
        process.wait(_PATIENCE_SECONDS)
    except subprocess.TimeoutExpired:
        process.kill()
        process.wait()


class Pmcd:
    """A daemon with its log in /dev/null, level info. It says by systemd's protocol that it is ready, and on which
    port. `prefix`: words before the program's name, which must become the program, as `ip netns exec` does."""

    def __init__(self, program, folder, core, options, prefix=()):
        self.admin_socket = str(folder / "admin.sock")
        ready = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
        ready.bind(str(folder / "ready.sock"))
        ready.setblocking(False)
        with ready:
            self._process = subprocess.Popen(
                [*prefix, str(program), "--database", str(folder / "meshes.db"), "--admin-socket", self.admin_socket,
                 "--request-port", "0", "--data-port", "0", "--log-level", "info", *options],
                stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
                preexec_fn=on_core(core), env={**os.environ, "NOTIFY_SOCKET": str(folder / "ready.sock")})
            self.port = _wait(lambda: self._port(ready), self._process, "pmcd")
        self.id = self._process.pid

    @staticmethod
    def _port(ready):
        try:
            message = ready.recv(65536).decode("utf-8", errors="replace")
        except BlockingIOError:
            return None
        port = re.search(r"request port (\d+)", message)
        return int(port[1]) if port and "READY=1" in message else None

    def stop(self):
        _stop(self._process)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.stop()


# As somebody would set it who wants nothing but speed from these files: no log, files kept open, one worker, connections
# that live as long as the client likes, and for each size what was measured to be the fastest way to send it. The kernel
# sends from the page cache, except that reading and one write are quicker for the smallest files; head and body go out
# together, except that for large ones it is quicker to let them go as they come.
_NGINX = """
{user}
daemon off;
worker_processes 1;
pid {folder}/nginx.pid;
error_log {folder}/error.log crit;
events {{
  worker_connections 4096;
}}
http {{
  access_log off;
  server_tokens off;
  etag off;
  default_type application/octet-stream;
  sendfile on;
  tcp_nopush on;
  tcp_nodelay on;
  keepalive_timeout 1h;
  keepalive_requests 1000000000;
  open_file_cache max=100000 inactive=1h;
  open_file_cache_valid 1h;
  open_file_cache_min_uses 1;
  client_body_temp_path {folder}/nginx-body;
  proxy_temp_path {folder}/nginx-proxy;
  fastcgi_temp_path {folder}/nginx-fastcgi;
  uwsgi_temp_path {folder}/nginx-uwsgi;
  scgi_temp_path {folder}/nginx-scgi;
  server {{
    listen 127.0.0.1:{port};
    root {root};
    location /600/ {{
      sendfile off;
    }}
    location /262144/ {{
      tcp_nopush off;
    }}
  }}
}}
"""


class Nginx:
    """nginx with one worker, serving a folder."""

    def __init__(self, folder, root, core):
        with socket.socket() as probe:
            probe.bind(("127.0.0.1", 0))
            self.port = probe.getsockname()[1]
        config = folder / "nginx.conf"
        # Workers of root's nginx would run as another user, who cannot enter the scratch folder.
        user = "user root;" if os.geteuid() == 0 else ""
        config.write_text(_NGINX.format(folder=folder, root=root, port=self.port, user=user), encoding="utf-8")
        self._process = subprocess.Popen(["nginx", "-c", str(config)], stdin=subprocess.DEVNULL,
                                         stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
                                         preexec_fn=on_core(core))
        self.id = _wait(self._worker, self._process, "nginx")

    def _worker(self):
        """The worker's process id, once it answers."""
        with socket.socket() as probe:
            if probe.connect_ex(("127.0.0.1", self.port)) != 0:
                return None
        master = self._process.pid
        children = pathlib.Path(f"/proc/{master}/task/{master}/children").read_text(encoding="ascii").split()
        return int(children[0]) if len(children) == 1 else None

    def stop(self):
        _stop(self._process)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.stop()
