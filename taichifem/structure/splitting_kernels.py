"""The loop behind `splitting`: one thread walks from element to element. Arrays are NumPy's.

`cells` and `beside` are flat, with `corners` numbers an element.
"""

from taichifem.runtime import ti

ADDED, STAMP, SPLITS, CAPPED = range(4)
"""Counters: how many vertices there are, the last mark used, how many splits, and whether there would be more."""

_list = ti.types.ndarray(ndim=1)


@ti.func
def _hash(a: ti.u32, b: ti.u32, c: ti.u32):
    """A number that looks random: the end of MurmurHash3 (A. Appleby, 2008), three times over."""
    h = ti.cast(0, ti.u32)
    for word in ti.static((a, b, c)):
        h = (h ^ word) * ti.cast(-1640531535, ti.u32)
        h ^= h >> 16
        h *= ti.cast(-2048144789, ti.u32)
        h ^= h >> 13
        h *= ti.cast(-1028477387, ti.u32)
        h ^= h >> 16
    return ti.cast(h >> 2, ti.i32)


@ti.func
def _walk(
    corners: ti.template(),
    cells: ti.template(),
    beside: ti.template(),
    mark: ti.template(),
    queue: ti.template(),
    stamp: ti.i32,
    start: ti.i32,
    vertex: ti.i32,
    first: ti.i32,
):
    """List in `queue`, from `first` on, the elements reached from one across faces at a vertex; where the list ends."""
    mark[start] = stamp
    queue[first] = start
    at, end = first, first + 1
    while at < end:
        e = queue[at]
        at += 1
        for a in range(corners):
            other = beside[corners * e + a]
            if other >= 0 and cells[corners * e + a] != vertex and mark[other] != stamp:
                mark[other] = stamp
                queue[end] = other
                end += 1
    return end


@ti.func
def _plane_parts(
    corners: ti.template(),
    cells: ti.template(),
    where: ti.template(),
    side: ti.template(),
    queue: ti.template(),
    count: ti.i32,
    vertex: ti.i32,
    normal,
):
    """Set `side` of the elements listed, 1 or 0; are there both?"""
    above = 0
    for k in range(count):
        e, height = queue[k], ti.cast(0.0, ti.f64)
        for a in range(corners):
            node = cells[corners * e + a]
            for c in ti.static(range(3)):
                height += normal[c] * (where[node, c] - where[vertex, c])
        side[e] = ti.cast(height > 0, ti.i32)
        above += side[e]
    return above > 0 and above < count


@ti.func
def _open(
    corners: ti.template(),
    cells: ti.template(),
    beside: ti.template(),
    side: ti.template(),
    queue: ti.template(),
    faces: ti.template(),
    touched: ti.template(),
    count: ti.i32,
    vertex: ti.i32,
):
    """Part the two sides of the elements listed; how many faces came open, and how many vertices they have.

    faces: the elements on both sides of each.
    """
    opened, vertices = 0, 0
    for k in range(count):
        e = queue[k]
        for a in range(corners):
            o = beside[corners * e + a]
            if side[e] == 1 and o >= 0 and cells[corners * e + a] != vertex and side[o] == 0:
                beside[corners * e + a] = -1
                for b in range(corners):
                    if beside[corners * o + b] == e:
                        beside[corners * o + b] = -1
                faces[2 * opened], faces[2 * opened + 1] = e, o
                opened += 1
                for b in range(corners):
                    if b != a:
                        node, known = cells[corners * e + b], 0
                        for m in range(vertices):
                            known |= ti.cast(touched[m] == node, ti.i32)
                        if known == 0:
                            touched[vertices] = node
                            vertices += 1
    return opened, vertices


@ti.func
def _has(corners: ti.template(), cells: ti.template(), e: ti.i32, vertex: ti.i32):
    has = 0
    for a in range(corners):
        has |= ti.cast(cells[corners * e + a] == vertex, ti.i32)
    return has


