"""All bodies of a scene laid out in one set of arrays. NumPy only: what the world's fields are filled from."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from functools import cached_property
from itertools import combinations

import numpy as np

from taichifem.description import Body, Handle, Load, Material, Motion, Pin, Region, Scene
from taichifem.errors import InputError
from taichifem.mesh.connectivity import boundary_faces
from taichifem.structure.aggregates import Aggregates, aggregate

AXES = {2: [0, 2], 3: [0, 1, 2]}
"""Coordinates that matter to bodies of dimension 2 (in the plane y = 0) and 3."""


@dataclass
class Group:
    """Nodes that follow one motion: a pin, or a handle with the stiffness [N/m] each node gets."""

    nodes: np.ndarray
    motion: Motion | None
    start: float
    until: float | None
    axes: tuple[bool, bool, bool] = (True, True, True)
    stiffness: float = 0.0

    def acts_at(self, time: float) -> bool:
        """Does it hold or pull during the step that ends at `time` [s]?"""
        return time > self.start and (self.until is None or time <= self.until * (1 + 1e-9))


@dataclass
class LoadGroup:
    """A load and what it acts on: nodes (n,) for a Force, boundary faces (k,d) with nodes for the others.

    thickness: of the body [m], for loads on the edges of planar bodies; 1 otherwise.
    """

    load: Load
    where: np.ndarray
    thickness: float = 1.0


def place_in(order: np.ndarray) -> np.ndarray:
    """Where in an order (n,) each number stands."""
    place = np.empty(len(order), dtype=np.int32)
    place[order] = np.arange(len(order), dtype=np.int32)
    return place


@dataclass
class Layout:
    """Arrays of a whole scene. Nodes and elements of a body are a contiguous range.

    dimension d: 3 for tetrahedra, 2 for triangles in the plane y = 0.
    rest (n,3) [m], velocities (n,3) [m/s], cells (m,d+1), thickness (m,) [m] (1 in space), node_bodies (n,),
    cell_bodies (m,), cell_materials (m,) into `materials`, regions (m,), body_start (bodies+1,),
    piece_start (pieces+1,): pieces are bodies, and what has come off them.

    Nodes are numbered such that those of an aggregate of the solver follow one another, and elements after their
    nodes: what is used together lies together. node_order (n,), cell_order (m,): the numbers they had in the scene.
    """

    dimension: int
    rest: np.ndarray
    velocities: np.ndarray
    cells: np.ndarray
    thickness: np.ndarray
    node_bodies: np.ndarray
    cell_bodies: np.ndarray
    cell_materials: np.ndarray
    regions: np.ndarray
    body_start: np.ndarray
    piece_start: np.ndarray
    materials: list[Material]
    material_of: dict[tuple[int, int | None], int]
    aggregates: Aggregates
    node_order: np.ndarray
    cell_order: np.ndarray
    pins: list[Group] = field(default_factory=list)
    handles: list[Group] = field(default_factory=list)
    loads: list[LoadGroup] = field(default_factory=list)

    @property
    def gradients(self) -> np.ndarray:
        """D_m^-1 of every element (m,d,d): its rows are the shape gradients g_1..g_d [1/m]."""
        return np.linalg.inv(self._edges())

    @property
    def volumes(self) -> np.ndarray:
        """Rest volumes (m,) [m^3]."""
        return np.linalg.det(self._edges()) * self.thickness / math.factorial(self.dimension)

    def _edges(self) -> np.ndarray:
        corners = self.rest[self.cells][:, :, AXES[self.dimension]]
        return (corners[:, 1:] - corners[:, :1]).transpose(0, 2, 1)

    @cached_property
    def node_number(self) -> np.ndarray:
        """The number (n,) here of each node of the scene."""
        return place_in(self.node_order)

    @cached_property
    def cell_number(self) -> np.ndarray:
        """The number (m,) here of each element of the scene."""
        return place_in(self.cell_order)

    @cached_property
    def load_corners(self) -> list[tuple[np.ndarray, np.ndarray] | None]:
        """Of each load on faces (k,d): the element (k,) that has the face, and which corners (k,d) it is."""
        faces, owner = boundary_faces(self.cells)
        element_of = {frozenset(face): e for face, e in zip(faces.tolist(), owner.tolist(), strict=True)}
        found = []
        for load in self.loads:
            if load.where.ndim == 1:
                found.append(None)
                continue
            element = np.array([element_of[frozenset(face)] for face in load.where.tolist()])
            found.append((element, (self.cells[element][:, None, :] == load.where[:, :, None]).argmax(axis=2)))
        return found

    @property
    def edge_shares(self) -> np.ndarray:
        """1 over the number of elements around each edge of each element (m, edges), edges 01 02 .. 12 .. in order."""
        pairs = list(combinations(range(self.dimension + 1), 2))
        ends = np.sort(self.cells[:, pairs].reshape(-1, 2).astype(np.int64), axis=1)
        _, which, count = np.unique(ends @ (len(self.rest), 1), return_inverse=True, return_counts=True)
        return (1.0 / count[which]).reshape(len(self.cells), len(pairs))


def _selected(region: Region, points: np.ndarray, first: int, where: str) -> np.ndarray:
    nodes = region.select(points)
    if not len(nodes):
        low, high = points.min(axis=0).round(4).tolist(), points.max(axis=0).round(4).tolist()
        raise InputError(f"{where} selects no node: the body spans {low} to {high} [m] in world coordinates at rest")
    return nodes + first


def _groups(body: Body, label: str, points: np.ndarray, first: int) -> tuple[list[Group], list[Group]]:
    pins, handles = [], []
    for k, entry in enumerate(body.pins):
        pin = entry if isinstance(entry, Pin) else Pin(region=entry)
        nodes = _selected(pin.region, points, first, f"{label}.pin.{k}")
        axes = tuple(axis in pin.axes for axis in "xyz")
        pins.append(Group(nodes, pin.motion, -np.inf, pin.until, axes=axes))
    for k, handle in enumerate(body.handles):
        if not isinstance(handle, Handle):
            raise InputError(f"{label}.handle.{k} is a {type(handle).__name__}: give a Handle")
        nodes = _selected(handle.region, points, first, f"{label}.handle.{k}")
        stiffness = handle.stiffness / len(nodes)
        handles.append(Group(nodes, handle.motion, handle.start, handle.until, stiffness=stiffness))
    return pins, handles


def _loads(body: Body, label: str, points: np.ndarray, first: int) -> list[LoadGroup]:
    found = [LoadGroup(f, _selected(f.region, points, first, f"{label}.force.{k}")) for k, f in enumerate(body.forces)]
    boundary = body.mesh.boundary()
    for kind, loads in (("traction", body.tractions), ("pressure", body.pressures)):
        for k, load in enumerate(loads):
            where = f"{label}.{kind}.{k}"
            inside = np.zeros(len(points), dtype=bool)
            inside[_selected(load.region, points, 0, where)] = True
            faces = boundary[inside[boundary].all(axis=1)]
            if not len(faces):
                raise InputError(f"{where} selects nodes but no face of the surface: make its region larger")
            found.append(LoadGroup(load, faces + first, body.thickness if body.mesh.dimension == 2 else 1.0))
    return found


def _dimension(scene: Scene) -> int:
    dimensions = {body.mesh.dimension for body in scene.bodies}
    if len(dimensions) > 1:
        raise InputError("the scene mixes planar bodies (triangles) with solid ones (tetrahedra): keep one kind")
    return dimensions.pop()


def lay_out(scene: Scene) -> Layout:
    """Concatenate the scene's bodies. Raises InputError where a pin, handle or load selects nothing."""
    rest, velocities, cells, thickness, node_bodies, cell_bodies, cell_materials = [], [], [], [], [], [], []
    regions, body_start = [], [0]
    materials: list[Material] = []
    material_of: dict[tuple[int, int | None], int] = {}
    pins, handles, loads = [], [], []
    dimension = _dimension(scene)
    for b, body in enumerate(scene.bodies):
        mesh = body.mesh
        points, first = body.placed_points(), body_start[-1]
        label = f"body.{body.name or b}"
        row = np.full(len(mesh.cells), len(materials), dtype=np.int32)
        material_of[b, None] = len(materials)
        materials.append(body.material)
        for region, material in sorted(body.materials.items()):
            material_of[b, region] = len(materials)
            row[mesh.regions == region] = len(materials)
            materials.append(material)
        rest.append(points)
        arm = points - points.mean(axis=0)
        velocities.append(np.asarray(body.velocity) + np.cross(np.asarray(body.spin), arm))
        cells.append(mesh.cells + first)
        thickness.append(np.full(len(mesh.cells), body.thickness if dimension == 2 else 1.0))
        cell_materials.append(row)
        regions.append(mesh.regions)
        node_bodies.append(np.full(len(points), b, dtype=np.int32))
        cell_bodies.append(np.full(len(mesh.cells), b, dtype=np.int32))
        held, pulled = _groups(body, label, points, first)
        pins += held
        handles += pulled
        loads += _loads(body, label, points, first)
        body_start.append(first + len(points))
    points, corners = np.concatenate(rest), np.concatenate(cells).astype(np.int32)
    aggregates = aggregate(points, np.asarray(body_start))
    nodes = aggregates.order
    number = np.empty(len(nodes), dtype=np.int32)
    number[nodes] = np.arange(len(nodes), dtype=np.int32)
    corners = number[corners]
    elements = np.argsort(corners.min(axis=1), kind="stable")
    for group in (*pins, *handles):
        group.nodes = number[group.nodes]
    for load in loads:
        load.where = number[load.where]
    return Layout(
        dimension=dimension,
        rest=points[nodes],
        velocities=np.concatenate(velocities)[nodes],
        cells=corners[elements],
        thickness=np.concatenate(thickness)[elements],
        node_bodies=np.concatenate(node_bodies)[nodes],
        cell_bodies=np.concatenate(cell_bodies)[elements],
        cell_materials=np.concatenate(cell_materials)[elements],
        regions=np.concatenate(regions)[elements],
        body_start=np.asarray(body_start, dtype=np.int32),
        piece_start=np.asarray(body_start, dtype=np.int32),
        materials=materials,
        material_of=material_of,
        aggregates=aggregates,
        node_order=nodes,
        cell_order=elements,
        pins=pins,
        handles=handles,
        loads=loads,
    )
