"""One choice of a comparison: its simulation, and what its steps took."""

from __future__ import annotations

import math
import statistics
from typing import TYPE_CHECKING

from taichifem.app.bench_worker import spread
from taichifem.errors import Diverged

if TYPE_CHECKING:
    from taichifem.simulation import Simulation


class Run:
    """A simulation that may diverge while others go on.

    label: the choice in words.  frames: to go through.
    diverged: time [s] of the last state that was finite, or None.
    """

    def __init__(self, label: str, simulation: Simulation) -> None:
        self.label, self.simulation = label, simulation
        self.diverged: float | None = None
        scene = simulation.scene
        self.frames = max(1, round(scene.seconds * scene.fps))
        self._critical = simulation.critical_step()
        self._ms: list[dict[str, float]] = []
        self._reports: list[tuple[int, float, bool]] = []
        self._energy = [self._energies()]

    @property
    def words(self) -> tuple[str, ...]:
        """Lines for the picture: time, and the cost of the last step."""
        lines = (f"t = {self.simulation.time:.2f} s",)
        if self._ms:
            cost, iterations = sum(self._ms[-1].values()), self._reports[-1][0]
            lines += (f"{cost:.1f} ms a step, {iterations} iterations",)
        return lines

    @property
    def remark(self) -> str:
        """What is to be said of the state: nothing, or when it diverged."""
        return "" if self.diverged is None else f"diverged at t = {self.diverged:.4g} s"

    def advance_to(self, time: float) -> bool:
        """Go to the last frame not after `time` [s], and not beyond the end; False if there was nothing to do."""
        due = min(self.frames, math.floor(time * self.simulation.scene.fps + 1e-6))
        if self.diverged is not None or self.simulation.frame >= due:
            return False
        try:
            while self.simulation.frame < due:
                self.simulation.step()
                report = self.simulation.report
                self._ms.append(self.simulation.phases)
                self._reports.append((report.iterations, report.residual, report.converged))
        except Diverged:
            self.diverged = self.simulation.time
        self._energy.append(self._energies())
        return True

    def _energies(self) -> dict[str, float]:
        return dict(self.simulation.stats.energy)

    def figures(self) -> dict:
        """All figures, ready for JSON: times of steps in milliseconds, everything else in SI units.

        dt_s is the mean.  What is not known is None: times of a run without a step, an energy that is not finite.
        """
        ms = self._ms[1:] or self._ms  # the first step also compiles
        iterations = [count for count, _, _ in self._reports]
        names = dict.fromkeys(name for phases in ms for name in phases)
        return {
            "choice": self.label,
            "nodes": len(self.simulation.rest_positions),
            "tets": len(self.simulation.cells),
            "steps": len(self._ms),
            "dt_s": self.simulation.time / len(self._ms) if self._ms else None,
            "simulated_s": self.simulation.time,
            "ms": spread([sum(phases.values()) for phases in ms]) if ms else None,
            "phases_ms": {name: statistics.median(phases.get(name, 0.0) for phases in ms) for name in names},
            "iterations": {"median": statistics.median(iterations), "max": max(iterations)} if iterations else None,
            "residual": _finite(max((residual for _, residual, _ in self._reports), default=math.nan)),
            "capped_steps": sum(not converged for _, _, converged in self._reports),
            "energy": self._energy_figures(),
            "critical_step_s": _finite(self._critical),
            "state": "ok" if self.diverged is None else "diverged",
            "diverged_at_s": self.diverged,
        }

    def _energy_figures(self) -> dict[str, float | None]:
        """Total energy at start and end [J], the largest kinetic + |elastic| seen [J], and the drift in parts of it."""
        start, end = self._energy[0]["total"], self._energy[-1]["total"]
        largest = max(energy["kinetic"] + abs(energy["elastic"]) for energy in self._energy)
        drift = (end - start) / largest if largest > 0 else math.nan
        named = {"start_J": start, "end_J": end, "largest_J": largest, "drift": drift}
        return {name: _finite(value) for name, value in named.items()}


def _finite(value: float) -> float | None:
    """`value`, or None for what JSON does not have."""
    return float(value) if math.isfinite(value) else None
