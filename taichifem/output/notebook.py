"""Pictures and short animations that a notebook displays by itself."""

from __future__ import annotations

import base64
import io
from dataclasses import dataclass
from typing import Any

from PIL import Image

from taichifem.errors import InputError
from taichifem.output.frame import build_frame
from taichifem.output.renderer import make_renderer

FPS = 25
"""Pictures a second of an animation, at most."""

LONGEST = 60.0
"""Seconds of one at most: it is kept in the notebook."""


@dataclass(frozen=True)
class Picture:
    """What Jupyter shows when it stands at the end of a cell. data: the file.  kind: "png" or "webp"."""

    data: bytes
    kind: str

    def _repr_mimebundle_(self, include: Any = None, exclude: Any = None) -> dict[str, str]:
        text = base64.b64encode(self.data).decode("ascii")
        return {"text/html": f'<img alt="simulation" src="data:image/{self.kind};base64,{text}">'}


def picture(simulation: Any, *, seconds: float | None, size: tuple[int, int]) -> Picture:
    """`Simulation.show`: the simulation now, or while it advances by `seconds`."""
    if seconds is not None and not 0 < seconds <= LONGEST:
        raise InputError(f"seconds is {seconds}: give more than 0 and at most {LONGEST:g}, or None for one picture")
    renderer = make_renderer("taichi", size, camera=simulation.scene.camera)
    try:
        images = [Image.fromarray(renderer.draw(build_frame(simulation)))]
        step = max(1, round(simulation.scene.fps / FPS))
        for frame in range(1, round((seconds or 0) * simulation.scene.fps) + 1):
            simulation.advance_frame()
            if frame % step == 0:
                images.append(Image.fromarray(renderer.draw(build_frame(simulation))))
    finally:
        renderer.close()
    file, kind = io.BytesIO(), "png" if seconds is None else "webp"
    if kind == "png":
        images[0].save(file, "PNG")
    else:
        duration = round(1000 * step / simulation.scene.fps)
        images[0].save(file, "WEBP", save_all=True, append_images=images[1:], duration=duration, loop=0, quality=80)
    return Picture(file.getvalue(), kind)
