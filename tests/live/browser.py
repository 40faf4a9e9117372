"""Drives a headless Chromium over the DevTools protocol: one page, its mouse, and pictures of it."""

import base64
import io
import itertools
import json
import os
import shutil
import subprocess
import tempfile
import time
import urllib.request
from contextlib import ExitStack
from pathlib import Path

import numpy as np
from PIL import Image
from websockets.sync.client import connect

NAMES = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable")
FLAGS = [
    "--headless=new",
    "--no-sandbox",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--disable-dev-shm-usage",
    "--remote-debugging-port=0",
    "--hide-scrollbars",
]
GRAPHICS = {
    "swiftshader": ["--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"],
    "egl": ["--use-gl=angle", "--use-angle=gl-egl", "--ignore-gpu-blocklist"],
}


def chromium() -> str | None:
    """The program, if there is one."""
    return next(filter(None, map(shutil.which, NAMES)), None)


class Browser:
    """A page of `size` pixels. A context manager."""

    def __init__(self, size=(1280, 720), graphics="swiftshader"):
        self.folder = Path(tempfile.mkdtemp(prefix="chromium-"))
        flags = [*FLAGS, *GRAPHICS[graphics], f"--user-data-dir={self.folder}", f"--window-size={size[0]},{size[1]}"]
        # The distribution's wrapper script wants a home.
        environment = {**os.environ, "HOME": str(self.folder)}
        quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
        self.process = subprocess.Popen([chromium(), *flags, "about:blank"], env=environment, **quiet)
        port = self._port()
        with urllib.request.urlopen(f"http://127.0.0.1:{port}/json/list", timeout=10) as answer:
            page = next(target for target in json.load(answer) if target["type"] == "page")
        self.opened = ExitStack()
        self.socket = self.opened.enter_context(connect(page["webSocketDebuggerUrl"], max_size=None, close_timeout=1))
        self.numbers = itertools.count(1)
        self.problems = []
        self.call("Page.enable")
        self.call("Runtime.enable")
        width, height = size
        self.call("Emulation.setDeviceMetricsOverride", width=width, height=height, deviceScaleFactor=1, mobile=False)

    def _port(self):
        file = self.folder / "DevToolsActivePort"
        for _ in range(300):
            if file.exists() and (lines := file.read_text().split()):
                return int(lines[0])
            time.sleep(0.1)
        raise TimeoutError("Chromium does not start")

    def call(self, method, **parameters):
        number = next(self.numbers)
        self.socket.send(json.dumps({"id": number, "method": method, "params": parameters}))
        while True:
            answer = json.loads(self.socket.recv(timeout=60))
            if answer.get("method") == "Runtime.exceptionThrown":
                self.problems.append(answer["params"]["exceptionDetails"])
            if answer.get("id") == number:
                assert "error" not in answer, answer["error"]
                return answer["result"]

    def open(self, url):
        self.call("Page.navigate", url=url)

    def value(self, expression):
        """What the expression is in the page."""
        found = self.call("Runtime.evaluate", expression=expression, returnByValue=True, awaitPromise=True)
        assert "exceptionDetails" not in found, found["exceptionDetails"]
        return found["result"].get("value")

    def wait(self, expression, seconds=30.0):
        """Wait until the expression is true; its value."""
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            found = self.value(f"(() => {{ try {{ return {expression}; }} catch (error) {{ return null; }} }})()")
            if found:
                return found
            time.sleep(0.05)
        raise TimeoutError(f"{expression} does not come true; {self.problems}")

    def mouse(self, kind, x, y, button="left"):
        pressed = 0 if kind == "mouseReleased" or button == "none" else 1
        self.call(
            "Input.dispatchMouseEvent", type=kind, x=x, y=y, button=button, buttons=pressed, clickCount=int(pressed)
        )

    def press(self, x, y):
        self.mouse("mouseMoved", x, y, "none")
        self.mouse("mousePressed", x, y)

    def pull(self, start, end, moves=10):
        """From one place to another with the button down."""
        for k in range(1, moves + 1):
            self.mouse("mouseMoved", *(a + (b - a) * k / moves for a, b in zip(start, end, strict=True)))

    def click(self, selector):
        self.value(f"document.querySelector({json.dumps(selector)}).click()")

    def slide(self, path, to):
        """Drag the slider of a parameter with the mouse to a part (0 to 1) of its way."""
        find = f"document.querySelector('input[type=range][data-path=\"{path}\"]')"
        self.value(f"{find}.scrollIntoView({{block: 'center'}})")
        box = self.value(f"(() => {{ const s = {find}, b = s.getBoundingClientRect(); "
                         "return [b.x, b.y, b.width, b.height, s.value / s.max]; })()")  # fmt: skip
        x, y, width, height, now = box
        thumb = 16
        ends = [(x + thumb / 2 + share * (width - thumb), y + height / 2) for share in (now, to)]
        self.press(*ends[0])
        self.pull(*ends)
        self.mouse("mouseReleased", *ends[1])

    def picture(self, path=None):
        """What the page looks like (height,width,3) uint8, with all that it has drawn until now."""
        # What a page draws is shown with its next frame, and a slow one is asked for when that has begun.
        self.value("new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))")
        data = base64.b64decode(self.call("Page.captureScreenshot", format="png")["data"])
        if path is not None:
            Path(path).write_bytes(data)
        return np.asarray(Image.open(io.BytesIO(data)).convert("RGB"))

    def kill(self):
        """End it at once, as a crash would."""
        self.process.kill()
        self.process.wait()

    def close(self):
        self.opened.close()
        self.process.terminate()
        try:
            self.process.wait(timeout=10)
        except subprocess.TimeoutExpired:
            self.kill()
        shutil.rmtree(self.folder, ignore_errors=True)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.close()
