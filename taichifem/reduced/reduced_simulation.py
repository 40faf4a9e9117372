"""A scene of reduced bodies brought to life: the same face as `Simulation`, with few unknowns behind it."""

from __future__ import annotations

import math
import os
from dataclasses import asdict
from functools import cached_property

import numpy as np

from taichifem import checkpoint, runtime
from taichifem.clock import Clock
from taichifem.description import Collider, Scene
from taichifem.errors import Diverged, InputError
from taichifem.integrators.step import StepReport
from taichifem.layout import lay_out
from taichifem.mesh.connectivity import boundary_faces, pieces
from taichifem.reduced.modal_body import ModalBody
from taichifem.reduced.obstacles import Obstacles
from taichifem.reduced.parts import Parts, linear_twin, take_apart
from taichifem.reduced.surface_body import SurfaceBody
from taichifem.reduced.surface_models import BoundarySurface, CondensedSurface
from taichifem.stats import Stats, figures
from taichifem.supports import check_supports
from taichifem.surroundings import pose
from taichifem.timing import PhaseTimer


class ReducedSimulation:
    """The state of a scene of reduced bodies over time. Arrays in and out are NumPy, float64, SI units; z points up.

    precision: of the rows of the surface, "f32" or "f64"; all else is in double precision.
    Raises InputError for what these bodies cannot do, with what to use instead.
    """

    splits, more_splits = 0, False

    def __init__(
        self, scene: Scene, *, precision: str = "f32", arch: str | None = None, threads: int | None = None
    ) -> None:
        if precision not in runtime.PRECISIONS:
            raise InputError(f'precision is {precision!r}: choose "f32" or "f64"')
        _check(scene)
        runtime.start(arch=arch, threads=threads)
        self.scene, self.precision = scene, precision
        self._clock = Clock(fps=scene.fps, substeps=scene.substeps or 1)
        self._twin = linear_twin(scene)
        self._obstacles = Obstacles(scene)
        if scene.integrator == "quasi-static":
            check_supports(scene, lay_out(scene))
        self.bodies = [self._body(parts) for parts in take_apart(scene, self._twin)]
        self._timer = PhaseTimer()
        self._stats: Stats | None = None

    def _body(self, parts: Parts) -> ModalBody | SurfaceBody:
        if parts.material.model == "modal":
            return ModalBody(parts, dt=self.dt, precision=self.precision)
        if parts.material.model == "bem":
            return SurfaceBody(parts, dt=self.dt, model=BoundarySurface(parts))
        still = self.scene.integrator == "quasi-static"
        return SurfaceBody(parts, dt=self.dt, model=CondensedSurface(parts, None if still else self.dt))

    # Time

    @property
    def dt(self) -> float:
        """Time step [s]."""
        return self._clock.dt

    @property
    def substeps(self) -> int:
        """Steps a frame."""
        return self._clock.substeps

    @property
    def time(self) -> float:
        """Simulated time [s]."""
        return self._clock.time

    @property
    def frame(self) -> int:
        """Frames completed."""
        return self._clock.frame

    @property
    def step_count(self) -> int:
        """Steps completed."""
        return self._clock.steps

    def step(self) -> None:
        """Advance by one time step. Raises Diverged on NaN or infinity."""
        self._stats = None
        self._timer.reset()
        gravity = np.asarray(self.scene.gravity, dtype=float)
        with self._timer.phase("step"):
            for body in self.bodies:
                before = body.keep()
                body.advance(self.dt, self.time, gravity, self._obstacles)
                if not body.finite:
                    body.take_back(before)
                    raise Diverged(f"the simulation diverged at t = {self.time:.4g} s: a coordinate is not finite")
        self._clock.tick()

    def advance_frame(self) -> None:
        """Advance to the next frame: `substeps` steps, or what is left of them."""
        frame = self.frame
        while self.frame == frame:
            self.step()

    def advance(self, *, seconds: float) -> None:
        """Advance by `seconds`, rounded to whole steps."""
        end = self.time + seconds
        while self.time + 0.5 * self.dt < end:
            self.step()

    # What does not change

    @property
    def dimension(self) -> int:
        """3: tetrahedra."""
        return 3

    @property
    def rest_positions(self) -> np.ndarray:
        """Rest positions (n,3) [m]."""
        return self._twin.rest_positions

    @property
    def cells(self) -> np.ndarray:
        """Elements (m,4)."""
        return self._twin.cells

    @property
    def cell_bodies(self) -> np.ndarray:
        """Body of each element (m,)."""
        return self._twin.cell_bodies

    @property
    def cell_regions(self) -> np.ndarray:
        """Region of each element in its mesh (m,)."""
        return self._twin.cell_regions

    @property
    def node_bodies(self) -> np.ndarray:
        """Body of each node (n,)."""
        return self._twin.node_bodies

    @property
    def surface(self) -> np.ndarray:
        """Outward triangles of all bodies (k,3), as node indices."""
        return self._twin.surface

    @property
    def surface_bodies(self) -> np.ndarray:
        """Body of each surface triangle (k,)."""
        return self._twin.surface_bodies

    @property
    def masses(self) -> np.ndarray:
        """Lumped node masses (n,) [kg]."""
        return self._twin.masses

    @property
    def crack_faces(self) -> np.ndarray:
        """Nothing breaks (k,)."""
        return np.zeros(len(self.surface), dtype=bool)

    @property
    def piece_count(self) -> int:
        """Number of pieces: sets of elements that hang together."""
        return pieces(self.cells, len(self.rest_positions))[0]

    @property
    def cell_pieces(self) -> np.ndarray:
        """Piece of each element (m,)."""
        return self._twin.cell_pieces

    @property
    def surface_pieces(self) -> np.ndarray:
        """Piece of each triangle of the surface (k,)."""
        return self._twin.surface_pieces

    # State

    @property
    def positions(self) -> np.ndarray:
        """Node positions (n,3) [m]; those of inner nodes are worked out here."""
        return np.concatenate([body.positions for body in self.bodies])

    @property
    def velocities(self) -> np.ndarray:
        """Node velocities (n,3) [m/s]."""
        return np.concatenate([body.velocities for body in self.bodies])

    @property
    def contacts(self) -> int:
        """Contacts between points and colliders in the last step."""
        return sum(body.contacts for body in self.bodies)

    def elastic_energy(self) -> float:
        """Elastic energy of everything [J]."""
        return sum(body.elastic_energy for body in self.bodies)

    def cauchy_stress(self) -> np.ndarray:
        """Cauchy stress of each element (m,3,3) [Pa]."""
        displacement = np.concatenate([body.displacement for body in self.bodies])
        self._twin.set_positions(self.rest_positions + displacement)
        turns = np.array([body.rotation for body in self.bodies])[self.cell_bodies]
        stress = turns @ self._twin.cauchy_stress() @ turns.transpose(0, 2, 1)
        for b, body in enumerate(self.bodies):
            # Boundary elements know the stress of the surface: elements that lie there have it.
            found = body.surface_stress()
            if found is not None:
                stress[self._surface_cells[self.surface_bodies == b]] = found
        return stress

    @cached_property
    def _surface_cells(self) -> np.ndarray:
        """The element of each triangle of the surface (k,)."""
        faces, owner = boundary_faces(self.cells)
        cell_of = dict(zip(map(frozenset, faces.tolist()), owner.tolist(), strict=True))
        return np.array([cell_of[frozenset(face)] for face in self.surface.tolist()])

    def von_mises(self) -> np.ndarray:
        """Equivalent (von Mises) stress of each element (m,) [Pa]."""
        stress = self.cauchy_stress()
        deviator = stress - np.trace(stress, axis1=1, axis2=2)[:, None, None] * np.eye(3) / 3
        return np.sqrt(1.5 * (deviator**2).sum(axis=(1, 2)))

    def plastic_strain(self) -> np.ndarray:
        """Nothing flows: zeros (m,3,3)."""
        return np.zeros((len(self.cells), 3, 3))

    def equivalent_plastic_strain(self) -> np.ndarray:
        """Nothing flows: zeros (m,)."""
        return np.zeros(len(self.cells))

    def critical_step(self) -> float:
        """No step [s] is too long."""
        return math.inf

    def collider_poses(self) -> list[tuple[Collider, np.ndarray, np.ndarray]]:
        """Each collider with the rotation R (3,3) and offset c (3,) [m] that move it now: x = R X + c."""
        return [(c, *pose(c.motion, self.time)) for c in self.scene.colliders]

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
        return checkpoint.fingerprint(self.rest_positions, self.cells, text=f"{self.precision} {models}")

    def save(self, path: str | os.PathLike) -> None:
        """Write everything the next steps depend on; see `load`. Raises InputError if it cannot be written."""
        arrays = {f"{b}.{name}": v for b, body in enumerate(self.bodies) for name, v in body.state().items()}
        checkpoint.write(path, arrays, {"scene": self._fingerprint(), "clock": asdict(self._clock)})

    def load(self, path: str | os.PathLike) -> None:
        """Continue from a checkpoint of the same scene and precision. Raises InputError if it belongs to another."""
        arrays, header = checkpoint.read(path)
        clock = Clock(**header.get("clock", {"fps": 0}))
        same = (clock.fps, clock.substeps) == (self._clock.fps, self._clock.substeps)
        if header.get("scene") != self._fingerprint() or not same:
            raise InputError(f"{path}: the checkpoint belongs to another scene, time step or precision")
        self._clock, self._stats = clock, None
        for b, body in enumerate(self.bodies):
            own = {name.removeprefix(f"{b}."): v for name, v in arrays.items() if name.startswith(f"{b}.")}
            body.set_state(own, self.time)


