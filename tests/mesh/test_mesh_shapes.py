"""Simple solids: volumes in closed form, closed surfaces, elements of good shape."""

import numpy as np
import pytest

from taichifem.errors import InputError
from taichifem.mesh import TetMesh, quality
from taichifem.mesh.shapes import SHAPES

ALL = {
    "bar5": TetMesh.bar(cells=(5, 3, 2)),
    "bar6": TetMesh.bar(cells=(5, 3, 2), split=6),
    "cylinder": TetMesh.cylinder(),
    "hollow_cylinder": TetMesh.hollow_cylinder(),
    "sphere": TetMesh.sphere(),
    "torus": TetMesh.torus(),
}


def enclosed(mesh: TetMesh) -> float:
    """Volume inside the surface, by the divergence theorem."""
    a, b, c = (mesh.points[mesh.surface()[:, i]] for i in range(3))
    return np.einsum("ij,ij->", np.cross(a, b), c) / 6


@pytest.mark.parametrize("mesh", list(ALL.values()), ids=list(ALL))
def test_surface_is_closed_and_faces_outward(mesh):
    triangles = mesh.surface()
    forth = {(a, b) for t in triangles.tolist() for a, b in zip(t, t[1:] + t[:1], strict=True)}
    assert len(forth) == 3 * len(triangles)  # each directed edge once
    assert forth == {(b, a) for a, b in forth}  # and once the other way round
    assert enclosed(mesh) == pytest.approx(mesh.volume, rel=1e-12)


@pytest.mark.parametrize("mesh", list(ALL.values()), ids=list(ALL))
def test_shapes_are_clean_and_well_shaped(mesh):
    q = quality(mesh)
    assert (q.repairs.flipped, q.repairs.orphans, q.repairs.duplicates, q.pieces) == (0, 0, 0, 1)
    assert q.smallest_angle > 22
    assert q.largest_angle < 135
    assert mesh.volumes().min() > 0


@pytest.mark.parametrize(("split", "per_cube"), [(5, 5), (6, 6)])
def test_bar_spans_its_size(split, per_cube):
    mesh = TetMesh.bar(size=(2, 1, 0.5), cells=(4, 3, 2), split=split)
    assert len(mesh.cells) == per_cube * 24
    assert len(mesh.surface()) == 4 * (12 + 8 + 6)  # two per square: faces match inside, or there would be more
    assert np.array_equal(mesh.bounds, [[0, 0, 0], [2, 1, 0.5]])
    assert mesh.volume == pytest.approx(1, rel=1e-14)


def test_kuhn_bar_is_that_of_the_reference_solutions(oracles):
    data = np.load(oracles / "linear_bar12x3x3.npz")
    mesh = TetMesh.bar(size=data["X"].max(axis=0), cells=(12, 3, 3), split=6)
    assert np.allclose(mesh.points, data["X"], atol=1e-15)
    assert np.array_equal(np.sort(mesh.cells), np.sort(data["T"]))


CURVED = {
    "cylinder": ({"radius": 0.3, "height": 0.8}, np.pi * 0.3**2 * 0.8),
    "hollow_cylinder": ({"inner_radius": 0.2, "outer_radius": 0.4, "height": 0.5}, np.pi * (0.16 - 0.04) * 0.5),
    "sphere": ({"radius": 0.5}, 4 / 3 * np.pi * 0.125),
    "torus": ({"major_radius": 0.5, "minor_radius": 0.2}, 2 * np.pi**2 * 0.5 * 0.04),
}


@pytest.mark.parametrize(("shape", "sizes", "exact"), [(s, *c) for s, c in CURVED.items()], ids=list(CURVED))
def test_curved_volume_converges_with_the_square_of_the_spacing(shape, sizes, exact):
    coarse, fine = (exact - getattr(TetMesh, shape)(**sizes, resolution=n).volume for n in (3, 6))
    assert 0 < fine < 0.03 * exact
    assert coarse / fine == pytest.approx(4, rel=0.15)


@pytest.mark.parametrize("shape", list(CURVED))
def test_bodies_of_revolution_are_centred(shape):
    low, high = getattr(TetMesh, shape)().bounds
    assert np.allclose(low + high, 0, atol=0.02)
    centre = getattr(TetMesh, shape)(resolution=2)
    moment = np.einsum("m,mi->i", centre.volumes(), centre.points[centre.cells].mean(axis=1))
    assert np.allclose(moment, 0, atol=1e-3)


@pytest.mark.parametrize("shape", list(SHAPES))
def test_source_makes_the_same_mesh_again(shape):
    mesh = getattr(TetMesh, shape)()
    again = TetMesh.from_source(mesh.source)
    assert mesh.source["shape"] == shape
    assert np.array_equal(mesh.points, again.points)
    assert np.array_equal(mesh.cells, again.cells)


@pytest.mark.parametrize(
    ("source", "named"),
    [
        ({"shape": "bar", "size": (1, 0, 1)}, r"size\[1\]"),
        ({"shape": "bar", "size": 3}, "size"),
        ({"shape": "bar", "cells": (1, 2.5, 1)}, r"cells\[1\]"),
        ({"shape": "bar", "split": 4}, "split"),
        ({"shape": "cylinder", "height": -1}, "height"),
        ({"shape": "cylinder", "radius": float("nan")}, "radius"),
        ({"shape": "sphere", "resolution": 0}, "resolution"),
        ({"shape": "torus", "minor_radius": 2.0}, "minor_radius"),
        ({"shape": "hollow_cylinder", "inner_radius": 1.0}, "inner_radius"),
        ({"shape": "sphere", "colour": "red"}, "colour"),
        ({"shape": "teapot"}, "teapot"),
        ({"size": (1, 1, 1)}, "size"),
    ],
)
def test_wrong_parameters_are_named(source, named):
    with pytest.raises(InputError, match=named) as caught:
        TetMesh.from_source(source)
    assert "\n" not in str(caught.value)
