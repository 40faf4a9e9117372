"""One bar of `taichifem bench`, measured in this process alone: `python -m taichifem.app.bench_worker '{...}'`.

Takes a Bar as JSON, prints its figures as one line of JSON. A process of its own, because memory
and compile times of one size would blur those of the next.
"""

from __future__ import annotations

import json
import statistics
import sys
import time
from dataclasses import dataclass

from taichifem.errors import InputError

LENGTH, SIDE = 1.0, 0.25  # [m]
POISSON, DENSITY, GRAVITY = 0.4, 1000.0, 9.81
FPS = 60
WARM_UP = 5


@dataclass(frozen=True, kw_only=True)
class Bar:
    """What to measure: a bar of 4m x m x m cubes, 20 m^3 tetrahedra, held at x = 0 and released at rest.

    youngs: [Pa].  steps: timed ones, at most; they end after `budget` seconds.  0 steps: only the start.
    """

    m: int
    youngs: float = 1e6
    model: str = "corotational"
    precision: str = "f32"
    arch: str | None = None
    threads: int | None = None
    steps: int = 60
    budget: float = 45.0


def measure(bar: Bar) -> dict:
    """All figures of one bar; times in milliseconds where the name says ms, else seconds."""
    from taichifem.app.starting import start_taichi

    begin = time.perf_counter()
    start_taichi(bar.arch, bar.threads)
    started = time.perf_counter()
    from taichifem import BoxRegion, TetMesh

    mesh = TetMesh.bar(size=(LENGTH, SIDE, SIDE), cells=(4 * bar.m, bar.m, bar.m))
    held = BoxRegion(lower=(-1.0, -1.0, -1.0), upper=(1e-6, 1.0, 1.0))
    simulation, setup = _set_up(bar, mesh, held)
    figures = {"nodes": len(mesh.points), "tets": len(mesh.cells), "taichi_s": started - begin, "setup_s": setup}
    tip = mesh.points[:, 0] > LENGTH - 1e-9
    figures["first_step_s"] = _timed_step(simulation) / 1e3
    if bar.steps:
        figures |= _steps(simulation, tip, bar)
    return figures | {"timoshenko_m": -timoshenko(bar.youngs), "peak_mib": peak_mib()}


def _set_up(bar: Bar, mesh, held) -> tuple:
    from taichifem import Body, Material, Scene, Simulation

    material = Material(model=bar.model, youngs=bar.youngs, poisson=POISSON, density=DENSITY)
    body = Body(mesh=mesh, material=material, pins=[held])
    scene = Scene(bodies=[body], gravity=(0.0, 0.0, -GRAVITY), fps=FPS)
    begin = time.perf_counter()
    simulation = Simulation(scene, precision=bar.precision, arch=bar.arch, threads=bar.threads)
    return simulation, time.perf_counter() - begin


def _timed_step(simulation) -> float:
    """Wall time of one step [ms]."""
    begin = time.perf_counter()
    simulation.step()
    return 1e3 * (time.perf_counter() - begin)


def _steps(simulation, tip, bar: Bar) -> dict:
    """Warm up, then time steps, one by one."""
    heights = []
    for _ in range(WARM_UP - 1):  # the first step was one
        simulation.step()
        heights.append(_height(simulation, tip))
    probe = [probe_ms()]
    steps, phases, iterations, residuals, capped = [], {}, [], [], 0
    end = time.perf_counter() + bar.budget
    while len(steps) < bar.steps and (not steps or time.perf_counter() < end):
        steps.append(_timed_step(simulation))
        # The timer and the report themselves: `simulation.stats` also computes stresses, which warms caches up.
        for name, ms in simulation.phases.items():
            phases.setdefault(name, []).append(ms)
        report = simulation.report
        iterations.append(report.iterations)
        residuals.append(report.residual)
        capped += not report.converged
        heights.append(_height(simulation, tip))
    probe.append(probe_ms())
    ms = spread(steps)
    return {
        "steps": len(steps),
        "ms": ms,
        "phases_ms": {name: spread(values) for name, values in phases.items()},
        "real_time_factor": 1e3 / FPS / ms["median"],
        "iterations": {"median": statistics.median(iterations), "max": max(iterations)},
        "capped_steps": capped,
        "residual": max(residuals),
        "tip_m": heights[-1] - SIDE / 2,
        "tip_lowest_m": min(heights) - SIDE / 2,
        "probe_ms": sum(probe) / 2,
    }


def _height(simulation, tip) -> float:
    return float(simulation.positions[tip, 2].mean())


def spread(values: list[float]) -> dict[str, float]:
    """Median and the tenth and ninetieth percentile."""
    ordered = sorted(values)
    last = len(ordered) - 1
    return {"median": statistics.median(ordered), "p10": ordered[round(0.1 * last)], "p90": ordered[round(0.9 * last)]}


def timoshenko(youngs: float) -> float:
    """Static deflection [m] of the free end of the bar under its weight, for small displacement.

    Bending and shear, with Cowper's shear coefficient of a rectangle (1966).
    """
    area, inertia = SIDE**2, SIDE**4 / 12
    load = DENSITY * GRAVITY * area
    shear_modulus = youngs / (2 * (1 + POISSON))
    coefficient = 10 * (1 + POISSON) / (12 + 11 * POISSON)
    return load * LENGTH**4 / (8 * youngs * inertia) + load * LENGTH**2 / (2 * coefficient * shear_modulus * area)


def probe_ms(repeats: int = 7) -> float:
    """Time [ms] of a fixed piece of NumPy on one thread: tells how fast the machine is just now."""
    import numpy as np

    rng = np.random.default_rng(0)
    index, x, weights = rng.integers(0, 1 << 16, 1 << 20), rng.standard_normal(1 << 16), rng.standard_normal(1 << 20)
    times = []
    for _ in range(repeats):
        begin = time.perf_counter()
        float((x[index] * weights).sum())
        times.append(1e3 * (time.perf_counter() - begin))
    return statistics.median(times)


def peak_mib() -> float:
    """Most memory this process has held [MiB]."""
    try:
        with open("/proc/self/status", encoding="ascii", errors="replace") as file:
            return next(float(line.split()[1]) / 1024 for line in file if line.startswith("VmHWM"))
    except (OSError, StopIteration):
        import resource  # not on Windows

        unit = 2**20 if sys.platform == "darwin" else 1024
        return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / unit


if __name__ == "__main__":
    try:
        print(json.dumps(measure(Bar(**json.loads(sys.argv[1])))), flush=True)
    except InputError as error:
        sys.exit(str(error))
