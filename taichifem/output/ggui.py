"""Taichi's own renderer (GGUI) in a hidden window: where Vulkan works. No shadow, no anti-aliasing.

GGUI ends the process from C++ where something is missing, so whether it works is asked in a process apart, and
the answer is kept on disk.
"""

from __future__ import annotations

import atexit
import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np

from taichifem import runtime
from taichifem.description.view import Camera
from taichifem.errors import InputError
from taichifem.output import colors
from taichifem.output.camera import Framing, Viewpoint
from taichifem.output.frame import Frame
from taichifem.output.overlay import annotate
from taichifem.output.solids import CornerNormals, Solids
from taichifem.runtime import ti

_PROBE = """
import os, sys, tempfile
os.chdir(tempfile.mkdtemp())
import taichi as ti
ti.init(arch=ti.cpu, log_level=ti.ERROR, offline_cache=False)
window = ti.ui.Window("probe", (32, 32), show_window=False)
window.get_canvas().set_background_color((1.0, 0.0, 0.0))
color = window.get_image_buffer_as_numpy()[16, 16]
sys.stdout.flush()
os._exit(0 if color[0] > 0.9 and color[1] < 0.1 else 3)
"""
_TIMEOUT = 30
_REMEDY = "install a Vulkan driver (Debian, Ubuntu: apt-get install libvulkan1 mesa-vulkan-drivers)"
_WINDOW_LIFE = 600
_VISIBLE_LIFE = 6000
"""Frames after which the window is made anew: GGUI keeps some memory of every mesh drawn."""

_HORIZON = colors.parse_hex("#f3f5f7")
_FLOOR = colors.parse_hex("#e2e3e4")


def cache_folder() -> Path:
    """Where answers of probes are kept: the user's cache folder."""
    if sys.platform == "win32":
        base = os.environ.get("LOCALAPPDATA") or Path.home() / "AppData" / "Local"
    elif sys.platform == "darwin":
        base = Path.home() / "Library" / "Caches"
    else:
        base = os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache"
    return Path(base) / "taichifem"


def probe(*, again: bool = False) -> tuple[bool, str]:
    """(works, "") or (does not, why). Asks in a process apart the first time, or `again`; takes seconds then."""
    kept = cache_folder() / "ggui.json"
    key = f"taichi {'.'.join(map(str, ti.__version__))}"
    if not again:
        try:
            answer = json.loads(kept.read_text())
            # Only a yes is kept: a no may be mended by installing a driver.
            if answer == {"key": key, "works": True}:
                return True, ""
        except (OSError, ValueError):
            pass
    ok, why = _ask()
    try:
        kept.parent.mkdir(parents=True, exist_ok=True)
        kept.write_text(json.dumps({"key": key, "works": ok}))
    except OSError:
        pass
    return ok, why


def _ask() -> tuple[bool, str]:
    try:
        run = subprocess.run([sys.executable, "-c", _PROBE], capture_output=True, text=True, timeout=_TIMEOUT)
    except subprocess.TimeoutExpired:
        return False, f"no answer from Vulkan within {_TIMEOUT} s"
    except OSError as error:
        return False, f"cannot start a process to try Vulkan: {error}"
    if run.returncode == 0:
        return True, ""
    if run.returncode == 3:
        return False, "Vulkan draws wrong colours"
    return False, f"Vulkan does not work here: {_REMEDY}"


@atexit.register
def _close_window() -> None:
    """A window that is open at the end of the process would leave imgui.ini behind."""
    if GguiRenderer._drawing is not None:
        GguiRenderer._drawing.close()


