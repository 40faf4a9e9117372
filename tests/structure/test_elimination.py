"""The order of elimination, and the blocks that it fills."""

import numpy as np
import pytest

from taichifem.mesh import TetMesh
from taichifem.structure import elimination
from taichifem.structure.aggregates import aggregate
from taichifem.structure.elimination import plan_elimination
from taichifem.structure.levels import stack_levels
from taichifem.structure.pattern import block_pattern


def planned(copies: int = 1, cells=(16, 6, 6), size=(1.0, 0.4, 0.4)):
    """Bars side by side that have nothing to do with one another: their aggregates, levels and elimination."""
    mesh = TetMesh.bar(size=size, cells=cells)
    n, points = len(mesh.points), np.concatenate([mesh.points + np.array([0, k, 0]) for k in range(copies)])
    found = aggregate(points, n * np.arange(copies + 1))
    number = np.argsort(found.order)
    corners = number[np.concatenate([mesh.cells + n * k for k in range(copies)])].astype(np.int32)
    pattern = block_pattern(corners, len(points))
    levels = stack_levels(pattern, found)
    return found, levels, plan_elimination(pattern, levels, found)


def links(levels, found, level: int) -> np.ndarray:
    """Which aggregates of a level are neighbours (k,k), and where their blocks stand, or -1."""
    first, count = found.first[level - 1], found.first[level] - found.first[level - 1]
    block = np.full((count, count), -1)
    for g, o, at, mirror in levels.pair[levels.first_pair[level - 1] : levels.first_pair[level]]:
        block[g - first, o - first], block[o - first, g - first] = at, mirror
    return block


@pytest.mark.parametrize("copies", [1, 3])
def test_the_factor_has_just_the_blocks_that_elimination_fills(copies):
    found, levels, plan = planned(copies)
    first, count = found.first[plan.level - 1], len(plan.order)
    assert sorted(plan.order - first) == list(range(count))
    block = links(levels, found, plan.level)[np.ix_(plan.order - first, plan.order - first)]
    filled = block >= 0
    for k in range(count):
        below = np.flatnonzero(filled[k + 1 :, k]) + k + 1
        assert np.array_equal(plan.row[plan.start[k] : plan.start[k + 1]], below)
        assert np.array_equal(plan.source[plan.start[k] : plan.start[k + 1]], block[below, k])
        filled[np.ix_(below, below)] = True
    assert plan.start[-1] > np.count_nonzero(np.tril(block >= 0, -1)), "some of it is filled"
    for begin, end in zip(plan.part[:-1], plan.part[1:], strict=True):
        assert not filled[begin:end, :begin].any() and not filled[begin:end, end:].any()
    assert (plan.part[0], plan.part[-1]) == (0, count) and (len(plan.part) > 2) == (copies > 1)


def test_what_hangs_together_in_a_chain_fills_nothing():
    _, levels, plan = planned(cells=(90, 2, 2), size=(9.0, 0.2, 0.2))
    pairs = levels.pair[levels.first_pair[plan.level - 1] : levels.first_pair[plan.level]]
    assert plan.start[-1] == np.count_nonzero(pairs[:, 0] != pairs[:, 1]) == len(plan.order) - 1
    assert (plan.source[: plan.start[-1]] >= 0).all()


def test_levels_that_would_take_too_long_are_not_eliminated(monkeypatch):
    found, _, first = planned()
    assert first.level == 1 and found.levels == 2
    monkeypatch.setattr(elimination, "most_changes", lambda blocks: first.start[-1])
    assert planned()[2].level == 2
    monkeypatch.setattr(elimination, "LARGEST", 3)
    _, _, last = planned()
    assert last.level == 2 and last.start[-1] == 0, "as if none had a neighbour"
    assert np.array_equal(last.order, np.arange(found.first[1], found.first[2]))
