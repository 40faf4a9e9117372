"""Simple plane shapes: areas in closed form, numbering, triangles of good shape."""

import numpy as np
import pytest

from taichifem.errors import InputError
from taichifem.mesh import TriMesh, mesh_from_source, quality
from taichifem.mesh.shapes2d import SHAPES

COOK = ((0.0, 0.0), (48.0, 44.0), (48.0, 60.0), (0.0, 44.0))


@pytest.mark.parametrize("pattern", ["alternating", "right"])
def test_rectangle_spans_its_size(pattern):
    mesh = TriMesh.rectangle(size=(0.7, 0.3), cells=(49, 7), pattern=pattern)
    assert (len(mesh.points), len(mesh.cells), len(mesh.boundary())) == (50 * 8, 2 * 49 * 7, 2 * (49 + 7))
    assert np.array_equal(mesh.bounds, [[0, 0], [0.7, 0.3]])
    assert mesh.area == pytest.approx(0.21, rel=1e-14)
    assert mesh.points[3 * 8 + 2] == pytest.approx([3 / 49 * 0.7, 2 / 7 * 0.3])  # vertex (3, 2)
    assert (mesh.repairs.flipped, mesh.repairs.orphans, mesh.repairs.duplicates) == (0, 0, 0)


def diagonals(mesh: TriMesh) -> np.ndarray:
    """Slope of each triangle's longest side, by the position of its lower left corner in the grid."""
    corners = mesh.points[mesh.cells]
    sides = np.roll(corners, -1, axis=1) - corners
    longest = np.take_along_axis(sides, np.linalg.norm(sides, axis=2).argmax(axis=1)[:, None, None], axis=1)[:, 0]
    return np.sign(longest.prod(axis=1))


def test_patterns_of_diagonals():
    right = TriMesh.rectangle(size=(3, 2), cells=(3, 2), pattern="right")
    assert np.all(diagonals(right) == 1)
    alternating = TriMesh.rectangle(size=(3, 2), cells=(3, 2))
    low = np.floor(alternating.points[alternating.cells].mean(axis=1)).astype(int)
    assert np.array_equal(diagonals(alternating), 1 - 2 * (low.sum(axis=1) % 2))


def test_a_quadrilateral_is_mapped_bilinearly():
    mesh = TriMesh.quadrilateral(COOK, cells=(4, 2))
    assert (len(mesh.points), len(mesh.cells), mesh.repairs.flipped) == (15, 16, 0)
    assert mesh.area == pytest.approx(48 * (44 + 16) / 2)
    assert mesh.points[[0, 12, 14, 2]].tolist() == [list(corner) for corner in COOK]
    assert mesh.points[2 * 3 + 1] == pytest.approx(np.mean(COOK, axis=0))  # the middle of the grid
    assert mesh.points[1 * 3 + 2] == pytest.approx([12, 48])  # a quarter along the upper side
    square = TriMesh.quadrilateral([[0, 0], [2, 0], [2, 1], [0, 1]], cells=(4, 3))
    assert np.allclose(square.points, TriMesh.rectangle(size=(2, 1), cells=(4, 3)).points)
    assert np.array_equal(square.cells, TriMesh.rectangle(size=(2, 1), cells=(4, 3)).cells)


@pytest.mark.parametrize("rings", [1, 2, 7])
def test_a_disk_is_a_regular_polygon(rings):
    mesh = TriMesh.disk(radius=0.3, rings=rings)
    sides = len(mesh.boundary())
    assert (sides, len(mesh.cells)) == (6 * rings, 6 * rings**2)
    assert mesh.area == pytest.approx(sides / 2 * np.sin(2 * np.pi / sides) * 0.09, rel=1e-12)
    assert np.linalg.norm(mesh.points, axis=1).max() == pytest.approx(0.3)


@pytest.mark.parametrize(("inner", "outer", "rings"), [(0.25, 0.5, 4), (0.1, 3.0, 5), (0.9, 1.0, 1), (1e-3, 1.0, 1)])
def test_a_ring_lies_between_two_regular_polygons(inner, outer, rings):
    mesh = TriMesh.ring(inner, outer, rings)
    q = quality(mesh)
    sides = q.boundary_edges // 2
    assert (q.loops, q.pieces, q.triangles) == (2, 1, 2 * rings * sides)
    assert mesh.area == pytest.approx(sides / 2 * np.sin(2 * np.pi / sides) * (outer**2 - inner**2), rel=1e-12)
    radii = np.linalg.norm(mesh.points, axis=1)
    assert (radii.min(), radii.max()) == pytest.approx((inner, outer), rel=1e-14)
    assert len(np.unique(np.round(radii, 12))) == rings + 1


