"""`taichifem modes`: how the bodies of a scene vibrate; a picture and a looping video of each mode."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import click
import numpy as np

from taichifem.app.compare import scene_file
from taichifem.app.console import console, table
from taichifem.app.figures import write_figures
from taichifem.app.starting import start_taichi
from taichifem.description import Camera, Scene
from taichifem.errors import InputError
from taichifem.files import replacing
from taichifem.output.frame import Frame
from taichifem.output.renderer import Renderer, make_renderer
from taichifem.output.video import open_video
from taichifem.scene import read_scene

if TYPE_CHECKING:
    from taichifem.reduced.modes import Modes
    from taichifem.reduced.parts import Parts

OUT = Path("out")
FPS, FRAMES = 30, 45
SWING = 0.12
"""Of the body's extent: how far the largest displacement goes in the pictures."""


@dataclass(frozen=True, kw_only=True)
class ModesOptions:
    """What the command line says. count: modes of each body; None: as many as its material says.

    output: folder of pictures and videos, out/NAME-modes if None.
    """

    overrides: tuple[str, ...] = ()
    count: int | None = None
    basis: str | None = None
    output: Path | None = None
    no_video: bool = False
    no_picture: bool = False
    size: tuple[int, int] = (640, 480)
    renderer: str = "auto"
    json_file: Path | None = None
    arch: str | None = None
    threads: int | None = None


def show_modes(name: str, options: ModesOptions) -> list[dict]:
    """Print the lowest elastic modes of every body of the scene (a file, or the name of a demo), and draw them."""
    file = scene_file(name)
    scene = read_scene(file, list(options.overrides))
    start_taichi(options.arch, options.threads)
    from taichifem.reduced.modal_body import modes_of
    from taichifem.reduced.parts import linear_twin, take_apart

    if scene.bodies[0].mesh.dimension == 2:
        raise InputError(f"{file}: modes are for solids of tetrahedra: this scene lies in the plane")
    found, rows = [], []
    for parts in take_apart(scene, linear_twin(scene)):
        material = parts.material
        count = options.count or material.modes
        modes = modes_of(parts, count, basis=options.basis or material.basis)
        found.append((parts, modes))
        rows += _rows(parts, modes)
    listing = table(
        "body",
        "mode",
        "frequency [Hz]",
        "period [s]",
        "damping",
        right=("mode", "frequency [Hz]", "period [s]", "damping"),
    )
    for row in rows:
        damping = "free" if row["damping_ratio"] is None else f"{100 * row['damping_ratio']:.3g} %"
        period = "-" if row["hertz"] == 0 else f"{1 / row['hertz']:.4g}"
        listing.add_row(row["body"], str(row["mode"]), f"{row['hertz']:.6g}", period, damping)
    console().print(listing)
    if options.json_file is not None:
        write_figures(options.json_file, {"scene": str(file), "overrides": list(options.overrides)}, rows)
        click.echo(f"wrote {options.json_file}")
    if not (options.no_picture and options.no_video):
        folder = options.output or OUT / f"{file.stem}-modes"
        for parts, modes in found:
            for k in range(len(modes.frequencies)):
                stem = folder / f"{parts.label.removeprefix('body.')}-{k + 1:02d}"
                for path in draw_mode(parts, modes, k, stem, scene, options):
                    click.echo(f"wrote {path}")
    return rows


def _rows(parts: Parts, modes: Modes) -> list[dict]:
    """Figures of the modes of one body. damping_ratio: of critical damping; None where nothing swings."""
    material = parts.material
    found = []
    for k, (w, hertz) in enumerate(zip(modes.frequencies, modes.hertz, strict=True), start=1):
        ratio = 0.5 * (material.mass_damping / w + material.stiffness_damping * w) if w > 0 else None
        found.append({"body": parts.label, "mode": k, "hertz": float(hertz), "damping_ratio": ratio})
    return found


def draw_mode(parts: Parts, modes: Modes, k: int, stem: Path, scene: Scene, options: ModesOptions) -> list[Path]:
    """A picture of the mode at its largest, and a video of one swing that loops; the files written."""
    shape = modes.shapes[:, :, k]
    extent = np.ptp(parts.rest, axis=0).max()
    shape = SWING * extent / np.linalg.norm(shape, axis=1).max() * shape
    renderer = make_renderer(options.renderer, options.size, camera=_camera(parts, scene))
    written = []
    try:
        if not options.no_picture:
            written.append(_picture(parts, shape, stem.with_suffix(".png"), renderer))
        if not options.no_video:
            video = open_video(stem.with_suffix(".mp4"), FPS, options.size)
            try:
                for frame in range(2 * FRAMES):
                    share = np.sin(2 * np.pi * frame / FRAMES)
                    video.write(renderer.draw(_frame(parts, shape, share)))
            finally:
                video.close()
            written.append(video.path)
    finally:
        renderer.close()
    return written


def _picture(parts: Parts, shape: np.ndarray, path: Path, renderer: Renderer) -> Path:
    from PIL import Image

    path.parent.mkdir(parents=True, exist_ok=True)
    with replacing(path) as part:
        Image.fromarray(renderer.draw(_frame(parts, shape, 1.0))).save(part, format="png")
    return path


def _frame(parts: Parts, shape: np.ndarray, share: float) -> Frame:
    size = np.linalg.norm(shape, axis=1)
    return Frame(
        points=np.ascontiguousarray(parts.rest + share * shape, np.float32),
        triangles=np.ascontiguousarray(parts.surface, np.int32),
        values=(size / size.max()).astype(np.float32),
        value_label="displacement, of the largest",
    )


def _camera(parts: Parts, scene: Scene) -> Camera:
    """The scene's direction of view, at a distance from which the body fills the picture."""
    low, high = parts.rest.min(axis=0), parts.rest.max(axis=0)
    middle, radius = (low + high) / 2, float(np.linalg.norm(high - low)) / 2
    camera, direction = scene.camera, np.array([0.5, -1.0, 0.45])
    if camera.eye is not None and camera.target is not None:
        direction = np.asarray(camera.eye) - np.asarray(camera.target)
    away = 1.25 * radius / np.sin(np.radians(camera.fov) / 2)
    eye = middle + away * direction / np.linalg.norm(direction)
    return replace(camera, eye=tuple(eye.tolist()), target=tuple(middle.tolist()))
