"""A scene brought to life: `Simulation(scene)` builds the world and advances it."""

from __future__ import annotations

import os

import numpy as np
import scipy.sparse

from taichifem import checkpoint, elements, runtime, transfer
from taichifem.description import Collider, Material, Scene
from taichifem.description.check import whole
from taichifem.errors import Diverged, InputError
from taichifem.integrators import backward_euler
from taichifem.integrators.backward_euler import StepReport
from taichifem.laws import Laws
from taichifem.layout import Layout, lay_out
from taichifem.linear_algebra import assembly, balance
from taichifem.linear_algebra.pattern import BlockPattern, block_pattern
from taichifem.stats import Stats, figures
from taichifem.surroundings import Surroundings, pose
from taichifem.timing import PhaseTimer
from taichifem.world import Capacity, Counts, World, acquire


class Simulation:
    """The state of a scene over time. Arrays in and out are NumPy, float64, SI units; z points up.

    precision: "f32" (real time) or "f64".  arch, threads: as `taichifem.runtime.start`; None keeps what runs.
    Raises InputError for what cannot be simulated.
    """

    def __init__(
        self,
        scene: Scene,
        *,
        precision: str = "f32",
        arch: str | None = None,
        threads: int | None = None,
    ) -> None:
        if precision not in runtime.PRECISIONS:
            raise InputError(f'precision is {precision!r}: choose "f32" or "f64"')
        runtime.start(arch=arch, threads=threads)
        self.scene = scene
        self.precision = precision
        self.step_count = 0
        self._layout: Layout = lay_out(scene)
        self._pattern: BlockPattern = block_pattern(self._layout.cells, len(self._layout.rest))
        self._materials = list(self._layout.materials)
        self._laws = Laws(self._materials)
        self._options = backward_euler.Options(
            tolerance=scene.tolerance,
            max_iterations=scene.max_iterations,
            newton=20 if scene.integrator == "backward-euler-newton" else 1,
            newton_tolerance=scene.newton_tolerance,
        )
        self._generation = runtime.generation
        self._world: World = acquire(self._capacity(), precision, self)
        self._timer = PhaseTimer()
        self._report = StepReport()
        self._stats: Stats | None = None
        self._counts = Counts(
            nodes=len(self._layout.rest),
            elements=len(self._layout.cells),
            pairs=self._pattern.n_pairs,
            bodies=len(scene.bodies),
            colliders=len(scene.colliders),
        )
        with self._kernels():
            transfer.fill(self._world, self._layout, self._pattern)
        self._surroundings = Surroundings(self.scene, self._layout, self._world, self._counts)
        self._surround(0.0)

    def _capacity(self) -> Capacity:
        layout, pattern = self._layout, self._pattern
        return Capacity(
            nodes=len(layout.rest),
            elements=len(layout.cells),
            blocks=pattern.n_blocks,
            pairs=pattern.n_pairs,
            materials=len(layout.materials),
            colliders=len(self.scene.colliders),
            held=1 + sum(len(g.nodes) for g in layout.pins),
            pulled=1 + sum(len(g.nodes) for g in layout.handles),
            poses=len(layout.pins) + len(layout.handles),
            bodies=len(self.scene.bodies),
            tangents=self._laws.stores_tangents,
        )

    def _kernels(self):
        """Around every use of the fields: the right precision, and fields that still exist."""
        if self._generation != runtime.generation:
            raise InputError("this simulation ended when Taichi was restarted with another arch or thread count")
        return runtime.precision_of(self.precision)

    # Time

    def step(self) -> None:
        """Advance by one time step. Raises Diverged, with the state before the step kept, on NaN or infinity."""
        dt = self.scene.dt
        end = (self.step_count + 1) * dt
        self._timer.reset()
        with self._timer.phase("set-up"):
            self._surround(end)
        with self._kernels():
            try:
                self._report = backward_euler.advance(
                    self._world,
                    self._counts,
                    self._laws,
                    dt=dt,
                    gravity=np.asarray(self.scene.gravity, dtype=float),
                    options=self._options,
                    timer=self._timer,
                )
            except Diverged as error:
                backward_euler.go_back(self._world, self._counts.nodes)
                raise Diverged(f"the simulation diverged at t = {self.time:.4g} s: {error}") from None
        self.step_count += 1
        self._stats = None

    def advance_frame(self) -> None:
        """Advance by one frame: `scene.substeps` steps."""
        for _ in range(self.scene.substeps):
            self.step()

    def advance(self, *, seconds: float) -> None:
        """Advance by `seconds`, rounded to whole steps."""
        for _ in range(round(seconds / self.scene.dt)):
            self.step()

    @property
    def time(self) -> float:
        """Simulated time [s]."""
        return self.step_count * self.scene.dt

    @property
    def frame(self) -> int:
        """Frames completed."""
        return self.step_count // self.scene.substeps

    # Surroundings and materials

    def collider_poses(self) -> list[tuple[Collider, np.ndarray, np.ndarray]]:
        """Each collider with the rotation R (3,3) and offset c (3,) [m] that move it now: x = R X + c."""
        return [(c, *pose(c.motion, self.time)) for c in self.scene.colliders]

    def _fill_table(self) -> None:
        rows = np.array(
            [
                [
                    m.lame_lambda,
                    m.shear_modulus,
                    m.mass_damping,
                    m.stiffness_damping,
                    m.density,
                    float(self._laws.number(m)),
                ]
                for m in self._materials
            ]
        )
        turning = np.zeros(len(self.scene.bodies), dtype=bool)
        for (body, _), row in self._layout.material_of.items():
            turning[body] |= self._materials[row].model != "linear"
        held = self._surroundings.held_bodies
        flies = np.where(held, balance.HELD, np.where(turning, balance.TURNS, balance.LINEAR))
        with self._kernels():
            transfer.fill_table(self._world, rows, self._layout.body_start, flies)
            elements.gather_masses(self._world, self._counts.nodes, self._counts.bodies)

    def _surround(self, time: float) -> None:
        """Put pins, handles and colliders where they stand at `time` [s]."""
        with self._kernels():
            changed = self._surroundings.update(time)
        if changed:
            self._fill_table()

    def set_material(self, body: int, material: Material, *, region: int | None = None) -> None:
        """Change a body's material (or that of one region of it) from the next step on; nothing recompiles.

        Raises InputError for a region without a material of its own, and for a law that the scene did not have.
        """
        row = self._layout.material_of.get((whole("body", body, at_least=0), region))
        if row is None:
            raise InputError(f"body {body} has no material for region {region}: name it in Body.materials")
        if not self._laws.knows(material):
            raise InputError(f"the scene has no {material.model!r} material yet: make a new simulation for that")
        self._materials[row] = material
        self._fill_table()

    # State

    def _read(self, field) -> np.ndarray:
        with self._kernels():
            per_element = field in (self._world.stress, self._world.energy, self._world.rotation)
            count = self._counts.elements if per_element else self._counts.nodes
            return transfer.read(self._world, field, count).astype(np.float64)

    @property
    def positions(self) -> np.ndarray:
        """Node positions (n,3) [m]."""
        return self._read(self._world.x)

    @property
    def velocities(self) -> np.ndarray:
        """Node velocities (n,3) [m/s]."""
        return self._read(self._world.v)

    @property
    def masses(self) -> np.ndarray:
        """Lumped node masses (n,) [kg]."""
        return self._read(self._world.mass)

    def set_positions(self, x: np.ndarray) -> None:
        """Move the nodes to x (n,3) [m]."""
        self._write(self._world.x, "positions", x)

    def set_velocities(self, v: np.ndarray) -> None:
        """Give the nodes velocities v (n,3) [m/s]."""
        self._write(self._world.v, "velocities", v)

    def _write(self, field, name: str, array: np.ndarray) -> None:
        array = np.asarray(array, dtype=np.float64)
        if array.shape != (self._counts.nodes, 3):
            raise InputError(f"{name} have shape {array.shape}: give {(self._counts.nodes, 3)}")
        if not np.isfinite(array).all():
            raise InputError(f"{name} hold NaN or infinity at node {np.argwhere(~np.isfinite(array))[0, 0]}")
        with self._kernels():
            transfer.write(self._world, field, array)
        self._stats = None

    @property
    def rest_positions(self) -> np.ndarray:
        """Rest positions (n,3) [m]."""
        return self._layout.rest

    @property
    def cells(self) -> np.ndarray:
        """Tetrahedra (m,4)."""
        return self._layout.cells

    @property
    def cell_bodies(self) -> np.ndarray:
        """Body of each element (m,)."""
        return self._layout.cell_bodies

    @property
    def cell_regions(self) -> np.ndarray:
        """Region of each element in its mesh (m,)."""
        return self._layout.regions

    @property
    def node_bodies(self) -> np.ndarray:
        """Body of each node (n,)."""
        return self._layout.node_bodies

    @property
    def surface(self) -> np.ndarray:
        """Outward triangles of all bodies (k,3), as node indices."""
        return self._layout.surface

    @property
    def surface_bodies(self) -> np.ndarray:
        """Body of each surface triangle (k,)."""
        return self._layout.surface_bodies

    # Mechanics at the current state

    def elastic_forces(self) -> np.ndarray:
        """Elastic forces on the nodes (n,3) [N] at the current positions, without damping."""
        with self._kernels():
            self._laws.deform(self._world, self._counts, stiffness=1.0)
            elements.gather_forces(self._world, self._counts.nodes)
        return self._read(self._world.force)

    def stiffness(self, *, projected: bool = False) -> scipy.sparse.csr_matrix:
        """Tangent stiffness K (3n,3n) [N/m] at the current positions, nothing pinned.

        projected: make every element's tangent positive semi-definite first, as the implicit step does.
        Corotational elements give the warped stiffness R K R^T (Mueller & Gross 2004), the others the exact tangent.
        """
        pattern = self._pattern
        with self._kernels():
            self._laws.deform(self._world, self._counts, stiffness=1.0, projected=projected)
            assembly.assemble(self._world, self._counts.pairs, 0.0, 0.0)
            blocks = transfer.read(self._world, self._world.block, pattern.n_blocks).astype(np.float64)
        n = 3 * self._counts.nodes
        return scipy.sparse.bsr_matrix((blocks, pattern.column, pattern.row_start), shape=(n, n)).tocsr()

    def _measure(self) -> None:
        with self._kernels():
            self._laws.measure(self._world, self._counts)

    def cauchy_stress(self) -> np.ndarray:
        """Cauchy stress of each element (m,3,3) [Pa]."""
        self._measure()
        return self._read(self._world.stress)

    def von_mises(self) -> np.ndarray:
        """Equivalent (von Mises) stress of each element (m,) [Pa]."""
        stress = self.cauchy_stress()
        deviator = stress - np.trace(stress, axis1=1, axis2=2)[:, None, None] * np.eye(3) / 3
        return np.sqrt(1.5 * (deviator**2).sum(axis=(1, 2)))

    def elastic_energy(self) -> float:
        """Elastic energy of everything [J]."""
        self._measure()
        return float(self._read(self._world.energy).sum())

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
        """Contacts between nodes and colliders after the last step."""
        if not self._counts.colliders:
            return 0
        with self._kernels():
            state = transfer.read_contacts(self._world, self._counts.colliders, self._counts.nodes)
        return int((state["touching"] > 0).sum())

    @property
    def stats(self) -> Stats:
        """Figures of the last step: times, iterations, energies, momenta."""
        if self._stats is None:
            self._stats = figures(self)
        return self._stats

    # Checkpoints

    def _fingerprint(self) -> str:
        layout = self._layout
        return checkpoint.fingerprint(
            layout.rest,
            layout.cells,
            layout.cell_materials,
            text=f"{self.precision} {len(self.scene.colliders)}",
        )

    def save(self, path: str | os.PathLike) -> None:
        """Write everything the next steps depend on; see `load`. Raises InputError if it cannot be written."""
        w, n, m = self._world, self._counts.nodes, self._counts.elements
        with self._kernels():
            arrays = {
                "x": transfer.read(w, w.x, n),
                "v": transfer.read(w, w.v, n),
                "dv": transfer.read(w, w.dv, n),
                "rotation": transfer.read(w, w.rotation, m),
                "plastic": transfer.read(w, w.plastic, m),
                **transfer.read_contacts(w, self._counts.colliders, n),
            }
        header = {"scene": self._fingerprint(), "step": self.step_count, "dt": self.scene.dt}
        checkpoint.write(path, arrays, header)

    def load(self, path: str | os.PathLike) -> None:
        """Continue from a checkpoint of the same scene and precision, bit for bit as if never interrupted.

        Raises InputError if the file is missing, damaged, or belongs to another scene; nothing changes then.
        """
        arrays, header = checkpoint.read(path)
        if header.get("scene") != self._fingerprint() or header.get("dt") != self.scene.dt:
            raise InputError(f"{path}: the checkpoint belongs to another scene, time step or precision")
        w = self._world
        with self._kernels():
            for name in ("x", "v", "dv", "rotation", "plastic"):
                transfer.write(w, getattr(w, name), arrays[name])
            transfer.write_contacts(w, arrays)
        self.step_count = int(header["step"])
        self._surroundings.forget()
        self._surround(self.time)
        self._stats = None