def _check(scene: Scene) -> None:
    """Raise InputError for what reduced bodies cannot be part of."""
    for b, body in enumerate(scene.bodies):
        label = f"body.{body.name or b}"
        materials = (body.material, *body.materials.values())
        models, full = {m.model for m in materials}, [m.model for m in materials if not m.reduced]
        if full:
            raise InputError(
                f"{label}: model {full[0]!r} cannot share a scene with reduced ones: "
                'use one kind, model = "linear" for example'
            )
        if len(models) > 1:
            raise InputError(f"{label}: models {', '.join(sorted(models))} in one body: give all its regions the same")
        if body.mesh.dimension == 2:
            raise InputError(f'{label}: reduced models are for solids of tetrahedra: use model = "linear" in the plane')
        damping = {(m.mass_damping, m.stiffness_damping) for m in materials}
        if len(damping) > 1:
            raise InputError(f"{label}: its regions are damped differently: give all the same damping")
        _check_integrator(label, body.material.model, scene.integrator)
        if body.material.model == "bem" and len({(m.youngs, m.poisson, m.density) for m in materials}) > 1:
            raise InputError(f'{label}: boundary elements are for one material: use model = "condensed" for several')


def _check_integrator(label: str, model: str, integrator: str) -> None:
    if model == "modal" and integrator == "quasi-static":
        raise InputError(
            f'{label}: model "modal" swings, and integrator "quasi-static" has no inertia: use model = "condensed"'
        )
    if model == "bem" and integrator != "quasi-static":
        raise InputError(
            f'{label}: model "bem" has no inertia, and integrator {integrator!r} has: use integrator = "quasi-static", '
            'or model = "condensed"'
        )
    if model == "condensed" and integrator not in ("backward-euler", "quasi-static"):
        raise InputError(
            f'{label}: model "condensed" knows integrators "backward-euler" and "quasi-static", not {integrator!r}: '
            "use one of them"
        )
