"""The command `taichifem`. Thin: each command imports what does the work when it is called."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from taichifem import __version__
from taichifem.app.options import (
    FILE,
    MODELS,
    PLASTICITIES,
    compare_options,
    live_options,
    machine_options,
    modes_options,
    run_options,
    static_options,
)
from taichifem.app.program import INTERRUPTED, UNSOLVED, Program

EXAMPLES = """
\b
Examples:
  taichifem demo                                  what there is to see
  taichifem demo hello                            writes out/hello.mp4
  taichifem run scene.toml -o fall.mp4 --seconds 3
  taichifem run scene.toml --set body.0.material.youngs=2e5 --color von-mises
  taichifem live hello                            take hold of it in the browser
  taichifem compare twist --vary model=corotational,stvk --video laws.mp4
  taichifem mesh surface.obj -o solid.vtu --tets 5000
"""


@click.group(
    cls=Program,
    invoke_without_command=True,
    epilog=EXAMPLES,
    context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 110},
)
@click.version_option(__version__, "-V", "--version", message="%(prog)s %(version)s")
@click.pass_context
def cli(ctx: click.Context) -> None:
    """Simulate elasto-plastic, breaking solids with finite elements.

    Lengths are in metres, times in seconds, stresses in pascals; z points up.
    """
    if ctx.invoked_subcommand is None:
        click.echo(ctx.get_help())


@cli.command()
@click.argument("scene", type=click.Path(path_type=Path))
@run_options
@click.pass_context
def run(ctx: click.Context, scene: Path, **options: Any) -> None:
    """Run a scene file and write a video.

    SCENE is a TOML file: bodies, materials, what holds and what hits them.

    Ctrl-C ends the run after the frame in work and leaves a video that plays.

    \b
    Examples:
      taichifem run scene.toml
      taichifem run scene.toml --no-video --export meshes --format vtu --stats figures.jsonl
      taichifem run scene.toml --checkpoint half.npz --frames 60
      taichifem run scene.toml --resume half.npz --frames 120
    """
    _run(ctx, scene, options)


@cli.command()
@click.argument("name", required=False)
@run_options
@click.pass_context
def demo(ctx: click.Context, name: str | None, **options: Any) -> None:
    """Run a demo, or list the demos.

    Without NAME, prints what there is; with it, runs that demo as `taichifem run` would.

    \b
    Example:
      taichifem demo hello --size 640x360 --color speed
    """
    from taichifem.app.demos import demos, find_demo

    if name is not None:
        _run(ctx, find_demo(name).path, options)
        return
    from taichifem.app.console import console, table

    listing = table("demo", "what it shows")
    for entry in demos().values():
        listing.add_row(entry.name, entry.description or entry.title)
    console().print(listing if listing.rows else "no demos are installed")


@cli.command()
@click.argument("scene")
@live_options
def live(scene: str, **options: Any) -> None:
    """Take hold of a scene while it runs: pull it, turn its parameters, watch it yield and break.

    SCENE is a scene file or the name of a demo. Serves a page on this machine and opens it in the browser.

    \b
    Examples:
      taichifem live hello
      taichifem live scene.toml --no-browser --port 9000
    """
    from taichifem.app.live import LiveOptions, run_live

    run_live(scene, LiveOptions(**options))


def _run(ctx: click.Context, scene: Path, options: dict[str, Any]) -> None:
    from taichifem.app.run import RunOptions, run_scene

    if run_scene(scene, RunOptions(**options)).interrupted:
        ctx.exit(INTERRUPTED)


@cli.command()
@click.argument("scene")
@static_options
@click.pass_context
def static(ctx: click.Context, scene: str, **options: Any) -> None:
    """Find the shape in which the loads of a scene are balanced.

    SCENE is a scene file or the name of a demo: gravity, forces, tractions and pressures at their full size, pins and
    handles at the end of their motion. Prints how Newton's method converges; loads are put on in steps where that is
    needed. Writes displacement, stress and reactions, and a picture. Exit code 1: no balance was found; what is
    written is then the last part of the loads that was balanced.

    \b
    Examples:
      taichifem static bracket.toml
      taichifem static bracket.toml --linear --set body.0.material.youngs=2e9 -o bracket.vtu
    """
    from taichifem.app.static import StaticOptions, run_static

    if not run_static(scene, StaticOptions(**options)).converged:
        ctx.exit(UNSOLVED)


@cli.command()
@click.argument("scene")
@modes_options
def modes(scene: str, **options: Any) -> None:
    """Show how the bodies of a scene vibrate.

    SCENE is a scene file or the name of a demo. Prints the lowest frequencies of each body as its pins hold it, without
    the rigid motions of a free one, for small displacements; writes a picture and a looping video of each mode.

    \b
    Examples:
      taichifem modes scene.toml --modes 6
      taichifem modes twist --modes 10 --no-video --no-picture --json modes.json
    """
    from taichifem.app.modes import ModesOptions, show_modes

    show_modes(scene, ModesOptions(**options))


@cli.command()
@click.argument("scene")
@compare_options
@click.pass_context
def compare(ctx: click.Context, scene: str, **options: Any) -> None:
    """Run a scene under several choices, side by side.

    SCENE is a scene file or the name of a demo. Prints a table: time and iterations of a step, energy, stability.

    The material's fields go into every body: model, youngs, poisson, density, mass_damping, stiffness_damping,
    wraps, threshold. So do integrator, substeps, tolerance and the like into [simulation]. A model may say what
    it wraps, as in invertible:stvk. A choice that diverges does not end the others.

    \b
    Examples:
      taichifem compare twist --vary model=linear,corotational,stvk,neo-hookean --video laws.mp4
      taichifem compare scene.toml --vary substeps=1,2,4 --seconds 1 --json figures.json
      taichifem compare scene.toml --vary body.ball.material.youngs=1e5,1e6 --video stiffness.gif
    """
    from taichifem.app.compare import CompareOptions, run_compare

    if run_compare(scene, CompareOptions(**options)).interrupted:
        ctx.exit(INTERRUPTED)


@cli.command()
@click.argument("source", metavar="IN")
@click.option("-o", "--output", type=FILE, metavar="OUT", help="Where to write: .vtu, .vtk, .msh, .mesh, .inp ...")
@click.option("--tets", type=click.IntRange(min=10), metavar="N", help="About how many tetrahedra fill a surface.")
@click.option("--cage", type=click.IntRange(min=5), metavar="N", help="About how many tetrahedra enclose a surface.")
@click.option("--planar", is_flag=True, help="Take IN for a flat mesh of triangles, for two-dimensional scenes.")
def mesh(source: str, output: Path | None, tets: int | None, cage: int | None, planar: bool) -> None:
    """Check, convert or make a mesh of tetrahedra, or of triangles in the plane.

    Prints how good the mesh IN is, and writes it to OUT if that is given.

    IN is a volume mesh (.msh .vtk .vtu .mesh .inp .node .ele .veg), which is converted, or a closed surface
    (.stl .obj .ply .glb), which is filled with tetrahedra. With --planar it holds triangles (.msh .vtk .vtu .mesh
    .inp .obj .stl .ply) in the x-z plane, or in the x-y plane, whose y then points up.

    \b
    Examples:
      taichifem mesh duck.ele
      taichifem mesh spot.obj --tets 5000 -o spot.vtu
      taichifem mesh spot.obj --cage 500 -o cage.vtu        any surface: what embed = "spot.obj" rides in
      taichifem mesh sheet.msh --planar -o sheet.vtu
    """
    from taichifem.mesh import TetMesh, TriMesh, report

    if planar and (tets is not None or cage is not None):
        raise click.UsageError("--tets and --cage make tetrahedra: leave them out with --planar")
    body = TriMesh.from_file(source) if planar else TetMesh.from_file(source, tets=tets, cage=cage)
    click.echo(report(body))
    if output is not None:
        body.write(output)
        click.echo(f"wrote {output}")


@cli.command()
def info() -> None:
    """Say what works here, and what will be used."""
    from taichifem.app.info import show_info

    show_info()


@cli.command()
@click.option("--sizes", default="1k,5k,20k,100k", show_default=True, help="Numbers of tetrahedra, up to 5m.")
@click.option("--stiffness", default="1e6", show_default=True, help="Young's moduli [Pa], separated by commas.")
@click.option("--poisson", type=float, default=0.4, show_default=True, help="Poisson's ratio.")
@click.option("--model", type=click.Choice(MODELS), default="corotational", show_default=True, help="Of the material.")
@click.option("--modes", type=click.IntRange(min=1), default=20, show_default=True, help="Of --model modal.")
@click.option(
    "--plasticity",
    type=click.Choice(PLASTICITIES),
    default="none",
    show_default=True,
    help="Of a bar that yields; an elastic twin runs in turn with it.",
)
@click.option("--solver", default="multilevel", show_default=True, help="Linear solvers: multilevel,block-jacobi.")
@click.option("--steps", type=click.IntRange(min=1), default=60, show_default=True, help="Timed steps, at most.")
@click.option("--budget", type=float, default=45.0, show_default=True, help="Seconds for them, at most.")
@click.option("--no-cold", is_flag=True, help="Leave out the start with an empty kernel cache.")
@click.option(
    "--against",
    default="",
    metavar="LIST",
    help="Other programs: mujoco,pybullet,newton,newton-semi-implicit,genesis,taichi-example.",
)
@click.option(
    "--peer-python",
    multiple=True,
    metavar="NAME=PYTHON",
    help="The Python of an environment that has that program. May be given again.  [default: this one]",
)
@click.option("--peer-limit", type=float, default=300.0, show_default=True, help="Seconds for one program and bar.")
@click.option("--fracture", is_flag=True, help="Instead: a plate that shatters, and a bar in steps with 50 splits.")
@click.option("--json", "json_file", type=FILE, metavar="FILE", help="Write all figures to this file, too.")
@click.option("--plot", type=FILE, metavar="FILE", help="Draw time over size: .png, .pdf or .svg.")
@machine_options()
def bench(fracture: bool, **options: Any) -> None:
    """Measure speed, start-up and memory.

    Each bar (1 x 0.25 x 0.25 m, one end held, released at rest, 60 steps a second) runs in a process of its own.

    --against runs the same bar in other programs, on the CPU, in turn with ours: same mesh, stiffness, density and
    frames. A program that is not installed gets a row that says how to get it. Where the tip is tells whether a
    program that is fast is also right.

    \b
    Examples:
      taichifem bench --sizes 1k,5k --no-cold
      taichifem bench --stiffness 1e5,1e6,1e7 --json bench.json
      taichifem bench --sizes 20k --plasticity von-mises
      taichifem bench --fracture
      taichifem bench --sizes 1k,20k,100k --model modal --modes 50
      taichifem bench --sizes 1k,5k,20k,100k,1m --plot bench.png     needs: pip install "taichifem[plot]"
      taichifem bench --sizes 5k --against mujoco,newton --peer-python newton=~/newton/bin/python
    """
    if fracture:
        from taichifem.app.bench_fracture import run_fracture_bench

        run_fracture_bench(**{name: options[name] for name in ("arch", "threads", "precision", "json_file")})
        return
    from taichifem.app.bench import run_bench
    from taichifem.app.bench_input import BenchOptions

    run_bench(BenchOptions(**options))


def main() -> None:
    """The console command."""
    cli.main(prog_name="taichifem")
