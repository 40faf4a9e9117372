"""One interface for everything that turns a frame into pixels."""

from __future__ import annotations

from typing import Protocol

import numpy as np

from taichifem.description.view import RENDERERS, Camera
from taichifem.errors import InputError
from taichifem.output.frame import Frame


class Renderer(Protocol):
    """Draws frames of one size from one viewpoint, which the first frame fixes."""

    size: tuple[int, int]

    def draw(self, frame: Frame) -> np.ndarray:
        """The picture (height,width,3) uint8, sRGB."""
        ...

    def move(self, camera: Camera) -> None:
        """Look from `camera` from the next frame on."""
        ...

    def close(self) -> None:
        """Let go of windows and the like; the renderer is done."""
        ...


def make_renderer(
    name: str = "auto",
    size: tuple[int, int] = (1280, 720),
    *,
    camera: Camera | None = None,
    quality: str = "final",
    arch: str | None = None,
) -> Renderer:
    """A renderer: "taichi" (also "auto"), "ggui" or "pyvista", for pictures of `size` (width, height).

    camera: None, or None in its parts, lets the first frame choose.  quality: "final" or "draft" (no
    anti-aliasing; only the Taichi rasteriser makes a difference).  arch: what Taichi starts on if it does not
    run yet (None: whatever runs, else "cpu").
    Raises InputError if the name is unknown or the renderer does not work on this machine.
    """
    if name not in RENDERERS:
        raise InputError(f"renderer is {name!r}: choose one of {', '.join(RENDERERS)}")
    if quality not in ("final", "draft"):
        raise InputError(f'quality is {quality!r}: choose "final" or "draft"')
    if len(size) != 2 or min(size) < 16 or max(size) > 8192:
        raise InputError(f"picture size {tuple(size)} must be (width, height), each 16 to 8192 pixels")
    size = (int(size[0]), int(size[1]))
    if name == "ggui":
        from taichifem.output.ggui import GguiRenderer

        return GguiRenderer(size, camera, arch=arch)
    if name == "pyvista":
        from taichifem.output.vtk import PyVistaRenderer

        return PyVistaRenderer(size, camera)
    from taichifem.output.rasterizer import Rasterizer

    return Rasterizer(size, camera, quality=quality, arch=arch)


def available_renderers() -> list[tuple[str, bool, str]]:
    """(name, works here, why or what it is) of each renderer; asks the machine, which may take seconds."""
    from taichifem.output import ggui, vtk

    rows = [("taichi", True, "rasteriser in Taichi kernels, the default")]
    for name, probe, text in (
        ("ggui", ggui.probe, "Taichi's own renderer on Vulkan"),
        ("pyvista", vtk.probe, "PyVista (VTK), for stills"),
    ):
        ok, why = probe()
        rows.append((name, ok, why or text))
    return rows
