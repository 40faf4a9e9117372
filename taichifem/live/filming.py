"""A video of what is seen, drawn by the renderer that draws all videos."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from taichifem.description import Camera
from taichifem.output.frame import build_frame, hud_lines
from taichifem.output.renderer import Renderer, make_renderer
from taichifem.output.video import VideoWriter, open_video

if TYPE_CHECKING:
    from taichifem.simulation import Simulation

SIZE = (1280, 720)


class Film:
    """Writes a video between `begin` and `end`. path: the file in work, or None."""

    def __init__(self) -> None:
        self.path: Path | None = None
        self._video: VideoWriter | None = None
        self._renderer: Renderer | None = None

    def begin(self, path: Path, simulation: Simulation, camera: Camera) -> Path:
        """Start a video as seen from `camera`. Raises InputError if it cannot be written."""
        self._video = open_video(path, simulation.scene.fps, SIZE)
        self._renderer, self.path = make_renderer("taichi", SIZE, camera=camera), path
        self.add(simulation)
        return path

    def look(self, camera: Camera) -> None:
        """Go on from another viewpoint."""
        if self._renderer is not None:
            self._renderer.move(camera)

    def add(self, simulation: Simulation) -> None:
        """One more frame, if a video is in work."""
        if self._video is not None:
            frame = replace(build_frame(simulation), hud=hud_lines(simulation))
            self._video.write(self._renderer.draw(frame))

    def end(self) -> Path | None:
        """Finish the file; which one it was."""
        path, self.path = self.path, None
        if self._video is not None:
            self._video.close()
            self._renderer.close()
        self._video = self._renderer = None
        return path
