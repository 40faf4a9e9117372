"""How good a mesh is: counts, angles and ratios that tell whether a simulation will like it."""

from dataclasses import dataclass

import numpy as np

from taichifem.mesh.connectivity import EDGES, FACES, pieces
from taichifem.mesh.kinds import Mesh
from taichifem.mesh.tet_mesh import TetMesh
from taichifem.mesh.tri_mesh import TriMesh
from taichifem.mesh.tri_quality import TriQuality, tri_quality
from taichifem.mesh.validation import Repairs


@dataclass(frozen=True)
class Quality:
    """Measures of a mesh of tetrahedra. Angles are dihedral angles in degrees; a regular tetrahedron has six of 70.53.

    Attributes:
        points, tets, triangles: counts; triangles are those of the surface.
        pieces: connected pieces, where touching means sharing a vertex.
        volume: of the whole mesh [m^3].
        size: extent of the bounding box along x, y and z [m].
        smallest_angle, mean_smallest_angle: of each tetrahedron's smallest angle, the least and the mean.
        largest_angle, mean_largest_angle: of each tetrahedron's largest angle, the greatest and the mean.
        worst_radius_ratio, mean_radius_ratio: 3 inradius / circumradius, 1 for a regular tetrahedron.
        repairs: what validation put right.
    """

    points: int
    tets: int
    triangles: int
    pieces: int
    volume: float
    size: tuple[float, float, float]
    smallest_angle: float
    mean_smallest_angle: float
    largest_angle: float
    mean_largest_angle: float
    worst_radius_ratio: float
    mean_radius_ratio: float
    repairs: Repairs


def quality(mesh: Mesh) -> Quality | TriQuality:
    """Measure a mesh; a million elements take a few seconds."""
    return tri_quality(mesh) if isinstance(mesh, TriMesh) else tet_quality(mesh)


def tet_quality(mesh: TetMesh) -> Quality:
    """Measure a mesh of tetrahedra."""
    angles = dihedral_angles(mesh)
    smallest, largest = angles.min(axis=1), angles.max(axis=1)
    ratios = radius_ratios(mesh)
    return Quality(
        points=len(mesh.points),
        tets=len(mesh.cells),
        triangles=len(mesh.surface()),
        pieces=int(pieces(mesh.cells, len(mesh.points))[0]),
        volume=mesh.volume,
        size=tuple(float(length) for length in np.diff(mesh.bounds, axis=0)[0]),
        smallest_angle=float(smallest.min()),
        mean_smallest_angle=float(smallest.mean()),
        largest_angle=float(largest.max()),
        mean_largest_angle=float(largest.mean()),
        worst_radius_ratio=float(ratios.min()),
        mean_radius_ratio=float(ratios.mean()),
        repairs=mesh.repairs,
    )


def dihedral_angles(mesh: TetMesh) -> np.ndarray:
    """The six dihedral angles (m, 6) of each tetrahedron, in degrees."""
    normals = _face_normals(mesh)
    normals /= np.linalg.norm(normals, axis=2, keepdims=True)
    cosines = [-np.einsum("ij,ij->i", normals[:, i], normals[:, j]) for i, j in EDGES]
    return np.degrees(np.arccos(np.clip(np.column_stack(cosines), -1, 1)))


def radius_ratios(mesh: TetMesh) -> np.ndarray:
    """Three times inradius over circumradius (m,) of each tetrahedron: 1 if regular, near 0 if flat."""
    corners, volume = mesh.points[mesh.cells], mesh.volumes()
    length = [np.linalg.norm(corners[:, i] - corners[:, j], axis=1) for i, j in EDGES]
    p, q, r = (length[i] * length[5 - i] for i in range(3))  # products of opposite edges
    circumradius = np.sqrt(np.maximum((p + q + r) * (p + q - r) * (p - q + r) * (q + r - p), 0)) / (24 * volume)
    area = np.linalg.norm(_face_normals(mesh), axis=2).sum(axis=1) / 2
    return 9 * volume / (area * circumradius)


def _face_normals(mesh: TetMesh) -> np.ndarray:
    """Outward normals (m, 4, 3), twice the area long, of the faces opposite each vertex."""
    a, b, c = (mesh.points[mesh.cells[:, FACES[:, i]]] for i in range(3))
    return np.cross(b - a, c - a)
