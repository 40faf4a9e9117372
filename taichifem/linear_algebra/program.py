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

ROWS, PARENTS = 16, 8
"""Aggregates that make a piece of work worth sharing out: their rows, or the gathering from those below."""


def write_program(pattern: BlockPattern, aggregates: Aggregates, *, solver: str) -> np.ndarray:
    """The operations (k,3) of a round: kind, level, pieces.  solver: "multilevel" or "block-jacobi"."""
    n, fine = pattern.n_nodes, pattern.pieces
    counts = [n, *np.diff(aggregates.first).tolist()]
    last = aggregates.levels
    whole = 6 * counts[last] <= DENSE

    def visit(level: int) -> list[tuple[int, int, int]]:
        """Improve the solution of a level, whose first smoothing is done, by way of those above."""
        if level == last:
            return [(LAST, last, 1)]
        # Twice, where what is above is not solved exactly: one visit leaves too much of long waves.
        visits = 1 if level == 0 or (level + 1 == last and whole) else 2
        items = fine if level == 0 else pieces_of(counts[level], ROWS)
        leave, up = (LEAVE, level, items), pieces_of(counts[level + 1], PARENTS)
        listing = []
        for _ in range(visits):
            listing += [leave, (RESTRICT, level + 1, up), *visit(level + 1), (CORRECT, level, items)]
        return [*listing, leave, (SMOOTH, level, items)]

    cycle = visit(0) if solver == "multilevel" else [(PLAIN, 0, fine)]
    rounds = [(ADVANCE, 0, fine), *cycle, (DIRECT, 0, fine), (PRODUCT, 0, fine)]
    return np.array(rounds, dtype=np.int32)
