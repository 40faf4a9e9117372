"""A round of conjugate gradients as a list of operations: with a cycle over the levels of the preconditioner.

As the cycle is data, not code, any number of levels and any cycle runs with the same compiled kernel.
"""

from __future__ import annotations

import numpy as np

from taichifem.structure.aggregates import Aggregates
from taichifem.structure.pattern import BlockPattern, pieces_of
from taichifem.world import DENSE

ADVANCE, LEAVE, RESTRICT, CORRECT, SMOOTH, LAST, PLAIN, DIRECT, PRODUCT = range(9)
"""Kinds of operations; see `steps` and `multilevel`."""

PLAIN_ROUND = 4
"""Operations of a round without levels: they end every program."""

FEW = 150
"""Aggregates of a level that is worth a second visit above it."""

ROWS, PARENTS = 16, 8
"""Aggregates that make a piece of work worth sharing out: their rows, or the gathering from those below."""


def most_operations(levels: int) -> int:
    """How many operations a round has at most, with this many levels of aggregates."""
    most = 2
    for _ in range(levels):
        most = 2 * (3 + most) + 2
    return most + 3 + PLAIN_ROUND


def write_program(pattern: BlockPattern, aggregates: Aggregates, *, solver: str, apart: bool) -> np.ndarray:
    """The operations (k,3) of a round: kind, level, pieces; and after them those of a round without levels.

    solver: "multilevel" or "block-jacobi".  apart: has no aggregate of the last level a neighbour?
    """
    n, fine = pattern.n_nodes, pattern.pieces
    counts = [n, *np.diff(aggregates.first).tolist()]
    last = aggregates.levels
    solved = apart or 6 * counts[last] <= DENSE

    def visit(level: int) -> list[tuple[int, int, int]]:
        """Improve the solution of a level, whose first smoothing is done, by way of those above."""
        if level == last:
            items = pieces_of(counts[last], ROWS)
            return [(LAST, last, 1)] if solved else [(LEAVE, last, items), (SMOOTH, last, items)]
        # Twice, where what is above is not solved exactly: one visit leaves too much of long waves. But a level of
        # few aggregates costs as much to wait for as a large one.
        visits = 1 if level == 0 or (level + 1 == last and solved) or counts[level] < FEW else 2
        items = fine if level == 0 else pieces_of(counts[level], ROWS)
        leave, up = (LEAVE, level, items), pieces_of(counts[level + 1], PARENTS)
        listing = []
        for _ in range(visits):
            listing += [leave, (RESTRICT, level + 1, up), *visit(level + 1), (CORRECT, level, items)]
        return [*listing, leave, (SMOOTH, level, items)]

    first, ending = (ADVANCE, 0, fine), [(DIRECT, 0, fine), (PRODUCT, 0, fine)]
    rounds = [first, *visit(0), *ending] if solver == "multilevel" else []
    return np.array([*rounds, first, (PLAIN, 0, fine), *ending], dtype=np.int32)
