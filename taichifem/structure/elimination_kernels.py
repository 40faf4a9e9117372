"""The loop behind `elimination`. Arrays are NumPy's, of 32-bit integers; one thread does it all, in one launch."""

from taichifem.runtime import ti

_list = ti.types.ndarray(ndim=1)
_table = ti.types.ndarray(ndim=2)


@ti.kernel
def eliminate(
    first: ti.i32,
    pair: _table,
    most: ti.i32,
    home: _list,
    pairs: _list,
    by_home: _list,
    local: _list,
    order: _list,
    linked: _list,
    degree: _list,
    start: _list,
    row: _list,
    source: _list,
    found: _list,
):
    """Eliminate what has fewest neighbours left, again and again: then those are neighbours of one another.

    Aggregates of the level are numbered from `first` in `pair` (k,4), which is as in `Levels`, and from 0 elsewhere.
    home (homes+1,): where those that hang together begin in `by_home` (count,).  pairs (count+1,): where those of each
    aggregate begin, that with itself first.
    local (count,): the place of each in its home at first, then in the order.  linked, degree: scratch.
    order, start, row, source: as in `Elimination`.
    found (1,): how many blocks L has, or -1 if more than `most` would be changed.
    """
    ti.loop_config(serialize=True)
    for _ in range(1):
        blocks, changes, column = 0, 0, 0
        start[0] = 0
        for h in range(home.shape[0] - 1):
            begin, size = home[h], home[h + 1] - home[h]
            for k in range(size):
                degree[k] = 0
            for k in range(size * size):
                linked[k] = 0
            for a in range(size):
                g = by_home[begin + a]
                for q in range(pairs[g] + 1, pairs[g + 1]):
                    b = local[pair[q, 1] - first]
                    linked[a * size + b], linked[b * size + a] = 1, 1
                    degree[a], degree[b] = degree[a] + 1, degree[b] + 1
            for _turn in range(size):
                best = -1
                for k in range(size):
                    if degree[k] >= 0 and (best < 0 or degree[k] < degree[best]):
                        best = k
                begins, left = blocks, degree[best]
                changes += left * (left + 1) // 2
                if changes <= most:
                    for k in range(size):
                        if linked[best * size + k] == 1 and degree[k] >= 0:
                            row[blocks] = k
                            blocks += 1
                            degree[k] = degree[k] - 1
                    for p in range(begins, blocks):
                        for q in range(begins, p):
                            one, other = row[p], row[q]
                            if linked[one * size + other] == 0:
                                linked[one * size + other], linked[other * size + one] = 1, 1
                                degree[one], degree[other] = degree[one] + 1, degree[other] + 1
                    # Until places are known, rows are aggregates.
                    for p in range(begins, blocks):
                        row[p] = by_home[begin + row[p]]
                degree[best] = -1
                order[column] = by_home[begin + best]
                column += 1
                start[column] = blocks
        found[0] = blocks if changes <= most else -1
        if changes <= most:
            for k in range(column):
                local[order[k]] = k
            for k in range(column):
                for p in range(start[k], start[k + 1]):
                    place, at = local[row[p]], p
                    while at > start[k] and row[at - 1] > place:
                        row[at] = row[at - 1]
                        at -= 1
                    row[at] = place
            for p in range(blocks):
                source[p] = -1
            for q in range(pair.shape[0]):
                g, o = pair[q, 0] - first, pair[q, 1] - first
                if g != o:
                    # Of rows of the later one, and columns of the earlier one.
                    late, p = ti.max(local[g], local[o]), start[ti.min(local[g], local[o])]
                    while row[p] != late:
                        p += 1
                    source[p] = pair[q, 3] if local[g] < local[o] else pair[q, 2]
