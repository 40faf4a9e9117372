"""The Taichi fields: nodes, elements, materials, block matrix, colliders. One world holds all bodies.

A world has room for a number of nodes, elements and so on (its `Capacity`), rounded up to powers of two. Kernels
are compiled for a world, so `acquire` hands out a free one of the same capacity before it makes a new one: a
second simulation of about the same size in a process starts without compiling.
"""

from __future__ import annotations

import gc
import weakref
from dataclasses import astuple, dataclass

from taichifem import runtime
from taichifem.runtime import ti
from taichifem.structure.pattern import PIECES

MOST_LEVELS = 12
"""Coarse levels of the solver at most: far more than memory would ever need."""

SIDES = 8
"""Shares of an operation that threads begin with: one for each, up to this many."""

WAKING = 100_000
"""Work [ns] that is not worth waking other threads for."""

MEMORY = 3
"""Steps that a solve's start is guessed from."""

MOST_TURNS = 4096
"""Operations of a solve in one launch at most."""


def round_up(count: int, least: int) -> int:
    """The power of two that holds `count`, at least `least`."""
    return max(least, 1 << max(0, int(count) - 1).bit_length())


@dataclass(frozen=True)
class Capacity:
    """Room in a world, in entries."""

    nodes: int
    elements: int
    blocks: int
    pairs: int
    materials: int = 1
    colliders: int = 1
    held: int = 1
    pulled: int = 1
    poses: int = 1
    bodies: int = 1
    aggregates: int = 1
    coarse_blocks: int = 1
    coarse_pairs: int = 1
    members: int = 1
    operations: int = 1
    factor: int = 1  # blocks of the level that is solved directly
    usual: int = 1  # nodes while little is broken
    meetings: int = 1  # springs between pieces
    dimension: int = 3  # of the elements: 3 for tetrahedra, 2 for triangles in the plane y = 0
    tangents: bool = False  # do elements store their stiffness blocks? Isotropic laws and springs need it
    springs: bool = False  # are there elements made of springs?
    plastic: bool = False  # are there plastic materials?

    LEAST = (256, 1024, 4096, 2048, 8, 4, 512, 512, 256, 8, 32, 1024, 256, 1024, 64, 512, 256, 1)

    def rounded(self) -> Capacity:
        """The capacity class: every count rounded up to a power of two."""
        values = astuple(self)
        counts = (round_up(n, k) for n, k in zip(values, self.LEAST, strict=False))
        return Capacity(*counts, *values[len(self.LEAST) :])


@dataclass
class Counts:
    """How much of a world is in use."""

    nodes: int = 0
    elements: int = 0
    pairs: int = 0
    pieces: int = 0  # that work on nodes is cut into
    bodies: int = 0
    flying: int = 0  # bodies that no pin holds
    colliders: int = 0
    meetings: int = 0  # springs between pieces
    riding: int = 0  # embedded vertices near colliders
    held: int = 0
    pulled: int = 0
    split: bool = False  # has some of the mesh come apart?
    sprung: bool = True  # may some springs of handles or contact be left from the last step?


