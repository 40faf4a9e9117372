"""The picture of a comparison: a tile for each choice, seen from one place and coloured on one scale."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from taichifem.app.compare_run import Run
from taichifem.description import Camera
from taichifem.output.frame import Frame, build_frame
from taichifem.output.renderer import make_renderer
from taichifem.output.tiles import Grid, label, remark
from taichifem.output.video import open_video

KEPT = 4 / 3
"""Width over height of what every tile shows of a scene's own picture: the outer sides of a wide one are empty."""

WIDEST = 165.0  # degrees


class SideBySide:
    """A video of several runs, at `path`. A context manager: leaving the block closes the video.

    One renderer draws all tiles, so what the first picture of the first run fixes holds for all of them.
    """

    def __init__(self, path: str | Path, fps: float, runs: Sequence[Run], grid: Grid) -> None:
        """Raises InputError if `path` cannot be written."""
        self._runs, self._grid = runs, grid
        self._frames = [_frame(run) for run in runs]
        self._tops: dict[str, float] = {}
        self._renderer = make_renderer(size=grid.tile, camera=widened(runs[0].simulation.scene.camera, grid.tile))
        self._video = open_video(path, fps, grid.size)
        self.path = self._video.path

    def __enter__(self) -> SideBySide:
        return self

    def __exit__(self, *_: object) -> None:
        self._renderer.close()
        self._video.close()

    def moved(self, number: int) -> None:
        """Run `number` has a new state: show that from now on."""
        self._frames[number] = _frame(self._runs[number])

    def write(self) -> None:
        """Append a picture of all runs as they are."""
        given = [run.simulation.scene.view.range is not None for run in self._runs]
        frames = on_one_scale(self._frames, given, self._tops)
        picture = self._grid.blank()
        for number, (run, frame) in enumerate(zip(self._runs, frames, strict=True)):
            tile = self._grid.part(picture, number)
            tile[...] = self._renderer.draw(frame)
            if run.remark:
                remark(tile, run.remark)
            label(tile, run.label)
        self._video.write(picture)


def _frame(run: Run) -> Frame:
    """The frame of a run now; its words leave out what all tiles have in common."""
    frame = build_frame(run.simulation)
    return replace(frame, hud=run.words if frame.hud else ())


def on_one_scale(frames: Sequence[Frame], given: Sequence[bool], tops: dict[str, float]) -> list[Frame]:
    """The frames with one colour range, and its bar in the first frame that it holds for.

    given: whether the scene gave the range, which then stays.
    tops: how high the range has grown, for each quantity shown; this function raises it.
    """
    for frame, fixed in zip(frames, given, strict=True):
        if frame.values is not None and not fixed:
            top = float(frame.values[np.isfinite(frame.values)].max(initial=0.0))
            tops[frame.value_label] = max(tops.get(frame.value_label, 0.0), top)
    scaled, barred = [], set()
    for frame, fixed in zip(frames, given, strict=True):
        common = frame.value_range if fixed else (0.0, tops.get(frame.value_label) or 1.0)
        bar = (frame.value_label, common)
        scaled.append(replace(frame, value_range=common, bar=bar not in barred))
        barred.add(bar)
    return scaled


def widened(camera: Camera, tile: tuple[int, int]) -> Camera:
    """The camera for a picture of the size `tile` that sees no less than in one whose sides are 4 : 3.

    One without an eye is left as it is: the first frame places it so that everything is seen.
    """
    narrower = KEPT * tile[1] / tile[0]
    if camera.eye is None or narrower <= 1:
        return camera
    fov = 2 * np.degrees(np.arctan(narrower * np.tan(np.radians(camera.fov) / 2)))
    return replace(camera, fov=max(camera.fov, min(WIDEST, float(fov))))
