"""Contact forces of linear bodies: single points in closed form, the complementarity conditions, work."""

import numpy as np
import pytest

from taichifem import runtime
from taichifem.reduced.contact import contact_forces, frames_of, stopping_impulses


@pytest.fixture(scope="module", autouse=True)
def taichi():
    runtime.start()


def test_frames_are_right_handed():
    normals = np.random.default_rng(0).normal(size=(20, 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    frames = frames_of(normals)
    np.testing.assert_allclose(frames[:, 0], normals)
    np.testing.assert_allclose(np.linalg.det(frames), 1)


@pytest.mark.parametrize("slip, force", [(0.2, -0.2), (3.0, -0.5)])
def test_a_point_sticks_or_slides(slip, force):
    """Unit compliance: the normal force closes the gap, friction stops the slip or is mu N."""
    found = contact_forces(np.eye(3), np.array([[-1.0, slip, 0.0]]), np.array([0.5]))
    np.testing.assert_allclose(found, [[1.0, force, 0.0]], atol=1e-4)


def test_nothing_pulls():
    assert not contact_forces(np.eye(3), np.array([[0.1, 5.0, 0.0]]), np.array([0.5])).any()


def spread(m: int, rank: int, seed: int):
    rng = np.random.default_rng(seed)
    A = rng.normal(size=(3 * m, rank))
    end = rng.normal(size=(m, 3))
    end[:, 0] = -np.abs(end[:, 0])
    return A @ A.T, end, rng


@pytest.mark.parametrize("seed", range(5))
def test_many_points_without_friction(seed):
    """Nothing penetrates, and what does not touch is not pushed."""
    answer, end, _ = spread(12, 60, seed)
    found = contact_forces(answer, end, np.zeros(12))
    after = (answer @ found.ravel()).reshape(-1, 3) + end
    assert not found[:, 1:].any() and (found[:, 0] >= 0).all()
    assert after[:, 0].min() > -2e-3
    assert np.abs(found[:, 0] * after[:, 0]).max() < 2e-3


@pytest.mark.parametrize("seed", range(5))
def test_contact_does_no_work_of_its_own(seed):
    answer, end, rng = spread(20, 15, seed)
    found = contact_forces(answer, end, rng.uniform(0, 1, size=20))
    after = (answer @ found.ravel()).reshape(-1, 3) + end
    assert (found * after).sum() < 1e-9 * np.abs(found * end).sum()
    impulses = stopping_impulses(answer, end, rng.uniform(0, 1, size=20))
    gained = 0.5 * impulses.ravel() @ answer @ impulses.ravel() + (impulses * end).sum()
    assert gained <= 0
