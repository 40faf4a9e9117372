import numpy as np
import pytest

from taichifem.structure.aggregates import SIZE, TOP, aggregate


@pytest.fixture
def points():
    return np.random.default_rng(0).random((3000, 3)) * (4, 1, 1)


def ranges(found, level):
    """The nodes of each aggregate of a level, as numbers in the new order."""
    begin, end = found.begin, found.end
    for g in range(found.first[level - 1], found.first[level]):
        first, last = begin[g], end[g] - 1
        for _ in range(level - 1):
            first, last = begin[first], end[last] - 1
        yield first, last + 1


@pytest.mark.parametrize("cuts", [[3000], [1000, 1010, 3000], list(range(100, 3001, 100))])
def test_every_level_covers_every_node_once_and_no_aggregate_has_two_bodies(points, cuts):
    body_start = np.array([0, *cuts])
    found = aggregate(points, body_start)
    assert np.array_equal(np.sort(found.order), np.arange(3000))
    body = np.searchsorted(body_start, found.order, side="right")
    for level in range(1, found.levels + 1):
        spans = list(ranges(found, level))
        assert [a for a, _ in spans] == [0, *(b for _, b in spans[:-1])] and spans[-1][1] == 3000
        assert all(len(set(body[a:b])) == 1 for a, b in spans)


def test_parents_are_the_ranges_read_backwards(points):
    found = aggregate(points, np.array([0, 3000]))
    for g in range(found.count):
        below = 0 if g < found.first[1] else 3000
        assert (found.parent[below + found.begin[g] : below + found.end[g]] == g).all()
    assert (found.parent[3000 + found.first[-2] :] == -1).all()


def test_aggregates_are_alike_in_size_and_compact(points):
    found = aggregate(points, np.array([0, 3000]))
    spans = list(ranges(found, 1))
    sizes = [b - a for a, b in spans]
    assert min(sizes) >= SIZE / 2 and max(sizes) <= 2 * SIZE
    assert max(np.ptp(points[found.order[a:b]], axis=0).max() for a, b in spans) < 0.8


@pytest.mark.parametrize("bodies", [1, 3, 10])
def test_the_last_level_is_small(bodies):
    points = np.random.default_rng(0).random((40_000, 3))
    found = aggregate(points, np.linspace(0, 40_000, bodies + 1).astype(int))
    assert bodies <= np.diff(found.first)[-1] <= TOP + 1


def test_of_many_bodies_each_is_one_aggregate_in_the_end():
    points = np.random.default_rng(0).random((40_000, 3))
    found = aggregate(points, np.arange(0, 40_001, 400))
    assert np.diff(found.first)[-1] == 100
