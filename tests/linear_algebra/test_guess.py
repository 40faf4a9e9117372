"""Where a solve starts."""

import numpy as np
import pytest

import taichifem as tf
from taichifem import transfer
from taichifem.linear_algebra import crew, guess
from taichifem.linear_algebra.steps import Limits
from taichifem.structure.pattern import to_sparse
from taichifem.world import MEMORY


def _bar(*, tolerance: float = 1e-3, **options) -> tf.Simulation:
    mesh = tf.TetMesh.bar(size=(1, 0.25, 0.25), cells=(12, 3, 3))
    pin = tf.BoxRegion(lower=(-1, -1, -1), upper=(1e-6, 1, 1))
    body = tf.Body(mesh=mesh, material=tf.Material(youngs=1e6, poisson=0.4), pins=[pin])
    return tf.Simulation(tf.Scene(bodies=[body], fps=60, tolerance=tolerance), **options)


def test_the_guess_is_the_best_combination_of_the_past():
    simulation = _bar(precision="f64")
    for _ in range(6):
        simulation.step()
    w, n, pieces = simulation._world, simulation._counts.nodes, simulation._counts.pieces
    random = np.random.default_rng(3)
    past = random.standard_normal((n, 3, MEMORY + 1))
    held = random.standard_normal((n, 3))
    load = random.standard_normal((n, 3))
    with simulation._kernels():
        transfer.write(w, w.past, past)
        transfer.write(w, w.dv, held)
        transfer.write(w, w.load, load)
        crew.run(w, n, simulation._plan.program.operations, Limits(0.0, 1), opening=(0, 1))
        guess.guess(w, n, pieces)
        dv, residual, free = (transfer.read(w, field, n) for field in (w.dv, w.residual, w.free))
        blocks = transfer.read(w, w.block, simulation._plan.pattern.n_blocks)
    assert 0 < free.sum() < free.size
    A = to_sparse(simulation._plan.pattern, blocks, np.arange(n))
    V = (past[..., 1:] * free[..., None]).reshape(3 * n, -1)
    h = ((1 - free) * held).ravel()
    c = np.linalg.solve(V.T @ (A @ V), V.T @ (load.ravel() - A @ h))
    np.testing.assert_allclose(dv.ravel(), h + V @ c, rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(residual.ravel(), free.ravel() * (load.ravel() - A @ (h + V @ c)), rtol=1e-7, atol=1e-8)


@pytest.mark.parametrize("repeated", [0, 1], ids=["nothing", "the same twice"])
def test_a_past_that_says_little_does_no_harm(repeated):
    simulation = _bar()
    simulation.step()
    w, n = simulation._world, simulation._counts.nodes
    past = np.zeros((n, 3, MEMORY + 1))
    past[..., 1 : 1 + 2 * repeated] = 0.1
    with simulation._kernels():
        transfer.write(w, w.past, past)
        guess.guess(w, n, simulation._counts.pieces)
        dv, share = transfer.read(w, w.dv, n), [w.share[k] for k in range(1, MEMORY + 1)]
    assert np.isfinite(dv).all() and np.isfinite(share).all()
    assert np.count_nonzero(share) == repeated


def test_smooth_motion_takes_fewer_iterations_and_ends_the_same():
    simulation, exact = _bar(), _bar(precision="f64", tolerance=1e-9)
    iterations = []
    for _ in range(40):
        simulation.step()
        exact.step()
        iterations.append(simulation.report.iterations)
    assert np.median(iterations[15:]) < 0.6 * iterations[0]
    sag = exact.positions[:, 2].min()
    assert simulation.positions[:, 2].min() == pytest.approx(sag, rel=2e-3)