@ti.data_oriented
class World:
    """Fields of one capacity and precision. Kernels take it as their first argument, by name.

    Nodes have three coordinates always; only elements know the dimension d, 3 or 2 (then they lie in the plane
    y = 0): `x` position, `v` velocity, `rest` (all [m], [m/s]), `x0`, `v0` at the start of the step, `mass` [kg],
    `drag` mass-proportional damping [kg/s], `outside` loads [N], `free` 1 or 0 per axis, `dv` the unknown of the
    step, `base_x` and `base_v`: what an implicit step starts from (`integrators.implicit`).
    Elements: `cell` nodes (d+1), `material` row, `gradients` rows g_1..g_d of D_m^-1 (B of the slides), `volume`
    [m^3], `rotation` quaternion, `plastic` strain (xx, yy, zz, xy, yz, zx) and `hardened`, how much of it has
    accumulated, `body`, and per step `h` (rotated
    gradients, corner by corner) and `corner_force` [N].
    """

    def __init__(self, capacity: Capacity, precision: str) -> None:
        self.capacity = capacity
        self.d = capacity.dimension
        self.corners = self.d + 1
        self.corner_pairs = self.corners * (self.corners + 1) // 2
        self.precision = precision
        self.real = runtime.PRECISIONS[precision]
        self.companions: dict = {}  # fields that only some scenes have, made when the first of them wants them
        self._builder = ti.FieldsBuilder()
        self._place_nodes()
        self._place_elements()
        self._place_matrix()
        self._place_coarse()
        self._place_surroundings()
        self._place_meetings()
        self._builder.finalize()

    def alone(self, cost: float) -> bool:
        """Is a loop over all nodes best left to one thread, at about `cost` [ns] a node?"""
        return runtime.running_arch() == "cpu" and (runtime.threads() == 1 or self.capacity.usual * cost < WAKING)

    def _scalar(self, size: int, dtype=None):
        field = ti.field(dtype or self.real)
        self._builder.dense(ti.i, size).place(field)
        return field

    def _vector(self, size: int, n: int, dtype=None):
        field = ti.Vector.field(n, dtype or self.real)
        self._builder.dense(ti.i, size).place(field)
        return field

    def _matrix(self, size: int, n: int, m: int, dtype=None):
        field = ti.Matrix.field(n, m, dtype or self.real)
        self._builder.dense(ti.i, size).place(field)
        return field

    def _place_nodes(self) -> None:
        n = self.capacity.nodes
        self.x, self.v, self.rest = (self._vector(n, 3) for _ in range(3))
        self.x0, self.v0, self.free, self.dv = (self._vector(n, 3) for _ in range(4))
        self.base_x, self.base_v, self.outside = (self._vector(n, 3) for _ in range(3))
        self.past_x, self.past_v = self._vector(n, 3), self._vector(n, 3)  # for integrators that look further back
        self.mass, self.drag = self._scalar(n), self._scalar(n)
        self.force = self._vector(n, 3)  # elastic force [N]
        self.load = self._vector(n, 3)  # right-hand side of the step, without contact and handles [N s]
        self.relaxed = self._vector(n, 3)  # where it would be without strain [m], for `linear_algebra.galerkin`
        self.around = self._matrix(n, 3, 3)  # mean stress of the elements around [Pa]
        # Normal of the plane across which a node comes apart, and how far beyond its toughness (`processes.fracture`).
        self.parting = self._vector(n, 4)
        self.incident_start = self._scalar(n + 1, ti.i32)
        self.incident = self._scalar(4 * self.capacity.elements, ti.i32)

    def _place_elements(self) -> None:
        m, d, corners = self.capacity.elements, self.d, self.corners
        self.cell = self._vector(m, corners, ti.i32)
        self.material, self.body = self._scalar(m, ti.i32), self._scalar(m, ti.i32)
        self.gradients, self.volume = self._matrix(m, d, d), self._scalar(m)
        self.rotation = self._vector(m, 4)
        k = m if self.capacity.plastic else 1
        self.plastic, self.hardened, self.plastic_inverse = self._vector(k, 6), self._scalar(k), self._matrix(k, 3, 3)
        self.h, self.corner_force = (self._vector(corners * m, d) for _ in range(2))
        self.moduli = self._vector(m, 2)  # lambda and mu, times the step's factor of K
        self.stress = self._matrix(m, 3, 3)
        self.energy = self._scalar(m)
        # Isotropic laws: F = U diag(stretch) V^T, and the tangent of `formulas.isotropic`.
        k, pairs = m if self.capacity.tangents else 1, d * (d - 1) // 2
        self.svd_u, self.svd_v, self.tangent_a = (self._matrix(k, d, d) for _ in range(3))
        self.stretch = self._vector(k, d)
        self.tangent_p, self.tangent_q = self._vector(k, pairs), self._vector(k, pairs)
        # Springs: of the stiffness given for a whole edge, the part that each edge of this element has.
        springs = self.corner_pairs - corners
        self.spring_share = self._vector(m if self.capacity.springs else 1, springs)
        k = m if self.capacity.springs and self.capacity.plastic else 1
        self.spring_growth, self.spring_hardened = self._vector(k, springs), self._vector(k, springs)
        # Material table: the columns are those of `elements`.
        self.table = self._vector(self.capacity.materials, 15)

    def _place_matrix(self) -> None:
        c = self.capacity
        # Rows of the nodes, and below them those of the coarse levels (`structure.levels`).
        rows, blocks = c.nodes + 2 * c.aggregates, c.blocks + c.coarse_blocks
        self.row_start, self.column = self._scalar(rows + 1, ti.i32), self._scalar(blocks, ti.i32)
        self.near = self._scalar(rows, ti.i32)  # where in a row the blocks begin that stand for their mirror images
        self.block = self._matrix(blocks, 3, 3)
        self.pair_start, self.pair_entry = (
            self._scalar(c.pairs + 1, ti.i32),
            self._scalar(self.corner_pairs * c.elements + (10 * c.meetings if c.meetings > 1 else 0), ti.i32),
        )
        self.upper, self.lower = self._scalar(c.pairs, ti.i32), self._scalar(c.pairs, ti.i32)
        self.diagonal = self._scalar(c.nodes, ti.i32)
        self.own = self._matrix(c.nodes, 3, 3)  # diagonal blocks without springs
        self.tangent = self._matrix(self.corner_pairs * c.elements if c.tangents else 1, self.d, self.d)
        self.spring = self._matrix(c.nodes, 3, 3)  # dt^2 times contact and handle stiffness, on the diagonal
        self.spring_load = self._vector(c.nodes, 3)
        self.sprung = self._scalar(c.nodes, ti.i32)  # 1 where a spring acts
        self.inverse = self._matrix(c.nodes, 3, 3)
        # What the last steps added to the velocities (`linear_algebra.guess`): column 0 is for what is held.
        self.past, self.image = (self._matrix(c.nodes, 3, MEMORY + 1) for _ in range(2))
        self.gram, self.share = ti.field(ti.f64), self._scalar(MEMORY + 1, ti.f64)
        self._builder.dense(ti.ijk, (PIECES + 1, MEMORY, MEMORY + 1)).place(self.gram)
        self.direction, self.product = self._vector(c.nodes, 3), self._vector(c.nodes, 3)
        # Right-hand side, solution and work space of every level; that of the nodes is the residual.
        self.residual, self.z, self.left = (self._vector(rows, 3) for _ in range(3))
        self.partial = self._vector(PIECES, 3, ti.f64)
        self.scalar = self._scalar(16, ti.f64)

    def _place_coarse(self) -> None:
        n, groups = self.capacity.nodes, self.capacity.aggregates
        self.parent = self._scalar(n + groups, ti.i32)
        self.child_begin, self.child_end = self._scalar(groups, ti.i32), self._scalar(groups, ti.i32)
        self.level_first = self._scalar(MOST_LEVELS + 1, ti.i32)
        self.centre, self.reach = self._vector(groups, 3), self._scalar(groups)
        # From the centre of its aggregate to a node, and behind those to an aggregate, in units of the reach there.
        self.arm = self._vector(n + groups, 3)
        self.coarse_pair = self._vector(self.capacity.coarse_pairs, 4, ti.i32)
        self.member_start = self._scalar(self.capacity.coarse_pairs + 1, ti.i32)
        self.member = self._vector(self.capacity.members, 2, ti.i32)
        # Of each aggregate's own matrix, the blocks for shifts, for shift by turn and for turns: without springs, and
        # what springs add (`linear_algebra.coarse_springs`).
        self.bare, self.sprung_on = self._matrix(3 * groups, 3, 3), self._matrix(3 * groups, 3, 3)
        # Where these blocks are, and their inverse: four blocks, shift and turn by shift and turn.
        self.own_block, self.own_inverse = self._scalar(groups, ti.i32), self._matrix(4 * groups, 3, 3)
        # Of the level that is solved directly (`structure.elimination`, `linear_algebra.coarse_factor`).
        self.eliminated, self.factor_start = self._scalar(groups, ti.i32), self._scalar(groups + 1, ti.i32)
        self.factor_part = self._scalar(PIECES + 1, ti.i32)
        rows = self.capacity.factor
        self.factor_row, self.factor_source = self._scalar(rows, ti.i32), self._scalar(rows, ti.i32)
        self.factor, self.pivot = (self._matrix(4 * k, 3, 3, ti.f64) for k in (rows, groups))
        self.settled = self._vector(2 * groups, 3, ti.f64)
        # What a solve does, operation by operation: kind, level, number of pieces (`linear_algebra.program`).
        self.operation = self._vector(self.capacity.operations, 3, ti.i32)
        self.claimed, self.finished = ti.field(ti.i32), self._scalar(MOST_TURNS, ti.i32)
        self._builder.dense(ti.ij, (MOST_TURNS, SIDES)).place(self.claimed)

    def _place_surroundings(self) -> None:
        c = self.capacity
        self.body_start, self.body_flies = self._scalar(c.bodies + 1, ti.i32), self._scalar(c.bodies, ti.i32)
        # Poses move pins and handles: rows of R and c, at the end of the step.
        self.pose_rotation, self.pose_offset = self._matrix(c.poses, 3, 3), self._vector(c.poses, 3)
        self.held_node, self.held_pose = self._scalar(c.held, ti.i32), self._scalar(c.held, ti.i32)
        self.held_axes = self._vector(c.held, 3)
        self.pulled_node, self.pulled_pose = self._scalar(c.pulled, ti.i32), self._scalar(c.pulled, ti.i32)
        self.pulled_stiffness = self._scalar(c.pulled)
        k = c.colliders
        self.collider_kind = self._scalar(k, ti.i32)
        self.collider_rotation, self.collider_center = self._matrix(k, 3, 3), self._vector(k, 3)
        self.collider_rotation0, self.collider_center0 = self._matrix(k, 3, 3), self._vector(k, 3)
        self.collider_size, self.collider_friction = self._vector(k, 3), self._scalar(k)
        self.collider_velocity, self.collider_spin = self._vector(k, 3), self._vector(k, 3)
        # A node's own stiffness at rest [N/m], and the mass of its piece [kg]: they size its contact springs.
        self.contact_stiffness, self.piece_mass = self._scalar(c.nodes), self._scalar(c.nodes)
        self.shielded = self._scalar(c.nodes, ti.i32)  # 1 where an embedded surface touches in the node's place
        self.slip = ti.Vector.field(3, self.real)
        self.pressed = ti.field(self.real)  # normal force that friction was last set for [N]
        self.touching = ti.field(ti.i32)
        self._builder.dense(ti.ij, (k, c.nodes)).place(self.slip)
        self.grip = ti.field(self.real)  # stiffness of the friction spring that was solved with [N/m]
        self._builder.dense(ti.ij, (k, c.nodes)).place(self.pressed, self.touching, self.grip)

    def _place_meetings(self) -> None:
        """For contact between pieces (`processes.meeting`), where there may be any."""
        k = self.capacity.meetings
        meet = k > 1
        n, m = (self.capacity.nodes, self.capacity.elements) if meet else (1, 1)
        # The element across the face opposite each corner, or -1; which piece an element is of.
        self.beside, self.piece = self._vector(m, self.corners, ti.i32), self._scalar(m, ti.i32)
        self.outward, self.entered = self._vector(n, 3), self._scalar(n, ti.i32)
        # The hash: nodes, sorted by bucket.
        self.bucket_start, self.bucket_node = self._scalar(2 * n + 1, ti.i32), self._scalar(n, ti.i32)
        self.bucket_pieces = self._vector(2 * n + 1, 2, ti.i32)  # the lowest and the highest that has a node there
        # Springs: a node and a face, shares, the face's normal, stiffness along and across it [N/m], gap at rest [m].
        self.meeting_cell, self.meeting_weight = self._vector(k, 4, ti.i32), self._vector(k, 4)
        self.meeting_normal, self.meeting_stiffness = self._vector(k, 3), self._vector(k, 2)
        self.meeting_gap = self._scalar(k)
        self.meetings, self.friction = ti.field(ti.i32), ti.field(self.real)
        self._builder.place(self.meetings, self.friction)


_free: dict[tuple, list[World]] = {}


def acquire(capacity: Capacity, precision: str, owner: object) -> World:
    """A world with room for `capacity`, lent until `owner` is garbage."""
    runtime.start()
    key = (runtime.generation, precision, *astuple(capacity.rounded()))
    shelf = _free.setdefault(key, [])
    if not shelf:
        gc.collect()  # a simulation in a cycle, such as an exception's, may still hold one: compiling takes far longer
    world = shelf.pop() if shelf else World(capacity.rounded(), precision)
    weakref.finalize(owner, shelf.append, world)
    return world
