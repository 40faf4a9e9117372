"""Who is next to whom, row by row: the loops behind `pattern`. Arrays are NumPy's, of 32-bit integers.

Sums are written out: `+=` on an array would be atomic. `cells` is flat, with `corners` numbers an element. The pairs of
a row are kept for a while in scratch arrays, from corners * start[i] on: no row has more.
"""

from taichifem.runtime import ti

_list = ti.types.ndarray(ndim=1)


@ti.kernel
def list_corners(corners: ti.template(), cells: _list, start: _list, incident: _list):
    """start (n+1,), zero: where the corners of each node begin; incident: which, as element * 4 + a, in order."""
    ti.loop_config(serialize=True)
    for c in range(cells.shape[0]):
        start[cells[c]] = start[cells[c]] + 1
    ti.loop_config(serialize=True)
    for _ in range(1):
        total = 0
        for i in range(start.shape[0]):
            total += start[i]
            start[i] = total
    ti.loop_config(serialize=True)
    for k in range(cells.shape[0]):
        c = cells.shape[0] - 1 - k
        at = start[cells[c]] - 1
        start[cells[c]] = at
        incident[at] = c // corners * 4 + c % corners


@ti.kernel
def find_pairs(
    corners: ti.template(),
    cells: _list,
    start: _list,
    incident: _list,
    j_of: _list,
    adding: _list,
    slot: _list,
    pairs: _list,
    entries: _list,
):
    """The pairs i <= j of each node i, itself first, the others as they come.

    j_of, adding: scratch; j of each, and how many elements add to it.  slot (corners of elements, corners): which
    pair of its row each entry adds to, -1 for those of other rows.  pairs, entries (n,): of the row.
    """
    for i in range(pairs.shape[0]):
        begin, end = start[i], start[i + 1]
        first, count, total = corners * begin, 1, 0
        j_of[first], adding[first] = i, 0
        for k in range(begin, end):
            e = incident[k] >> 2
            for b in ti.static(range(corners)):
                j = cells[corners * e + b]
                rank = -1
                if j >= i:
                    rank = 0
                    while rank < count and j_of[first + rank] != j:
                        rank += 1
                    if rank == count:
                        j_of[first + rank], adding[first + rank] = j, 0
                        count += 1
                    adding[first + rank] = adding[first + rank] + 1
                    total += 1
                slot[corners * k + b] = rank
        pairs[i], entries[i] = count, total


@ti.kernel
def count_blocks(
    corners: ti.template(), start: _list, piece: _list, j_of: _list, pairs: _list, lower: _list, far: _list
):
    """far (n,), zero: neighbours in other pieces of each node; lower (n,), zero: those with smaller numbers."""
    ti.loop_config(serialize=True)
    for i in range(pairs.shape[0]):
        first, own = corners * start[i], piece[i]
        for p in range(first + 1, first + pairs[i]):
            if piece[j_of[p]] != own:
                far[i] = far[i] + 1
                far[j_of[p]] = far[j_of[p]] + 1
                lower[j_of[p]] = lower[j_of[p]] + 1


@ti.kernel
def write_rows(
    corners: ti.template(),
    start: _list,
    incident: _list,
    piece: _list,
    j_of: _list,
    adding: _list,
    slot: _list,
    lower: _list,
    near: _list,
    row_start: _list,
    first_pair: _list,
    pair_start: _list,
    column: _list,
    other: _list,
    upper: _list,
    pair_entry: _list,
):
    """Columns of each row: smaller numbers in other pieces (`write_mirrors`), itself, larger ones there, near ones.

    pair_start, for the first pair of each row: where its entries begin; here it is completed. So are other, upper.
    """
    for i in range(piece.shape[0]):
        first, pair, count, own = corners * start[i], first_pair[i], first_pair[i + 1] - first_pair[i], piece[i]
        away, close, entry = row_start[i] + lower[i], near[i], pair_start[pair]
        for r in range(count):
            j = j_of[first + r]
            block = away
            if j != i and piece[j] == own:
                block = close
                close += 1
            else:
                away += 1
            column[block], other[pair + r], upper[pair + r], pair_start[pair + r] = j, j, block, entry
            entry += adding[first + r]
            adding[first + r] = pair_start[pair + r]
        for k in range(start[i], start[i + 1]):
            for b in ti.static(range(corners)):
                rank = slot[corners * k + b]
                if rank >= 0:
                    at = adding[first + rank]
                    pair_entry[at] = (incident[k] << 2) + b
                    adding[first + rank] = at + 1


@ti.kernel
def write_mirrors(
    piece: _list,
    row_start: _list,
    first_pair: _list,
    other: _list,
    upper: _list,
    column: _list,
    lower: _list,
    at: _list,
):
    """lower (pairs,): where block (j, i) of each pair stands, which is written to `column`; see `BlockPattern`.

    at (n,): where the next one of each row goes.
    """
    ti.loop_config(serialize=True)
    for i in range(piece.shape[0]):
        first, own = first_pair[i], piece[i]
        lower[first] = upper[first]
        for p in range(first + 1, first_pair[i + 1]):
            j = other[p]
            lower[p] = -1
            if piece[j] != own:
                lower[p] = at[j]
                column[at[j]] = i
                at[j] = at[j] + 1
