"""The block matrices of all levels of the solver behind one another: which blocks there are. NumPy only.

The rows of the nodes come first. An aggregate g has two rows, n + 2 g for its shift and the next one for its turn,
and so four blocks with each neighbour, two in either row.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from taichifem.structure.aggregates import Aggregates
from taichifem.structure.pattern import BlockPattern


@dataclass(frozen=True)
class Levels:
    """row_start (rows+1,), column (blocks,): as in `BlockPattern`, of all levels.

    Pairs are neighbouring aggregates g <= o of a level, or g = o.
    first_pair (levels+1,): where those of each level begin.  pair (pairs,4): g, o, and the blocks of their shifts,
        of g with o and of o with g.
    member_start (pairs+1,), member (k,2): the pairs i <= j of the level below that add to a pair, as i and the block;
        of the four blocks of two aggregates, that of the shifts.
    own (aggregates,): the block of each aggregate's shift with itself.
    """

    row_start: np.ndarray
    column: np.ndarray
    first_pair: np.ndarray
    pair: np.ndarray
    member_start: np.ndarray
    member: np.ndarray
    own: np.ndarray


def stack_levels(pattern: BlockPattern, aggregates: Aggregates) -> Levels:
    """Add the Galerkin matrices of the aggregates below the matrix of the nodes."""
    n, count = pattern.n_nodes, aggregates.count
    parent = aggregates.parent.astype(np.int64)
    # Of the level at hand: its pairs i <= j (numbers of nodes, or of aggregates), and their blocks.
    i, block = pattern.row.astype(np.int64), pattern.upper.astype(np.int64)
    j = pattern.column[block].astype(np.int64)
    below, total = 0, pattern.n_blocks
    starts, columns = [pattern.row_start.astype(np.int64)], [pattern.column.astype(np.int64)]
    pairs, sizes, members, own, first_pair = [], [], [], [], [0]
    for level in range(aggregates.levels):
        first, end = aggregates.first[level], aggregates.first[level + 1]
        # Numbers rise with those of the children, so here too g <= o.
        key, pair = np.unique(parent[below + i] * count + parent[below + j], return_inverse=True)
        g, o = np.divmod(key, count)
        off = g != o
        row, column = np.r_[g, o[off]], np.r_[o, g[off]]
        by_row = np.lexsort((column, row))
        degree = np.bincount(row - first, minlength=end - first)
        # The blocks of each aggregate: those of its neighbours in the row of its shift, then in that of its turn.
        begin = np.r_[0, np.cumsum(degree)][row[by_row] - first]
        shifts = np.empty(len(row), dtype=np.int64)
        shifts[by_row] = total + 4 * begin + 2 * (np.arange(len(row)) - begin)
        new = np.empty(4 * len(row), dtype=np.int64)
        for at in (shifts - total, shifts - total + 2 * degree[row - first]):
            new[at], new[at + 1] = n + 2 * column, n + 2 * column + 1
        columns.append(new)
        starts.append(total + np.cumsum(np.repeat(2 * degree, 2)))

        mirror = shifts[: len(key)].copy()
        mirror[off] = shifts[len(key) :]
        pairs.append(np.column_stack([g, o, shifts[: len(key)], mirror]))
        own.append(shifts[: len(key)][~off])
        first_pair.append(first_pair[-1] + len(key))
        members.append(np.column_stack([i, block])[np.argsort(pair, kind="stable")])
        sizes.append(np.bincount(pair, minlength=len(key)))

        i, j, block, below = g, o, shifts[: len(key)], n
        total += len(new)
    member_start = np.r_[0, np.cumsum(np.concatenate(sizes))]
    stacked = [np.concatenate(a) for a in (starts, columns)]
    stacked += [np.array(first_pair), np.concatenate(pairs), member_start, np.concatenate(members), np.concatenate(own)]
    return Levels(*(array.astype(np.int32) for array in stacked))
