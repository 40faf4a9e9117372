"""Gives the world what it has to know of its matrices: a `Plan`, from NumPy to the fields.

It is given anew whenever something splits or meets. One thread copies it all: that takes less than waking others.
"""

from taichifem.linear_algebra.plan import Plan
from taichifem.runtime import ti
from taichifem.structure.aggregates import Aggregates
from taichifem.world import World

_array = ti.types.ndarray


@ti.kernel
def _tell_pattern(
    w: ti.template(),
    pair_start: _array(),
    pair_entry: _array(),
    upper: _array(),
    lower: _array(),
    diagonal: _array(),
):
    ti.loop_config(serialize=ti.static(w.alone(0)))
    for i in range(pair_start.shape[0]):
        w.pair_start[i] = pair_start[i]
    ti.loop_config(serialize=ti.static(w.alone(0)))
    for i in range(pair_entry.shape[0]):
        w.pair_entry[i] = pair_entry[i]
    ti.loop_config(serialize=ti.static(w.alone(0)))
    for i in range(upper.shape[0]):
        w.upper[i] = upper[i]
        w.lower[i] = lower[i]
    ti.loop_config(serialize=ti.static(w.alone(0)))
    for i in range(diagonal.shape[0]):
        w.diagonal[i] = diagonal[i]


@ti.kernel
def _tell_levels(
    w: ti.template(),
    row_start: _array(),
    column: _array(),
    near: _array(),
    parent: _array(),
    begin: _array(),
    end: _array(),
    first: _array(),
    pair: _array(),
    member_start: _array(),
    member: _array(),
    own: _array(),
    operations: _array(),
    eliminated: _array(),
    factor_start: _array(),
    factor_row: _array(),
    factor_source: _array(),
    factor_part: _array(),
):
    ti.loop_config(serialize=ti.static(w.alone(0)))
    for i in range(row_start.shape[0]):
        w.row_start[i] = row_start[i]
        if i + 1 < row_start.shape[0]:
            w.near[i] = near[i] if i < near.shape[0] else row_start[i + 1]
    ti.loop_config(serialize=ti.static(w.alone(0)))
    for i in range(column.shape[0]):
        w.column[i] = column[i]
    ti.loop_config(serialize=ti.static(w.alone(0)))
    for i in range(parent.shape[0]):
        w.parent[i] = parent[i]
    ti.loop_config(serialize=ti.static(w.alone(0)))
    for g in range(begin.shape[0]):
        w.child_begin[g] = begin[g]
        w.child_end[g] = end[g]
    ti.loop_config(serialize=ti.static(w.alone(0)))
    for level in range(first.shape[0]):
        w.level_first[level] = first[level]
    ti.loop_config(serialize=ti.static(w.alone(0)))
    for q in range(pair.shape[0]):
        for a in ti.static(range(4)):
            w.coarse_pair[q][a] = pair[q, a]
    ti.loop_config(serialize=ti.static(w.alone(0)))
    for q in range(member_start.shape[0]):
        w.member_start[q] = member_start[q]
    ti.loop_config(serialize=ti.static(w.alone(0)))
    for k in range(member.shape[0]):
        for a in ti.static(range(2)):
            w.member[k][a] = member[k, a]
    ti.loop_config(serialize=ti.static(w.alone(0)))
    for g in range(own.shape[0]):
        w.own_block[g] = own[g]
    ti.loop_config(serialize=ti.static(w.alone(0)))
    for k in range(operations.shape[0]):
        for a in ti.static(range(3)):
            w.operation[k][a] = operations[k, a]
    ti.loop_config(serialize=ti.static(w.alone(0)))
    for k in range(eliminated.shape[0]):
        w.eliminated[k] = eliminated[k]
        w.factor_start[k] = factor_start[k]
        w.factor_start[k + 1] = factor_start[k + 1]
    ti.loop_config(serialize=ti.static(w.alone(0)))
    for p in range(factor_start[eliminated.shape[0]]):
        w.factor_row[p] = factor_row[p]
        w.factor_source[p] = factor_source[p]
    ti.loop_config(serialize=ti.static(w.alone(0)))
    for c in range(factor_part.shape[0]):
        w.factor_part[c] = factor_part[c]


def tell(w: World, plan: Plan, aggregates: Aggregates) -> None:
    """Which blocks the matrices of all levels have, what adds to them, how one level is eliminated; the operations."""
    p, a, levels, e = plan.pattern, aggregates, plan.levels, plan.elimination
    _tell_pattern(w, p.pair_start, p.pair_entry, p.upper, p.lower, p.diagonal)
    of_levels = levels.pair, levels.member_start, levels.member, levels.own
    of_factors = e.order, e.start, e.row, e.source, e.part
    of_aggregates = a.parent, a.begin, a.end, a.first
    matrices = levels.row_start, levels.column, p.near
    _tell_levels(w, *matrices, *of_aggregates, *of_levels, plan.program.operations, *of_factors)
