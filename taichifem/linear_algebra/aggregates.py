"""Nodes grouped into aggregates of about equal size, for the coarse space of the solver. NumPy only."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

MOST = 128
"""Aggregates of a scene at most: the coarse matrix has 6 rows for each, and is inverted whole."""

SMALLEST = 40
"""Nodes an aggregate has at least, where a body has as many."""


@dataclass(frozen=True)
class Aggregates:
    """node (n,): the nodes, aggregate by aggregate; start (aggregates+1,): where each begins; of (n,): each node's."""

    node: np.ndarray
    start: np.ndarray
    of: np.ndarray

    @property
    def count(self) -> int:
        return len(self.start) - 1


def aggregate(points: np.ndarray, body_start: np.ndarray) -> Aggregates:
    """Cut every body (nodes body_start[b] .. body_start[b+1]) in halves along its longest side, again and again.

    No aggregates at all where there are more bodies than could have one each.
    """
    n, bodies = len(points), len(body_start) - 1
    of = np.full(n, -1, dtype=np.int32)
    if bodies > MOST:
        return Aggregates(np.zeros(0, np.int32), np.zeros(1, np.int32), of)
    size = max(SMALLEST, n / (MOST - bodies + 1))
    count = 0
    for b in range(bodies):
        nodes = np.arange(body_start[b], body_start[b + 1])
        parts = [(nodes, max(1, int(len(nodes) / size)))]
        while parts:
            nodes, pieces = parts.pop()
            if pieces == 1:
                of[nodes] = count
                count += 1
                continue
            longest = np.argmax(np.ptp(points[nodes], axis=0))
            nodes = nodes[np.argsort(points[nodes, longest], kind="stable")]
            cut = len(nodes) * (pieces // 2) // pieces
            parts += [(nodes[:cut], pieces // 2), (nodes[cut:], pieces - pieces // 2)]
    node = np.argsort(of, kind="stable").astype(np.int32)
    return Aggregates(node, np.searchsorted(of[node], np.arange(count + 1)).astype(np.int32), of)
