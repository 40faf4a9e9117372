"""PyVista (VTK) for stills: an extra, and asked in a process apart, as VTK ends the process where a driver lacks."""

from __future__ import annotations

import functools
import importlib.util
import os
import subprocess
import sys

import numpy as np

from taichifem.description.view import Camera
from taichifem.errors import InputError
from taichifem.output import colors
from taichifem.output.camera import Framing
from taichifem.output.frame import Frame
from taichifem.output.overlay import annotate
from taichifem.output.solids import Solids

_PROBE = """
import os, pyvista
plotter = pyvista.Plotter(off_screen=True, window_size=(32, 32))
plotter.set_background("red")
plotter.render_window.SetMultiSamples(0)
plotter.show(auto_close=False)
color = plotter.screenshot(return_img=True)[16, 16]
os._exit(0 if color[0] > 200 and color[1] < 60 else 3)
"""
_TIMEOUT = 60


@functools.cache
def probe() -> tuple[bool, str]:
    """(works, "") or (does not, why). Asks in a process apart, once; takes seconds."""
    if importlib.util.find_spec("pyvista") is None:
        return False, 'PyVista is not installed: pip install "taichifem[vtk]"'
    if sys.platform.startswith("linux") and not os.environ.get("DISPLAY"):
        # Otherwise VTK looks for an X server first, and complains.
        os.environ.setdefault("VTK_DEFAULT_OPENGL_WINDOW", "vtkEGLRenderWindow")
    try:
        run = subprocess.run([sys.executable, "-c", _PROBE], capture_output=True, text=True, timeout=_TIMEOUT)
    except subprocess.TimeoutExpired:
        return False, f"no answer from VTK within {_TIMEOUT} s"
    except OSError as error:
        return False, f"cannot start a process to try VTK: {error}"
    if run.returncode == 0:
        return True, ""
    return False, "VTK cannot draw here: install EGL (Debian, Ubuntu: apt-get install libegl1 libgl1)"


class PyVistaRenderer:
    """Draws frames with VTK: shadows are left out, ambient occlusion and multi-sampling are not."""

    def __init__(self, size: tuple[int, int] = (1280, 720), camera: Camera | None = None) -> None:
        ok, why = probe()
        if not ok:
            raise InputError(f"renderer pyvista is not available: {why}")
        import pyvista

        self._pyvista = pyvista
        self.size = size
        self._framing = Framing(camera, size)
        self._plotter = pyvista.Plotter(off_screen=True, window_size=list(size), lighting="light kit")
        self._plotter.render_window.SetMultiSamples(0)
        self._plotter.set_background("#f3f5f7", top="#d9e2ec")
        self._plotter.enable_anti_aliasing("ssaa")

    def draw(self, frame: Frame) -> np.ndarray:
        """The picture (height,width,3) uint8."""
        viewpoint = self._framing.of(lambda: Solids(frame).subject())
        solids = Solids(frame, viewpoint.eye)
        plotter, bodies = self._plotter, len(frame.triangles)
        plotter.clear_actors()
        self._add(solids, np.arange(bodies), edges=frame.wire)
        self._add(solids, np.arange(bodies, len(solids.triangles) - 1), edges=False)
        if solids.floor is not None and solids.floor.normal @ (viewpoint.eye - solids.floor.center) > 0:
            normal = solids.floor.normal
            foot = viewpoint.target - ((viewpoint.target - solids.floor.center) @ normal) * normal
            disc = self._pyvista.Disc(center=foot, inner=0, outer=2 * viewpoint.reach, normal=normal, c_res=96)
            plotter.add_mesh(disc, color="#e4e5e6", lighting=False)  # the light kit would stain it
        plotter.camera.position = tuple(viewpoint.eye)
        plotter.camera.focal_point = tuple(viewpoint.target)
        plotter.camera.up = tuple(viewpoint.up)
        plotter.camera.view_angle = viewpoint.fov
        plotter.reset_camera_clipping_range()
        plotter.show(auto_close=False)
        plotter.render()
        return annotate(np.array(plotter.screenshot(return_img=True)[..., :3]), frame)

    def _add(self, solids: Solids, which: np.ndarray, *, edges: bool) -> None:
        if not len(which):
            return
        triangles = solids.triangles[which]
        faces = np.column_stack([np.full(len(triangles), 3), np.arange(3 * len(triangles)).reshape(-1, 3)])
        mesh = self._pyvista.PolyData(solids.points[triangles].reshape(-1, 3), faces.ravel())
        mesh["rgb"] = (255 * colors.to_srgb(solids.colors[which].reshape(-1, 3)) + 0.5).astype(np.uint8)
        # Corners apart carry their own colours; joined again they get common normals, split at creases.
        mesh = mesh.clean(tolerance=0.0) if np.ptp(mesh["rgb"], axis=0).max() == 0 else mesh
        self._plotter.add_mesh(
            mesh, scalars="rgb", rgb=True, smooth_shading=True, split_sharp_edges=True, show_edges=edges, specular=0.2
        )

    def move(self, camera: Camera) -> None:
        """Look from `camera` from the next frame on."""
        self._framing.move(camera)

    def close(self) -> None:
        """Let VTK's window go."""
        if self._plotter is not None:
            self._plotter.close()
        self._plotter = None
