"""One bar of `taichifem bench`, measured in this process alone: `python -m taichifem.app.bench_worker '{...}'`.

Takes a Bar as JSON, prints its figures as one line of JSON. A process of its own, because memory
and compile times of one size would blur those of the next.
"""

from __future__ import annotations

import json
import statistics
import sys
import time
from dataclasses import dataclass, replace

from taichifem.app.peers.common import FPS, drive, peak_mib, spread, timed_ms
from taichifem.description.material import REDUCED
from taichifem.errors import InputError

LENGTH, SIDE = 1.0, 0.25  # [m]
DENSITY, GRAVITY = 1000.0, 9.81


@dataclass(frozen=True, kw_only=True)
class Bar:
    """What to measure: a bar of 4m x m x m cubes, 20 m^3 tetrahedra, held at x = 0 and released at rest.

    youngs: [Pa].  plasticity: law of a bar that yields at half of the stress which its weight gives its root; an
    elastic twin then runs in turn with it.  modes: of "modal". Beside reduced models the full linear one runs.
    steps: timed ones, at most; they end after `budget` seconds.  0 steps: only the start.
    """

    m: int
    youngs: float = 1e6
    poisson: float = 0.4
    model: str = "corotational"
    modes: int = 20
    plasticity: str = "none"
    solver: str = "multilevel"
    precision: str = "f32"
    arch: str | None = None
    threads: int | None = None
    steps: int = 60
    budget: float = 45.0


def bar_mesh(m: int):
    """The mesh of a Bar."""
    from taichifem.mesh import TetMesh

    return TetMesh.bar(size=(LENGTH, SIDE, SIDE), cells=(4 * m, m, m))


def measure(bar: Bar) -> dict:
    """All figures of one bar; times in milliseconds where the name says ms, else seconds."""
    from taichifem.app.starting import start_taichi

    begin = time.perf_counter()
    start_taichi(bar.arch, bar.threads)
    started = time.perf_counter()
    mesh = bar_mesh(bar.m)
    simulation, setup = _set_up(bar, mesh)
    figures = {"nodes": len(mesh.points), "tets": len(mesh.cells), "taichi_s": started - begin, "setup_s": setup}
    twin = _twin(bar, mesh)
    figures |= _steps(simulation, mesh.points[:, 0] > LENGTH - 1e-9, bar, twin)
    return figures | {"timoshenko_m": -timoshenko(bar.youngs, bar.poisson), "peak_mib": peak_mib()}


def _twin(bar: Bar, mesh):
    """What runs in turn with the bar: an elastic one beside a plastic, the full one beside a reduced; or nothing."""
    if bar.model in REDUCED:
        return _set_up(replace(bar, model="linear"), mesh)[0]
    return _set_up(replace(bar, plasticity="none"), mesh)[0] if bar.plasticity != "none" else None


def _set_up(bar: Bar, mesh) -> tuple:
    from taichifem import Body, BoxRegion, Material, Scene, simulate

    flow = {"modes": bar.modes, **_flow(bar)}
    material = Material(model=bar.model, youngs=bar.youngs, poisson=bar.poisson, density=DENSITY, **flow)
    held = BoxRegion(lower=(-1.0, -1.0, -1.0), upper=(1e-6, 1.0, 1.0))
    body = Body(mesh=mesh, material=material, pins=[held])
    integrator = "quasi-static" if bar.model == "bem" else "backward-euler"
    scene = Scene(bodies=[body], gravity=(0.0, 0.0, -GRAVITY), fps=FPS, solver=bar.solver, integrator=integrator)
    begin = time.perf_counter()
    simulation = simulate(scene, precision=bar.precision, arch=bar.arch, threads=bar.threads)
    return simulation, time.perf_counter() - begin


def _flow(bar: Bar) -> dict:
    limit = 1.5 * DENSITY * GRAVITY * LENGTH**2 / SIDE
    if bar.plasticity == "creep":
        return {"plasticity": "creep", "yield_strain": limit / bar.youngs, "creep_rate": 10.0}
    if bar.plasticity != "none":
        return {"plasticity": bar.plasticity, "yield_stress": limit, "hardening": bar.youngs / 20}
    return {}


def _steps(simulation, tip, bar: Bar, twin) -> dict:
    """What the steps took, and what each of them tells about itself; and what those of its elastic twin took."""
    phases, reports, elastic = {}, [], []

    def note() -> None:
        if twin is not None:
            elastic.append(timed_ms(twin.step))
        # The timer and the report themselves: `simulation.stats` also computes stresses, which warms caches up.
        for name, ms in simulation.phases.items():
            phases.setdefault(name, []).append(ms)
        reports.append(simulation.report)

    def deflection() -> float:
        return float(simulation.positions[tip, 2].mean()) - SIDE / 2

    figures = drive(simulation.step, deflection, steps=bar.steps, budget=bar.budget, after=note)
    if not bar.steps:
        return figures
    iterations = [report.iterations for report in reports]
    if twin is not None and bar.model in REDUCED:
        figures["full_ms"] = spread(elastic[1:])
    elif twin is not None:
        # The first step of the twin compiles, and is no sooner than the first timed one of the bar.
        flowed = simulation.equivalent_plastic_strain()
        figures |= {"elastic_ms": spread(elastic[1:]), "yielded": float((flowed > 0).mean())}
    return figures | {
        "phases_ms": {name: spread(values) for name, values in phases.items()},
        "real_time_factor": 1e3 / FPS / figures["ms"]["median"],
        "iterations": {"median": statistics.median(iterations), "max": max(iterations)},
        "capped_steps": sum(not report.converged for report in reports),
        "residual": max(report.residual for report in reports),
        "product": _product(simulation),
    }


def _product(simulation) -> dict | None:
    """The matrix product alone, against a plain read of the same memory; None for models without one."""
    if not hasattr(simulation, "product_bandwidth"):
        return None
    found = simulation.product_bandwidth()
    return {"ms": 1e3 * found.product, "gb_s": found.achieved, "read_gb_s": found.limit}


def timoshenko(youngs: float, poisson: float) -> float:
    """Static deflection [m] of the free end of the bar under its weight, for small displacement.

    Bending and shear, with Cowper's shear coefficient of a rectangle (1966).
    """
    area, inertia = SIDE**2, SIDE**4 / 12
    load = DENSITY * GRAVITY * area
    shear_modulus = youngs / (2 * (1 + poisson))
    coefficient = 10 * (1 + poisson) / (12 + 11 * poisson)
    return load * LENGTH**4 / (8 * youngs * inertia) + load * LENGTH**2 / (2 * coefficient * shear_modulus * area)


if __name__ == "__main__":
    try:
        print(json.dumps(measure(Bar(**json.loads(sys.argv[1])))), flush=True)
    except InputError as error:
        sys.exit(str(error))
