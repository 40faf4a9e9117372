"""Static solves: the shape in which a scene's loads are balanced.

Newton's method with tangents projected to positive semi-definite and a line search; where it does not converge, the
loads (gravity, forces, tractions, pressures, and the motions of pins, handles and colliders) are put on in steps.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace

from taichifem.description import Material, Scene
from taichifem.description.material import ELASTIC
from taichifem.errors import Diverged
from taichifem.integrators.step import Iteration, StepReport
from taichifem.simulation import Simulation

SMALLEST_STEP = 1 / 1024
"""Part of the loads below which stepping gives up."""

LARGEST_TURN = 30.0
"""Degrees that a pin may turn in one load step: set down after much more, it could have come either way."""


@dataclass(frozen=True)
class LoadStep:
    """One attempt: up to which part of the loads, 0 to 1, whether it converged, and how it went."""

    share: float
    converged: bool
    iterations: tuple[Iteration, ...]


@dataclass
class StaticResult:
    """How a static solve went. share: the part of the loads that is balanced; 1 when it converged.

    steps: all attempts, those that failed among them.
    """

    share: float = 0.0
    steps: list[LoadStep] = field(default_factory=list)

    @property
    def converged(self) -> bool:
        """Are all loads balanced?"""
        return self.share == 1.0

    @property
    def linearisations(self) -> int:
        """Matrices set up in all."""
        return sum(len(step.iterations) for step in self.steps)


def static_scene(scene: Scene, *, linear: bool = False) -> Scene:
    """The scene to be solved statically; linear: with small strains, every material Hooke's."""
    bodies = scene.bodies
    if linear:
        bodies = [
            replace(b, material=_hookean(b.material), materials={k: _hookean(m) for k, m in b.materials.items()})
            for b in bodies
        ]
    return replace(scene, bodies=bodies, integrator="quasi-static")


def _hookean(material: Material) -> Material:
    return replace(material, model="linear", spring_stiffness=None, **ELASTIC)


def solve_static(
    simulation: Simulation,
    *,
    tolerance: float = 1e-9,
    max_newton: int = 30,
    on_step: Callable[[LoadStep], None] | None = None,
) -> StaticResult:
    """Balance a simulation of a `static_scene` under its full loads; state and loads are the last that were balanced.

    tolerance: imbalance of the nodes relative to the forces at work.  max_newton: linearisations a load step.
    on_step: told of every attempt as it ends.  Motions are taken at their last key time, loads at their full size;
    where a pin turns by more than `LARGEST_TURN`, they go on in steps from the start.
    A shape with elements turned inside out does not count as balanced: such a balance is not the one looked for.
    """
    result = StaticResult()
    width = widest = min(1.0, LARGEST_TURN / max(simulation.turn, 1e-300))
    while not result.converged:
        share = result.share + width if result.share + width < 1 - 1e-9 else 1.0
        converged, report = _attempt(simulation, share, tolerance, max_newton)
        result.steps.append(LoadStep(share, converged, tuple(report.history)))
        if on_step is not None:
            on_step(result.steps[-1])
        if converged:
            result.share = share
            width = min(2 * width, widest)
        else:
            width = 0.5 * (share - result.share)
            if width < SMALLEST_STEP:
                break
    return result


def _attempt(simulation: Simulation, share: float, tolerance: float, max_newton: int) -> tuple[bool, StepReport]:
    try:
        report = simulation.balance(share=share, tolerance=tolerance, max_newton=max_newton)
        good = report.balanced and not len(simulation.turned_inside_out())
    except Diverged:
        good, report = False, StepReport()
    if not good:
        simulation.take_back()
    return good, report
