"""What a renderer draws: one dataclass of NumPy arrays, taken from a simulation at an instant."""

from __future__ import annotations

import functools
import weakref
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from scipy.sparse import csr_array

from taichifem.description.colliders import BoxCollider, Collider, PlaneCollider
from taichifem.description.motion import rotation_matrix
from taichifem.description.view import View
from taichifem.output import colors
from taichifem.output.skin import Seen, Skin


@dataclass(frozen=True, kw_only=True)
class Shape:
    """A collider in place: local point X lies at rotation @ X + center.

    kind: "plane" (local z = 0, solid below), "sphere" (of `radius` [m]) or "box" (of full `size` [m]).
    rotation: (3,3).  center: (3,) [m].
    """

    kind: str
    rotation: np.ndarray
    center: np.ndarray
    size: tuple[float, float, float] = (1.0, 1.0, 1.0)
    radius: float = 1.0

    @property
    def normal(self) -> np.ndarray:
        """Outward normal (3,) of a plane."""
        return self.rotation[:, 2]


@dataclass(frozen=True, kw_only=True)
class Frame:
    """Everything in one picture.

    points: (n,3) float32 [m].  triangles: (k,3) int32, outward.
    colors: (k,3) float32, sRGB in [0, 1], one per triangle (None: the first of the palette).
    values: (n,) float32 or None: shown by the colour map over value_range instead of `colors`.
    value_label: what the values are;  value_unit: their SI unit.
    bar: write the colour map beside them.
    wire: draw the triangles' edges.  hud: lines of text, top left.
    """

    points: np.ndarray
    triangles: np.ndarray
    nodes: np.ndarray | None = None
    colors: np.ndarray | None = None
    values: np.ndarray | None = None
    value_range: tuple[float, float] = (0.0, 1.0)
    value_label: str = ""
    value_unit: str = ""
    bar: bool = True
    colliders: tuple[Shape, ...] = ()
    wire: bool = False
    hud: tuple[str, ...] = field(default=())

    def corner_colors(self) -> np.ndarray:
        """sRGB (k,3,3) float32: a colour for each corner of each triangle."""
        if self.values is not None:
            return colors.color_map(self.values, *self.value_range)[self.triangles]
        plain = colors.body_colors(1) if self.colors is None else self.colors
        return np.broadcast_to(np.asarray(plain, np.float32)[:, None, :], (len(self.triangles), 3, 3))


def pose(collider: Collider, rotation: np.ndarray, offset: np.ndarray) -> Shape:
    """The shape of `collider` moved by x = rotation X + offset (its motion up to now)."""
    if isinstance(collider, PlaneCollider):
        local, center = _turn_to(np.asarray(collider.normal, float)), collider.point
        return Shape(kind="plane", rotation=rotation @ local, center=rotation @ center + offset)
    center = rotation @ np.asarray(collider.center, float) + offset
    if isinstance(collider, BoxCollider):
        local = rotation_matrix(collider.axis, collider.angle)
        return Shape(kind="box", rotation=rotation @ local, center=center, size=tuple(collider.size))
    return Shape(kind="sphere", rotation=np.asarray(rotation), center=center, radius=collider.radius)


def _turn_to(normal: np.ndarray) -> np.ndarray:
    """A rotation (3,3) taking z to `normal`, and nothing at all where it is z already."""
    n = normal / np.linalg.norm(normal)
    axis = np.array([-n[1], n[0], 0.0])
    if np.linalg.norm(axis) < 1e-9:
        return np.eye(3) if n[2] > 0 else np.diag([1.0, -1.0, -1.0])
    return rotation_matrix(axis, np.degrees(np.arccos(np.clip(n[2], -1, 1))))


def triangulate(shape: Shape) -> tuple[np.ndarray, np.ndarray]:
    """Points (n,3) float32 [m] and outward triangles (k,3) int32 of a sphere or box in place."""
    points, triangles = _unit_sphere() if shape.kind == "sphere" else _unit_box()
    scale = shape.radius if shape.kind == "sphere" else np.asarray(shape.size)
    return ((points * scale) @ shape.rotation.T + shape.center).astype(np.float32), triangles


@functools.cache
def _unit_box() -> tuple[np.ndarray, np.ndarray]:
    points = np.array([[x, y, z] for z in (-0.5, 0.5) for y in (-0.5, 0.5) for x in (-0.5, 0.5)])
    quads = [(0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5)]
    return points, np.array([t for a, b, c, d in quads for t in ((a, b, c), (a, c, d))], np.int32)


@functools.cache
def _unit_sphere(rings: int = 24, sectors: int = 48) -> tuple[np.ndarray, np.ndarray]:
    polar = np.linspace(0, np.pi, rings + 1)[1:-1, None]
    turn = np.linspace(0, 2 * np.pi, sectors, endpoint=False)[None, :]
    z = np.broadcast_to(np.cos(polar), (rings - 1, sectors))
    belt = np.stack([np.sin(polar) * np.cos(turn), np.sin(polar) * np.sin(turn), z], axis=-1).reshape(-1, 3)
    points = np.vstack([belt, [[0, 0, 1], [0, 0, -1]]])
    top, bottom = len(belt), len(belt) + 1
    here = np.arange(sectors)
    after = (here + 1) % sectors
    faces = [np.stack([np.full(sectors, top), here, after], axis=1)]
    for ring in range(rings - 2):
        a, b = ring * sectors + here, ring * sectors + after
        faces += [np.stack([a, a + sectors, b + sectors], axis=1), np.stack([a, b + sectors, b], axis=1)]
    last = (rings - 2) * sectors
    faces.append(np.stack([last + here, np.full(sectors, bottom), last + after], axis=1))
    return points, np.vstack(faces).astype(np.int32)


