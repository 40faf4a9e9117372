"""The renderers that need more than Taichi's kernels: they draw where they can, and say why where they cannot."""

import os

import numpy as np
import pytest

from taichifem.description import Camera
from taichifem.errors import InputError
from taichifem.output import ggui, vtk
from taichifem.output.frame import Frame, Shape, triangulate
from taichifem.output.renderer import make_renderer

SIZE = (160, 120)


def ball() -> Frame:
    points, triangles = triangulate(Shape(kind="sphere", rotation=np.eye(3), center=np.zeros(3), radius=0.5))
    red = np.tile(np.float32([0.8, 0.1, 0.1]), (len(triangles), 1))
    return Frame(points=points, triangles=triangles, colors=red)


def check_ball(name: str) -> None:
    renderer = make_renderer(name, SIZE, camera=Camera(eye=(0, -4, 0), target=(0, 0, 0)))
    image = renderer.draw(ball())
    renderer.close()
    assert image.shape == (120, 160, 3) and image.dtype == np.uint8
    seen = image[..., 0].astype(int) > image[..., 2].astype(int) + 30
    radius = 60 / np.tan(np.radians(17.5)) * 0.5 / np.sqrt(4**2 - 0.5**2)
    assert seen.sum() == pytest.approx(np.pi * radius**2, rel=0.1)
    assert np.argwhere(seen).mean(axis=0) == pytest.approx([59.5, 79.5], abs=1.5)
    assert image[42, 80].sum() > image[78, 80].sum(), "lit from above"


def test_ggui():
    ok, why = ggui.probe()
    if not ok:
        pytest.skip(why)
    check_ball("ggui")
    assert not os.path.exists("imgui.ini")


@pytest.mark.slow
def test_pyvista():
    ok, why = vtk.probe()
    if not ok:
        pytest.skip(why)
    check_ball("pyvista")


def test_a_renderer_that_is_not_there_says_so_in_one_line(monkeypatch):
    monkeypatch.setattr(ggui, "probe", lambda: (False, "no Vulkan"))
    monkeypatch.setattr(vtk, "probe", lambda: (False, "no PyVista"))
    for name in ("ggui", "pyvista"):
        with pytest.raises(InputError, match=f"renderer {name} is not available: no") as error:
            make_renderer(name)
        assert "\n" not in str(error.value)


def test_ggui_probe_keeps_a_yes_and_asks_again_after_a_no(monkeypatch, tmp_path):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    monkeypatch.setattr(ggui, "cache_folder", lambda: tmp_path)
    answers = iter([(False, "no"), (True, "")])
    monkeypatch.setattr(ggui, "_ask", lambda: next(answers))
    assert ggui.probe() == (False, "no")
    assert ggui.probe() == (True, "")
    assert ggui.probe() == (True, ""), "kept: a third question would end the iterator"


def test_ggui_probe_survives_a_crash(monkeypatch):
    monkeypatch.setattr(ggui, "_PROBE", "import os; os.abort()")
    ok, why = ggui._ask()
    assert not ok and "apt-get install libvulkan1" in why
