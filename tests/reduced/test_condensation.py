"""The condensed body against the whole one; changing what is held against starting again."""

import numpy as np
import pytest
import scipy.sparse.linalg

import taichifem as tf
from taichifem.errors import InputError
from taichifem.reduced.condensation import Condensation


@pytest.fixture(scope="module")
def bar():
    """K, masses, points, surface nodes, and random forces of a bar."""
    mesh = tf.TetMesh.bar(size=(1.0, 0.4, 0.4), cells=(8, 4, 4))
    simulation = tf.Simulation(
        tf.Scene(bodies=[tf.Body(mesh=mesh, material=tf.Material(model="linear"))]), precision="f64"
    )
    forces = np.random.default_rng(0).normal(size=mesh.points.shape)
    return simulation.stiffness(), simulation.masses, mesh.points, np.unique(mesh.surface()), forces


@pytest.fixture(scope="module")
def condensed(bar):
    K, masses, points, skin, _ = bar
    return Condensation(K, points, masses, skin)


@pytest.fixture(scope="module")
def compliance(condensed):
    return condensed.compliance()


def axes_of(nodes):
    return (3 * np.asarray(nodes)[:, None] + np.arange(3)).ravel()


def whole_solution(bar, held, target):
    """Displacement of all nodes with surface nodes `held` at `target`, by a sparse direct solver."""
    K, _, points, _, forces = bar
    axes = axes_of(held)
    free = np.setdiff1d(np.arange(3 * len(points)), axes)
    u = np.zeros(3 * len(points))
    u[axes] = target
    u[free] = scipy.sparse.linalg.spsolve(K[free][:, free].tocsc(), forces.ravel()[free] - K[free][:, axes] @ u[axes])
    return u.reshape(-1, 3)


@pytest.mark.parametrize("seed", [0, 1])
def test_balance_is_that_of_the_whole_body(bar, condensed, compliance, seed):
    """Surface and inner nodes to 1e-10, whatever is held: one matrix for all."""
    _, _, _, skin, forces = bar
    rng = np.random.default_rng(seed)
    held = rng.choice(skin, size=len(skin) // 10, replace=False)
    target = 1e-4 * rng.normal(size=3 * len(held))
    expected = whole_solution(bar, held, target)
    load = condensed.load(forces)
    axes = axes_of(np.searchsorted(skin, held))
    found = compliance.displaced(compliance.matrix @ load, compliance.balance @ load, axes, target)
    size = np.abs(expected).max()
    np.testing.assert_allclose(found.displacement.reshape(-1, 3), expected[skin], rtol=0, atol=1e-10 * size)
    inner = condensed.inner_displacement(found.displacement, forces)
    np.testing.assert_allclose(inner, expected[condensed.inner], rtol=0, atol=1e-10 * size)
    reactions = found.reactions.reshape(-1, 3).sum(axis=0)
    np.testing.assert_allclose(reactions, -forces.sum(axis=0), rtol=1e-8)


def test_what_is_held_for_good_is_held(bar, condensed, compliance):
    _, _, points, skin, forces = bar
    rng = np.random.default_rng(3)
    held = skin[points[skin, 0] < 1e-9]
    more = rng.choice(np.setdiff1d(skin, held), size=8, replace=False)
    target = 1e-4 * rng.normal(size=3 * (len(held) + len(more)))
    base, moved_by, _ = compliance.held_for_good(axes_of(np.searchsorted(skin, held)))
    load = condensed.load(forces)
    free = base.matrix @ load + moved_by @ target[: 3 * len(held)]
    found = base.displaced(free, np.zeros(0), axes_of(np.searchsorted(skin, more)), target[3 * len(held) :])
    expected = whole_solution(bar, np.concatenate([held, more]), target)
    np.testing.assert_allclose(
        found.displacement.reshape(-1, 3), expected[skin], rtol=0, atol=1e-9 * np.abs(expected).max()
    )


def test_rigid_motions_cost_nothing(condensed, compliance):
    stiff = np.abs(condensed.stiffness).max()
    assert np.abs(condensed.stiffness @ condensed.rigid).max() < 1e-10 * stiff
    assert np.abs(compliance.matrix @ compliance.rigid).max() < 1e-10 * np.abs(compliance.matrix).max()


def test_masses_add_up(bar, condensed):
    """A rigid shift carries the whole mass."""
    shift = np.tile([1.0, 0, 0], len(condensed.skin))
    assert shift @ condensed.mass() @ shift == pytest.approx(bar[1].sum(), rel=1e-10)


def test_one_held_node_is_not_enough(compliance):
    with pytest.raises(InputError, match="free to move"):
        compliance.holding(axes_of([3]))
