"""What is known about a step: sizes, time per phase, solver, energies and momenta."""

from __future__ import annotations

from dataclasses import asdict, dataclass, field
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from taichifem.simulation import Simulation


@dataclass(frozen=True)
class Stats:
    """Figures after a step; SI units, times of phases in milliseconds.

    energy: kinetic, elastic, gravity (zero at the origin) and their total [J].
    momentum [kg m/s]; angular_momentum about the origin [kg m^2/s].
    residual: of the last linear solve, relative; converged: False if the iteration cap was hit.
    pieces: sets of elements that hang together; splits: vertices split in the step; more_splits: the cap was hit.
    linearisations: matrices set up; balanced: False if Newton's method hit its cap.
    """

    time: float
    frame: int
    step: int
    nodes: int
    elements: int
    ms: dict[str, float] = field(default_factory=dict)
    ms_per_step: float = 0.0
    iterations: int = 0
    residual: float = 0.0
    converged: bool = True
    contact_passes: int = 0
    linearisations: int = 0
    balanced: bool = True
    contacts: int = 0
    pieces: int = 0
    splits: int = 0
    more_splits: bool = False
    energy: dict[str, float] = field(default_factory=dict)
    momentum: tuple[float, float, float] = (0.0, 0.0, 0.0)
    angular_momentum: tuple[float, float, float] = (0.0, 0.0, 0.0)
    max_speed: float = 0.0

    def as_dict(self) -> dict:
        """Plain numbers, lists and dictionaries, ready for JSON."""
        return asdict(self)

    def __str__(self) -> str:
        cap = "" if self.converged else " (iteration cap hit)"
        return (
            f"t = {self.time:.3f} s, {self.nodes} nodes, {self.elements} elements, "
            f"{self.ms_per_step:.1f} ms a step, {self.iterations} CG iterations to {self.residual:.1e}{cap}, "
            f"energy {self.energy.get('total', 0.0):.4g} J"
        )


def figures(simulation: Simulation) -> Stats:
    """Figures of a simulation's last step; energies and momenta are worked out here."""
    x, v, m = simulation.positions, simulation.velocities, simulation.masses[:, None]
    kinetic = 0.5 * float((m * v**2).sum())
    elastic = simulation.elastic_energy()
    gravity = -float((m * x).sum(axis=0) @ np.asarray(simulation.scene.gravity))
    ms = {name: round(t, 4) for name, t in simulation.phases.items()}
    return Stats(
        time=simulation.time,
        frame=simulation.frame,
        step=simulation.step_count,
        nodes=len(x),
        elements=len(simulation.cells),
        ms=ms,
        ms_per_step=round(sum(ms.values()), 4),
        **{name: value for name, value in asdict(simulation.report).items() if name != "history"},
        contacts=simulation.contacts,
        pieces=simulation.piece_count,
        splits=simulation.splits,
        more_splits=simulation.more_splits,
        energy={"kinetic": kinetic, "elastic": elastic, "gravity": gravity, "total": kinetic + elastic + gravity},
        momentum=tuple((m * v).sum(axis=0).tolist()),
        angular_momentum=tuple((m * np.cross(x, v)).sum(axis=0).tolist()),
        max_speed=float(np.sqrt((v**2).sum(axis=1).max())),
    )
