"""A scene of reduced bodies brought to life: the same face as `Simulation`, with few unknowns behind it."""

from __future__ import annotations

from dataclasses import asdict, replace

import numpy as np

from taichifem import checkpoint
from taichifem.checkpoint import Resumable
from taichifem.clock import Clock
from taichifem.description import Collider, Scene
from taichifem.errors import Diverged
from taichifem.integrators.step import StepReport
from taichifem.reduced.gripped_bodies import GrippedBodies
from taichifem.stats import Stats, figures
from taichifem.surroundings import pose
from taichifem.timing import PhaseTimer


class ReducedSimulation(Resumable, GrippedBodies):
    """The state of a scene of reduced bodies over time. Arrays in and out are NumPy, float64, SI units; z points up.

    precision: of the rows of the surface, "f32" or "f64"; all else is in double precision.
    Raises InputError for what these bodies cannot do, with what to use instead.
    """

    def __init__(
        self, scene: Scene, *, precision: str = "f32", arch: str | None = None, threads: int | None = None
    ) -> None:
        self._clock = Clock(fps=scene.fps, substeps=scene.substeps or 1)
        super().__init__(scene, precision=precision, arch=arch, threads=threads, dt=self._clock.dt)
        self._timer = PhaseTimer()
        self._stats: Stats | None = None

    def step(self) -> None:
        """Advance by one time step. Raises Diverged on NaN or infinity."""
        self._stats = None
        self._timer.reset()
        gravity = np.asarray(self.scene.gravity, dtype=float)
        with self._timer.phase("step"):
            for body, grip in zip(self.bodies, self._grips(self.time, self.dt), strict=True):
                before = body.keep()
                body.advance(self.dt, self.time, gravity, self._obstacles, grip)
                if not body.finite:
                    body.take_back(before)
                    raise Diverged(f"the simulation diverged at t = {self.time:.4g} s: a coordinate is not finite")
        self._clock.tick()

    def collider_poses(self) -> list[tuple[Collider, np.ndarray, np.ndarray]]:
        """Each collider with the rotation R (3,3) and offset c (3,) [m] that move it now: x = R X + c."""
        return [(c, *pose(c.motion, self.time)) for c in self.scene.colliders]

    def adjust(self, **changes: object) -> None:
        """Change gravity, view and other plain fields of the scene from the next step on."""
        self.scene, self._stats = replace(self.scene, **changes), None

    @property
    def report(self) -> StepReport:
        """What the last step took: nothing is iterated."""
        return StepReport()

    @property
    def phases(self) -> dict[str, float]:
        """Time the last step spent in each phase [ms]."""
        return dict(self._timer.ms)

    @property
    def stats(self) -> Stats:
        """Figures of the last step: times, energies, momenta."""
        if self._stats is None:
            self._stats = figures(self)
        return self._stats

    # Checkpoints

    def _fingerprint(self) -> str:
        models = " ".join(f"{m.model} {m.modes} {m.basis} {m.youngs}" for m in (b.material for b in self.scene.bodies))
        text = f"{self.precision} {self.substeps} {models}"
        return checkpoint.fingerprint(self.rest_positions, self.cells, text=text)

    def snapshot(self) -> tuple[dict[str, np.ndarray], dict]:
        """Arrays and a header with all that the next steps depend on, for `restore`."""
        arrays = {f"{b}.{name}": v.copy() for b, body in enumerate(self.bodies) for name, v in body.state().items()}
        return arrays, {"scene": self._fingerprint(), "clock": asdict(self._clock)}

    def restore(self, arrays: dict[str, np.ndarray], header: dict) -> None:
        """Go on from a `snapshot`; hands let go."""
        self.let_go()
        self._clock, self._stats = Clock(**header["clock"]), None
        for b, body in enumerate(self.bodies):
            own = {name.removeprefix(f"{b}."): v for name, v in arrays.items() if name.startswith(f"{b}.")}
            body.set_state(own, self.time)
