"""How much goes to a browser, and whether the simulation keeps time meanwhile.

    python tests/live/rates.py

A client that only reads, then headless Chromium with software graphics. Nothing else should run.
"""

import tempfile
import time
from pathlib import Path

from browser import GRAPHICS, Browser, chromium
from serving import Client, Serving

SCENE = """
name = "slab"
[view]
color = "von-mises"
[[body]]
mesh = {{ shape = "bar", size = [2.0, 2.0, 0.05], cells = [{0}, {0}, 1] }}
material = {{ youngs = 1e5, poisson = 0.3, stiffness_damping = 0.01 }}
[[body.pin]]
box = {{ lower = [-1, -1, -1], upper = [1e-6, 3, 3] }}
"""
SECONDS = 10.0


def read(url):
    with Client(url) as client:
        client.until(lambda: client.updates > 60)
        begin, updates, size, at = time.monotonic(), client.updates, client.bytes, client.time
        while time.monotonic() - begin < SECONDS:
            client.read()
        wall, count = time.monotonic() - begin, client.updates - updates
        factor, figures = (client.time - at) / wall, client.last["figures"]
        print(
            f"{figures['elements']} tetrahedra, {figures['ms']:.1f} ms a step: {count / wall:.0f} updates a second, "
            f"{(client.bytes - size) / count / 1e3:.1f} kB each, {factor:.2f} x real time"
        )


def draw(url, graphics):
    with Browser((1280, 720), graphics) as page:
        page.open(url)
        page.wait("taichifem.state.updates > 10", 120)
        begin, before = time.monotonic(), page.value("taichifem.state.updates")
        time.sleep(SECONDS)
        rate = (page.value("taichifem.state.updates") - before) / (time.monotonic() - begin)
        factor = page.value("taichifem.state.figures.factor")
        print(f"  Chromium, {graphics}, 1280x720: {rate:.1f} pictures a second, {factor:.2f} x real time")


def main():
    with tempfile.TemporaryDirectory() as folder:
        for cells in (32, 49):
            path = Path(folder, "slab.toml")
            path.write_text(SCENE.format(cells))
            print(f"{4 * cells * cells + 8 * cells} triangles on the surface")
            serving = Serving(path, folder)
            try:
                read(serving.url)
                for graphics in GRAPHICS if chromium() else ():
                    draw(serving.url, graphics)
            finally:
                serving.close()


if __name__ == "__main__":
    main()
