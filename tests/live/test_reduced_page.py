"""Boundary elements in a real browser: taken hold of with the mouse, and what the page offers for them."""

import numpy as np
import pytest
from browser import Browser, chromium
from serving import Serving

SCENE = """\
name = "bar"
[simulation]
integrator = "quasi-static"
gravity = [0, 0, 0]
[camera]
eye = [0.5, -2.2, 0.5]
target = [0.35, 0.1, 0.0]
[view]
color = "von-mises"
[[body]]
mesh = { shape = "bar", size = [0.6, 0.2, 0.2], cells = [6, 2, 2] }
material = { model = "bem", youngs = 2e5, poisson = 0.3 }
[[body.pin]]
box = { lower = [-1, -1, -1], upper = [1e-6, 1, 1] }
"""
SIZE = (1000, 600)


def points(page):
    return np.array(page.value("Array.from(taichifem.view.update.points)")).reshape(-1, 3)


def on_screen(page, point):
    matrix = page.value("Array.from(taichifem.camera.matrix(taichifem.view.aspect))")
    x, y, _, w = np.array(matrix).reshape(4, 4).T @ [*point, 1]
    return (0.5 + 0.5 * x / w) * SIZE[0], (0.5 - 0.5 * y / w) * SIZE[1]


@pytest.mark.slow
@pytest.mark.skipif(chromium() is None, reason="Chromium is not installed: nothing to look at pages with")
def test_the_mouse_pulls_a_bar_of_boundary_elements(tmp_path):
    (tmp_path / "bar.toml").write_text(SCENE)
    serving = Serving("bar.toml", tmp_path)
    with Browser(SIZE) as page:
        page.open(serving.url)
        page.wait("taichifem.state.updates > 3 && taichifem.panel.rows.size", 180)
        assert page.value("document.querySelector('[data-tool=throw]').hidden")
        assert page.value("[...taichifem.panel.rows.keys()].filter((path) => path.startsWith('body')).length") == 1
        rest = points(page)
        before = page.picture().astype(int)
        tip = rest[np.argmax(rest @ (1.0, -0.5, 0.01))]
        start = on_screen(page, tip + np.array([-0.03, 0.0, -0.02]))
        end = start[0], start[1] - 60
        page.press(*start)
        page.wait("taichifem.hand.held")
        page.pull(start, end)
        top = 3 * int(np.argmax(rest @ (1.0, -0.5, 0.01))) + 2
        page.wait(f"taichifem.view.update.points[{top}] > {rest.ravel()[top]} + 0.02")
        changed = np.abs(page.picture().astype(int) - before).max(axis=2)
        assert (changed[:, :650] > 40).mean() > 0.01
        page.mouse("mouseReleased", *end)
        page.wait(f"Math.abs(taichifem.view.update.points[{top}] - {rest.ravel()[top]}) < 1e-6")
        assert not page.problems
    assert "Traceback" not in serving.close()