class GguiRenderer:
    """Draws frames in a hidden GGUI window. One at a time in a process: the last one made draws.

    visible: the window is shown; who uses `place` and `window` then draws its widgets and shows it.
    """

    _drawing: GguiRenderer | None = None

    def __init__(
        self,
        size: tuple[int, int] = (1280, 720),
        camera: Camera | None = None,
        *,
        arch: str | None = None,
        visible: bool = False,
    ) -> None:
        ok, why = probe()
        if not ok:
            raise InputError(f"renderer ggui is not available: {why}, or use the renderer taichi")
        self.size = size
        self._arch, self._visible = arch, visible
        self._framing = Framing(camera, size)
        self._normals = CornerNormals()
        self._window = self._scene = None
        self._drawn = 0
        self._generation = -1
        self._capacity = 0

    def draw(self, frame: Frame) -> np.ndarray:
        """The picture (height,width,3) uint8."""
        runtime.start(arch=self._arch)
        viewpoint = self._framing.of(lambda: Solids(frame).subject())
        solids = Solids(frame, viewpoint.eye)
        settings_file = Path("imgui.ini")
        was_there = settings_file.exists()
        self._open()
        picture = self._render(solids, viewpoint)
        # A window made after another one sometimes leaves out the scene: then a new one gets it right.
        for _ in range(4):
            if (picture != picture[0, 0]).any():
                break
            self._drawn = _WINDOW_LIFE
            self._open()
            picture = self._render(solids, viewpoint)
        if not was_there:
            settings_file.unlink(missing_ok=True)
        return annotate(picture, frame)

    @property
    def window(self) -> ti.ui.Window:
        """The window that `place` has drawn into."""
        return self._window

    def place(self, frame: Frame) -> Viewpoint:
        """Draw a frame into the window; where it is seen from."""
        viewpoint = self._framing.of(lambda: Solids(frame).subject())
        self._open()
        self._draw(Solids(frame, viewpoint.eye), viewpoint)
        return viewpoint

    def move(self, camera: Camera) -> None:
        """Look from `camera` from the next frame on."""
        self._framing.move(camera)

    def close(self) -> None:
        """Destroy the window."""
        if self._window is not None and self._generation == runtime.generation:
            was_there = Path("imgui.ini").exists()
            self._window.destroy()
            if not was_there:
                Path("imgui.ini").unlink(missing_ok=True)
        self._window = self._scene = None
        if GguiRenderer._drawing is self:
            GguiRenderer._drawing = None

    def _open(self) -> None:
        if self._generation != runtime.generation:
            self._window, self._capacity = None, 0  # went with the Taichi they were made in
        if self._window is not None and self._drawn < (_VISIBLE_LIFE if self._visible else _WINDOW_LIFE):
            return
        if GguiRenderer._drawing is not None:
            GguiRenderer._drawing.close()
        self._window = ti.ui.Window("taichifem", self.size, show_window=self._visible, vsync=False)
        self._scene = self._window.get_scene()
        self._camera = ti.ui.Camera()
        self._drawn, self._generation = 0, runtime.generation
        GguiRenderer._drawing = self

    def _render(self, solids: Solids, viewpoint: Viewpoint) -> np.ndarray:
        self._draw(solids, viewpoint)
        image = self._window.get_image_buffer_as_numpy()
        picture = image.transpose(1, 0, 2)[::-1, :, :3]
        return np.ascontiguousarray((np.clip(picture, 0, 1) * 255 + 0.5).astype(np.uint8))

    def _draw(self, solids: Solids, viewpoint: Viewpoint) -> None:
        points, normals, shades = _triangle_soup(solids, self._normals.of(solids), viewpoint)
        if solids.floor is not None and solids.floor.normal @ (viewpoint.eye - solids.floor.center) > 0:
            disc = _floor_disc(solids, viewpoint)
            points, normals, shades = (np.concatenate(p) for p in zip((points, normals, shades), disc, strict=True))
        count = len(points)
        if count > self._capacity:
            self._capacity = 1 << (count - 1).bit_length()
            self._fields = [ti.Vector.field(3, ti.f32, shape=self._capacity) for _ in range(3)]
        for target, source in zip(self._fields, (points, normals, shades), strict=True):
            padded = np.zeros((self._capacity, 3), np.float32)
            padded[:count] = source
            target.from_numpy(padded)

        self._drawn += 1
        self._camera.position(*viewpoint.eye)
        self._camera.lookat(*viewpoint.target)
        self._camera.up(*viewpoint.up)
        self._camera.fov(viewpoint.fov)
        self._camera.z_near(0.01 * viewpoint.reach)
        self._camera.z_far(40 * viewpoint.reach)
        scene = self._scene
        scene.set_camera(self._camera)
        scene.ambient_light((0.42, 0.44, 0.47))
        lamp = viewpoint.target + viewpoint.reach * (-4 * viewpoint.forward - 4 * viewpoint.right + 6 * viewpoint.up)
        scene.point_light(pos=tuple(lamp), color=(0.62, 0.60, 0.56))
        positions, normal_field, color_field = self._fields
        scene.mesh(positions, normals=normal_field, per_vertex_color=color_field, vertex_count=count)
        canvas = self._window.get_canvas()
        canvas.set_background_color(tuple(float(c) for c in _HORIZON))
        canvas.scene(scene)


def _triangle_soup(
    solids: Solids, normals: np.ndarray, viewpoint: Viewpoint
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    corners = solids.points[solids.triangles]
    a, b, c = corners[:, 0], corners[:, 1], corners[:, 2]
    # GGUI's own two-sided light treats what is turned away from the lamp as if it faced it.
    facing = (np.cross(b - a, c - a) * (viewpoint.eye.astype(np.float32) - a)).sum(axis=1)
    normals = np.where(facing[:, None, None] < 0, -normals, normals).reshape(-1, 3)
    # It also writes what it is given straight into the picture, so it gets sRGB.
    return corners.reshape(-1, 3), normals, colors.to_srgb(solids.colors).reshape(-1, 3)


def _floor_disc(solids: Solids, viewpoint: Viewpoint) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Rings of triangles on the ground, going over into the background outwards."""
    u, v, normal = solids.floor.rotation.T
    middle = viewpoint.target - ((viewpoint.target - solids.floor.center) @ normal) * normal
    turn = np.linspace(0, 2 * np.pi, 49)
    spokes = np.cos(turn)[:, None] * u + np.sin(turn)[:, None] * v
    radii = viewpoint.reach * np.array([0, 0.8, 1.6, 2.4, 3.2])
    rings = middle + radii[:, None, None] * spokes
    fade = np.clip(radii / radii[-1], 0, 1)[:, None]
    tints = (1 - fade) * _FLOOR + fade * _HORIZON
    a, b, c, d = rings[:-1, :-1], rings[1:, :-1], rings[1:, 1:], rings[:-1, 1:]
    points = np.stack([a, b, c, a, c, d], axis=2).reshape(-1, 3)
    inner, outer = (np.broadcast_to(t[:, None], a.shape) for t in (tints[:-1], tints[1:]))
    shades = np.stack([inner, outer, outer, inner, outer, inner], axis=2).reshape(-1, 3)
    return points, np.broadcast_to(normal, points.shape), shades
