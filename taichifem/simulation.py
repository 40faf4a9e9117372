"""A scene brought to life: `Simulation(scene)` builds the world and advances it."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from taichifem import transfer
from taichifem.description import Collider, Load, Material, Scene
from taichifem.errors import Diverged, InputError
from taichifem.integrators import ADVANCE, implicit, symplectic_euler
from taichifem.integrators.step import Options, Step, StepReport
from taichifem.resumable_bodies import ResumableBodies
from taichifem.stats import Stats, figures
from taichifem.supports import check_supports
from taichifem.timing import PhaseTimer

STATIC_TOLERANCE, STATIC_ITERATIONS = 1e-6, 50_000
"""Of the linear solver in a static solve: the stiffness matrix alone is far worse conditioned than a step's."""


class Simulation(ResumableBodies):
    """The state of a scene over time. Arrays in and out are NumPy, float64, SI units; z points up.

    precision: "f32" (real time) or "f64".  arch, threads: as `taichifem.runtime.start`; None keeps what runs.
    Raises InputError for what cannot be simulated: among others, explicit steps longer than stability allows.
    """

    def __init__(
        self,
        scene: Scene,
        *,
        precision: str = "f32",
        arch: str | None = None,
        threads: int | None = None,
    ) -> None:
        super().__init__(scene, precision=precision, arch=arch, threads=threads)
        self._timer = PhaseTimer()
        self._report = StepReport()
        self._stats: Stats | None = None
        self._loaded: list[float] | None = None
        self._share_on = 0.0
        self._before: tuple[float, np.ndarray, dict[str, np.ndarray]] | None = None
        self._explicit = scene.integrator == "symplectic-euler"
        self._restiffened = False
        if scene.integrator == "quasi-static":
            check_supports(scene, self._layout)
        self._surround(0.0, self.dt)
        if self._explicit:
            self._keep_stable()

    # Time

    def step(self) -> None:
        """Advance by one time step. Raises Diverged, with the state before the step kept, on NaN or infinity."""
        if self._explicit and self._clock.substep == 0 and self.scene.substeps is None:
            if self._restiffened or not self._laws.linear:
                self._keep_stable()
            self._restiffened = False
        self._timer.reset()
        with self._timer.phase("set-up"):
            self._surround(self._clock.end, self.dt)
            self._put_loads(self._clock.end)
        with self._timer.phase("contact"):
            self._meet(self.dt)
        self._gravity = np.asarray(self.scene.gravity, dtype=float)
        self._advance()
        self._clock.tick()
        self._fresh = False
        if self._may_break:
            with self._timer.phase("fracture"):
                if self._break(self._clock.steps):
                    self._surround(self.time, self.dt)
                    self._loaded, self._fresh, self._restiffened = None, True, True

    def _advance(self, **options: object) -> None:
        """One step of the scene's integrator under what the world holds; `options` replace those of the scene."""
        scene = self.scene
        chosen = {
            "tolerance": scene.tolerance,
            "max_iterations": scene.max_iterations,
            "newton_tolerance": scene.newton_tolerance,
        }
        with self._timer.phase("set-up"):
            plan = None if self._explicit else self._plan
        step = Step(
            w=self._world,
            counts=self._counts,
            laws=self._laws,
            dt=self.dt,
            gravity=self._gravity,
            options=Options(**chosen | options),
            timer=self._timer,
            plan=plan,
            riding=self._riding,
            follow=self._follow if self._loading.follows else None,
            due=self._due,
            # Methods that look back start anew where a load jumps: they would smear it over the steps around.
            fresh=self._fresh or self._loading.jumps(self._clock.time, self._clock.end),
            damped=any(m.stiffness_damping > 0 for m in self._materials),
        )
        self._stats = None
        with self._kernels():
            try:
                self._report = ADVANCE[scene.integrator](step)
            except Diverged as error:
                implicit.go_back(self._world, self._counts.nodes)
                self._due = step.due
                raise Diverged(f"the simulation diverged at t = {self.time:.4g} s: {error}") from None
        self._due = self.dt

    def balance(self, *, share: float = 1.0, tolerance: float = 1e-9, max_newton: int = 30) -> StepReport:
        """Find the balance under the part `share` of gravity, loads and motions; for "quasi-static" scenes.

        Loads are taken at their full size, motions as far on their way to the last key time.  The report says whether
        it was found (`balanced`); `taichifem.statics.solve_static` puts loads on in steps where it was not.
        tolerance: imbalance relative to the forces at work.  max_newton: most linearisations.
        """
        if self.scene.integrator != "quasi-static":
            raise InputError(f'integrator is {self.scene.integrator!r}: only "quasi-static" scenes can be balanced')
        self._timer.reset()
        with self._timer.phase("set-up"):
            self._before = self._share_on, self.positions, self._contact_state()
            self._put_on(share)
        self._advance(
            tolerance=STATIC_TOLERANCE,
            max_iterations=max(STATIC_ITERATIONS, self.scene.max_iterations),
            newton=max_newton,
            newton_tolerance=tolerance,
        )
        return self._report

    @property
    def turn(self) -> float:
        """Degrees by which pins or handles turn on their way to the last key time, at most."""
        return self._surroundings.turn

    def take_back(self) -> None:
        """Undo the last `balance`: the shape, contacts, loads, and where pins and colliders stand."""
        share, positions, contacts = self._before
        self._due = 0.0
        self.set_positions(positions)
        self._put_on(share)
        if contacts:
            self._write_contacts(contacts)

    def _put_on(self, share: float) -> None:
        """Put on the part `share` of all loads and motions."""
        self._share_on, self._gravity = share, share * np.asarray(self.scene.gravity, dtype=float)
        self._surround(share * self._surroundings.last_key, self.dt, all_act=True)
        self._send_loads(lambda _: share)

    def _keep_stable(self) -> None:
        """Choose the steps a frame of an explicit method, or refuse those the scene asks for."""
        critical = self.critical_step()
        longest = 1.0 / (self.scene.fps * critical) if critical < math.inf else 0.0
        if self.scene.substeps is None:
            self._clock.divide(max(1, math.ceil(longest / symplectic_euler.SAFETY)))
        elif self.dt > critical:
            raise InputError(
                f"simulation.substeps is {self.scene.substeps}, a step of {1e3 * self.dt:.4g} ms, and symplectic Euler "
                f"is stable up to {1e3 * critical:.4g} ms here: give at least {math.ceil(longest)}, or leave it out"
            )

    # Loads

    def _put_loads(self, time: float) -> None:
        """Give the world the loads at `time` [s], if they changed."""
        shares = self._loading.shares(time)
        if shares != self._loaded:
            self._send_loads(lambda load: load.share_at(time))
            self._loaded = shares

    def _send_loads(self, share: Callable[[Load], float]) -> None:
        self._loaded = None
        self._share = share
        with self._kernels():
            self._follow()

    def _follow(self) -> None:
        """Loads on the surface as it is now; on that at rest where all displacements count as small."""
        positions = None
        if self._loading.follows and not self._laws.linear:
            positions = transfer.read(self._world, self._world.x, self._counts.nodes).astype(np.float64)
        transfer.write(self._world, self._world.outside, self._loading.forces(self._share, positions))

    # Surroundings and materials

    def collider_poses(self) -> list[tuple[Collider, np.ndarray, np.ndarray]]:
        """Each collider with the rotation R (3,3) and offset c (3,) [m] that move it now: x = R X + c."""
        return self._poses(self.time)

    def set_material(self, body: int, material: Material, *, region: int | None = None) -> None:
        """Change a body's material (or that of one region of it) from the next step on; nothing recompiles.

        Raises InputError for a region without a material of its own, for a law that the scene did not have, and
        for one too stiff for the explicit steps that the scene asks for.
        """
        row = self._row(body, region)
        if material.fracture and not self._may_break:
            raise InputError("no material of the scene breaks yet: make a new simulation for that")
        before = self._materials[row]
        self._change_material(row, material)
        if self._explicit:
            self._restiffened = True
            try:
                self._keep_stable()
            except InputError:
                self._change_material(row, before)
                raise

    def adjust(self, **changes: object) -> None:
        """Change gravity, tolerances, view and other plain fields of the scene from the next step on.

        `substeps` too, between frames.  Raises InputError for values out of bounds, and for a time step so long that
        symplectic Euler is unstable.
        """
        before, self.scene = self.scene, replace(self.scene, **changes)
        if "substeps" in changes:
            try:
                self._clock.substeps = self.scene.substeps or 1
                if self._explicit:
                    self._keep_stable()
            except InputError:
                self.scene, self._clock.substeps = before, before.substeps or self._clock.substeps
                raise
        self._stats, self._fresh = None, self._fresh or changes.keys() != {"view"}

    def _changed(self) -> None:
        self._stats, self._fresh = None, True

    def _resumed(self, same: bool) -> None:
        self._stats = self._loaded = None
        if self._explicit and not same:
            self._keep_stable()

    @property
    def report(self) -> StepReport:
        """What the last step took: iterations, residual, contact passes. Costs nothing, unlike `stats`."""
        return self._report

    @property
    def phases(self) -> dict[str, float]:
        """Time the last step spent in each phase [ms]. Costs nothing, unlike `stats`."""
        return dict(self._timer.ms)

    @property
    def contacts(self) -> int:
        """Contacts of nodes and embedded vertices with colliders after the last step."""
        return sum(int((v > 0).sum()) for name, v in self._contact_state().items() if name.endswith("touching"))

    def _contact_state(self) -> dict[str, np.ndarray]:
        return self._read_contacts(self._counts.colliders) if self._counts.colliders else {}

    @property
    def stats(self) -> Stats:
        """Figures of the last step: times, iterations, energies, momenta."""
        if self._stats is None:
            self._stats = figures(self)
        return self._stats

    def show(self, *, seconds: float | None = None, size: tuple[int, int] = (640, 360)) -> object:
        """A picture of now, or an animation of the next `seconds`, which Jupyter displays; its `data` is the file."""
        from taichifem.output.notebook import picture  # a look upstairs, for a short name people can call

        return picture(self, seconds=seconds, size=size)
