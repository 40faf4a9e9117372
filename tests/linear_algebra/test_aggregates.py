import numpy as np
import pytest

from taichifem.linear_algebra.aggregates import MOST, SMALLEST, aggregate


@pytest.fixture
def points():
    return np.random.default_rng(0).random((3000, 3)) * (4, 1, 1)


def test_every_node_is_in_one_aggregate_of_its_body(points):
    body_start = np.array([0, 1000, 1010, 3000])
    found = aggregate(points, body_start)
    assert np.array_equal(np.sort(found.node), np.arange(3000))
    assert np.array_equal(found.of[found.node], np.repeat(np.arange(found.count), np.diff(found.start)))
    body = np.searchsorted(body_start, np.arange(3000), side="right")
    assert all(len(set(body[found.of == g])) == 1 for g in range(found.count))


def test_aggregates_are_alike_in_size_and_compact(points):
    found = aggregate(points, np.array([0, 3000]))
    sizes = np.diff(found.start)
    assert sizes.min() >= SMALLEST - 1 and sizes.max() < 2 * sizes.min()
    extent = [np.ptp(points[found.of == g], axis=0).max() for g in range(found.count)]
    assert max(extent) < 0.8


def test_there_are_never_too_many():
    points = np.random.default_rng(0).random((40_000, 3))
    assert aggregate(points, np.array([0, 40_000])).count <= MOST
    assert aggregate(points, np.arange(0, 40_001, 400)).count <= MOST
    assert aggregate(points, np.arange(0, 40_001, 100)).count == 0, "more bodies than aggregates"
