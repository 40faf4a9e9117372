"""How much goes to a browser, and whether the simulation keeps time meanwhile.

    python tests/live/rates.py

A client that only reads, then headless Chromium with software graphics. Nothing else should run.
"""

import tempfile
import time
from pathlib import Path

import meshio
from browser import GRAPHICS, Browser, chromium
from serving import Client, Serving

import taichifem as tf

SCENE = """
name = "block"
[view]
color = "von-mises"
[[body]]
mesh = { shape = "bar", size = [1.0, 0.5, 0.5], cells = [16, 8, 8] }
material = { youngs = 1e5, poisson = 0.3, stiffness_damping = 0.01 }
EMBED
[[body.pin]]
box = { lower = [-1, -1, -1], upper = [1e-6, 3, 3] }
"""
SECONDS = 10.0


def block(folder: Path, cells: tuple[int, int, int] | None) -> Path:
    """A block of 5,120 tetrahedra; with a surface embedded that is that of a block of so many cells."""
    text, path = SCENE.replace("EMBED", ""), folder / "block.toml"
    if cells is not None:
        fine = tf.TetMesh.bar(size=(1.0, 0.5, 0.5), cells=cells)
        meshio.Mesh(fine.points, [("triangle", fine.surface())]).write(folder / "fine.obj")
        text = SCENE.replace("EMBED", 'embed = "fine.obj"')
    path.write_text(text)
    return path


def read(url):
    with Client(url) as client:
        client.until(lambda: client.updates > 60)
        begin, updates, size, at = time.monotonic(), client.updates, client.bytes, client.time
        while time.monotonic() - begin < SECONDS:
            client.read()
        wall, count = time.monotonic() - begin, client.updates - updates
        factor, figures = (client.time - at) / wall, client.last["figures"]
        print(
            f"{figures['elements']:,} tetrahedra, {figures['ms']:.1f} ms a step, {client.triangles:,} triangles: "
            f"{count / wall:.0f} updates a second, {(client.bytes - size) / count:,.0f} bytes each, "
            f"{factor:.2f} x real time"
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
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for cells in (None, (45, 23, 22)):
            serving = Serving(block(folder, cells), folder)
            try:
                read(serving.url)
                for graphics in GRAPHICS if chromium() else ():
                    draw(serving.url, graphics)
            finally:
                serving.close()


if __name__ == "__main__":
    main()
