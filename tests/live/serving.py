"""A live view in a process of its own, and what a browser would say to it."""

import json
import os
import re
import subprocess
import sys
import threading
from contextlib import ExitStack
from pathlib import Path
from urllib.parse import parse_qs, urlsplit

import numpy as np
from websockets.sync.client import connect

CHECKOUT = Path(__file__).resolve().parents[2]


class Serving:
    """`taichifem live SCENE` with more arguments, in `folder`."""

    def __init__(self, scene, folder, *arguments):
        path = os.pathsep.join(filter(None, [str(CHECKOUT), os.environ.get("PYTHONPATH")]))
        command = [sys.executable, "-m", "taichifem", "live", str(scene), "--no-browser", "--port", "0", *arguments]
        pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.STDOUT}
        environment = {**os.environ, "PYTHONPATH": path, "PYTHONUNBUFFERED": "1"}
        self.process = subprocess.Popen(command, cwd=folder, text=True, env=environment, **pipes)
        self.said = []
        for line in self.process.stdout:
            self.said.append(line)
            if found := re.search(r"http://\S+", line):
                self.url = found[0]
                break
        else:
            raise AssertionError("".join(self.said))
        self._reader = threading.Thread(target=lambda: self.said.extend(self.process.stdout), daemon=True)
        self._reader.start()

    @property
    def memory(self):
        """Resident memory [MB]."""
        status = Path(f"/proc/{self.process.pid}/status").read_text()
        return int(re.search(r"VmRSS:\s+(\d+)", status)[1]) / 1024

    def close(self):
        """End it as Ctrl-C does; what it said."""
        self.process.terminate()
        self.process.wait(timeout=30)
        self._reader.join(timeout=10)
        return "".join(self.said)


class Client:
    """Says what a browser says, and reads what it gets. A context manager."""

    def __init__(self, url, *, origin=None, token=None):
        parts = urlsplit(url)
        token = parse_qs(parts.query)["token"][0] if token is None else token
        origin = f"http://{parts.netloc}" if origin is None else origin
        self.opened = ExitStack()
        address = f"ws://{parts.netloc}/socket?token={token}"
        made = connect(address, origin=origin or None, max_size=None, compression=None, close_timeout=1)
        self.socket = self.opened.enter_context(made)
        self.last, self.updates, self.bytes, self.notices = {}, 0, 0, []
        self.topology = self.points = None
        self.triangles = 0

    def send(self, **message):
        self.socket.send(json.dumps(message))

    def read(self, *, draw=True, timeout=60.0):
        """Take one message: its type, and its content."""
        data = self.socket.recv(timeout=timeout)
        self.bytes += len(data)
        if isinstance(data, str):
            message = json.loads(data)
            self.last[message["type"]] = message
            if message["type"] == "notice":
                self.notices.append(message["text"])
            return message["type"], message
        kind, version, number, nodes = np.frombuffer(data, "<u4", 4)
        if kind == 1:
            self.topology = int(version), np.frombuffer(data, "<u4", int(number), 24)
            self.triangles = int(nodes)
            return "topology", None
        assert self.topology[0] == version
        self.updates += 1
        self.time = float(np.frombuffer(data, "<f4", 1, 32)[0])
        self.points = np.frombuffer(data, "<f4", 3 * int(nodes), 48).reshape(-1, 3)
        if draw:
            self.send(drawn=int(number))
        return "update", int(number)

    def until(self, true, *, most=100_000):
        """Read until `true()`."""
        for _ in range(most):
            if true():
                return
            self.read()
        raise AssertionError("it does not come true")

    def close(self):
        self.opened.close()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.close()
