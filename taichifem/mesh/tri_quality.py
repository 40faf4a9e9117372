"""How good a plane triangle mesh is: counts, angles and ratios."""

from dataclasses import dataclass

import numpy as np

from taichifem.mesh.connectivity import pieces
from taichifem.mesh.tri_mesh import TriMesh
from taichifem.mesh.validation import Repairs


@dataclass(frozen=True)
class TriQuality:
    """Measures of a mesh of triangles. Angles are in degrees; an equilateral triangle has three of 60.

    Attributes:
        points, triangles, boundary_edges: counts.
        loops: closed lines that make the boundary: one for each piece and one for each hole. Lines that meet in a
            vertex count as one.
        pieces: connected pieces, where touching means sharing a vertex.
        area: of the whole mesh [m^2].
        size: extent of the bounding box along x and z [m].
        smallest_angle, mean_smallest_angle: of each triangle's smallest angle, the least and the mean.
        largest_angle, mean_largest_angle: of each triangle's largest angle, the greatest and the mean.
        worst_radius_ratio, mean_radius_ratio: 2 inradius / circumradius, 1 for an equilateral triangle.
        repairs: what validation put right.
    """

    points: int
    triangles: int
    boundary_edges: int
    loops: int
    pieces: int
    area: float
    size: tuple[float, float]
    smallest_angle: float
    mean_smallest_angle: float
    largest_angle: float
    mean_largest_angle: float
    worst_radius_ratio: float
    mean_radius_ratio: float
    repairs: Repairs


def tri_quality(mesh: TriMesh) -> TriQuality:
    """Measure a mesh of triangles."""
    angles = triangle_angles(mesh)
    smallest, largest = angles.min(axis=1), angles.max(axis=1)
    ratios = triangle_radius_ratios(mesh)
    rim = mesh.boundary()
    return TriQuality(
        points=len(mesh.points),
        triangles=len(mesh.cells),
        boundary_edges=len(rim),
        loops=len(np.unique(pieces(rim, len(mesh.points))[1][rim[:, 0]])),
        pieces=int(pieces(mesh.cells, len(mesh.points))[0]),
        area=mesh.area,
        size=tuple(float(length) for length in np.diff(mesh.bounds, axis=0)[0]),
        smallest_angle=float(smallest.min()),
        mean_smallest_angle=float(smallest.mean()),
        largest_angle=float(largest.max()),
        mean_largest_angle=float(largest.mean()),
        worst_radius_ratio=float(ratios.min()),
        mean_radius_ratio=float(ratios.mean()),
        repairs=mesh.repairs,
    )


def triangle_angles(mesh: TriMesh) -> np.ndarray:
    """The angle (m, 3) at each vertex of each triangle, in degrees."""
    corners = mesh.points[mesh.cells]
    ahead, behind = np.roll(corners, -1, axis=1) - corners, np.roll(corners, 1, axis=1) - corners
    return np.degrees(np.arctan2(2 * mesh.areas()[:, None], np.einsum("mij,mij->mi", ahead, behind)))


def triangle_radius_ratios(mesh: TriMesh) -> np.ndarray:
    """Twice inradius over circumradius (m,) of each triangle: 1 if equilateral, near 0 if flat."""
    corners = mesh.points[mesh.cells]
    lengths = np.linalg.norm(np.roll(corners, -1, axis=1) - corners, axis=2)
    return 16 * mesh.areas() ** 2 / (lengths.prod(axis=1) * lengths.sum(axis=1))
