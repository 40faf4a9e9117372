"""Bodies and the scene they live in."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from taichifem.description import check
from taichifem.description.colliders import Collider
from taichifem.description.loads import Force, Pressure, Traction
from taichifem.description.material import Material
from taichifem.description.motion import Motion, rotation_matrix
from taichifem.description.regions import Region
from taichifem.description.view import Camera, View
from taichifem.errors import InputError
from taichifem.mesh import EmbeddedSurface, Mesh
from taichifem.mesh.embedded import Embedding, embed

INTEGRATORS = ("backward-euler", "backward-euler-newton", "bdf2", "newmark", "symplectic-euler", "quasi-static")
SOLVERS = ("multilevel", "block-jacobi")


@dataclass(frozen=True, kw_only=True)
class Pin:
    """Holds the nodes of `region` (world coordinates at rest), or moves them along `motion`.

    axes: which of "xyz" are held; the others stay free.
    until: time [s] at which the nodes are let go; None holds them for ever.
    """

    region: Region
    motion: Motion | None = None
    axes: str = "xyz"
    until: float | None = None

    def __post_init__(self) -> None:
        if not self.axes or set(self.axes) - set("xyz") or len(set(self.axes)) != len(self.axes):
            raise InputError(f'axes is {self.axes!r}: give some of "xyz", each once')
        if self.until is not None:
            check.number("until", self.until, at_least=0, unit="s")


@dataclass(frozen=True, kw_only=True)
class Handle:
    """Pulls the nodes of `region` towards their rest position moved along `motion`, by an implicit spring.

    stiffness: of the whole handle [N/m], shared equally by its nodes.
    start, until: times [s] between which it pulls; until None pulls for ever.
    """

    region: Region
    motion: Motion = field(default_factory=Motion)
    stiffness: float = 1e3
    start: float = 0.0
    until: float | None = None

    def __post_init__(self) -> None:
        check.number("stiffness", self.stiffness, above=0, unit="N/m")
        check.number("start", self.start, at_least=0, unit="s")
        if self.until is not None:
            check.number("until", self.until, above=self.start, unit="s")


@dataclass(frozen=True, kw_only=True)
class Body:
    """A solid: a mesh, what it is made of, where it starts, and how it is held.

    mesh: the shape at rest, before placement.
    material: of all elements;  materials: replaces it where the mesh's region has that number.
    scale, then a turn by `angle` [degrees] about `axis` through the origin, then `position` [m] place it.
    velocity: at the start [m/s].  spin: angular velocity at the start [rad/s], about the centre of the nodes.
    pins: regions to hold, or Pin objects.  handles: springs that pull.  forces, tractions, pressures: loads.
    A planar mesh (triangles) lies in the plane y = 0, in plane strain; `thickness` [m] is its extent along y. It can
    be turned about y only.
    embed: a surface that rides in the mesh, placed like it, and is drawn, exported and recorded in its place.
    """

    mesh: Mesh
    material: Material = field(default_factory=Material)
    materials: Mapping[int, Material] = field(default_factory=dict)
    name: str = ""
    scale: float = 1.0
    axis: check.Vector = (0.0, 0.0, 1.0)
    angle: float = 0.0
    position: check.Vector = (0.0, 0.0, 0.0)
    velocity: check.Vector = (0.0, 0.0, 0.0)
    spin: check.Vector = (0.0, 0.0, 0.0)
    pins: Sequence[Region | Pin] = ()
    handles: Sequence[Handle] = ()
    forces: Sequence[Force] = ()
    tractions: Sequence[Traction] = ()
    pressures: Sequence[Pressure] = ()
    thickness: float = 1.0
    embed: EmbeddedSurface | None = None

    def __post_init__(self) -> None:
        if self.embed is not None and self.mesh.dimension == 2:
            raise InputError("embed rides in tetrahedra, and the mesh is planar: leave it out")
        if self.embed is not None:
            self.embedding  # noqa: B018  (tells early where the surface reaches far out of the mesh)
        check.number("scale", self.scale, above=0)
        check.number("thickness", self.thickness, above=0, unit="m")
        if not np.linalg.norm(check.vector("axis", self.axis)) > 0:
            raise InputError("axis is (0, 0, 0): give a direction")
        check.number("angle", self.angle, unit="degrees")
        check.vector("position", self.position, unit="m")
        check.vector("velocity", self.velocity, unit="m/s")
        check.vector("spin", self.spin, unit="rad/s")
        unknown = sorted(set(self.materials) - set(np.unique(self.mesh.regions).tolist()))
        if unknown:
            known = np.unique(self.mesh.regions).tolist()
            raise InputError(f"materials names region {unknown[0]}, but the mesh has only {known}")
        if self.mesh.dimension == 2:
            self._check_plane()

    def _check_plane(self) -> None:
        if self.angle and (self.axis[0] or self.axis[2]):
            raise InputError(f"axis {tuple(self.axis)} turns a planar body out of its plane: give (0, 1, 0)")
        for name, leaves in (("position", self.position[1]), ("velocity", self.velocity[1])):
            if leaves:
                raise InputError(f"{name} {tuple(getattr(self, name))} leaves the plane of a planar body: y must be 0")
        if self.spin[0] or self.spin[2]:
            raise InputError(f"spin {tuple(self.spin)} turns a planar body out of its plane: only y may differ from 0")

    @cached_property
    def embedding(self) -> Embedding:
        """Where the points of `embed` lie in the mesh."""
        return embed(np.asarray(self.embed.points, dtype=float), self.mesh.points, self.mesh.cells)

    def placed_points(self) -> np.ndarray:
        """Rest positions of the nodes in the world (n,3) [m]."""
        points = self.mesh.points
        if self.mesh.dimension == 2:
            points = np.column_stack([points[:, 0], np.zeros(len(points)), points[:, 1]])
        return self.placed(points)

    def placed(self, points: np.ndarray) -> np.ndarray:
        """Points (n,3) of the mesh's own coordinates in the world [m]."""
        turned = self.scale * points @ rotation_matrix(self.axis, self.angle).T
        return turned + np.asarray(self.position, dtype=float)


