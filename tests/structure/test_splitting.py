"""Meshes that come apart stay meshes: whatever is split, whenever."""

import numpy as np
import pytest

from taichifem.mesh import TetMesh, TriMesh
from taichifem.mesh.connectivity import across, boundary_faces, pieces
from taichifem.structure.pieces import label_pieces
from taichifem.structure.splitting import Splitting


def whole(mesh) -> Splitting:
    return Splitting(mesh.cells, np.arange(len(mesh.points)))


def tear(split: Splitting, points: np.ndarray, elements, normal, *, seed=0, most=1000):
    """Tear elements across a direction."""
    x = np.zeros((len(split.origin), 3))
    x[:, : points.shape[1]] = points[split.origin]
    normal = np.r_[normal, np.zeros(3 - len(normal))]
    any_corner = np.full(len(elements), -1)
    return split.tear(x, elements, any_corner, np.tile(normal, (len(elements), 1)), seed=(seed, 1), most=most)


def assert_sound(split: Splitting, cells: np.ndarray) -> None:
    """Nothing lost, no vertex without element, no face of three elements, closed surface, vertices of one fan each."""
    n = len(split.origin)
    np.testing.assert_array_equal(split.origin[split.cells], cells)
    np.testing.assert_array_equal(np.unique(split.cells), np.arange(n))
    np.testing.assert_array_equal(across(split.cells), split.beside)
    assert n <= cells.size
    faces, _ = boundary_faces(split.cells)  # refuses faces of three elements
    if cells.shape[1] == 4:
        directed = np.concatenate([faces[:, [a, (a + 1) % 3]] for a in range(3)])
        there = directed @ (n, 1)
        assert np.array_equal(np.sort(there), np.sort(directed[:, ::-1] @ (n, 1))), "the surface has a hole"
    assert all(fans(split, node) == 1 for node in range(n))


def fans(split: Splitting, node: int) -> int:
    """Groups of elements around a vertex that hang together by faces at it."""
    star = np.flatnonzero((split.cells == node).any(axis=1))
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


@pytest.mark.parametrize("seed", [*range(10), *(pytest.param(k, marks=pytest.mark.slow) for k in range(10, 250))])
def test_random_cuts_leave_sound_meshes(seed):
    rng = np.random.default_rng(seed)
    for _ in range(4):
        mesh = some_mesh(rng)
        split = whole(mesh)
        for _ in range(int(rng.integers(1, 6))):
            elements = rng.integers(len(mesh.cells), size=int(rng.integers(1, 12)))
            before = len(split.origin)
            done = tear(split, mesh.points, elements, rng.normal(size=mesh.points.shape[1]), seed=seed)
            assert (len(split.origin) > before) == (done.splits > 0) and len(done.parent) == len(split.origin)
            np.testing.assert_array_equal(split.origin, split.origin[done.parent])
        assert_sound(split, mesh.cells)


def test_in_the_end_every_element_is_on_its_own():
    rng = np.random.default_rng(0)
    mesh = TetMesh.bar(size=(1.0, 1.0, 1.0), cells=(2, 2, 2))
    split = whole(mesh)
    for k in range(400):
        tear(split, mesh.points, rng.permutation(len(mesh.cells)), rng.normal(size=3), seed=k)
    assert_sound(split, mesh.cells)
    assert len(split.origin) == mesh.cells.size
    assert label_pieces(split.cells, len(split.origin))[0] == len(mesh.cells)


def test_a_bar_is_cut_in_two_by_a_plane_of_crack_tips():
    mesh = TetMesh.bar(size=(2.0, 1.0, 1.0), cells=(4, 2, 2))
    middle = abs(mesh.points[:, 0] - 1.0) < 1e-9
    split = Splitting(mesh.cells, np.arange(len(mesh.points)), middle)
    while split.tips.any():
        tear(split, mesh.points, np.flatnonzero(split.tips[split.cells].any(axis=1))[:1], (1.0, 0, 0))
    assert label_pieces(split.cells, len(split.origin))[0] == 2
    assert len(split.origin) == len(mesh.points) + middle.sum()
    assert_sound(split, mesh.cells)


def test_a_cut_tells_where_it_ends():
    """Two quads side by side above two others: split at the left, the crack ends in the middle."""
    points = np.array([[0.0, 0], [1, 0], [2, 0], [0, 1], [1, 1], [2, 1], [0, -1], [1, -1], [2, -1]])
    quads = np.array([[0, 1, 4, 3], [1, 2, 5, 4], [6, 7, 1, 0], [7, 8, 2, 1]])
    cells = np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
    split = Splitting(cells, np.arange(len(points)), np.arange(len(points)) == 0)
    assert tear(split, points, [0], (0, 1.0)).splits == 1
    assert np.flatnonzero(split.tips).tolist() == [1] and len(split.origin) == 10


def test_the_cap_is_told_and_kept():
    mesh = TetMesh.bar(size=(4.0, 1.0, 1.0), cells=(16, 3, 3))
    every = np.arange(len(mesh.cells))
    few, all_ = (
        tear(whole(mesh), mesh.points, every, (1.0, 0, 0), most=3),
        tear(whole(mesh), mesh.points, every, (1, 0, 0)),
    )
    assert few.splits == 3 and few.capped
    assert all_.splits > 3 and not all_.capped


def test_the_seed_chooses_the_vertices():
    mesh = TetMesh.bar(size=(4.0, 1.0, 1.0), cells=(8, 3, 3))
    ends = []
    for seed in (1, 1, 2):
        split = whole(mesh)
        tear(split, mesh.points, [100, 300], (1.0, 0, 0), seed=seed)
        ends.append(split.cells.copy())
    assert np.array_equal(ends[0], ends[1]) and not np.array_equal(ends[0], ends[2])


@pytest.mark.parametrize("seed", range(5))
def test_pieces_are_those_of_the_graph(seed):
    rng = np.random.default_rng(seed)
    mesh = some_mesh(rng)
    split = whole(mesh)
    for k in range(8):
        tear(split, mesh.points, rng.permutation(len(mesh.cells)), rng.normal(size=mesh.points.shape[1]), seed=k)
    count, of_cell, of_node = label_pieces(split.cells, len(split.origin))
    expected, label = pieces(split.cells, len(split.origin))
    assert count == expected == len(set(zip(label.tolist(), of_node.tolist(), strict=True)))
    assert (of_node[split.cells] == of_cell[:, None]).all()
    first = [np.flatnonzero(of_cell == p)[0] for p in range(count)]
    assert first == sorted(first)
