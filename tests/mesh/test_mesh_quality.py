"""Quality measures against a regular tetrahedron and a corner of a cube."""

import numpy as np
import pytest

from taichifem.mesh import TetMesh, quality, report

REGULAR = TetMesh([[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]], [[0, 1, 2, 3]])
CORNER = TetMesh([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], [[0, 1, 2, 3]])


def test_regular_tetrahedron_is_perfect():
    q = quality(REGULAR)
    assert q.smallest_angle == pytest.approx(np.degrees(np.arccos(1 / 3)), rel=1e-12)
    assert q.largest_angle == pytest.approx(q.smallest_angle, rel=1e-12)
    assert q.worst_radius_ratio == pytest.approx(1, rel=1e-12)
    assert q.volume == pytest.approx(8 / 3)


def test_corner_of_a_cube():
    q = quality(CORNER)
    inradius, circumradius = 0.5 / (1.5 + 3**0.5 / 2), 3**0.5 / 2
    assert q.worst_radius_ratio == pytest.approx(3 * inradius / circumradius, rel=1e-12)
    assert q.largest_angle == pytest.approx(90)
    assert q.smallest_angle == pytest.approx(np.degrees(np.arccos(1 / 3**0.5)))


def test_quality_does_not_depend_on_size_or_place():
    mesh = TetMesh.sphere(resolution=2)
    moved = quality(mesh.transformed(scale=1e-3, translation=(1, 2, 3)))
    assert moved.worst_radius_ratio == pytest.approx(quality(mesh).worst_radius_ratio, rel=1e-9)
    assert moved.smallest_angle == pytest.approx(quality(mesh).smallest_angle, rel=1e-9)


def test_mean_and_worst_are_over_the_mesh():
    points = np.concatenate([REGULAR.points, CORNER.points + 10])
    q = quality(TetMesh(points, [[0, 1, 2, 3], [4, 5, 6, 7]]))
    assert q.pieces == 2
    assert q.worst_radius_ratio == pytest.approx(quality(CORNER).worst_radius_ratio)
    assert q.mean_radius_ratio == pytest.approx((1 + quality(CORNER).worst_radius_ratio) / 2)
    assert (q.points, q.tets, q.triangles) == (8, 2, 8)


def test_report_tells_counts_volume_and_repairs():
    mesh = TetMesh(np.concatenate([CORNER.points, [[9, 9, 9]]]), [[0, 2, 1, 3]])
    text = report(mesh)
    assert "0.166667 m^3" in text
    assert "1 elements flipped, 1 unused points dropped" in text
    assert "regions" not in text


def test_report_counts_regions():
    cube = TetMesh.bar(cells=(1, 1, 1))
    assert "0 (3), 5 (2)" in report(TetMesh(cube.points, cube.cells, [0, 5, 0, 5, 0]))
