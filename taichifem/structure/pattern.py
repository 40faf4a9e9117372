"""Which blocks of the stiffness matrix exist, and which elements add to each."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse

from taichifem import runtime
from taichifem.structure import pattern_kernels as kernels

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
    Pairs are neighbours i <= j, those of each i behind one another, (i, i) first.
    first_pair (n+1,): where those of each i begin.  other, upper, lower (pairs,): j of each, and where block (i, j)
        and block (j, i) stand; equal on the diagonal, and -1 where (j, i) is not stored.
    pair_start (pairs+1,), pair_entry: the elements that add to each pair, as
        element * 16 + a * 4 + b with local nodes a (row i) and b (column j). Gathering them in this order
        makes sums repeat bit for bit.
    diagonal (n,): where block (i, i) stands.
    pieces: how many.
    """

    row_start: np.ndarray
    column: np.ndarray
    near: np.ndarray
    first_pair: np.ndarray
    pair_start: np.ndarray
    pair_entry: np.ndarray
    other: np.ndarray
    upper: np.ndarray
    lower: np.ndarray
    diagonal: np.ndarray
    pieces: int

    @property
    def row(self) -> np.ndarray:
        """i of each pair (pairs,)."""
        return np.repeat(np.arange(self.n_nodes, dtype=np.int32), np.diff(self.first_pair))

    @property
    def n_nodes(self) -> int:
        return len(self.row_start) - 1

    @property
    def n_blocks(self) -> int:
        return len(self.column)

    @property
    def n_pairs(self) -> int:
        return len(self.upper)


def block_pattern(cells: np.ndarray, n_nodes: int) -> BlockPattern:
    """Pattern for the cells (m,d+1) of a mesh with `n_nodes` nodes, each of which some cell uses."""
    runtime.start()
    corners, size, n, of = cells.shape[1], cells.size, n_nodes, np.int32
    flat = np.ascontiguousarray(cells, dtype=of).ravel()
    pieces = pieces_of(n, NODES)
    piece = np.repeat(np.arange(pieces, dtype=of), np.diff(piece_starts(n, pieces)))
    start, incident = corners_at(cells, n)
    j_of, adding, slot = (np.empty(corners * size, dtype=of) for _ in range(3))
    pairs, entries, lower_far, far = (np.zeros(n, dtype=of) for _ in range(4))
    kernels.find_pairs(corners, flat, start, incident, j_of, adding, slot, pairs, entries)
    kernels.count_blocks(corners, start, piece, j_of, pairs, lower_far, far)
    # Blocks of a row: those of its pairs, and of far neighbours with smaller numbers.
    row_start, first_pair = starts_of(pairs + lower_far), starts_of(pairs)
    near, n_pairs = row_start[:-1] + 1 + far, int(first_pair[-1])
    first_entry = starts_of(entries)
    pair_start, other, upper, lower = (np.empty(n_pairs + k, dtype=of) for k in (1, 0, 0, 0))
    pair_start[first_pair] = first_entry
    column, pair_entry = np.empty(row_start[-1], dtype=of), np.empty(first_entry[-1], dtype=of)
    kernels.write_rows(
        corners,
        start,
        incident,
        piece,
        j_of,
        adding,
        slot,
        lower_far,
        near,
        row_start,
        first_pair,
        pair_start,
        column,
        other,
        upper,
        pair_entry,
    )
    kernels.write_mirrors(piece, row_start, first_pair, other, upper, column, lower, row_start[:-1].copy())
    return BlockPattern(
        row_start=row_start,
        column=column,
        near=near,
        first_pair=first_pair,
        pair_start=pair_start,
        pair_entry=pair_entry,
        other=other,
        upper=upper,
        lower=lower,
        diagonal=upper[first_pair[:-1]],
        pieces=pieces,
    )


def corners_at(cells: np.ndarray, n_nodes: int) -> tuple[np.ndarray, np.ndarray]:
    """Where the corners at each node begin (n+1,), and which they are, as element * 4 + a, in their order."""
    runtime.start()
    flat = np.ascontiguousarray(cells, dtype=np.int32).ravel()
    start, incident = np.zeros(n_nodes + 1, dtype=np.int32), np.empty(len(flat), dtype=np.int32)
    kernels.list_corners(cells.shape[1], flat, start, incident)
    return start, incident


def starts_of(sizes: np.ndarray) -> np.ndarray:
    """Where each part of a list begins, and the last one ends, from their sizes."""
    starts = np.zeros(len(sizes) + 1, dtype=np.int32)
    np.cumsum(sizes, out=starts[1:])
    return starts


def order_of(numbers: np.ndarray) -> np.ndarray:
    """Places of whole numbers (n,) from 0 up in their order; equal ones stay as they are."""
    # NumPy sorts 16 bits by their digits: six times as fast.
    return np.argsort(numbers.astype(np.uint16) if numbers.max(initial=0) < 1 << 16 else numbers, kind="stable")


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
