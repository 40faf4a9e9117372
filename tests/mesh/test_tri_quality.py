"""Quality measures of triangles, and the report about them."""

import numpy as np
import pytest
from click.testing import CliRunner

from taichifem.app.cli import cli
from taichifem.mesh import TetMesh, TriMesh, quality, report

EQUILATERAL = TriMesh([[0, 0], [1, 0], [0.5, 0.75**0.5]], [[0, 1, 2]])
CORNER = TriMesh([[0, 0], [1, 0], [0, 1]], [[0, 1, 2]])


def test_an_equilateral_triangle_is_perfect():
    q = quality(EQUILATERAL)
    assert (q.smallest_angle, q.largest_angle) == pytest.approx((60, 60), rel=1e-12)
    assert q.worst_radius_ratio == pytest.approx(1, rel=1e-12)
    assert q.area == pytest.approx(3**0.5 / 4)


def test_half_a_square():
    q = quality(CORNER)
    inradius, circumradius = 1 - 0.5**0.5, 0.5**0.5
    assert q.worst_radius_ratio == pytest.approx(2 * inradius / circumradius, rel=1e-12)
    assert (q.smallest_angle, q.largest_angle) == pytest.approx((45, 90))
    assert q.size == (1, 1)


def test_mean_and_worst_are_over_the_mesh():
    q = quality(TriMesh(np.concatenate([EQUILATERAL.points, CORNER.points + 10]), [[0, 1, 2], [3, 4, 5]]))
    assert (q.points, q.triangles, q.pieces, q.loops, q.boundary_edges) == (6, 2, 2, 2, 6)
    assert q.worst_radius_ratio == pytest.approx(quality(CORNER).worst_radius_ratio)
    assert q.mean_radius_ratio == pytest.approx((1 + q.worst_radius_ratio) / 2)
    assert (q.mean_smallest_angle, q.mean_largest_angle) == pytest.approx((52.5, 75))


def test_holes_are_loops_of_the_boundary():
    assert (quality(TriMesh.disk()).loops, quality(TriMesh.ring()).loops) == (1, 2)
    square = TriMesh.rectangle(cells=(5, 5))
    middle = square.points[square.cells].mean(axis=1) / square.bounds[1] * 5
    hole = np.all(np.floor(middle) == 2, axis=1) | np.all(np.floor(middle) == [0, 0], axis=1)
    q = quality(TriMesh(square.points, square.cells[~hole]))
    assert (hole.sum(), q.loops, q.pieces) == (4, 2, 1)  # the corner that is gone makes no hole


def test_report_tells_counts_area_and_repairs():
    points = [[0, 0], [1, 0], [1, 1], [0, 1], [9, 9]]
    text = report(TriMesh(points, [[0, 2, 1], [0, 2, 3]], [0, 5]))
    for line in ("triangles       2", "4 edges in 1 closed line\n", "1 m^2", "45.0 deg worst", "0 (1), 5 (1)"):
        assert line in text
    assert "1 elements flipped, 1 unused points dropped" in text
    assert "dihedral" not in text and "tetrahedra" not in text


def call(*arguments: object):
    return CliRunner().invoke(cli, [str(a) for a in arguments], prog_name="taichifem")


def test_the_command_reports_and_converts(tmp_path):
    source, target = tmp_path / "ring.obj", tmp_path / "ring.vtu"
    mesh = TriMesh.ring()
    mesh.write(source)
    result = call("mesh", source, "--planar", "-o", target)
    assert result.exit_code == 0
    assert report(mesh) in result.output and f"wrote {target}" in result.output
    assert np.array_equal(TriMesh.from_file(target).points, mesh.points)


def test_the_command_refuses_in_one_line(tmp_path):
    TetMesh.bar(cells=(1, 1, 1)).write(tmp_path / "bar.vtu")
    for arguments, words in (((), "holds tetrahedra"), (("--tets", 50), "--tets and --cage")):
        result = call("mesh", tmp_path / "bar.vtu", "--planar", *arguments)
        assert result.exit_code == 2
        assert len(result.stderr.splitlines()) == 1 and words in result.stderr
