"""Embedded surfaces follow their mesh; cages enclose them."""

import numpy as np
import pytest

from taichifem.errors import InputError
from taichifem.mesh import TetMesh
from taichifem.mesh.cage import cage
from taichifem.mesh.embedded import EmbeddedSurface, closest_point, embed, winding_number


@pytest.fixture(scope="module")
def bear():
    return EmbeddedSurface.from_file("asset:bear")


@pytest.fixture(scope="module")
def caged(bear):
    mesh = TetMesh(*cage(bear, 500))
    return mesh, embed(bear.points, mesh.points, mesh.cells)


def test_a_cage_encloses_its_surface(bear, caged):
    mesh, embedding = caged
    assert 350 < len(mesh.cells) < 650
    assert embedding.weights.min() > -1e-9
    np.testing.assert_allclose(embedding.weights.sum(axis=1), 1)
    assert 1.0 < mesh.volume / TetMesh.from_file("asset:bear").volume < 5


@pytest.mark.parametrize("rigid", [True, False])
def test_motions_of_the_cage_move_the_surface_exactly(bear, caged, rigid):
    """A rigid motion and an affine one, to round-off."""
    mesh, embedding = caged
    rng = np.random.default_rng(0)
    A = np.linalg.qr(rng.normal(size=(3, 3)))[0] if rigid else rng.normal(size=(3, 3))
    moved = embedding.points(mesh.points @ A.T + [1, 2, 3], mesh.cells)
    np.testing.assert_allclose(moved, bear.points @ A.T + [1, 2, 3], atol=1e-12)


def test_points_outside_take_the_nearest_element():
    mesh = TetMesh.bar(size=(1, 1, 1), cells=(2, 2, 2))
    points = np.array([[0.5, 0.5, 1.1], [1.05, 0.2, 0.7], [-0.1, -0.1, -0.1]])
    embedding = embed(points, mesh.points, mesh.cells)
    np.testing.assert_allclose(embedding.points(mesh.points, mesh.cells), points, atol=1e-12)
    centers = mesh.points[mesh.cells[embedding.element]].mean(axis=1)
    assert np.linalg.norm(centers - points, axis=1).max() < 0.6
    with pytest.raises(InputError, match=r"out of its mesh: use .*--cage"):
        embed(points + 1, mesh.points, mesh.cells)


def test_every_point_of_a_mesh_is_found():
    mesh = TetMesh.from_file("asset:octopus")
    inside = np.random.default_rng(1).dirichlet(np.ones(4), size=len(mesh.cells))
    points = np.einsum("ma,mab->mb", inside, mesh.points[mesh.cells])
    embedding = embed(points, mesh.points, mesh.cells)
    assert (embedding.element == np.arange(len(mesh.cells))).mean() > 0.999
    assert embedding.weights.min() > -1e-9


def test_an_open_surface_may_have_a_cage(bear):
    mesh = TetMesh(*cage(EmbeddedSurface(bear.points, bear.triangles[:1500]), 300))
    assert embed(bear.points[np.unique(bear.triangles[:1500])], mesh.points, mesh.cells).weights.min() > -1e-9


def test_a_real_surface(meshes):
    surface = EmbeddedSurface.from_file(str(meshes / "spot.obj"))
    mesh = TetMesh(*cage(surface, 500))
    assert 350 < len(mesh.cells) < 650
    assert embed(surface.points, mesh.points, mesh.cells).weights.min() > -1e-9


def test_winding_and_nearest_points(bear):
    mesh = TetMesh.from_file("asset:bear")
    centers = mesh.points[mesh.cells].mean(axis=1)[::40]
    np.testing.assert_allclose(winding_number(centers, bear.points, bear.triangles), 1, atol=1e-9)
    np.testing.assert_allclose(winding_number(centers + np.array([2, 0, 0]), bear.points, bear.triangles), 0, atol=1e-9)
    triangle = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]])
    for point, nearest in (((0.2, 0.2, 1), (0.2, 0.2, 0)), ((2, -1, 1), (1, 0, 0)), ((1, 1, 0), (0.5, 0.5, 0))):
        np.testing.assert_allclose(closest_point(np.array(point), triangle), nearest, atol=1e-12)
