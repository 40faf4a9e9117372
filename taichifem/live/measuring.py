"""Figures of a simulation that runs: what a step takes, how time goes by, energies, stress."""

from __future__ import annotations

import time
from collections import deque
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from taichifem.simulation import Simulation

SPAN = 1.0
"""Seconds over which is measured."""


class Meter:
    """Notes every step of the last second."""

    def __init__(self) -> None:
        self._steps: deque[tuple[float, float, float, dict[str, float]]] = deque()
        self._compiled: Simulation | None = None

    def begin(self) -> None:
        """Forget what was, as after a pause."""
        self._steps.clear()

    def note(self, simulation: Simulation, took: float) -> None:
        """A step is done that took so many seconds; the first one of a simulation compiles and does not count."""
        if self._compiled is not simulation:
            self._compiled = simulation
            return
        now = time.perf_counter()
        self._steps.append((now, simulation.dt, took, simulation.phases))
        while self._steps and now - self._steps[0][0] > SPAN:
            self._steps.popleft()

    def figures(self, simulation: Simulation, *, paused: bool) -> dict[str, Any]:
        """What the page shows, as plain numbers; factor: simulated seconds a second."""
        stats, steps = simulation.stats, list(self._steps)
        count = max(len(steps), 1)
        names = {name for *_, phases in steps for name in phases}
        wall = steps[-1][0] - steps[0][0] if len(steps) > 1 else 0.0
        report = simulation.report
        return {
            "time": simulation.time,
            "frame": simulation.frame,
            "dt": simulation.dt,
            "phases": {name: sum(p.get(name, 0.0) for *_, p in steps) / count for name in sorted(names)},
            "ms": 1e3 * sum(took for _, _, took, _ in steps) / count,
            "factor": sum(dt for _, dt, _, _ in steps[1:]) / wall if wall > 0 and not paused else 0.0,
            "nodes": stats.nodes,
            "elements": stats.elements,
            "pieces": stats.pieces,
            "contacts": stats.contacts,
            "iterations": report.iterations,
            "converged": report.converged and report.balanced,
            "energy": stats.energy,
            "stress": float(simulation.von_mises().max()),
        }