def _surface_colors(seen: Seen, simulation: Any, view: View) -> np.ndarray:
    """Colours (k,3) of the triangles: their own, those of their bodies or pieces, and what cracks opened paler."""
    if view.color == "piece":
        return colors.body_colors(simulation.piece_count, view.colors)[seen.pieces]
    found = colors.body_colors(len(simulation.scene.bodies), view.colors)[seen.bodies]
    own = np.isfinite(seen.colors).all(axis=1)
    found[own] = seen.colors[own]
    found[seen.cracked] = 0.35 * found[seen.cracked] + 0.65 * colors.CRACK
    return found


class FrameBuilder:
    """Takes frames of one simulation: remembers the topology and how high the colour bar has grown."""

    def __init__(self) -> None:
        self._top = 0.0
        self.skin = Skin()
        self._seen: Seen | None = None
        self._around: csr_array | None = None
        self._painted: tuple[Any, ...] = ()

    def build(self, simulation: Any) -> Frame:
        """The frame of `simulation` now."""
        view, seen = simulation.scene.view, self.skin.of(simulation)
        if seen is not self._seen:
            self._seen, self._around = seen, None
        values, label, unit = self._values(simulation, view.color)
        if values is not None:
            values = seen.follow(values).astype(np.float32)
        return Frame(
            points=np.ascontiguousarray(seen.follow(np.asarray(simulation.positions)), np.float32),
            triangles=seen.triangles,
            nodes=seen.nodes,
            colors=self._colors(simulation, view, seen),
            values=values,
            value_range=self._range(values, view.range),
            value_label=label,
            value_unit=unit,
            colliders=tuple(pose(*posed) for posed in simulation.collider_poses()),
            wire=view.wire,
            hud=hud_lines(simulation) if view.hud else (),
        )

    def _colors(self, simulation: Any, view: View, seen: Seen) -> np.ndarray:
        """Of the triangles; the same array as long as nothing changes them."""
        what = seen, view.color == "piece", view.colors
        if not self._painted or self._painted[0] is not seen or self._painted[1:3] != what[1:]:
            self._painted = *what, _surface_colors(seen, simulation, view)
        return self._painted[3]

    def _values(self, simulation: Any, what: str) -> tuple[np.ndarray | None, str, str]:
        if what == "von-mises":
            return self._to_nodes(simulation, simulation.von_mises()), "von Mises stress", "Pa"
        if what == "plastic-strain":
            return self._to_nodes(simulation, simulation.equivalent_plastic_strain()), "plastic strain", ""
        if what == "displacement":
            moved = np.asarray(simulation.positions) - np.asarray(simulation.rest_positions)
            return np.linalg.norm(moved, axis=1), "displacement", "m"
        if what == "speed":
            return np.linalg.norm(simulation.velocities, axis=1), "speed", "m/s"
        return None, "", ""

    def _to_nodes(self, simulation: Any, values: np.ndarray) -> np.ndarray:
        """Mean of the values (m,) of the elements around each node (n,); those without any have 0."""
        if self._around is None:
            cells, nodes = np.asarray(simulation.cells), len(simulation.rest_positions)
            around = np.maximum(np.bincount(cells.ravel(), minlength=nodes), 1)
            elements = np.repeat(np.arange(len(cells)), cells.shape[1])
            self._around = csr_array((1 / around[cells.ravel()], (cells.ravel(), elements)), (nodes, len(cells)))
        return self._around @ np.asarray(values, float)

    def _range(self, values: np.ndarray | None, given: tuple[float, float] | None) -> tuple[float, float]:
        if given is not None:
            return float(given[0]), float(given[1])
        if values is not None and np.isfinite(values).any():
            self._top = max(self._top, float(values[np.isfinite(values)].max()))
        return 0.0, self._top or 1.0


_builders: weakref.WeakKeyDictionary[Any, FrameBuilder] = weakref.WeakKeyDictionary()


def build_frame(simulation: Any) -> Frame:
    """The frame of `simulation` now; where the scene gives no range, the colour bar's top only grows."""
    return _builders.setdefault(simulation, FrameBuilder()).build(simulation)


def hud_lines(simulation: Any) -> tuple[str, ...]:
    """What the picture says in words: time, size, cost."""
    stats = simulation.stats.as_dict()
    cost = stats.get("ms_per_step") or sum(stats.get("ms", {}).values())
    elements = "triangles" if simulation.cells.shape[1] == 3 else "tetrahedra"
    lines = [
        simulation.scene.name,
        f"t = {simulation.time:.2f} s",
        f"{stats.get('elements', 0):,} {elements}, {stats.get('nodes', 0):,} nodes",
    ]
    if cost > 0 and stats.get("step") != 1:  # the first step also compiles
        solver = f", {stats['iterations']} iterations" if stats.get("iterations") else ""
        lines.append(f"{cost:.2g} ms a step{solver}" if cost < 1 else f"{cost:.1f} ms a step{solver}")
    return tuple(lines)