@ti.func
def _part(
    corners: ti.template(),
    cells: ti.template(),
    beside: ti.template(),
    origin: ti.template(),
    parent: ti.template(),
    tips: ti.template(),
    where: ti.template(),
    mark: ti.template(),
    queue: ti.template(),
    faces: ti.template(),
    starts: ti.template(),
    counters: ti.template(),
    opened: ti.i32,
    vertex: ti.i32,
):
    """Give each group of elements around a vertex that no face joins to the largest a copy of it; was it split?"""
    stamp, groups, end = counters[STAMP] + 1, 0, 0
    counters[STAMP] = stamp
    largest = 0
    for k in range(2 * opened):
        e = faces[k]
        if mark[e] != stamp and _has(corners, cells, e, vertex) == 1:
            starts[groups] = end
            end = _walk(corners, cells, beside, mark, queue, stamp, e, vertex, end)
            size = end - starts[groups]
            if groups > 0 and size > starts[largest + 1] - starts[largest]:
                largest = groups
            groups += 1
            starts[groups] = end
    for g in range(groups):
        if g != largest:
            copy = counters[ADDED]
            counters[ADDED] = copy + 1
            origin[copy], parent[copy], tips[copy] = origin[vertex], parent[vertex], 0
            for c in ti.static(range(3)):
                where[copy, c] = where[vertex, c]
            for k in range(starts[g], starts[g + 1]):
                for a in range(corners):
                    if cells[corners * queue[k] + a] == vertex:
                        cells[corners * queue[k] + a] = copy
    return groups > 1


@ti.kernel
def tear(
    corners: ti.template(),
    cells: _list,
    beside: _list,
    origin: _list,
    parent: _list,
    tips: _list,
    where: ti.types.ndarray(ndim=2),
    elements: _list,
    corner: _list,
    normals: ti.types.ndarray(ndim=2),
    waits: _list,
    mark: _list,
    side: _list,
    queue: _list,
    around: _list,
    faces: _list,
    touched: _list,
    starts: _list,
    counters: _list,
    seed: ti.i32,
    step: ti.i32,
    most: ti.i32,
):
    """See `Splitting.tear`. queue, around, faces, touched, starts: scratch."""
    ti.loop_config(serialize=True)
    for t in range(elements.shape[0]):
        e, waiting = elements[t], waits[elements[t]]
        if corner[t] >= 0:
            counters[STAMP] = counters[STAMP] + 1
            vertex = cells[corners * e + corner[t]]
            count = _walk(corners, cells, beside, mark, around, counters[STAMP], e, vertex, 0)
            for k in range(count):
                waiting |= waits[around[k]]
        if waiting == 0 and counters[SPLITS] == most:
            counters[CAPPED] = 1
        if waiting == 0 and counters[CAPPED] == 0:
            normal = ti.Vector([normals[t, 0], normals[t, 1], normals[t, 2]])
            # Where cracks end first, the rest at random.
            tried, done = 0, 0
            for _ in range(corners):
                chosen, least = -1, 0
                for a in range(corners):
                    node = cells[corners * e + a]
                    rank = _hash(ti.cast(seed, ti.u32), ti.cast(step, ti.u32), ti.cast(corners * e + a, ti.u32)) >> 1
                    rank += 0 if tips[node] else 1 << 29
                    wanted = corner[t] < 0 or corner[t] == a
                    if wanted and (tried >> a) & 1 == 0 and (chosen < 0 or rank < least):
                        chosen, least = a, rank
                if chosen >= 0 and done == 0:
                    tried |= 1 << chosen
                    vertex = cells[corners * e + chosen]
                    counters[STAMP] = counters[STAMP] + 1
                    count = _walk(corners, cells, beside, mark, around, counters[STAMP], e, vertex, 0)
                    if _plane_parts(corners, cells, where, side, around, count, vertex, normal):
                        done = 1
                        opened, vertices = _open(corners, cells, beside, side, around, faces, touched, count, vertex)
                        for k in range(vertices):
                            node = touched[k]
                            tips[node] = 1 - ti.cast(
                                _part(
                                    corners,
                                    cells,
                                    beside,
                                    origin,
                                    parent,
                                    tips,
                                    where,
                                    mark,
                                    queue,
                                    faces,
                                    starts,
                                    counters,
                                    opened,
                                    node,
                                ),
                                ti.i32,
                            )
                        for k in range(count):
                            waits[around[k]] = 1
                        counters[SPLITS] = counters[SPLITS] + 1
