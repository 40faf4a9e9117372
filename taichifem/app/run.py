"""`taichifem run`: a scene file in; a video, meshes, figures and checkpoints out."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import click

from taichifem.app.starting import start_taichi
from taichifem.errors import InputError
from taichifem.files import need_place
from taichifem.output.export import open_export
from taichifem.output.recorder import Summary, run_recording
from taichifem.output.renderer import make_renderer
from taichifem.output.stats import StatsWriter
from taichifem.output.video import open_video
from taichifem.scene import read_scene

if TYPE_CHECKING:
    from taichifem.description import Scene
    from taichifem.simulation import Simulation

OUT = Path("out")


@dataclass(frozen=True, kw_only=True)
class RunOptions:
    """What the command line says about a run; None leaves it to the scene.

    overrides: "body.0.material.youngs=2e5" and the like.  seconds, frames: where to end, counted from the start
    of the scene.  fps [1/s].  size: (width, height) [pixels].  output: the video, out/NAME.mp4 if None.
    """

    overrides: tuple[str, ...] = ()
    seconds: float | None = None
    frames: int | None = None
    fps: float | None = None
    output: str | None = None
    no_video: bool = False
    size: tuple[int, int] = (1280, 720)
    renderer: str = "auto"
    color: str | None = None
    wire: bool | None = None
    export: Path | None = None
    export_format: str | None = None
    stats: Path | None = None
    checkpoint: Path | None = None
    checkpoint_every: int | None = None
    resume: Path | None = None
    replay: Path | None = None
    arch: str | None = None
    threads: int | None = None
    precision: str = "f32"
    quiet: bool = False

    def __post_init__(self) -> None:
        for one, other in (("frames", "seconds"), ("output", "no_video"), ("resume", "replay")):
            if getattr(self, one) and getattr(self, other):
                raise InputError(f"--{one} and --{_dashed(other)} exclude each other: give one")
        for one, other in (("export_format", "export"), ("checkpoint_every", "checkpoint")):
            if getattr(self, one) and not getattr(self, other):
                raise InputError(f"--{_dashed(one.removeprefix('export_'))} needs --{other}: give that too")

    def scene_overrides(self) -> list[str]:
        """All changes to the scene, the dedicated options last."""
        found = list(self.overrides)
        if self.seconds is not None:
            found.append(f"simulation.seconds={self.seconds!r}")
        if self.fps is not None:
            found.append(f"simulation.fps={self.fps!r}")
        if self.color is not None:
            found.append(f"view.color={self.color}")
        if self.wire is not None:
            found.append(f"view.wire={str(self.wire).lower()}")
        return found


def run_scene(path: Path, options: RunOptions) -> Summary:
    """Run the scene file and write what the options ask for. Raises InputError for what is wrong."""
    scene = read_scene(path, overrides=options.scene_overrides())
    if options.checkpoint is not None:
        need_place(options.checkpoint)
    simulation = _begin(scene, options)
    if scene.integrator == "symplectic-euler" and not options.quiet:
        click.echo(explicit_steps(simulation))
    summary = _record(simulation, _frames_left(simulation, options), path.stem, options)
    if not options.quiet:
        click.echo(str(summary))
        for file in summary.files:
            click.echo(f"wrote {file}")
    return summary


def _begin(scene: Scene, options: RunOptions) -> Simulation:
    """The simulation at its start: that of a checkpoint, or one on which interactions are done again."""
    interactions = None
    if options.replay is not None:
        from taichifem.live.interactions import Interactions

        interactions = Interactions.read(options.replay)
    start_taichi(options.arch, options.threads)
    if interactions is not None:
        from taichifem.live.replay import Replay
        from taichifem.live.stage import Stage

        return Replay(Stage(scene, precision=options.precision), interactions)
    from taichifem.factory import simulate

    simulation = simulate(scene, precision=options.precision)
    if options.resume is not None:
        simulation.load(options.resume)
    return simulation


def explicit_steps(simulation: Simulation) -> str:
    """What stability asks of an explicit simulation, in words."""
    chosen = "as the scene says" if simulation.scene.substeps else "chosen for it"
    return (
        f"symplectic Euler: critical time step {1e3 * simulation.critical_step():.4g} ms; "
        f"{simulation.substeps} steps a frame of {1e3 * simulation.dt:.4g} ms, {chosen}"
    )


def _frames_left(simulation: Simulation, options: RunOptions) -> int:
    scene = simulation.scene
    last = options.frames or max(1, round(scene.seconds * scene.fps))
    if simulation.frame >= last:
        raise InputError(
            f"{options.resume}: the checkpoint is at frame {simulation.frame}, and the run ends at frame {last}: "
            "give more --frames or --seconds"
        )
    return last - simulation.frame


def _record(simulation: Simulation, frames: int, name: str, options: RunOptions) -> Summary:
    """Open what is asked for, then run."""
    scene, video, renderer = simulation.scene, None, None
    if not options.no_video:
        video = open_video(options.output or _default_output(name, simulation.frame), scene.fps, options.size)
    export = options.export and open_export(options.export, options.export_format or "vtu", simulation)
    stats = options.stats and StatsWriter(options.stats)
    if video is not None:
        renderer = make_renderer(options.renderer, options.size, camera=scene.camera)
    return run_recording(
        simulation,
        frames=frames,
        renderer=renderer,
        video=video,
        export=export,
        stats=stats,
        checkpoint=options.checkpoint,
        checkpoint_every=options.checkpoint_every,
        quiet=options.quiet,
    )


def _default_output(name: str, frame: int) -> Path:
    """A resumed run does not overwrite the video that its first part wrote."""
    return OUT / (f"{name}-from-{frame}.mp4" if frame else f"{name}.mp4")


def _dashed(name: str) -> str:
    return name.replace("_", "-")
