"""Which blocks of the stiffness matrix exist, and which elements add to each. NumPy and SciPy only."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse

PIECES = 32
"""Pieces that work on nodes or rows is cut into, at most."""

NODES = 256
"""Nodes of a piece, about, as long as there are few: smaller ones would store more blocks twice."""


def pieces_of(items: int, size: int) -> int:
    """Into how many pieces of about `size`, and at least two of them, so many items are cut for the threads."""
    return min(PIECES, max(1, min(2, items // 64), items // size))


def piece_starts(items: int, pieces: int) -> np.ndarray:
    """Where the pieces begin, and the last one ends (pieces+1,): as even as can be, the first ones larger."""
    return np.r_[0, np.cumsum(items // pieces + (np.arange(pieces) < items % pieces))]


@dataclass(frozen=True)
class BlockPattern:
    """Symmetric block matrix of n nodes, whose rows are cut into pieces that threads work on at the same time.

    Within a piece only the blocks on and above the diagonal are stored, which spares nearly half of the memory that a
    product has to read; blocks between two pieces are stored in both rows, so that no piece adds to another's rows.

    row_start (n+1,), column (blocks,): the blocks by rows.  near (n,): where in each row those begin whose mirror image
        is not stored; before them come the others, the one on the diagonal among them.
    pair_start (pairs+1,), pair_entry: the elements that add to each pair i <= j, as
        element * 16 + a * 4 + b with local nodes a (row i) and b (column j). Gathering them in this order
        makes sums repeat bit for bit.
    row, upper, lower (pairs,): i of each pair, and where block (i, j) and block (j, i) stand; equal on the diagonal,
        and -1 where (j, i) is not stored.
    diagonal (n,): where block (i, i) stands.
    incident_start (n+1,), incident: the element corners at each node, as element * 4 + a.
    pieces: how many.
    """

    row_start: np.ndarray
    column: np.ndarray
    near: np.ndarray
    pair_start: np.ndarray
    pair_entry: np.ndarray
    row: np.ndarray
    upper: np.ndarray
    lower: np.ndarray
    diagonal: np.ndarray
    incident_start: np.ndarray
    incident: np.ndarray
    pieces: int

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

    pieces = pieces_of(n_nodes, NODES)
    piece = np.repeat(np.arange(pieces), np.diff(piece_starts(n_nodes, pieces)))
    diagonal = i == j
    near = ~diagonal & (piece[i] == piece[j])
    far = ~diagonal & ~near
    pairs = np.arange(len(i))
    row, column, pair = np.r_[i, j[far]], np.r_[j, i[far]], np.r_[pairs, pairs[far] + len(pairs)]
    later = np.r_[near, near[far]]
    by_row = np.lexsort((column, later, row))
    place = np.full(2 * len(pairs), -1, dtype=np.int64)
    place[pair[by_row]] = np.arange(len(by_row))
    upper = place[: len(pairs)]
    lower = np.where(diagonal, upper, place[len(pairs) :])
    row_start = _starts(row[by_row], n_nodes)

    corner = cells.ravel()
    by_node = np.argsort(corner, kind="stable")
    narrow = np.int32
    return BlockPattern(
        row_start=row_start,
        column=column[by_row].astype(narrow),
        near=(row_start[1:] - np.bincount(i[near], minlength=n_nodes)).astype(narrow),
        pair_start=np.r_[first, len(key)].astype(narrow),
        pair_entry=entry.astype(narrow),
        row=i.astype(narrow),
        upper=upper.astype(narrow),
        lower=lower.astype(narrow),
        diagonal=upper[diagonal].astype(narrow),
        incident_start=_starts(corner[by_node], n_nodes),
        incident=(by_node // corners * 4 + by_node % corners).astype(narrow),
        pieces=pieces,
    )


def to_sparse(pattern: BlockPattern, blocks: np.ndarray, order: np.ndarray) -> scipy.sparse.csr_matrix:
    """The whole matrix (3n,3n) from its stored blocks (blocks,3,3), node i of the pattern being node order[i]."""
    off = np.flatnonzero(pattern.lower != pattern.upper)
    row, column, block = order[pattern.row], order[pattern.column[pattern.upper]], blocks[pattern.upper]
    row, column = np.r_[row, column[off]], np.r_[column, row[off]]
    block = np.concatenate([block, block[off].transpose(0, 2, 1)])
    by_row = np.lexsort((column, row))
    start = np.r_[0, np.cumsum(np.bincount(row))]
    n = 3 * pattern.n_nodes
    return scipy.sparse.bsr_matrix((block[by_row], column[by_row], start), shape=(n, n)).tocsr()
