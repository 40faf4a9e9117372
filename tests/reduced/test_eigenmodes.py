"""Modes against independent solvers, the table of the reference solutions, and the matrix exponential."""

import json

import numpy as np
import pytest
import scipy.linalg

import taichifem as tf
from taichifem.errors import InputError
from taichifem.reduced import modes as modes_module
from taichifem.reduced.modes import lowest_modes
from taichifem.reduced.oscillators import Oscillators
from taichifem.reduced.ritz import quadratic_fields, ritz_modes


def system(mesh: tf.TetMesh, **material):
    """K, masses and points of a body of linear elasticity."""
    body = tf.Body(mesh=mesh, material=tf.Material(model="linear", **material))
    simulation = tf.Simulation(tf.Scene(bodies=[body]), precision="f64")
    return simulation.stiffness(), simulation.masses, simulation.rest_positions


@pytest.fixture(scope="module")
def small():
    return system(tf.TetMesh.bar(size=(0.6, 0.3, 0.3), cells=(3, 2, 2)), youngs=1e5, poisson=0.3)


@pytest.fixture(scope="module")
def bar():
    return system(tf.TetMesh.bar(size=(1.0, 0.2, 0.2), cells=(12, 4, 4)), youngs=1e5, poisson=0.3)


@pytest.mark.parametrize("case", [0, 1])
def test_the_table_of_a_clamped_bar(oracles, case):
    """The lumped column of the reference solutions, to 1e-6 in frequency."""
    table = json.loads((oracles / "modes_bar.json").read_text())["cases"][case]
    data = np.load(oracles / "linear_bar12x3x3.npz")
    mesh = tf.TetMesh(data["X"], data["T"])
    K, masses, points = system(mesh, youngs=table["E"], poisson=table["nu"], density=table["rho"])
    free = np.repeat(points[:, :1] > 1e-9, 3, axis=1)
    found = lowest_modes(K, masses, 10, free=free)
    np.testing.assert_allclose(found.hertz, table["hz_skfem_lumped"], rtol=1e-6)
    np.testing.assert_allclose(found.frequencies**2, table["eigenvalues_rad2_lumped"], rtol=1e-6)
    assert not found.shapes[~free].any()


def test_lanczos_equals_another_eigensolver(bar):
    """LAPACK's generalised one knows nothing of shift, scaling and factorisation."""
    K, masses, points = bar
    assert 3 * len(masses) > modes_module.DENSE, "large enough for Lanczos' method"
    free = np.repeat(points[:, :1] > 1e-9, 3, axis=1)
    axes = np.flatnonzero(free.ravel())
    found = lowest_modes(K, masses, 20, free=free)
    inner = K.tocsr()[axes][:, axes].toarray()
    whole = scipy.linalg.eigh(inner, np.diag(np.repeat(masses, 3)[axes]), eigvals_only=True)
    np.testing.assert_allclose(found.frequencies**2, whole[:20], rtol=1e-6)


def test_free_bodies_have_six_zero_modes(small, bar):
    for K, masses, _ in (small, bar):
        found = lowest_modes(K, masses, 12)
        assert found.rigid == 6
        assert found.frequencies[6] > 1
        flat = found.shapes.reshape(-1, 12)
        np.testing.assert_allclose(flat.T @ (np.repeat(masses, 3)[:, None] * flat), np.eye(12), atol=1e-8)


def test_all_modes_are_the_whole_linear_system(small):
    """Undamped and damped, free and loaded: the matrix exponential to 1e-8."""
    K, masses, _ = small
    n = 3 * len(masses)
    everything = lowest_modes(K, masses, n)
    assert everything.rigid == 6
    U = everything.shapes.reshape(n, n)
    M, rng = np.repeat(masses, 3), np.random.default_rng(1)
    x0, v0, load = 1e-3 * rng.normal(size=n), rng.normal(size=n), rng.normal(size=n)
    for alpha, beta in ((0.0, 0.0), (0.7, 2e-3)):
        modes = Oscillators(everything.frequencies, mass_damping=alpha, stiffness_damping=beta)
        modes.q, modes.v = U.T @ (M * x0), U.T @ (M * v0)
        stiff, dt, steps = K.toarray() / M[:, None], 0.01, 20
        A = np.zeros((2 * n + 1, 2 * n + 1))
        A[:n, n : 2 * n] = np.eye(n)
        A[n : 2 * n, :n], A[n : 2 * n, n : 2 * n] = -stiff, -alpha * np.eye(n) - beta * stiff
        A[n : 2 * n, -1] = load / M
        expected = scipy.linalg.expm(A * dt * steps) @ np.r_[x0, v0, 1.0]
        for _ in range(steps):
            modes.advance(dt, U.T @ load)
        got = np.r_[U @ modes.q, U @ modes.v]
        for part in (slice(0, n), slice(n, 2 * n)):
            error = np.abs(got[part] - expected[:-1][part]).max()
            assert error < 1e-8 * np.abs(expected[:-1][part]).max()


def test_quadratic_fields_bound_the_frequencies_from_above(bar):
    """Of a bar's bending, stretching and twisting modes, few percent; rigid motions are among the fields."""
    K, masses, points = bar
    exact, rough = lowest_modes(K, masses, 9), ritz_modes(K, masses, quadratic_fields(points), 9)
    assert rough.rigid == 6
    assert (rough.frequencies[6:] >= exact.frequencies[6:] - 1e-9).all()
    assert (rough.frequencies[6:] < 1.35 * exact.frequencies[6:]).all()


def test_a_field_that_holds_the_mode_finds_it_exactly(small):
    K, masses, _ = small
    exact = lowest_modes(K, masses, 10)
    found = ritz_modes(K, masses, exact.shapes, 10)
    np.testing.assert_allclose(found.frequencies[6:], exact.frequencies[6:], rtol=1e-9)


def test_pinned_quadratic_fields_stay_pinned(bar):
    K, masses, points = bar
    free = np.repeat(points[:, :1] > 1e-9, 3, axis=1)
    found = ritz_modes(K, masses, quadratic_fields(points), 6, free=free)
    assert np.abs(found.shapes[~free]).max() < 1e-8 * np.abs(found.shapes).max()
    exact = lowest_modes(K, masses, 6, free=free)
    assert (found.frequencies >= exact.frequencies).all()
    with pytest.raises(InputError, match='basis "quadratic" has'):
        ritz_modes(K, masses, quadratic_fields(points), 20, free=free)


def test_more_modes_than_degrees_of_freedom(small):
    K, masses, _ = small
    with pytest.raises(InputError, match="degrees of freedom"):
        lowest_modes(K, masses, 3 * len(masses) + 1)
