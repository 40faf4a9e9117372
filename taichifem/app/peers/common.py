"""What `taichifem bench` and its peers share: the task, the frames and their clock.

Peer scripts run wherever the peer is installed: NumPy and the standard library are all there is.
"""

from __future__ import annotations

import json
import math
import statistics
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

FPS = 60
WARM_UP = 5
SHARE = 0.8  # of the time a pressure wave needs across an element: explicit steps of 1.0 were seen to fly apart
REACH = 100.0  # [m] no tip of a sound bar gets that far within the frames of a bench


@dataclass(frozen=True, kw_only=True)
class Task:
    """A bar that is held at x = 0 and released at rest, gravity along -z.

    points: (nodes, 3) [m].  tets: (tets, 4), of positive volume.  youngs [Pa].  density [kg/m^3].  gravity [m/s^2].
    threads: None for as many as there are cores.  steps: timed frames, at most; they end after `budget` seconds.
    mode: which of the peer's methods, where it has several.
    """

    points: np.ndarray
    tets: np.ndarray
    youngs: float
    poisson: float
    density: float
    gravity: float
    steps: int
    budget: float
    threads: int | None = None
    mode: str = ""

    @property
    def held(self) -> np.ndarray:
        """Numbers of the nodes that are held."""
        return np.flatnonzero(self.points[:, 0] < 1e-9)

    @property
    def tip(self) -> np.ndarray:
        """Numbers of the nodes of the free end."""
        return np.flatnonzero(self.points[:, 0] > self.points[:, 0].max() - 1e-9)

    @property
    def lame(self) -> tuple[float, float]:
        """Lamé's mu and lambda [Pa]."""
        E, nu = self.youngs, self.poisson
        return E / (2 * (1 + nu)), E * nu / ((1 + nu) * (1 - 2 * nu))

    @property
    def smith_constants(self) -> tuple[float, float]:
        """mu and lambda [Pa] that give a stable neo-Hookean law with log term the stiffness of `lame` at rest.

        Smith, de Goes and Kim, Stable Neo-Hookean Flesh Simulation (2018), section 3.4.
        """
        mu, lam = self.lame
        return 4 / 3 * mu, lam + 5 / 6 * mu

    @property
    def volumes(self) -> np.ndarray:
        """Of the tetrahedra [m^3]."""
        corner = self.points[self.tets]
        return np.linalg.det(corner[:, 1:] - corner[:, :1]) / 6

    @property
    def masses(self) -> np.ndarray:
        """Of the nodes [kg]: a quarter of each tetrahedron around."""
        shares = np.repeat(self.density * self.volumes / 4, 4)
        return np.bincount(self.tets.ravel(), shares, minlength=len(self.points))

    @property
    def explicit_substeps(self) -> int:
        """Explicit steps a frame: as few as keep SHARE of what a wave needs across the flattest tetrahedron."""
        corner = self.points[self.tets]
        gradients = np.linalg.inv(corner[:, 1:] - corner[:, :1])  # columns: 1 over the heights of three corners
        gradients = np.append(gradients, gradients.sum(axis=2, keepdims=True), axis=2)
        mu, lam = self.lame
        speed = math.sqrt((lam + 2 * mu) / self.density)
        return math.ceil(speed * np.linalg.norm(gradients, axis=1).max() / (SHARE * FPS))


def drive(
    frame: Callable[[], object],
    deflection: Callable[[], float],
    *,
    steps: int,
    budget: float,
    after: Callable[[], object] = lambda: None,
) -> dict:
    """Run frames: WARM_UP, then up to `steps` timed ones within `budget` seconds; 0 steps: the first frame only.

    deflection: height of the tip above where it started [m], read after each frame, untimed.  after: called after each
    timed frame.  Ends early when the tip is nowhere.
    """
    times, tips, probes, end = [], [], [], math.inf
    for i in range(WARM_UP + steps if steps else 1):
        if i == WARM_UP:
            probes.append(probe_ms())
            end = time.perf_counter() + budget
        elif time.perf_counter() >= end:
            break
        times.append(timed_ms(frame))
        if i >= WARM_UP:
            after()
        tips.append(float(deflection()))
        if not abs(tips[-1]) < REACH:  # nor if it is not a number
            break
    figures = {"first_step_s": times[0] / 1e3}
    if len(times) > WARM_UP:
        probes.append(probe_ms())
        ms = times[WARM_UP:]
        figures |= {"steps": len(ms), "ms": spread(ms), "probe_ms": sum(probes) / 2}
        figures |= {"tip_m": tips[-1], "tip_lowest_m": min(tips)}
    return figures | {"tips_m": tips}


def main(build: Callable[[Task], tuple[Callable[[], object], Callable[[], np.ndarray], dict]]) -> None:
    """A peer script: builds the task of the command line, runs it, prints what came out as one line of JSON.

    build: gives a function that advances by one frame, one that reads the heights of the tip's nodes [m], and what
    there is to say: version, law, method, substeps, threads.
    """
    given = json.loads(sys.argv[1])
    mesh = np.load(given.pop("mesh"))
    task = Task(points=mesh["points"], tets=mesh["tets"], **given)
    begin = time.perf_counter()
    frame, heights, about = build(task)
    setup = time.perf_counter() - begin
    rest = np.mean(heights())
    figures = drive(frame, lambda: float(np.mean(heights()) - rest), steps=task.steps, budget=task.budget)
    print("\n" + json.dumps(about | {"setup_s": setup, "peak_mib": peak_mib()} | figures), flush=True)


def timed_ms(action: Callable[[], object]) -> float:
    """Wall time of one call [ms]."""
    begin = time.perf_counter()
    action()
    return 1e3 * (time.perf_counter() - begin)


def spread(values: list[float]) -> dict[str, float]:
    """Median and the tenth and ninetieth percentile."""
    ordered = sorted(values)
    last = len(ordered) - 1
    return {"median": statistics.median(ordered), "p10": ordered[round(0.1 * last)], "p90": ordered[round(0.9 * last)]}


def probe_ms(repeats: int = 7) -> float:
    """Time [ms] of a fixed piece of NumPy on one thread: tells how fast the machine is just now."""
    rng = np.random.default_rng(0)
    index, x, weights = rng.integers(0, 1 << 16, 1 << 20), rng.standard_normal(1 << 16), rng.standard_normal(1 << 20)
    return statistics.median(timed_ms(lambda: float((x[index] * weights).sum())) for _ in range(repeats))


def peak_mib() -> float:
    """Most memory this process has held [MiB]."""
    try:
        with open("/proc/self/status", encoding="ascii", errors="replace") as file:
            return next(float(line.split()[1]) / 1024 for line in file if line.startswith("VmHWM"))
    except (OSError, StopIteration):
        import resource  # not on Windows

        unit = 2**20 if sys.platform == "darwin" else 1024
        return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / unit
