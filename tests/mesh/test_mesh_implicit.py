"""Solids from formulas, and the ones that come with the package."""

import numpy as np
import pytest

from taichifem.errors import InputError
from taichifem.mesh import TetMesh, asset_names, asset_path, quality

BOX = ((-0.6, -0.6, -0.6), (0.6, 0.6, 0.6))


def ball(p):
    return np.linalg.norm(p - 0.013, axis=1) - 0.5


def test_ball_converges_with_the_square_of_the_spacing():
    exact = 4 / 3 * np.pi * 0.125
    errors = [exact - TetMesh.from_implicit(ball, *BOX, spacing).volume for spacing in (0.2, 0.1, 0.05)]
    assert 0 < errors[2] < 0.005 * exact
    assert errors[0] / errors[2] == pytest.approx(16, rel=0.35)


def test_surface_points_lie_on_the_surface():
    mesh = TetMesh.from_implicit(ball, *BOX, 0.15)
    assert np.abs(ball(mesh.points[np.unique(mesh.surface())])).max() < 1e-8


@pytest.mark.parametrize("spacing", [0.23, 0.11, 0.07])
def test_angles_stay_away_from_0_and_180_degrees(spacing):
    def bumpy(p):
        return ball(p) + 0.05 * np.sin(9 * p[:, 0]) * np.sin(8 * p[:, 1] + 1)

    q = quality(TetMesh.from_implicit(bumpy, (-0.7,) * 3, (0.7,) * 3, spacing))
    assert q.smallest_angle > 8
    assert q.largest_angle < 165
    assert (q.pieces, q.repairs.flipped, q.repairs.duplicates) == (1, 0, 0)


def test_mesh_is_conforming():
    mesh = TetMesh.from_implicit(ball, *BOX, 0.1)
    triangles = mesh.surface()
    forth = {(a, b) for t in triangles.tolist() for a, b in zip(t, t[1:] + t[:1], strict=True)}
    assert len(forth) == 3 * len(triangles)
    assert forth == {(b, a) for a, b in forth}
    a, b, c = (mesh.points[triangles[:, i]] for i in range(3))
    assert np.einsum("ij,ij->", np.cross(a, b), c) / 6 == pytest.approx(mesh.volume, rel=1e-12)
    assert len(np.unique(triangles)) - len(triangles) // 2 == 2  # Euler: the topology of a sphere


@pytest.mark.parametrize(
    ("function", "lower", "spacing", "message"),
    [
        (lambda p: np.ones(len(p)), -1, 0.3, "empty"),
        (lambda p: -np.ones(len(p)), -1, 0.3, "leaves its box"),
        (lambda p: np.full(len(p), np.nan), -1, 0.3, "one finite number per point"),
        (lambda p: p, -1, 0.3, "one finite number per point"),
        (ball, 2, 0.3, "lower"),
        (ball, -1, 0, "spacing"),
        (ball, -1, 1e-4, "coarser"),
    ],
)
def test_what_cannot_be_meshed_is_refused(function, lower, spacing, message):
    with pytest.raises(InputError, match=message):
        TetMesh.from_implicit(function, (lower,) * 3, (1, 1, 1), spacing)


@pytest.mark.parametrize("name", ["bear", "octopus", "vase"])
def test_assets_stand_on_the_floor_and_are_good_meshes(name):
    mesh = TetMesh.from_file(f"asset:{name}")
    q = quality(mesh)
    assert 2000 < q.tets < 8000
    assert q.pieces == 1
    assert q.smallest_angle > 10
    assert np.allclose(mesh.bounds[0, 2], 0, atol=1e-12)
    assert np.allclose(mesh.bounds.sum(axis=0)[:2], 0, atol=1e-12)
    assert 0.5 < mesh.bounds[1, 2] < 1
    assert mesh.source == {"file": f"asset:{name}"}
    assert asset_path(name).stat().st_size < 300_000


def test_unknown_assets_are_refused_with_the_list():
    assert asset_names() == ["bear", "octopus", "vase"]
    for name in ("cat", "../pyproject", ""):
        with pytest.raises(InputError, match="choose from bear, octopus, pig, vase"):
            TetMesh.from_file(f"asset:{name}")
