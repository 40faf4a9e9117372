"""Meshes that come apart stay meshes: whatever is split, whenever."""

import numpy as np
import pytest

from taichifem.mesh import TetMesh, TriMesh
from taichifem.mesh.connectivity import boundary_faces, pieces
from taichifem.mesh.splitting import Splitting


def assert_sound(split: Splitting, cells: np.ndarray) -> None:
    """Nothing lost, no vertex without element, no face of three elements, closed surface, vertices of one fan each."""
    n = len(split.origin)
    np.testing.assert_array_equal(np.array(split.origin)[split.cells], cells)
    np.testing.assert_array_equal(np.unique(split.cells), np.arange(n))
    assert n <= cells.size
    faces, _ = boundary_faces(split.cells)  # refuses faces of three elements
    if cells.shape[1] == 4:
        directed = np.concatenate([faces[:, [a, (a + 1) % 3]] for a in range(3)])
        there = directed @ (n, 1)
        assert np.array_equal(np.sort(there), np.sort(directed[:, ::-1] @ (n, 1))), "the surface has a hole"
    for node in range(n):
        star = split.star(node)
        np.testing.assert_array_equal(np.flatnonzero((split.cells == node).any(axis=1)), star)


def fans(split: Splitting, node: int) -> int:
    """Groups of elements around a vertex that hang together by faces at it."""
    star = split.star(node)
    others = [set(split.cells[e]) for e in star]
    d = split.cells.shape[1] - 1
    links = [(i, j) for i in range(len(star)) for j in range(i) if len(others[i] & others[j]) >= d]
    label = list(range(len(star)))
    for i, j in links:
        old, new = label[i], label[j]
        label = [new if a == old else a for a in label]
    return len(set(label))


def some_mesh(rng: np.random.Generator):
    kind = rng.integers(4)
    if kind == 0:
        return TetMesh.bar(size=(1.0, 1.0, 1.0), cells=tuple(int(k) for k in rng.integers(1, 4, 3)))
    if kind == 1:
        return TetMesh.sphere(resolution=int(rng.integers(1, 3)))
    if kind == 2:
        return TetMesh.torus(resolution=1)
    return TriMesh.rectangle(size=(1.0, 1.0), cells=tuple(int(k) for k in rng.integers(1, 5, 2)))


def cut_somewhere(split: Splitting, points: np.ndarray, rng: np.random.Generator) -> bool:
    """A plane of random direction through a random vertex."""
    node = int(rng.integers(len(split.origin)))
    star = split.star(node)
    where = points[np.array(split.origin)]
    height = (where[split.cells[star]].mean(axis=1) - where[node]) @ rng.normal(size=points.shape[1])
    if (height > 0).all() or (height <= 0).all():
        return False
    split.cut(node, star[height > 0])
    return True


@pytest.mark.parametrize("seed", [*range(10), *(pytest.param(k, marks=pytest.mark.slow) for k in range(10, 250))])
def test_random_cuts_leave_sound_meshes(seed):
    rng = np.random.default_rng(seed)
    for _ in range(4):
        mesh = some_mesh(rng)
        split = Splitting(mesh.cells, len(mesh.points))
        done = [cut_somewhere(split, mesh.points, rng) for _ in range(int(rng.integers(1, 60)))]
        assert_sound(split, mesh.cells)
        if any(done):
            assert all(fans(split, node) == 1 for node in range(len(split.origin)))


def test_in_the_end_every_element_is_on_its_own():
    rng = np.random.default_rng(0)
    mesh = TetMesh.bar(size=(1.0, 1.0, 1.0), cells=(2, 2, 2))
    split = Splitting(mesh.cells, len(mesh.points))
    for _ in range(4000):
        cut_somewhere(split, mesh.points, rng)
    assert_sound(split, mesh.cells)
    assert len(split.origin) == mesh.cells.size
    assert pieces(split.cells, len(split.origin))[0] == len(mesh.cells)


def test_a_bar_is_cut_in_two_by_a_plane():
    mesh = TetMesh.bar(size=(2.0, 1.0, 1.0), cells=(4, 2, 2))
    split = Splitting(mesh.cells, len(mesh.points))
    right = mesh.points[mesh.cells].mean(axis=1)[:, 0] > 1.0
    ends: list[int] = []
    middle = np.flatnonzero(abs(mesh.points[:, 0] - 1.0) < 1e-9)
    for node in middle:
        star = split.star(node)
        ends = split.cut(int(node), star[right[star]]) if right[star].any() and not right[star].all() else ends
    assert pieces(split.cells, len(split.origin))[0] == 2
    assert len(split.origin) == len(mesh.points) + len(middle)
    assert ends == [], "nothing is left to cut"
    assert_sound(split, mesh.cells)


def test_a_cut_tells_where_it_ends():
    """Two triangles side by side above two others: split at the left, the crack ends in the middle."""
    points = np.array([[0.0, 0], [1, 0], [2, 0], [0, 1], [1, 1], [2, 1], [0, -1], [1, -1], [2, -1]])
    quads = np.array([[0, 1, 4, 3], [1, 2, 5, 4], [6, 7, 1, 0], [7, 8, 2, 1]])
    cells = np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
    split = Splitting(cells, len(points))
    star = split.star(0)
    above = points[split.cells[star]].mean(axis=1)[:, 1] > 0
    assert split.cut(0, star[above]) == [1]
    assert len(split.origin) == 10
