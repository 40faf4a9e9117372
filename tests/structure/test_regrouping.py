"""Aggregates of meshes that were split: what the solver works with must hang together."""

import itertools

import numpy as np
import pytest
import scipy.sparse as sp
from scipy.sparse.csgraph import connected_components

from taichifem.mesh import TetMesh
from taichifem.structure.aggregates import SIZE, aggregate
from taichifem.structure.pieces import label_pieces
from taichifem.structure.regrouping import MOST, regroup
from taichifem.structure.splitting import Splitting


def split(seed: int, splits: int):
    """Two bodies, split at random: their aggregates; elements, old number and body of the nodes; the new aggregates."""
    rng = np.random.default_rng(seed)
    mesh = TetMesh.bar(size=(1.0, 0.5, 0.5), cells=(12, 6, 6))
    n = len(mesh.points)
    points = np.concatenate([mesh.points, mesh.points + 3])
    whole = aggregate(points, np.array([0, n, 2 * n]))
    number = np.argsort(whole.order)
    cells = number[np.concatenate([mesh.cells, mesh.cells + n])]
    points = points[whole.order]
    apart = Splitting(cells, np.arange(2 * n))
    for step in range(splits // 50):
        torn = rng.choice(len(cells), 80, replace=False)
        normals = rng.normal(size=(80, 3))
        normals /= np.linalg.norm(normals, axis=1)[:, None]
        apart.tear(points[apart.origin], torn, np.full(80, -1), normals, seed=(seed, step), most=50)
    order = np.argsort(apart.origin, kind="stable")
    old, placed = apart.origin[order], np.argsort(order)[apart.cells]
    body = (whole.order[old] >= n).astype(int)
    piece = label_pieces(placed, len(old))[2]
    return whole, placed, old, body, *regroup(placed, body, piece, whole.levels)


def parts(cells: np.ndarray, chosen: np.ndarray) -> np.ndarray:
    """Nodes in each set of the chosen ones (n,) that hangs together."""
    edges = cells[:, [0, 0, 0, 1, 1, 2, 1, 2, 3, 2, 3, 3]].reshape(len(cells), 2, 6).transpose(0, 2, 1).reshape(-1, 2)
    edges = edges[chosen[edges].all(axis=1)]
    n = len(chosen)
    label = connected_components(sp.coo_matrix((np.ones(len(edges)), edges.T), shape=(n, n)), directed=False)[1]
    return np.bincount(label[chosen], minlength=1)[np.unique(label[chosen])]


@pytest.mark.parametrize("splits", [50, 600, 4000])
def test_an_aggregate_hangs_together_and_has_one_body(splits):
    _whole, cells, _old, body, found, piece_start = split(splits, splits)
    n = len(body)
    assert np.array_equal(np.sort(found.order), np.arange(n))
    label = connected_components(
        sp.coo_matrix((np.ones(cells.size), (np.repeat(cells[:, 0], 4), cells.ravel())), shape=(n, n)), directed=False
    )[1][found.order]
    assert len(piece_start) == label.max() + 2
    assert all(len(set(label[a:b])) == 1 for a, b in itertools.pairwise(piece_start))
    for g in range(found.first[1]):
        chosen = np.zeros(n, dtype=bool)
        chosen[found.order[found.begin[g] : found.end[g]]] = True
        assert len(set(body[chosen])) == 1
        assert len(parts(cells, chosen)) == 1
        assert chosen.sum() < 2 * MOST * SIZE


@pytest.mark.parametrize("splits", [50, 600, 4000])
def test_levels_grow_small_and_belong_to_one_another(splits):
    whole, _cells, old, body, found, _ = split(splits, splits)
    n, counts = len(old), np.diff(found.first)
    assert (np.diff(counts) < 0).all() and counts[-1] <= 12
    assert len(found.begin) == found.count
    assert len(counts) <= whole.levels + 2
    for level, (first, end) in enumerate(zip(found.first[:-1], found.first[1:], strict=True)):
        below = 0 if level == 0 else found.first[level - 1]
        assert found.begin[first] == below
        assert np.array_equal(found.begin[first + 1 : end], found.end[first : end - 1])
        for g in range(first, end):
            offset = 0 if level == 0 else n
            assert (found.parent[offset + found.begin[g] : offset + found.end[g]] == g).all()
    top = np.arange(n)
    for level in range(len(counts)):
        top = found.parent[top if level == 0 else n + top]
    assert all(len(set(body[found.order][top == g])) == 1 for g in np.unique(top))
