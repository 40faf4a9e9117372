"""The bodies of a scene at an instant: what they are made of, what surrounds them, and their state."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from taichifem import elements, runtime, transfer
from taichifem.description import Collider, Material, Scene
from taichifem.description.check import whole
from taichifem.description.material import ELASTIC
from taichifem.errors import InputError
from taichifem.hands import Hands
from taichifem.integrators import EXACT
from taichifem.laws import Laws
from taichifem.layout import Layout, lay_out
from taichifem.linear_algebra import balance
from taichifem.linear_algebra.plan import Plan, make_plan
from taichifem.linear_algebra.telling import tell
from taichifem.processes.loading import Loading
from taichifem.room import assert_room, room_for
from taichifem.structure.pattern import corners_at
from taichifem.surface import Surface, whole_surface
from taichifem.surroundings import Surroundings, pose
from taichifem.world import Counts, World, acquire


class Bodies:
    """All bodies in one world. Arrays in and out are NumPy, float64, SI units; z points up.

    Node arrays are (n,3), also for planar bodies: those lie in the plane y = 0.
    """

    def __init__(self, scene: Scene, *, precision: str, arch: str | None, threads: int | None) -> None:
        if precision not in runtime.PRECISIONS:
            raise InputError(f'precision is {precision!r}: choose "f32" or "f64"')
        runtime.start(arch=arch, threads=threads)
        self.scene = scene
        self.precision = precision
        layout = lay_out(scene)
        self._whole = layout
        self._materials = list(layout.materials)
        if any(m.reduced for m in self._materials):
            raise InputError('the scene has reduced models: use taichifem.simulate(scene), or model = "linear"')
        self._laws = Laws(self._materials, exact=scene.integrator in EXACT)
        self._first_surface = whole_surface(scene)
        self._take(layout)
        self._generation = runtime.generation
        plan = make_plan(layout.cells, len(layout.rest), layout.aggregates, solver=scene.solver)
        self._world: World = acquire(room_for(scene, layout, self._laws, plan), precision, self)
        self._counts = Counts(bodies=len(scene.bodies), colliders=len(scene.colliders))
        self._hands = Hands()
        self._fill()
        self._tell(plan)
        self._gravity = np.asarray(scene.gravity, dtype=float)
        self._due = 0.0  # time over which plastic flow is due: it is made up for when the next step begins [s]

    def _take(self, layout: Layout) -> None:
        """Take a layout, and work out what follows from its mesh; the matrix can wait until it is asked for."""
        self._layout = layout
        self._loading = Loading(layout)
        self._plan_for(layout.cells)

    def _plan_for(self, cells: np.ndarray) -> None:
        """From now on, the matrix is that of some cells (k,d+1)."""
        self._in_matrix, self._told = cells, None

    @property
    def _plan(self) -> Plan:
        """Which blocks the matrix has, and how it is solved; the world knows as well, from when it is asked for."""
        if self._told is None:
            layout = self._layout
            self._tell(make_plan(self._in_matrix, len(layout.rest), layout.aggregates, solver=self.scene.solver))
        return self._told

    def _tell(self, plan: Plan) -> None:
        """Give the world what it has to know of the matrix."""
        assert_room(self._world.capacity, plan)
        self._counts.pairs, self._counts.pieces = plan.pattern.n_pairs, plan.pattern.pieces
        with self._kernels():
            tell(self._world, plan, self._layout.aggregates)
        self._told = plan

    def _fill(self) -> None:
        """Fill the world with it, at rest."""
        self._fill_topology()
        with self._kernels():
            transfer.fill(self._world, self._layout)
            if self._laws.springs:
                # Of the stiffness of an edge as it was before anything split.
                transfer.write(self._world, self._world.spring_share, self._whole.edge_shares)

    def _fill_topology(self) -> None:
        """Give the world what follows from the mesh."""
        layout = self._layout
        self._counts.nodes, self._counts.elements = len(layout.rest), len(layout.cells)
        self._counts.split = len(layout.rest) > len(self._whole.rest)
        # Springs were those of another mesh; what new nodes find in their places is someone else's.
        self._counts.meetings, self._counts.sprung = 0, True
        with self._kernels():
            transfer.fill_mesh(self._world, layout, *corners_at(layout.cells, len(layout.rest)))
        self._surroundings = Surroundings(self.scene, layout, self._world, self._counts, self._hands)

    def _kernels(self):
        """Around every use of the fields: the right precision, and fields that still exist."""
        if self._generation != runtime.generation:
            raise InputError("this simulation ended when Taichi was restarted with another arch or thread count")
        return runtime.precision_of(self.precision)

    # Materials and surroundings

    def _fill_table(self) -> None:
        rows = np.array([self._laws.row(m) for m in self._materials])
        turning = np.zeros(len(self.scene.bodies), dtype=bool)
        for (body, _), row in self._layout.material_of.items():
            turning[body] |= self._materials[row].model != "linear"
        held = self._surroundings.held_bodies
        flies = np.where(held, balance.HELD, np.where(turning, balance.TURNS, balance.LINEAR))
        with self._kernels():
            transfer.fill_table(self._world, rows, self._layout.body_start, flies)
            inertia = self.scene.integrator != "quasi-static"
            elements.gather_masses(self._world, self._counts.nodes, self._layout.piece_start, inertia)
        self._counts.flying = int((flies != balance.HELD).sum())

    def _surround(self, time: float, dt: float, *, all_act: bool = False) -> None:
        """Put pins, handles and colliders where they stand at `time` [s]."""
        with self._kernels():
            changed = self._surroundings.update(time, dt, all_act=all_act)
        if changed:
            self._fill_table()

    def _row(self, body: int, region: int | None) -> int:
        row = self._layout.material_of.get((whole("body", body, at_least=0), region))
        if row is None:
            raise InputError(f"body {body} has no material for region {region}: name it in Body.materials")
        return row

    def _change_material(self, row: int, material: Material) -> None:
        if not self._laws.knows(material):
            kind = "plastic" if self._laws.knows(replace(material, **ELASTIC)) else repr(material.model)
            raise InputError(f"the scene has no {kind} material yet: make a new simulation for that")
        self._materials[row] = material
        self._fill_table()

    def _poses(self, time: float) -> list[tuple[Collider, np.ndarray, np.ndarray]]:
        return [(c, *pose(c.motion, time)) for c in self.scene.colliders]

    # What does not change

    @property
    def dimension(self) -> int:
        """3 for tetrahedra, 2 for triangles in the plane y = 0."""
        return self._layout.dimension

    @property
    def rest_positions(self) -> np.ndarray:
        """Rest positions (n,3) [m]."""
        return self._given(self._layout.rest)

    @property
    def cells(self) -> np.ndarray:
        """Elements (m,d+1): tetrahedra, or triangles of planar bodies."""
        return self._given_cells(self._layout.node_order[self._layout.cells])

    @property
    def cell_bodies(self) -> np.ndarray:
        """Body of each element (m,)."""
        return self._given_cells(self._layout.cell_bodies)

    @property
    def cell_regions(self) -> np.ndarray:
        """Region of each element in its mesh (m,)."""
        return self._given_cells(self._layout.regions)

    @property
    def node_bodies(self) -> np.ndarray:
        """Body of each node (n,)."""
        return self._given(self._layout.node_bodies)

    @property
    def surface(self) -> np.ndarray:
        """Outward triangles of all bodies (k,3), as node indices; of planar bodies, all their elements."""
        return self._surface.triangles

    @property
    def surface_bodies(self) -> np.ndarray:
        """Body of each surface triangle (k,)."""
        return self._surface.bodies

    @property
    def _surface(self) -> Surface:
        return self._first_surface

    # State

    def _given(self, values: np.ndarray) -> np.ndarray:
        """Values of the nodes (n,...) in the order of the scene, from that of the layout."""
        target = np.empty_like(values)
        target[self._layout.node_order] = values
        return target

    def _given_cells(self, values: np.ndarray) -> np.ndarray:
        """Values of the elements (m,...) in the order of the scene, from that of the layout."""
        target = np.empty_like(values)
        target[self._layout.cell_order] = values
        return target

    def _read(self, field) -> np.ndarray:
        """Node or element values in the order of the scene."""
        with self._kernels():
            if field in (self._world.stress, self._world.energy, self._world.rotation):
                return self._given_cells(transfer.read(self._world, field, self._counts.elements).astype(np.float64))
            return self._given(transfer.read(self._world, field, self._counts.nodes).astype(np.float64))

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
            self._laws.settle(self._world, self._counts, due=self._due)
            transfer.write(self._world, field, array[self._layout.node_order])
        self._due = 0.0
        self._changed()

    def _changed(self) -> None:
        """Positions or velocities were set from outside."""
