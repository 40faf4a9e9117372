"""In which order the aggregates of a level are eliminated, and which blocks that fills: how it is solved directly."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from taichifem.structure.aggregates import Aggregates
from taichifem.structure.elimination_kernels import eliminate
from taichifem.structure.levels import Levels
from taichifem.structure.pattern import BlockPattern, order_of, piece_starts, pieces_of, starts_of
from taichifem.structure.pieces import label_pieces

WORTH = 8
"""Blocks of the matrix of the nodes for each that an elimination changes, at least: otherwise it takes too long."""

LEAST, MOST = 512, 16384
"""Blocks that any elimination may change, whatever the matrix of the nodes; and as many as there is room for."""

LARGEST = 512
"""Aggregates that hang together, at most, where they are eliminated."""

PARTS = 32
"""Aggregates that make a part of the work, about."""


@dataclass(frozen=True)
class Elimination:
    """The factors of a level's matrix, L D L^T: D has a block for each aggregate, L those below it.

    level: which one, from 1.
    order (k,): its aggregates, in the order in which they are eliminated; those that hang together follow one another.
    start (k+1,), row (blocks,): the blocks of L in each column, by columns in that order, and by rows within; rows
        are places in the order.
    source (blocks,): the block of the matrix that stands there, that of the shifts, or -1 where there is none.
        Neither is ever empty: `start` tells what counts.
    part (parts+1,): where parts of the order begin that have nothing to do with one another.
    """

    level: int
    order: np.ndarray
    start: np.ndarray
    row: np.ndarray
    source: np.ndarray
    part: np.ndarray


def most_changes(blocks: int) -> int:
    """Blocks that an elimination may change where the matrix of the nodes has so many; L has no more than that."""
    return min(max(blocks // WORTH, LEAST), MOST)


def plan_elimination(pattern: BlockPattern, levels: Levels, aggregates: Aggregates) -> Elimination:
    """Eliminate the first level of which that is cheap enough.

    Where that is none, the aggregates of the last one are solved as if none had a neighbour.
    """
    most = most_changes(pattern.n_blocks)
    for level in range(1, aggregates.levels + 1):
        found = _eliminate(levels, aggregates, level, most)
        if found is not None:
            return found
    first, count = int(aggregates.first[-2]), int(aggregates.first[-1] - aggregates.first[-2])
    parts = piece_starts(count, pieces_of(count, PARTS)).astype(np.int32)
    empty = np.zeros(1, dtype=np.int32)
    order = np.arange(first, first + count, dtype=np.int32)
    return Elimination(aggregates.levels, order, np.zeros(count + 1, dtype=np.int32), empty, empty, parts)


def _eliminate(levels: Levels, aggregates: Aggregates, level: int, most: int) -> Elimination | None:
    """That of a level, or None if it changes more than `most` blocks."""
    of, first = np.int32, int(aggregates.first[level - 1])
    count = int(aggregates.first[level]) - first
    pairs = levels.pair[levels.first_pair[level - 1] : levels.first_pair[level]]
    if len(pairs) - count > most:
        return None
    pairs = np.ascontiguousarray(pairs)
    # What hangs together, then in which order.
    _, _, home_of = label_pieces(pairs[:, :2] - of(first), count)
    sizes = np.bincount(home_of)
    if sizes.max() > LARGEST:
        return None
    home, by_home = starts_of(sizes), order_of(home_of).astype(of)
    local = np.empty(count, dtype=of)
    local[by_home] = np.arange(count) - np.repeat(home[:-1], sizes)
    begins = np.r_[np.flatnonzero(pairs[:, 0] == pairs[:, 1]), len(pairs)].astype(of)
    linked, degree = np.empty(sizes.max() ** 2, dtype=of), np.empty(sizes.max(), dtype=of)
    order, start, row, source = (np.empty(size, dtype=of) for size in (count, count + 1, most + 1, most + 1))
    found = np.zeros(1, dtype=of)
    eliminate(first, pairs, most, home, begins, by_home, local, order, linked, degree, start, row, source, found)
    blocks = int(found[0])
    if blocks < 0:
        return None
    cuts = piece_starts(count, pieces_of(count, PARTS))
    part = np.unique(home[np.searchsorted(home, cuts)])
    return Elimination(level, order + of(first), start, row[: blocks + 1], source[: blocks + 1], part)
