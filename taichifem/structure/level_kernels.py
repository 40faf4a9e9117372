"""Which aggregates are next to each other: the loop behind `levels`. Arrays are NumPy's, of 32-bit integers.

Nodes and aggregates are numbered through here, nodes first: aggregate g is item n + g. There are far fewer
aggregates than nodes, so one thread does it all, in one launch.
"""

from taichifem.runtime import ti

_list = ti.types.ndarray(ndim=1)
_table = ti.types.ndarray(ndim=2)


@ti.func
def _merge(
    g: ti.i32,
    off: ti.i32,
    begin: ti.template(),
    end: ti.template(),
    parent: ti.template(),
    first_pair: ti.template(),
    other: ti.template(),
    block: ti.template(),
    slot: ti.template(),
    cursor: ti.template(),
    member_start: ti.template(),
    member: ti.template(),
):
    """The pairs of aggregate g, itself first, and the pairs of its items that add to each, in their order."""
    n, fine = parent.shape[0] - begin.shape[0], first_pair[parent.shape[0] - begin.shape[0]]
    first, last, pair, count = first_pair[off + begin[g]], first_pair[off + end[g]], first_pair[n + g], 0
    for p in range(first, last):
        o, rank = n + parent[other[p]], 0
        while rank < count and other[pair + rank] != o:
            rank += 1
        if rank == count:
            other[pair + rank], cursor[pair + rank] = o, 0
            count += 1
        cursor[pair + rank] = cursor[pair + rank] + 1
        slot[p] = rank
    first_pair[n + g + 1] = pair + count
    total = first
    for q in range(pair, pair + count):
        member_start[q - fine] = total
        total += cursor[q]
        cursor[q] = member_start[q - fine]
    for item in range(off + begin[g], off + end[g]):
        for p in range(first_pair[item], first_pair[item + 1]):
            at = cursor[pair + slot[p]]
            member[at, 0], member[at, 1] = item - off, block[p]
            cursor[pair + slot[p]] = at + 1


@ti.kernel
def stack(
    level_first: _list,
    begin: _list,
    end: _list,
    parent: _list,
    first_pair: _list,
    other: _list,
    block: _list,
    row_start: _list,
    column: _list,
    pair: _table,
    member_start: _list,
    member: _table,
    slot: _list,
    cursor: _list,
    lower: _list,
    at: _list,
):
    """All levels: pairs to the ends of first_pair, other and block; see `Levels` for what else is written.

    lower, at (aggregates,), zero: neighbours with smaller numbers, and how many of them have their blocks.
    slot, cursor: scratch, an entry for each pair.
    """
    ti.loop_config(serialize=True)
    for level in range(level_first.shape[0] - 1):
        n, begins, ends = parent.shape[0] - begin.shape[0], level_first[level], level_first[level + 1]
        fine = first_pair[n]
        for g in range(begins, ends):
            off = 0 if level == 0 else n
            _merge(g, off, begin, end, parent, first_pair, other, block, slot, cursor, member_start, member)
        for g in range(begins, ends):
            for q in range(first_pair[n + g] + 1, first_pair[n + g + 1]):
                lower[other[q] - n] = lower[other[q] - n] + 1
        for g in range(begins, ends):
            width = 2 * (first_pair[n + g + 1] - first_pair[n + g] + lower[g])
            row = n + 2 * g
            row_start[row + 1], row_start[row + 2] = row_start[row] + width, row_start[row] + 2 * width
        for g in range(begins, ends):
            for q in range(first_pair[n + g], first_pair[n + g + 1]):
                o = other[q] - n
                here = row_start[n + 2 * g] + 2 * (lower[g] + q - first_pair[n + g])
                there = here
                if o != g:
                    there = row_start[n + 2 * o] + 2 * at[o]
                    at[o] = at[o] + 1
                block[q] = here
                pair[q - fine, 0], pair[q - fine, 1], pair[q - fine, 2], pair[q - fine, 3] = g, o, here, there
                for k in range(2):
                    place = here + k * (row_start[n + 2 * g + 1] - row_start[n + 2 * g])
                    column[place], column[place + 1] = n + 2 * o, n + 2 * o + 1
                    place = there + k * (row_start[n + 2 * o + 1] - row_start[n + 2 * o])
                    column[place], column[place + 1] = n + 2 * g, n + 2 * g + 1
