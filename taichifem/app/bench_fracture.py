"""`taichifem bench --fracture`: a plate that shatters in real time, and what a step costs in which much splits."""

from __future__ import annotations

import time
from pathlib import Path

from taichifem.app.console import console, table
from taichifem.app.figures import write_figures
from taichifem.app.peers.common import spread, timed_ms
from taichifem.app.starting import start_taichi
from taichifem.files import replacing

SPLITS = 50
"""Splits of a step that counts as one in which much splits."""

FPS, FRAMES = 30, 60


def run_fracture_bench(
    *, arch: str | None, threads: int | None, precision: str, json_file: Path | None
) -> dict[str, dict]:
    """Measure both, print them, write them as JSON if that is asked for."""
    start_taichi(arch, threads)
    found = {"plate": _shatter(precision), "bar": _split(precision)}
    screen = console()
    for name, title in (
        ("plate", f"A brittle plate, struck by a ball: one step a frame, {FPS} frames a second"),
        ("bar", f"A bar, in steps with {SPLITS} splits, and beside it one that is tough enough"),
    ):
        listing = table("", "", right=("",))
        for key, value in found[name].items():
            listing.add_row(key, _told(value))
        screen.print(title, listing, sep="\n")
    if json_file is not None:
        with replacing(json_file) as part:
            write_figures(part, {"precision": precision}, [{"scene": name, **row} for name, row in found.items()])
    return found


def _told(value) -> str:
    if isinstance(value, dict):
        return ", ".join(f"{name} {_told(part)}" for name, part in value.items())
    return f"{value:.3g}" if isinstance(value, float) else f"{value:,}"


def _shatter(precision: str) -> dict:
    """Frames of a plate of some 10k tetrahedra from the blow on."""
    from taichifem import Body, Fracture, Material, Motion, PlaneCollider, Scene, Simulation, SphereCollider, TetMesh

    mesh = TetMesh.bar(size=(1.2, 0.8, 0.05), cells=(56, 38, 1))
    glass = Material(
        youngs=5e6,
        poisson=0.25,
        density=1500.0,
        mass_damping=0.2,
        stiffness_damping=5e-4,
        fracture=Fracture(toughness=4e5, criterion="separation-tensor"),
    )
    fall = Motion(times=(0.0, 0.2, 0.4, 0.6), translation=((0, 0, 0), (0, 0, -0.4), (0, 0, -0.7), (0, 0, 0)))
    ball = SphereCollider(center=(0.65, 0.45, 0.87), radius=0.12, motion=fall)
    body = Body(mesh=mesh, material=glass, position=(0, 0, 0.3), pins=_ends(1.2))
    scene = Scene(bodies=[body], colliders=[PlaneCollider(friction=0.6), ball], fps=FPS, max_splits=1000, seed=3)
    _warm(Simulation(scene, precision=precision), 12)
    simulation = Simulation(scene, precision=precision)
    frames, phases, splits, met = [], {}, 0, True
    for _ in range(FRAMES):
        frames.append(timed_ms(simulation.advance_frame))
        splits += simulation.splits
        met &= simulation.report.converged
        for name, ms in simulation.phases.items():
            phases.setdefault(name, []).append(ms)
    return {
        "tets": len(mesh.cells),
        "pieces": simulation.piece_count,
        "splits": splits,
        "ms a frame": spread(frames),
        "most ms": max(frames),
        "x real time": FRAMES / FPS / (1e-3 * sum(frames)),
        "every solve converged": int(met),
        "phases, median ms": {name: spread(values)["median"] for name, values in phases.items()},
    }


def _split(precision: str) -> dict:
    """Steps of a bar of 20k tetrahedra that is torn lengthwise, in turn with those of a tough twin.

    Grips along two of its sides go on pulling wherever it has split, so that every step has something to split.
    """
    from taichifem import Body, Fracture, Material, Motion, Pin, Scene, Simulation, TetMesh

    mesh = TetMesh.bar(size=(1.0, 0.25, 0.25), cells=(40, 10, 10))
    draw = Motion(times=(0, 10), translation=((0, 0, 0), (0.0, 3.0, 0.0)))
    near, far = _ends(0.25, axis=1)
    twins = []
    for toughness in (2e4, 1e30):
        material = Material(youngs=1e6, poisson=0.3, fracture=Fracture(toughness=toughness))
        body = Body(mesh=mesh, material=material, pins=[near, Pin(region=far, motion=draw)])
        scene = Scene(bodies=[body], gravity=(0, 0, 0), max_splits=SPLITS)
        twins.append(Simulation(scene, precision=precision))
    _warm(twins[1], 3)
    torn, whole, fracture = [], [], []
    begin = time.perf_counter()
    while len(torn) < 12 and time.perf_counter() - begin < 60:
        ms, other = (timed_ms(twin.step) for twin in twins)
        # The first split compiles.
        if twins[0].splits == SPLITS and twins[0].piece_count > 0:
            torn.append(ms)
            whole.append(other)
            fracture.append(twins[0].phases["fracture"])
    torn, whole, fracture = torn[1:], whole[1:], fracture[1:]
    if not torn:
        return {"tets": len(mesh.cells), "steps": 0}
    ratio = spread([a / b for a, b in zip(torn, whole, strict=True)])
    return {
        "tets": len(mesh.cells),
        "steps": len(torn),
        "ms a step that splits": spread(torn),
        "of which fracture": spread(fracture),
        "ms a step of the tough one": spread(whole),
        "ratio": ratio,
        "pieces": twins[0].piece_count,
    }


def _ends(length: float, *, axis: int = 0) -> list:
    """Both ends of a bar that lies at the origin, `length` [m] long along an axis."""
    from taichifem import BoxRegion

    upper, lower = [1e3, 1e3, 1e3], [-1e3, -1e3, -1e3]
    upper[axis], lower[axis] = 1e-6, length - 1e-6
    return [BoxRegion(lower=(-1e3,) * 3, upper=tuple(upper)), BoxRegion(lower=tuple(lower), upper=(1e3,) * 3)]


def _warm(simulation, steps: int) -> None:
    """Compile what is needed."""
    for _ in range(steps):
        simulation.step()
