"""`taichifem compare`: one scene under several choices, side by side in a video and in a table."""

from __future__ import annotations

import re
from collections.abc import Sequence
from contextlib import nullcontext
from dataclasses import dataclass
from pathlib import Path

import click

from taichifem.app.compare_report import print_report
from taichifem.app.compare_run import Run
from taichifem.app.compare_video import SideBySide
from taichifem.app.demos import find_demo
from taichifem.app.figures import write_figures
from taichifem.app.starting import start_taichi
from taichifem.errors import InputError
from taichifem.files import need_place
from taichifem.output.progress import ProgressReport
from taichifem.output.tiles import Grid
from taichifem.scene import read_scene

FEWEST, MOST = 2, 9
EXAMPLE = "--vary model=linear,corotational"


@dataclass(frozen=True, kw_only=True)
class CompareOptions:
    """What the command line says about a comparison; None leaves it to the scene.

    vary: the key and its values, "model=linear,stvk"; the key may be short.  overrides: for all choices alike.
    seconds: where to end [s].  fps [1/s].  size: (width, height) of the whole picture [pixels].
    video: where to write it; None draws nothing.  json_file: where to write all figures, too.
    """

    vary: str
    overrides: tuple[str, ...] = ()
    seconds: float | None = None
    fps: float | None = None
    video: str | None = None
    size: tuple[int, int] = (1280, 720)
    json_file: Path | None = None
    arch: str | None = None
    threads: int | None = None
    precision: str = "f32"

    def scene_overrides(self) -> list[str]:
        """All changes to the scene that are the same for every choice."""
        given = {"seconds": self.seconds, "fps": self.fps}
        return [*self.overrides, *(f"simulation.{k}={v!r}" for k, v in given.items() if v is not None)]


@dataclass(frozen=True, kw_only=True)
class Comparison:
    """rows: the figures of each choice.  interrupted: stopped by Ctrl-C."""

    rows: list[dict]
    interrupted: bool


def run_compare(scene: str, options: CompareOptions) -> Comparison:
    """Run the scene (a file, or the name of a demo) under every choice; print a table, write what is asked for.

    The choices advance in turns, a frame each, so that they are timed on the same machine.
    Raises InputError for what is wrong, before anything is written; a choice that diverges ends only itself.
    """
    file = scene_file(scene)
    key, values = parse_vary(options.vary)
    if key.startswith("camera.") and options.video is not None:
        raise InputError(f"--vary {key}: all tiles are seen from one place: vary something else, or leave out --video")
    overrides = options.scene_overrides()
    scenes = [read_scene(file, overrides, choice=f"{key}={value}") for value in values]
    grid = None if options.video is None else Grid.of(len(values), options.size)
    start_taichi(options.arch, options.threads)
    from taichifem.factory import simulate

    runs = []
    for value, one in zip(values, scenes, strict=True):
        try:
            runs.append(Run(f"{key} = {value}", simulate(one, precision=options.precision)))
        except InputError as error:
            raise InputError(f"--vary {key}={value}: {error}") from None
    if options.json_file is not None:
        need_place(options.json_file)
    rate = max(one.fps for one in scenes)
    pictures = None if grid is None else SideBySide(options.video, rate, runs, grid)
    with pictures or nullcontext():
        interrupted = _advance(runs, rate, pictures)
    rows = [run.figures() for run in runs]
    print_report(rows)
    if options.json_file is not None:
        settings = {"scene": str(file), "key": key, "values": values, "overrides": overrides}
        settings |= {name: getattr(options, name) for name in ("arch", "threads", "precision")}
        write_figures(options.json_file, settings, rows)
    for written in (pictures and pictures.path, options.json_file):
        if written is not None:
            click.echo(f"wrote {written}")
    return Comparison(rows=rows, interrupted=interrupted)


def scene_file(scene: str) -> Path:
    """The scene file that `scene` names, or that of the demo called so. Raises InputError if there is neither."""
    path = Path(scene)
    if path.exists() or path.suffix or len(path.parts) > 1:
        return path
    return find_demo(scene).path


def parse_vary(text: str) -> tuple[str, list[str]]:
    """Key and values of "KEY=A,B,C"; commas inside brackets belong to a value.

    Raises InputError if it is not written like that, or there are too few or too many values.
    """
    key, equals, rest = (part.strip() for part in text.partition("="))
    values = [value.strip() for value in re.split(r",(?![^\[]*\])", rest)]
    if not key or not equals or not all(values):
        raise InputError(f"--vary {text!r}: write it as KEY=A,B,C, for example {EXAMPLE}")
    if not FEWEST <= len(values) <= MOST:
        count = f"{len(values)} choice{'s' if len(values) > 1 else ''}"
        raise InputError(f"--vary {text!r}: {count} cannot be compared: give {FEWEST} to {MOST}, separated by commas")
    return key, values


def _advance(runs: Sequence[Run], rate: float, pictures: SideBySide | None) -> bool:
    """All runs to their ends, in turns, at `rate` pictures a second; True if Ctrl-C ended them before."""
    frames = max(1, round(max(run.simulation.scene.seconds for run in runs) * rate))
    with ProgressReport(frames) as report:
        try:
            for frame in range(frames + 1):
                for number, run in enumerate(runs):
                    if run.advance_to(frame / rate) and pictures is not None:
                        pictures.moved(number)
                if pictures is not None:
                    pictures.write()
                if frame:
                    report.update(frame, frame / rate)
                if all(run.diverged is not None for run in runs):
                    break
        except KeyboardInterrupt:
            return True
    return False
