"""The plane mesh itself: checks, repairs, boundary, transforms."""

import numpy as np
import pytest

from taichifem.errors import InputError
from taichifem.mesh import TetMesh, TriMesh
from taichifem.mesh.connectivity import boundary_faces, edges, pieces

CORNER = np.array([[0, 0], [1, 0], [0, 1]], float)
SQUARE = np.array([[0, 0], [1, 0], [1, 1], [0, 1]], float)
FAN = np.array([[0, 0], [1, 0], [0.5, 1], [0.5, -1], [0.5, 2]], float)  # three triangles on the first edge

ALL = {
    "rectangle": TriMesh.rectangle(cells=(5, 3)),
    "right": TriMesh.rectangle(cells=(4, 4), pattern="right"),
    "quadrilateral": TriMesh.quadrilateral([[0, 0], [48, 44], [48, 60], [0, 44]], cells=(3, 5)),
    "disk": TriMesh.disk(),
    "ring": TriMesh.ring(),
    "two triangles that touch": TriMesh([[0, 0], [1, 0], [0, 1], [-1, 0], [0, -1]], [[0, 1, 2], [0, 3, 4]]),
}


def shoelace(mesh: TriMesh) -> float:
    """Area inside the boundary, by the divergence theorem: holes count negative."""
    (ax, az), (bx, bz) = (mesh.points[mesh.boundary()[:, i]].T for i in (0, 1))
    return float(np.sum(ax * bz - az * bx) / 2)


@pytest.mark.parametrize("mesh", list(ALL.values()), ids=list(ALL))
def test_boundary_is_closed_and_goes_round_counter_clockwise(mesh):
    heads, tails = mesh.boundary().T
    assert np.array_equal(np.sort(heads), np.sort(tails))  # who comes to a vertex leaves it again
    assert shoelace(mesh) == pytest.approx(mesh.area, rel=1e-12)
    assert mesh.area == pytest.approx(mesh.areas().sum()) and mesh.areas().min() > 0


def test_the_body_is_on_the_left_of_each_boundary_edge():
    mesh = TriMesh.ring(rings=2)
    rim, owner = boundary_faces(mesh.cells)
    assert np.array_equal(rim, mesh.boundary())
    head, tail, middle = mesh.points[rim[:, 0]], mesh.points[rim[:, 1]], mesh.points[mesh.cells[owner]].mean(axis=1)
    along, inward = tail - head, middle - head
    assert np.all(along[:, 0] * inward[:, 1] - along[:, 1] * inward[:, 0] > 0)


def test_the_boundary_of_a_square():
    mesh = TriMesh(SQUARE, [[0, 1, 2], [0, 2, 3]])
    assert {tuple(edge) for edge in mesh.boundary().tolist()} == {(0, 1), (1, 2), (2, 3), (3, 0)}
    assert mesh.surface() is mesh.cells
    assert np.array_equal(mesh.bounds, [[0, 0], [1, 1]])


def test_edges_and_pieces_of_two_squares():
    cells = np.array([[0, 1, 2], [0, 2, 3]])
    assert edges(cells).tolist() == [[0, 1], [0, 2], [0, 3], [1, 2], [2, 3]]
    count, piece = pieces(np.concatenate([cells, cells + 4]), 8)
    assert count == 2 and piece.tolist() == [0] * 4 + [1] * 4


def test_clockwise_triangles_are_flipped():
    mesh = TriMesh(SQUARE, [[0, 2, 1], [0, 2, 3]], regions=[7, 8])
    assert mesh.repairs.flipped == 1
    assert mesh.areas().tolist() == [0.5, 0.5]
    assert mesh.regions.tolist() == [7, 8]


def test_unused_points_are_dropped_and_coincident_ones_counted():
    points = np.concatenate([[[9, 9]], CORNER, CORNER + 1e-12])
    mesh = TriMesh(points, [[1, 2, 3], [4, 5, 6]])
    assert (mesh.repairs.orphans, mesh.repairs.duplicates) == (1, 3)
    assert len(mesh.points) == 6 and np.array_equal(mesh.points[:3], CORNER)


