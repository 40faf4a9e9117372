"""The coarse space: few iterations whatever the stiffness, and the same answers."""

import numpy as np
import pytest
import scipy.sparse.linalg

import taichifem as tf

SIZE, CELLS = (1.0, 0.25, 0.25), (20, 5, 5)
HELD = tf.BoxRegion(lower=(-1, -1, -1), upper=(1e-6, 1, 1))


def bar(youngs=1e6, poisson=0.4, pins=(HELD,), **body):
    mesh = tf.TetMesh.bar(size=SIZE, cells=CELLS)
    return tf.Body(mesh=mesh, material=tf.Material(youngs=youngs, poisson=poisson), pins=pins, **body)


@pytest.mark.parametrize("youngs", [1e5, 1e6, 1e7, 1e9])
def test_iterations_hardly_grow_with_stiffness(youngs):
    """Block Jacobi alone takes about 50, 110, 120 and 130 here."""
    simulation = tf.Simulation(tf.Scene(bodies=[bar(youngs)]))
    simulation.advance(seconds=0.1)
    assert simulation.report.converged
    assert simulation.report.iterations <= 40


def test_nearly_incompressible_bodies_converge():
    simulation = tf.Simulation(tf.Scene(bodies=[bar(1e6, poisson=0.49)]))
    simulation.advance(seconds=0.1)
    assert simulation.report.converged
    assert simulation.report.iterations <= 100


def test_the_solution_is_that_of_a_direct_solver():
    scene = tf.Scene(bodies=[bar(1e6), bar(1e9, position=(0, 0.5, 0))], tolerance=1e-12)
    simulation = tf.Simulation(scene, precision="f64")
    K, m = simulation.stiffness(), np.repeat(simulation.masses, 3)
    free = (np.repeat(simulation.rest_positions[:, 0], 3) > 1e-6).nonzero()[0]
    A = (scipy.sparse.diags_array(m) + simulation.dt**2 * K).tocsc()[free][:, free]
    gravity = np.tile(scene.gravity, len(simulation.masses))
    expected = scipy.sparse.linalg.spsolve(A, (simulation.dt * m * gravity)[free])
    simulation.step()
    assert simulation.velocities.ravel()[free] == pytest.approx(expected, rel=1e-8, abs=1e-9 * abs(expected).max())


def test_a_tumbling_body_keeps_its_inverse():
    """It turns with the body: no renewal is called for in a whole turn."""
    scene = tf.Scene(bodies=[bar(1e6, pins=(), spin=(0, 5.0, 3.0))], gravity=(0, 0, 0))
    simulation = tf.Simulation(scene)
    simulation.advance(seconds=1.3)
    assert simulation.report.converged
    renewed = simulation._space._solves
    assert renewed >= 60, "the inverse was renewed although the body only turned"


def test_bodies_of_very_different_stiffness_on_the_ground():
    soft = [tf.TetMesh.bar(size=(0.3, 0.3, 0.3), cells=(4, 4, 4))] * 5
    bodies = [
        tf.Body(mesh=mesh, material=tf.Material(youngs=10.0 ** (4 + k)), position=(0.5 * k, 0, 0.05))
        for k, mesh in enumerate(soft)
    ]
    simulation = tf.Simulation(tf.Scene(bodies=bodies, colliders=[tf.PlaneCollider(friction=0.5)]))
    most = 0
    for _ in range(60):
        simulation.step()
        assert simulation.report.converged
        most = max(most, simulation.report.iterations / max(1, simulation.report.contact_passes))
    assert most <= 80
    assert np.isfinite(simulation.positions).all()
