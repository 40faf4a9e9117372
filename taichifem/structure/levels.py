"""The block matrices of all levels of the solver behind one another: which blocks there are.

The rows of the nodes come first. An aggregate g has two rows, n + 2 g for its shift and the next one for its turn,
and so four blocks with each neighbour, two in either row.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from taichifem.structure.aggregates import Aggregates
from taichifem.structure.level_kernels import stack
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
    n, count, fine, of = pattern.n_nodes, aggregates.count, pattern.n_pairs, np.int32
    room = fine * aggregates.levels  # no level has more pairs than the one below; what is not used costs nothing
    first_pair, row_start = np.empty(n + count + 1, dtype=of), np.empty(n + 2 * count + 1, dtype=of)
    first_pair[: n + 1], row_start[: n + 1] = pattern.first_pair, pattern.row_start
    other, block, slot, cursor = (np.empty(fine + room, dtype=of) for _ in range(4))
    other[:fine], block[:fine] = pattern.other, pattern.upper
    column = np.empty(pattern.n_blocks + 8 * room, dtype=of)
    column[: pattern.n_blocks] = pattern.column
    pair, member_start, member = np.empty((room, 4), dtype=of), np.empty(room + 1, dtype=of), np.empty((room, 2), of)
    lower, at = np.zeros(count, dtype=of), np.zeros(count, dtype=of)
    a = aggregates
    found = first_pair, other, block, row_start, column, pair, member_start, member
    stack(a.first, a.begin, a.end, a.parent, *found, slot, cursor, lower, at)

    first_of_level = first_pair[n + aggregates.first] - fine
    pairs, members = int(first_of_level[-1]), int(first_pair[n + aggregates.first[-2]])
    member_start[pairs] = members
    return Levels(
        row_start=row_start,
        column=column[: row_start[-1]],
        first_pair=first_of_level,
        pair=pair[:pairs],
        member_start=member_start[: pairs + 1],
        member=member[:members],
        own=block[first_pair[n:-1]],
    )