@pytest.mark.parametrize(
    ("points", "cells", "regions", "message"),
    [
        (np.eye(3), [[0, 1, 2]], None, r"\(n, 2\), not \(3, 3\); give x and z only"),
        ("abc", [[0, 1, 2]], None, r"\(n, 2\) array of numbers"),
        (CORNER * [1, np.nan], [[0, 1, 2]], None, "points 0, 1, 2 are not finite"),
        ([[np.inf, 0], [1, 0], [0, 1]], [[0, 1, 2]], None, "not finite"),
        (CORNER, [], None, "no triangles; give at least one"),
        (CORNER, [[0, 1, 2, 2]], None, r"\(m, 3\), not \(1, 4\)"),
        (CORNER, [0, 1, 2], None, r"\(m, 3\), not \(3,\)"),
        (CORNER, [[0, 1, 2], [0, 1]], None, r"\(m, 3\) array of integers"),
        (CORNER, [[0.0, 1, 2]], None, "integer"),
        (CORNER, [[0, 1, 2], [0, 1, 3]], None, r"triangles 1 use vertex indices outside 0\.\.2"),
        (CORNER, [[0, 1, -1]], None, "triangles 0 use"),
        (CORNER, [[0, 1, 1]], None, "triangles 0 have no area"),
        (CORNER * [1, 1e-14], [[0, 1, 2]], None, "triangles 0 have no area"),
        (SQUARE, [[0, 1, 2], [0, 2, 3]], [1], "regions must be one integer for each of the triangles"),
        (CORNER, [[0, 1, 2]], [0.5], "regions"),
        (FAN, [[0, 1, 2], [0, 1, 3], [0, 1, 4]], None, "an edge is shared by more than two triangles.* 0, 1, 2;"),
        (CORNER, [[0, 1, 2], [1, 2, 0]], None, "triangles 0, 1 overlap a neighbour; remove"),
        (FAN, [[0, 1, 2], [0, 1, 4]], None, "triangles 0, 1 overlap a neighbour"),
    ],
)
def test_bad_arrays_are_refused(points, cells, regions, message):
    with pytest.raises(InputError, match=message) as caught:
        TriMesh(points, cells, regions)
    assert "\n" not in str(caught.value)


def test_tiny_and_huge_meshes_are_not_degenerate():
    for scale in (1e-9, 1e9):
        assert TriMesh(CORNER * scale, [[0, 1, 2]]).area == pytest.approx(scale**2 / 2)


def test_the_kinds_know_their_dimension():
    assert (TriMesh.dimension, TetMesh.dimension) == (2, 3)
    assert repr(TriMesh(CORNER, [[0, 1, 2]])) == "TriMesh(3 points, 1 triangles, source=None)"


def test_transformed_scales_then_turns_then_moves():
    mesh = TriMesh.rectangle(size=(1, 2), cells=(2, 1))
    quarter = np.array([[0, -1], [1, 0]])  # x to z
    moved = mesh.transformed(scale=(3, 1), rotation=quarter, translation=(10, 0))
    assert np.allclose(moved.bounds, [[8, 0], [10, 3]])
    assert moved.area == pytest.approx(3 * mesh.area)
    assert np.allclose(TriMesh.from_source(moved.source).points, moved.points)
    assert np.array_equal(mesh.transformed().points, mesh.points)


@pytest.mark.parametrize(
    "arguments",
    [
        {"scale": 0},
        {"scale": (1, 1, 1)},
        {"rotation": np.eye(3)},
        {"rotation": np.diag([1, -1])},
        {"translation": (0, 0, 0)},
    ],
)
def test_wrong_transforms_are_named(arguments):
    with pytest.raises(InputError, match=next(iter(arguments))):
        TriMesh.rectangle(cells=(1, 1)).transformed(**arguments)


def test_arrays_cannot_be_changed_behind_the_boundary():
    mesh = TriMesh.rectangle(cells=(1, 1))
    for array in (mesh.points, mesh.cells, mesh.regions, mesh.boundary()):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 0


def test_the_mesh_keeps_its_own_copy():
    points, cells = CORNER.copy(), np.array([[0, 1, 2]], np.int32)
    mesh = TriMesh(points, cells)
    points[:], cells[:] = 5, 0
    assert mesh.area == 0.5
