"""Contact forces by an active set: Coulomb's law to round-off, and how it goes on where sweeps stop."""

import numpy as np
import pytest

from taichifem import runtime
from taichifem.reduced.active_set import balanced_forces
from taichifem.reduced.contact import contact_forces


@pytest.fixture(scope="module", autouse=True)
def taichi():
    runtime.start()


def crowded(seed, points=12):
    """Points that lie close together on a half space (Boussinesq's 1 / r), pressed in and pushed aside."""
    rng = np.random.default_rng(seed)
    places = rng.uniform(0, 0.1, (points, 3))
    apart = np.linalg.norm(places[:, None] - places[None], axis=2) + 0.01
    answer = np.einsum("ij,ab->iajb", 1 / apart, np.diag([1.0, 1.3, 1.3])).reshape(3 * points, -1)
    end = 0.01 * rng.normal(size=(points, 3)) + (-0.01, 0.01, 0.0)
    return answer, end


@pytest.mark.parametrize("seed", range(8))
@pytest.mark.parametrize("friction", [0.0, 0.3])
def test_forces_follow_the_laws_of_contact(seed, friction):
    answer, end = crowded(seed)
    mu = np.full(len(end), friction)
    forces = balanced_forces(answer, end, mu, np.zeros_like(end))
    reached = end + (answer @ forces.ravel()).reshape(-1, 3)
    size, far = forces[:, 0].max(), np.abs(end).max()
    side, slip = np.linalg.norm(forces[:, 1:], axis=1), np.linalg.norm(reached[:, 1:], axis=1)
    touches = forces[:, 0] > 0
    assert 1 < touches.sum() < len(end)
    assert forces[:, 0].min() >= -1e-5 * size and reached[:, 0].min() > -1e-4 * far
    assert np.abs(reached[touches, 0]).max() < 1e-4 * far
    assert (side <= mu * forces[:, 0] + 1e-4 * size).all()
    slides = touches & (slip > 1e-3 * far) & (friction > 0)
    np.testing.assert_allclose(side[slides], mu[slides] * forces[slides, 0], atol=1e-4 * size)
    against = (forces[slides, 1:] * reached[slides, 1:]).sum(axis=1)
    np.testing.assert_allclose(against, -side[slides] * slip[slides], atol=1e-3 * size * far)


def test_sweeps_are_left_behind_where_points_lie_close():
    """The same system: gaps that sweeps leave open, and that the active set closes."""
    answer, end = crowded(3)
    mu = np.zeros(len(end))

    def left(forces):
        reached = end + (answer @ forces.ravel()).reshape(-1, 3)
        return np.abs(reached[forces[:, 0] > 0, 0]).max()

    assert left(balanced_forces(answer, end, mu, np.zeros_like(end))) < 0.01 * left(contact_forces(answer, end, mu))
