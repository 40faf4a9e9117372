"""Bodies twisted, flattened and scrambled beyond all measure find their rest shape again, in single precision."""

import numpy as np
import pytest
from mechanics import tear
from motions import rigid_misfit

import taichifem as tf

CUBE = tf.TetMesh.bar(size=(0.4, 0.4, 0.4), cells=(4, 4, 4))
BAR, BALL = tf.TetMesh.bar(size=(0.8, 0.2, 0.2), cells=(8, 2, 2)), tf.TetMesh.sphere(radius=0.2, resolution=2)


def twist(x: np.ndarray) -> np.ndarray:
    """Two whole turns from one end of the bar to the other."""
    angle = 4 * np.pi * x[:, 0] / 0.8
    y, z = x[:, 1] - 0.1, x[:, 2] - 0.1
    cosine, sine = np.cos(angle), np.sin(angle)
    return np.column_stack([x[:, 0], cosine * y - sine * z, sine * y + cosine * z])


def flatten(x: np.ndarray) -> np.ndarray:
    return x * [1, 1, 0]


def scramble(x: np.ndarray) -> np.ndarray:
    return np.random.default_rng(4).uniform(-0.3, 0.3, size=x.shape)


def to_a_point(x: np.ndarray) -> np.ndarray:
    return np.zeros_like(x)


@pytest.mark.parametrize("model", ["corotational", pytest.param("invertible", marks=pytest.mark.slow)])
@pytest.mark.parametrize(
    ("mesh", "change"),
    [(BAR, twist), (BALL, flatten), (BALL, scramble), (BALL, to_a_point)],
    ids=["twisted bar", "flat ball", "scrambled ball", "ball in a point"],
)
def test_the_rest_shape_comes_back(mesh, change, model):
    material = tf.Material(model=model, wraps="corotational", youngs=1e5, poisson=0.3, stiffness_damping=0.01)
    simulation = tf.Simulation(tf.Scene(bodies=[tf.Body(mesh=mesh, material=material)], gravity=(0, 0, 0)))
    simulation.set_positions(change(simulation.rest_positions))
    for _ in range(30):
        simulation.advance(seconds=0.1)
        assert np.isfinite(simulation.positions).all()
    assert rigid_misfit(mesh.points, simulation.positions) < 1e-3


def test_a_body_made_whole_again_forgets_how_its_pieces_met():
    material = tf.Material(youngs=1e6, poisson=0.3, fracture=tf.Fracture(toughness=1e9))
    body = tf.Body(mesh=CUBE, material=material, spin=(0, 90, 0))
    simulation = tf.Simulation(tf.Scene(bodies=[body], gravity=(0, 0, 0)))
    whole, undisturbed = simulation.snapshot(), []
    for _ in range(5):
        simulation.step()
        undisturbed.append(simulation.positions)
    simulation.restore(*whole)
    rng = np.random.default_rng(0)
    for k in range(30):
        tear(simulation, rng.permutation(len(CUBE.cells)), rng.normal(size=3), seed=k)
    outward = simulation.rest_positions - simulation.rest_positions.mean(axis=0)
    for speed in [5.0] * 5 + [-5.0] * 20:  # they have to part before they can meet
        simulation.set_velocities(speed * outward)
        simulation.step()
        if simulation.meetings:
            break
    assert simulation.meetings > 0
    simulation.restore(*whole)
    assert simulation.meetings == 0 and simulation.piece_count == 1
    for there in undisturbed:
        simulation.step()
        np.testing.assert_array_equal(simulation.positions, there)
        assert simulation.report.converged and simulation.meetings == 0
