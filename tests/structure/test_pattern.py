import numpy as np
import pytest
import scipy.sparse

from taichifem import TetMesh
from taichifem.structure.aggregates import aggregate
from taichifem.structure.levels import stack_levels
from taichifem.structure.pattern import NODES, block_pattern, piece_starts, pieces_of


@pytest.fixture(scope="module")
def mesh():
    return TetMesh.bar(size=(1, 0.5, 0.5), cells=(12, 8, 8))


@pytest.fixture(scope="module")
def pattern(mesh):
    return block_pattern(mesh.cells, len(mesh.points))


def test_pieces_are_even_and_cover_everything():
    assert [pieces_of(n, NODES) for n in (1, 64, 128, 1000, 10**6)] == [1, 1, 2, 3, 32]
    assert piece_starts(10, 3).tolist() == [0, 4, 7, 10]


def test_every_neighbour_is_stored_once_or_in_both_rows(mesh, pattern):
    """Rebuilt from the blocks, with mirror images of the near ones, the pattern is that of the mesh."""
    n = pattern.n_nodes
    assert pattern.pieces > 1
    row = np.repeat(np.arange(n), np.diff(pattern.row_start))
    near = np.arange(pattern.n_blocks) >= pattern.near[row]
    piece = np.repeat(np.arange(pattern.pieces), np.diff(piece_starts(n, pattern.pieces)))
    assert (piece[row[near]] == piece[pattern.column[near]]).all() and (row[near] < pattern.column[near]).all()
    far = ~near & (row != pattern.column)
    assert (piece[row[far]] != piece[pattern.column[far]]).all()
    rows, columns = np.r_[row, pattern.column[near]], np.r_[pattern.column, row[near]]
    built = scipy.sparse.coo_array((np.ones(len(rows)), (rows, columns)), shape=(n, n)).tocsr()
    pairs = np.concatenate([mesh.cells[:, [a, b]] for a in range(4) for b in range(4)])
    expected = scipy.sparse.coo_array((np.ones(len(pairs)), pairs.T), shape=(n, n)).tocsr()
    assert built.max() == 1 and np.array_equal(built.indices, expected.indices)
    assert near.sum() > 0.25 * pattern.n_blocks


def test_pairs_know_their_blocks(pattern):
    row = np.repeat(np.arange(pattern.n_nodes), np.diff(pattern.row_start))
    i, j = pattern.row, pattern.column[pattern.upper]
    assert (i <= j).all() and np.array_equal(row[pattern.upper], i)
    both = pattern.lower >= 0
    assert np.array_equal(row[pattern.lower[both]], j[both]) and np.array_equal(
        pattern.column[pattern.lower[both]], i[both]
    )
    assert np.array_equal(row[pattern.diagonal], np.arange(pattern.n_nodes))
    assert np.array_equal(pattern.column[pattern.diagonal], np.arange(pattern.n_nodes))


def test_every_pair_adds_to_one_pair_of_the_next_level(mesh):
    found = aggregate(mesh.points, np.array([0, len(mesh.points)]))
    number = np.empty(len(mesh.points), dtype=int)
    number[found.order] = np.arange(len(number))
    pattern = block_pattern(number[mesh.cells], len(number))
    levels = stack_levels(pattern, found)
    assert levels.row_start[-1] == len(levels.column)
    first = slice(0, levels.member_start[levels.first_pair[1]])
    assert np.array_equal(np.sort(levels.member[first, 1]), np.sort(pattern.upper))
    for q in range(levels.first_pair[1]):
        g, o, at, mirror = levels.pair[q]
        assert levels.column[at] == pattern.n_nodes + 2 * o and levels.column[mirror] == pattern.n_nodes + 2 * g
        part = levels.member[levels.member_start[q] : levels.member_start[q + 1]]
        assert (found.parent[part[:, 0]] == g).all() and (found.parent[levels.column[part[:, 1]]] == o).all()
