"""The block matrices of all levels of the solver behind one another: which blocks there are. NumPy only.

The rows of the nodes come first. An aggregate g has two rows, n + 2 g for its shift and the next one for its turn,
and so four blocks with each neighbour, two in either row.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from taichifem.linear_algebra.aggregates import Aggregates
from taichifem.linear_algebra.pattern import BlockPattern


@dataclass(frozen=True)
class Levels:
    """row_start (rows+1,), column (blocks,): as in `BlockPattern`, of all levels.

    Pairs are neighbouring aggregates g <= o of a level, or g = o.
    first_pair (levels+1,): where those of each level begin.  pair (pairs,4): g, o, and the blocks of their shifts,
        of g with o and of o with g.
    member_start (pairs+1,), member (k,2): the blocks of the level below that add to a pair, as the row's node (or
        aggregate) and the block; of the four of two aggregates, that of the shifts.
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
    # Of the level at hand: item and neighbour of its pairs (numbers of nodes, or of aggregates), and their blocks.
    item, other = np.repeat(np.arange(n), np.diff(pattern.row_start)), pattern.column.astype(np.int64)
    block, below, total = np.arange(pattern.n_blocks), 0, pattern.n_blocks
    starts, columns = [pattern.row_start.astype(np.int64)], [other]
    pairs, sizes, members, own, first_pair = [], [], [], [], [0]
    for level in range(aggregates.levels):
        first, end = aggregates.first[level], aggregates.first[level + 1]
        key, pair = np.unique(parent[below + item] * count + parent[below + other], return_inverse=True)
        g, o = np.divmod(key, count)
        degree = np.bincount(g - first, minlength=end - first)
        # The blocks of each aggregate: `degree` pairs in the row of its shift, then as many in that of its turn.
        begin = np.r_[0, np.cumsum(degree)][g - first]
        shifts = total + 4 * begin + 2 * (np.arange(len(key)) - begin)
        column = np.empty(4 * len(key), dtype=np.int64)
        for row in (shifts - total, shifts - total + 2 * degree[g - first]):
            column[row], column[row + 1] = n + 2 * o, n + 2 * o + 1
        columns.append(column)
        starts.append(total + np.cumsum(np.repeat(2 * degree, 2)))

        upper = np.flatnonzero(g <= o)
        mirror = np.searchsorted(key, o[upper] * count + g[upper])
        pairs.append(np.column_stack([g[upper], o[upper], shifts[upper], shifts[mirror]]))
        own.append(shifts[g == o])
        first_pair.append(first_pair[-1] + len(upper))
        used = g[pair] <= o[pair]
        order = np.argsort(pair[used], kind="stable")
        members.append(np.column_stack([item, block])[used][order])
        sizes.append(np.bincount(pair[used], minlength=len(key))[upper])

        item, other, block, below = g, o, shifts, n
        total += len(column)
    member_start = np.r_[0, np.cumsum(np.concatenate(sizes))]
    stacked = [np.concatenate(a) for a in (starts, columns)]
    stacked += [np.array(first_pair), np.concatenate(pairs), member_start, np.concatenate(members), np.concatenate(own)]
    return Levels(*(array.astype(np.int32) for array in stacked))
