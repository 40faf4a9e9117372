"""The mesh itself: checks, repairs, transforms, neighbours."""

import numpy as np
import pytest

from taichifem.errors import InputError
from taichifem.mesh import TetMesh
from taichifem.mesh.connectivity import boundary_faces, edges, pieces

CORNER = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], float)


def test_mirrored_tetrahedra_are_flipped():
    mesh = TetMesh(CORNER, [[0, 2, 1, 3]], regions=[7])
    assert mesh.repairs.flipped == 1
    assert mesh.volume == pytest.approx(1 / 6)
    assert mesh.regions.tolist() == [7]


def test_unused_points_are_dropped():
    points = np.insert(CORNER, 1, [9, 9, 9], axis=0)
    mesh = TetMesh(points, [[0, 2, 3, 4]])
    assert mesh.repairs.orphans == 1
    assert np.array_equal(mesh.points, CORNER)
    assert sorted(mesh.cells[0]) == [0, 1, 2, 3]


def test_coincident_points_are_counted_but_stay():
    points = np.concatenate([CORNER, CORNER[1:] + 1e-12, [[1, 1, 1]]])
    mesh = TetMesh(points, [[0, 1, 2, 3], [4, 5, 6, 7]])
    assert mesh.repairs.duplicates == 3
    assert len(mesh.points) == 8


@pytest.mark.parametrize(
    ("points", "cells", "regions", "message"),
    [
        (CORNER[:, :2], [[0, 1, 2, 3]], None, r"\(n, 3\)"),
        ("abc", [[0, 1, 2, 3]], None, "array of numbers"),
        (CORNER * [1, np.nan, 1], [[0, 1, 2, 3]], None, "points 0, 1, 2, 3 are not finite"),
        (CORNER, [], None, "no tetrahedra"),
        (CORNER, [[0, 1, 2]], None, r"\(m, 4\)"),
        (CORNER, [[0.0, 1, 2, 3]], None, "integer"),
        (CORNER, [[0, 1, 2, 3], [0, 1, 2, 4]], None, r"tetrahedra 1 use vertex indices outside 0\.\.3"),
        (CORNER, [[0, 1, 2, -1]], None, "tetrahedra 0 use"),
        (CORNER, [[0, 1, 2, 2]], None, "tetrahedra 0 have no volume"),
        (CORNER * [1, 1, 1e-14], [[0, 1, 2, 3]], None, "tetrahedra 0 have no volume"),
        (CORNER, [[0, 1, 2, 3]] * 9, np.zeros(3, int), "regions"),
    ],
)
def test_bad_arrays_are_refused(points, cells, regions, message):
    with pytest.raises(InputError, match=message) as caught:
        TetMesh(points, cells, regions)
    assert "\n" not in str(caught.value)


def test_only_the_first_bad_elements_are_listed():
    with pytest.raises(InputError, match=r"0, 1, 2, 3, 4, \.\.\. \(9 in all\)"):
        TetMesh(CORNER, [[0, 1, 2, 2]] * 9)


def test_tiny_and_huge_meshes_are_not_degenerate():
    for scale in (1e-9, 1e9):
        assert TetMesh(CORNER * scale, [[0, 1, 2, 3]]).volume == pytest.approx(scale**3 / 6)


def test_a_face_of_three_tetrahedra_is_refused():
    points = np.concatenate([CORNER, [[1, 1, 1], [2, 2, 2]]])
    mesh = TetMesh(points, [[1, 2, 3, 0], [1, 2, 3, 4], [1, 2, 3, 5]])
    with pytest.raises(InputError, match="more than two tetrahedra, among them 0, 1, 2"):
        mesh.surface()


def test_boundary_faces_know_their_tetrahedron():
    mesh = TetMesh.bar(cells=(2, 2, 2))
    triangles, owner = boundary_faces(mesh.cells)
    assert all(set(t) <= set(c) for t, c in zip(triangles, mesh.cells[owner], strict=True))


def test_edges_and_pieces_of_two_bars():
    mesh = TetMesh.bar(size=(1, 1, 1), cells=(1, 1, 1))
    cells = np.concatenate([mesh.cells, mesh.cells + 8])
    assert len(edges(mesh.cells)) == 18  # 12 of the cube, one diagonal on each face
    count, piece = pieces(cells, 16)
    assert count == 2
    assert piece.tolist() == [0] * 8 + [1] * 8


def test_transformed_scales_then_turns_then_moves():
    mesh = TetMesh.bar(size=(1, 2, 3), cells=(1, 1, 1))
    quarter = np.array([[0, -1, 0], [1, 0, 0], [0, 0, 1]])  # x to y
    moved = mesh.transformed(scale=(2, 1, 1), rotation=quarter, translation=(10, 0, 0))
    assert np.allclose(moved.bounds, [[8, 0, 0], [10, 2, 3]])
    assert moved.volume == pytest.approx(2 * mesh.volume)
    assert np.allclose(TetMesh.from_source(moved.source).points, moved.points)
    assert np.allclose(mesh.bounds, [[0, 0, 0], [1, 2, 3]])  # the original stays


@pytest.mark.parametrize(
    "arguments",
    [
        {"scale": 0},
        {"scale": (1, -1, 1)},
        {"scale": "big"},
        {"rotation": np.diag([1, 1, -1])},
        {"rotation": 2 * np.eye(3)},
        {"rotation": [1, 0, 0]},
        {"translation": (np.inf, 0, 0)},
        {"translation": 1},
    ],
)
def test_wrong_transforms_are_named(arguments):
    with pytest.raises(InputError, match=next(iter(arguments))):
        TetMesh.bar(cells=(1, 1, 1)).transformed(**arguments)


def test_arrays_cannot_be_changed_behind_the_cached_surface():
    mesh = TetMesh.bar(cells=(1, 1, 1))
    for array in (mesh.points, mesh.cells, mesh.regions, mesh.surface()):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 0


def test_the_mesh_keeps_its_own_copy():
    points, cells = CORNER.copy(), np.array([[0, 1, 2, 3]], np.int32)
    mesh = TetMesh(points, cells)
    points[:], cells[:] = 5, 0
    assert mesh.volume == pytest.approx(1 / 6)