@dataclass(frozen=True, kw_only=True)
class Scene:
    """Everything that is simulated, and how. SI units, z points up.

    gravity: [m/s^2].  fps: frames a second.  substeps: time steps a frame, so dt = 1 / (fps substeps); None takes one,
    and with "symplectic-euler" as many as stability asks for.
    seconds: how long `taichifem run` goes on.
    integrator: "backward-euler" (one linearisation a step), "backward-euler-newton" (to convergence), "bdf2" and
    "newmark" (second order, Newton's method), "symplectic-euler" (explicit), or "quasi-static" (no inertia: balance at
    every step).
    solver: of the linear systems, conjugate gradients with the preconditioner "multilevel", or "block-jacobi", which
    suits soft or tiny scenes at best and is there for comparison.
    tolerance: relative residual at which the linear solver stops.  max_iterations: its cap, told when hit.
    newton_tolerance: size of the out-of-balance force, relative to the first, at which Newton's method stops.
    body_contact: do bodies, and pieces of them, keep out of each other? None: where some may break. Not in the plane,
    and not with "symplectic-euler" and "quasi-static".  body_friction: coefficient of Coulomb's friction between them.
    seed: of what is random, which is how cracks begin.  max_splits: of vertices in a step, told when hit.
    """

    bodies: Sequence[Body]
    colliders: Sequence[Collider] = ()
    gravity: check.Vector = (0.0, 0.0, -9.81)
    fps: float = 60
    substeps: int | None = None
    seconds: float = 5.0
    integrator: str = "backward-euler"
    solver: str = "multilevel"
    tolerance: float = 1e-3
    max_iterations: int = 2000
    newton_tolerance: float = 1e-6
    body_contact: bool | None = None
    body_friction: float = 0.5
    seed: int = 0
    max_splits: int = 100
    name: str = "scene"
    description: str = ""
    camera: Camera = field(default_factory=Camera)
    view: View = field(default_factory=View)

    def __post_init__(self) -> None:
        if not len(self.bodies):
            raise InputError("the scene has no body: add at least one")
        names = [body.name for body in self.bodies if body.name]
        for name in names:
            if names.count(name) > 1:
                raise InputError(f"two bodies are called {name!r}: give each its own name")
        check.vector("gravity", self.gravity, unit="m/s^2")
        check.number("fps", self.fps, above=0, unit="1/s")
        if self.substeps is not None:
            check.whole("substeps", self.substeps)
        check.number("seconds", self.seconds, above=0, unit="s")
        check.choice("integrator", self.integrator, INTEGRATORS)
        check.choice("solver", self.solver, SOLVERS)
        check.number("tolerance", self.tolerance, above=0, below=1)
        check.whole("max_iterations", self.max_iterations)
        check.number("newton_tolerance", self.newton_tolerance, above=0, below=1)
        check.number("body_friction", self.body_friction, at_least=0)
        check.whole("seed", self.seed, at_least=0)
        check.whole("max_splits", self.max_splits)
        if self.integrator == "quasi-static" and self.breaks:
            raise InputError(
                'integrator "quasi-static" has no inertia, and pieces that come off need it: choose another'
            )

        if self.body_contact and self._without_contact:
            raise InputError(f"body_contact is not there {self._without_contact}: leave it out")

    @property
    def _without_contact(self) -> str:
        """Why bodies cannot keep out of each other; empty if they can."""
        if self.bodies[0].mesh.dimension == 2:
            return "for planar bodies"
        if self.integrator in ("symplectic-euler", "quasi-static"):
            return f'with integrator "{self.integrator}"'
        return ""

    @property
    def breaks(self) -> bool:
        """Is there a material that breaks?"""
        return any(m.fracture for body in self.bodies for m in (body.material, *body.materials.values()))

    @property
    def pieces_meet(self) -> bool:
        """Do bodies, and pieces of them, keep out of each other?"""
        wanted = self.breaks if self.body_contact is None else self.body_contact
        return wanted and not self._without_contact

    @classmethod
    def from_file(cls, path: str, *, overrides: Sequence[str] = ()) -> Scene:
        """Read a scene file (TOML); `overrides` are "body.0.material.youngs=2e5" and the like.

        Raises InputError naming the file, the key and the remedy.
        """
        from taichifem.scene import read_scene  # the one look upstairs, for a short name people can call

        return read_scene(path, overrides=overrides)
