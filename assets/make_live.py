"""Make live.webp: a person at work in the live view, filmed in headless Chromium (tests/live has what drives it).

python assets/make_live.py
"""

import io
import sys
import tempfile
from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent / "tests" / "live"))

from browser import Browser  # noqa: E402
from serving import Serving  # noqa: E402

SIZE, SHOWN, FPS = (1120, 630), (800, 450), 15
SCENE = """
name = "bear"
[camera]
eye = [0.15, -3.3, 1.25]
target = [0.12, 0.0, 0.5]
fov = 32.0
[view]
color = "von-mises"
range = [0.0, 1.5e4]
[[body]]
name = "bear"
mesh = { file = "asset:bear" }
[body.material]
youngs = 9e4
poisson = 0.4
density = 900.0
stiffness_damping = 0.015
fracture = { toughness = 1e9 }
[[body.pin]]
box = { lower = [-2.0, -2.0, -1.0], upper = [2.0, 2.0, 0.1] }
[[collider]]
type = "plane"
friction = 0.6
"""
CURSOR = [(0, 0), (0, 16), (4, 12), (7, 18), (9, 17), (6, 11), (11, 11)]


class Film:
    """Pictures of the page, two steps of the simulation apart; the pointer is painted in."""

    def __init__(self, page):
        self.page, self.pictures, self.at = page, [], (620, 560)

    def shoot(self, steps=4):
        for _ in range(steps):
            seen = self.page.value("taichifem.view.update.number")
            self.page.click("[data-ask=step]")
            self.page.wait(f"taichifem.view.update.number > {seen}", 60)
        image = Image.fromarray(self.page.picture()).resize(SHOWN, Image.LANCZOS)
        pen, scale = ImageDraw.Draw(image), SHOWN[0] / SIZE[0]
        place = [(scale * self.at[0] + 0.9 * x, scale * self.at[1] + 0.9 * y) for x, y in CURSOR]
        pen.polygon(place, fill="white", outline="black")
        self.pictures.append(image)

    def move(self, to, count, pressed=True):
        start = self.at
        for k in range(1, count + 1):
            share = 0.5 - 0.5 * np.cos(np.pi * k / count)
            self.at = tuple(a + (b - a) * share for a, b in zip(start, to, strict=True))
            self.page.mouse("mouseMoved", *self.at, *([] if pressed else ["none"]))
            self.shoot()

    def hold(self):
        self.page.mouse("mousePressed", *self.at)

    def let(self):
        self.page.mouse("mouseReleased", *self.at)

    def wait(self, count):
        for _ in range(count):
            self.shoot()


def slider(page, path, to):
    """Where the thumb of a slider is, and where it is at a part `to` of the way."""
    find = f"document.querySelector('input[type=range][data-path=\"{path}\"]')"
    x, y, width, height, now = page.value(
        f"(() => {{ const s = {find}, b = s.getBoundingClientRect(); "
        "return [b.x, b.y, b.width, b.height, s.value / s.max]; })()"
    )
    return [(x + 8 + share * (width - 16), y + height / 2) for share in (now, to)]


def on_screen(page, point):
    matrix = np.array(page.value("Array.from(taichifem.camera.matrix(taichifem.view.aspect))")).reshape(4, 4).T
    x, y, _, w = matrix @ [*point, 1]
    return (0.5 + 0.5 * x / w) * SIZE[0], (0.5 - 0.5 * y / w) * SIZE[1]


def take(page, film, along):
    """Take hold of what lies farthest in a direction, an ear or a paw, by its middle: it moves meanwhile."""
    for count in (5, 1, 1):
        points = np.array(page.value("Array.from(taichifem.view.update.points)")).reshape(-1, 3)
        tip = points[np.argmax(points @ np.array(along))]
        middle = points[np.linalg.norm(points - tip, axis=1) < 0.12].mean(axis=0)
        film.move(on_screen(page, middle), count, pressed=False)
    film.hold()
    assert page.value("!!taichifem.hand.held"), "the mouse has missed"


def act(page, film):
    film.wait(3)
    take(page, film, (0.45, 0.0, 1.0))
    film.move((690, 60), 10)
    film.wait(3)
    film.let()
    film.wait(9)
    start, end = slider(page, "body.0.material.youngs", 0.22)
    film.move(start, 5, pressed=False)
    film.hold()
    film.move(end, 6)
    film.let()
    film.wait(10)
    start, end = slider(page, "body.0.material.youngs", 0.30)
    film.hold()
    film.move(end, 4)
    film.let()
    start, end = slider(page, "body.0.material.toughness", 0.42)
    film.move(start, 3, pressed=False)
    film.hold()
    film.move(end, 5)
    film.let()
    take(page, film, (1.0, 0.0, 0.1))
    film.move((720, 480), 12)
    film.wait(3)
    film.let()
    film.wait(12)


def main():
    with tempfile.TemporaryDirectory() as folder:
        Path(folder, "bear.toml").write_text(SCENE)
        serving = Serving("bear.toml", folder, "--paused")
        try:
            with Browser(SIZE, graphics="egl") as page:
                page.open(serving.url)
                page.wait("taichifem.panel.rows.size && taichifem.view.update", 120)
                film = Film(page)
                act(page, film)
        finally:
            serving.close()
    file = io.BytesIO()
    first, *rest = film.pictures
    first.save(file, "WEBP", save_all=True, append_images=rest, duration=1000 // FPS, loop=0, quality=48, method=4)
    (HERE / "live.webp").write_bytes(file.getvalue())
    print(f"{len(film.pictures)} pictures, {len(file.getvalue()) / 1000:.0f} kB")
    for k in range(0, len(film.pictures), 12):
        film.pictures[k].save(Path(tempfile.gettempdir(), f"live-{k:03d}.png"))


if __name__ == "__main__":
    main()
