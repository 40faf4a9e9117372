"""`taichifem static`: the balance of a scene's loads; how it was found, a mesh with the results, a picture."""

from __future__ import annotations

import json
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import click
import numpy as np

from taichifem.app.compare import scene_file
from taichifem.app.starting import start_taichi
from taichifem.errors import InputError
from taichifem.files import replacing
from taichifem.output.export import write_vtu
from taichifem.output.frame import build_frame
from taichifem.output.renderer import make_renderer
from taichifem.scene import read_scene

if TYPE_CHECKING:
    from taichifem.simulation import Simulation
    from taichifem.statics import LoadStep, StaticResult

OUT = Path("out")


@dataclass(frozen=True, kw_only=True)
class StaticOptions:
    """What the command line says about a static solve; None leaves it to the scene.

    output: the .vtu file, out/NAME.vtu if None.  picture: a .png file, out/NAME.png if None.
    linear: small strains, every material Hooke's.  tolerance: imbalance relative to the forces at work.
    """

    overrides: tuple[str, ...] = ()
    output: Path | None = None
    picture: Path | None = None
    no_picture: bool = False
    linear: bool = False
    tolerance: float = 1e-9
    color: str | None = None
    size: tuple[int, int] = (1280, 720)
    renderer: str = "auto"
    json_file: Path | None = None
    arch: str | None = None
    threads: int | None = None
    precision: str = "f64"
    quiet: bool = False

    def __post_init__(self) -> None:
        if not 0 < self.tolerance < 1:
            raise InputError(f"--tolerance is {self.tolerance:g}: give a number above 0 and below 1")
        if self.picture is not None and self.no_picture:
            raise InputError("--picture and --no-picture exclude each other: give one")
        for option, file, ending in (("--output", self.output, ".vtu"), ("--picture", self.picture, ".png")):
            if file is not None and file.suffix.lower() != ending:
                raise InputError(f"{option} is {file}: give a file that ends in {ending}")


def run_static(name: str, options: StaticOptions) -> StaticResult:
    """Solve the scene (a file, or the name of a demo) and write what the options ask for.

    Raises InputError for what is wrong. No balance is no error: the result says so.
    """
    file = scene_file(name)
    scene = read_scene(file, list(options.overrides))
    shown = options.color or (scene.view.color if scene.view.color != "material" else "von-mises")
    scene = replace(scene, view=replace(scene.view, color=shown))
    start_taichi(options.arch, options.threads)
    from taichifem.simulation import Simulation
    from taichifem.statics import solve_static, static_scene

    simulation = Simulation(static_scene(scene, linear=options.linear), precision=options.precision)
    tell = _silent if options.quiet else _Log()
    result = solve_static(simulation, tolerance=options.tolerance, on_step=tell)
    figures = _figures(simulation, result)
    written = _write(simulation, figures, file.stem, options)
    if not options.quiet:
        click.echo(_words(figures))
        for path in written:
            click.echo(f"wrote {path}")
    return result


def _silent(_: LoadStep) -> None:
    pass


class _Log:
    """Prints each load step as it ends."""

    def __call__(self, step: LoadStep) -> None:
        """A line for each linearisation."""
        if not step.iterations:
            click.echo(f"load {100 * step.share:6.2f} %: the solver met a number that is not finite")
        for k, one in enumerate(step.iterations, start=1):
            cut = f", step cut to {one.length:.2f}" if one.length < 1 else ""
            click.echo(
                f"load {100 * step.share:6.2f} %  linearisation {k:2d}  "
                f"imbalance {one.imbalance:.2e}  {one.iterations:5d} CG iterations{cut}"
            )
        if not step.converged:
            click.echo(f"load {100 * step.share:6.2f} %: no balance found in one go, trying less")


def _figures(simulation: Simulation, result: StaticResult) -> dict:
    """What the solve came to, in plain numbers."""
    moved = np.linalg.norm(simulation.positions - simulation.rest_positions, axis=1)
    stress = simulation.von_mises()
    return {
        "converged": result.converged,
        "share": result.share,
        "linearisations": result.linearisations,
        "iterations": sum(one.iterations for step in result.steps for one in step.iterations),
        "nodes": len(moved),
        "elements": len(stress),
        "max_displacement": float(moved.max()),
        "max_displacement_node": int(moved.argmax()),
        "max_von_mises": float(stress.max()),
        "max_von_mises_element": int(stress.argmax()),
        "elastic_energy": simulation.elastic_energy(),
        "reaction": simulation.reactions().sum(axis=0).tolist(),
        "steps": [
            {"share": s.share, "converged": s.converged, "imbalance": [one.imbalance for one in s.iterations]}
            for s in result.steps
        ],
    }


def _words(figures: dict) -> str:
    reaction = ", ".join(f"{value:.4g}" for value in figures["reaction"])
    end = (
        "balanced"
        if figures["converged"]
        else f"no balance found for all loads: the last good one is {100 * figures['share']:.4g} % of them"
    )
    return (
        f"{end}: {figures['linearisations']} linearisations, {figures['iterations']} CG iterations\n"
        f"largest displacement {figures['max_displacement']:.6g} m at node {figures['max_displacement_node']}\n"
        f"largest von Mises stress {figures['max_von_mises']:.6g} Pa in element {figures['max_von_mises_element']}\n"
        f"elastic energy {figures['elastic_energy']:.6g} J, sum of the reactions ({reaction}) N"
    )


def _write(simulation: Simulation, figures: dict, name: str, options: StaticOptions) -> list[Path]:
    mesh = options.output or OUT / f"{name}.vtu"
    with replacing(mesh) as part:
        write_vtu(part, simulation, reaction=simulation.reactions())
    written = [mesh]
    if not options.no_picture:
        written.append(options.picture or OUT / f"{name}.png")
        _draw(simulation, written[-1], options)
    if options.json_file is not None:
        with replacing(options.json_file) as part:
            part.write_text(json.dumps(figures, indent=2) + "\n", encoding="utf-8")
        written.append(options.json_file)
    return written


def _draw(simulation: Simulation, path: Path, options: StaticOptions) -> None:
    from PIL import Image

    view = replace(simulation.scene.view, hud=False)
    simulation.scene = replace(simulation.scene, view=view)  # time and cost say nothing of a static solve
    renderer = make_renderer(options.renderer, options.size, camera=simulation.scene.camera)
    try:
        picture = renderer.draw(build_frame(simulation))
    finally:
        renderer.close()
    with replacing(path) as part:
        Image.fromarray(picture).save(part, format="png")
