"""What a reduced body is made from: the stiffness and masses of the mesh, what holds it, what pulls at it."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import scipy.sparse

from taichifem.description import Body, Load, Material, Pressure, Scene
from taichifem.layout import Group, Layout, lay_out
from taichifem.mesh.embedded import Embedding
from taichifem.processes.loading import Loading
from taichifem.simulation import Simulation


@dataclass(frozen=True)
class LoadField:
    """A load at its full size: forces (n,3) [N] on the nodes at rest; do they turn with the body?"""

    load: Load
    forces: np.ndarray
    turns: bool


@dataclass(frozen=True)
class Parts:
    """A body of the scene by itself, nodes in its own order.

    rest (n,3) [m], masses (n,) [kg], velocities (n,3) [m/s] at the start, stiffness K (3n,3n) [N/m], surface (k,3)
    outward triangles, skin: (s,) the nodes on it; pins and handles with nodes of this body; embedded: rest places (p,3)
    [m] of the surface that rides in it, and where they lie, or None.
    """

    label: str
    material: Material
    rest: np.ndarray
    masses: np.ndarray
    velocities: np.ndarray
    stiffness: scipy.sparse.csr_matrix
    surface: np.ndarray
    pins: list[Group]
    handles: list[Group]
    loads: list[LoadField]
    cells: np.ndarray
    embedded: tuple[np.ndarray, Embedding] | None = None

    @property
    def skin(self) -> np.ndarray:
        """Nodes (s,) on the surface."""
        return np.unique(self.surface)


def linear_twin(scene: Scene) -> Simulation:
    """The same bodies of linear elasticity in double precision, nothing acting on them: for stiffness and stress."""

    def bare(body: Body) -> Body:
        materials = {region: replace(m, model="linear") for region, m in body.materials.items()}
        material = replace(body.material, model="linear")
        nothing = dict.fromkeys(("pins", "handles", "forces", "tractions", "pressures"), ())
        return replace(body, material=material, materials=materials, **nothing)

    twin = replace(scene, bodies=[bare(body) for body in scene.bodies], colliders=(), integrator="backward-euler")
    return Simulation(twin, precision="f64")


def take_apart(scene: Scene, twin: Simulation) -> list[Parts]:
    """The bodies of the scene, each by itself."""
    layout = lay_out(scene)
    K, masses, rest = twin.stiffness(), twin.masses, twin.rest_positions
    velocities = np.empty_like(layout.velocities)
    velocities[layout.node_order] = layout.velocities
    loads = _load_fields(layout)
    found = []
    for b, body in enumerate(scene.bodies):
        first, last = int(layout.body_start[b]), int(layout.body_start[b + 1])
        axes = slice(3 * first, 3 * last)
        found.append(
            Parts(
                label=f"body.{body.name or b}",
                material=body.material,
                rest=rest[first:last],
                masses=masses[first:last],
                velocities=velocities[first:last],
                stiffness=K[axes, axes],
                surface=twin.surface[twin.surface_bodies == b] - first,
                pins=_of_body(layout.pins, layout, first, last),
                handles=_of_body(layout.handles, layout, first, last),
                cells=np.asarray(body.mesh.cells),
                embedded=_embedded(body),
                loads=[replace(f, forces=f.forces[first:last]) for f in loads if f.forces[first:last].any()],
            )
        )
    return found


def _embedded(body: Body) -> tuple[np.ndarray, Embedding] | None:
    if body.embed is None:
        return None
    return body.placed(np.asarray(body.embed.points)), body.embedding


def _of_body(groups: list[Group], layout: Layout, first: int, last: int) -> list[Group]:
    """The groups that hold nodes from `first` to before `last`, by their numbers in the body."""
    own = [replace(group, nodes=layout.node_order[group.nodes]) for group in groups]
    return [replace(group, nodes=group.nodes - first) for group in own if first <= group.nodes[0] < last]


def _load_fields(layout: Layout) -> list[LoadField]:
    loading = Loading(layout)
    found = []
    for group in layout.loads:
        forces = np.empty_like(layout.rest)
        forces[layout.node_order] = loading.forces(lambda load, this=group.load: float(load is this))
        found.append(LoadField(group.load, forces, isinstance(group.load, Pressure)))
    return found
