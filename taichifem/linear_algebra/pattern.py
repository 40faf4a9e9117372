"""Which blocks of the stiffness matrix exist, and which elements add to each. NumPy only."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class BlockPattern:
    """Symmetric block matrix of n nodes, rows compressed, columns increasing.

    row_start (n+1,), column (blocks,): the whole matrix by rows.
    pair_start (pairs+1,), pair_entry: the elements that add to each pair i <= j, as
        element * 16 + a * 4 + b with local nodes a (row i) and b (column j). Gathering them in this order
        makes sums repeat bit for bit.
    upper, lower (pairs,): where block (i, j) and block (j, i) stand; equal on the diagonal.
    diagonal (n,): where block (i, i) stands.
    incident_start (n+1,), incident: the element corners at each node, as element * 4 + a.
    """

    row_start: np.ndarray
    column: np.ndarray
    pair_start: np.ndarray
    pair_entry: np.ndarray
    upper: np.ndarray
    lower: np.ndarray
    diagonal: np.ndarray
    incident_start: np.ndarray
    incident: np.ndarray

    @property
    def n_nodes(self) -> int:
        return len(self.row_start) - 1

    @property
    def n_blocks(self) -> int:
        return len(self.column)

    @property
    def n_pairs(self) -> int:
        return len(self.upper)


def _starts(sorted_ids: np.ndarray, count: int) -> np.ndarray:
    """First position of each id 0..count in a sorted array, and its end."""
    return np.searchsorted(sorted_ids, np.arange(count + 1)).astype(np.int32)


def block_pattern(cells: np.ndarray, n_nodes: int) -> BlockPattern:
    """Pattern for the cells (m,d+1) of a mesh with `n_nodes` nodes, each of which some cell uses."""
    corners = cells.shape[1]
    element = np.arange(len(cells), dtype=np.int64)
    keys, entries = [], []
    for a in range(corners):
        for b in range(a, corners):
            i, j = cells[:, a].astype(np.int64), cells[:, b].astype(np.int64)
            keys.append(np.minimum(i, j) * n_nodes + np.maximum(i, j))
            entries.append(element * 16 + np.where(i <= j, a * 4 + b, b * 4 + a))
    key, entry = np.concatenate(keys), np.concatenate(entries)
    order = np.lexsort((entry, key))
    key, entry = key[order], entry[order]
    first = np.flatnonzero(np.r_[True, key[1:] != key[:-1]])
    i, j = np.divmod(key[first], n_nodes)

    pairs = np.arange(len(i))
    off = i != j
    row, column, pair = np.r_[i, j[off]], np.r_[j, i[off]], np.r_[pairs, pairs[off] + len(pairs)]
    by_row = np.lexsort((column, row))
    place = np.empty(2 * len(pairs), dtype=np.int64)
    place[pair[by_row]] = np.arange(len(by_row))
    upper = place[: len(pairs)]
    lower = np.where(off, place[len(pairs) :], upper)

    corner = cells.ravel()
    by_node = np.argsort(corner, kind="stable")
    narrow = np.int32
    return BlockPattern(
        row_start=_starts(row[by_row], n_nodes),
        column=column[by_row].astype(narrow),
        pair_start=np.r_[first, len(key)].astype(narrow),
        pair_entry=entry.astype(narrow),
        upper=upper.astype(narrow),
        lower=lower.astype(narrow),
        diagonal=upper[~off].astype(narrow),
        incident_start=_starts(corner[by_node], n_nodes),
        incident=(by_node // corners * 4 + by_node % corners).astype(narrow),
    )