def test_a_ring_has_vertices_on_both_axes():
    points = TriMesh.ring(inner=0.2, outer=0.7, rings=6).points
    for place in ((0.2, 0), (0, 0.2), (-0.7, 0), (0, -0.7)):
        assert np.linalg.norm(points - place, axis=1).min() < 1e-15


@pytest.mark.parametrize(
    ("mesh", "least"),
    [
        (TriMesh.disk(rings=8), 40),
        (TriMesh.ring(rings=4), 45),
        (TriMesh.ring(0.05, 1.0, rings=10), 45),
        (TriMesh.rectangle(size=(3, 2), cells=(6, 4)), 44.9),
    ],
)
def test_shapes_are_clean_and_well_shaped(mesh, least):
    q = quality(mesh)
    assert (q.repairs.flipped, q.repairs.orphans, q.repairs.duplicates, q.pieces) == (0, 0, 0, 1)
    assert q.smallest_angle > least
    assert q.largest_angle < 95


@pytest.mark.parametrize("mesh", [TriMesh.disk(rings=3), TriMesh.ring(rings=3)], ids=["disk", "ring"])
def test_round_shapes_are_centred(mesh):
    moment = np.einsum("m,mi->i", mesh.areas(), mesh.points[mesh.cells].mean(axis=1))
    assert np.allclose(moment, 0, atol=1e-15)


@pytest.mark.parametrize("shape", list(SHAPES))
def test_source_makes_the_same_mesh_again(shape):
    mesh = getattr(TriMesh, shape)(**({"corners": COOK} if shape == "quadrilateral" else {}))
    assert mesh.source["shape"] == shape
    for again in (TriMesh.from_source(mesh.source), mesh_from_source(mesh.source)):
        assert isinstance(again, TriMesh)
        assert np.array_equal(mesh.points, again.points)
        assert np.array_equal(mesh.cells, again.cells)


@pytest.mark.parametrize(
    ("source", "named"),
    [
        ({"shape": "rectangle", "size": (1, 0)}, r"size\[1\] must be a positive"),
        ({"shape": "rectangle", "size": (1, 1, 1)}, "size must be two numbers, for x and z"),
        ({"shape": "rectangle", "cells": (1, 2.5)}, r"cells\[1\]"),
        ({"shape": "rectangle", "pattern": "left"}, "pattern must be one of 'alternating', 'right', not 'left'"),
        ({"shape": "disk", "radius": float("inf")}, "radius"),
        ({"shape": "disk", "rings": 0}, "rings"),
        ({"shape": "ring", "inner": 0.5}, "inner 0.5 must be smaller than outer 0.5"),
        ({"shape": "ring", "inner": 3.0, "outer": float(np.nextafter(3, 4))}, "inner 3.0 must be smaller"),
        ({"shape": "ring", "rings": True}, "rings"),
        ({"shape": "quadrilateral"}, "corners is missing; give it"),
        ({"shape": "quadrilateral", "corners": "abc"}, "corners must be four points"),
        ({"shape": "quadrilateral", "corners": COOK[:3]}, "corners must be four points"),
        ({"shape": "quadrilateral", "corners": [*COOK[:3], (np.nan, 0)]}, "corners must be four points"),
        ({"shape": "quadrilateral", "corners": COOK[::-1]}, "counter-clockwise about a convex"),
        ({"shape": "quadrilateral", "corners": [(0, 0), (1, 0), (0.1, 0.1), (0, 1)]}, "convex"),
        ({"shape": "quadrilateral", "corners": [(0, 0), (1, 0), (0, 1), (1, 1)]}, "convex"),
        ({"shape": "quadrilateral", "corners": [(0, 0), (1, 0), (2, 0), (0, 1)]}, "convex"),
        ({"shape": "disk", "colour": "red"}, "colour"),
        ({"shape": "bar"}, "unknown shape 'bar'; choose from rectangle"),
        ({"size": (1, 1)}, "size"),
    ],
)
def test_wrong_parameters_are_named(source, named):
    with pytest.raises(InputError, match=named) as caught:
        TriMesh.from_source(source)
    assert "\n" not in str(caught.value)
