"""The isotropic laws on meshes: forces, tangents, and the way through inversion."""

import numpy as np
import pytest
from motions import random_rotation, rigid_misfit

import taichifem as tf

LAWS = {
    "stvk": tf.Material(model="stvk", youngs=1e5, poisson=0.3),
    "neo-hookean": tf.Material(model="neo-hookean", youngs=1e5, poisson=0.3),
    "invertible": tf.Material(model="invertible", youngs=1e5, poisson=0.3, threshold=0.4),
}
BLOCK = tf.TetMesh.bar(size=(0.6, 0.3, 0.3), cells=(4, 2, 2))


@pytest.fixture(scope="module", params=LAWS)
def simulation(request):
    body = tf.Body(mesh=BLOCK, material=LAWS[request.param])
    return tf.Simulation(tf.Scene(bodies=[body], gravity=(0, 0, 0)), precision="f64")


def deformed(seed: int, amount: float = 0.03) -> np.ndarray:
    rng = np.random.default_rng(seed)
    return (BLOCK.points + amount * rng.normal(size=BLOCK.points.shape)) @ random_rotation(rng).T


def test_forces_and_tangent_are_derivatives(simulation):
    """Force = -dU/dx and K = -df/dx by central differences, for a scrambled mesh with inverted elements."""
    for seed, amount in ((0, 0.02), (1, 0.08)):
        x, d, h = deformed(seed, amount), np.random.default_rng(9).normal(size=BLOCK.points.shape), 1e-6
        simulation.set_positions(x)
        force, product = simulation.elastic_forces(), simulation.stiffness() @ d.ravel()
        simulation.set_positions(x + h * d)
        force_up, energy_up = simulation.elastic_forces(), simulation.elastic_energy()
        simulation.set_positions(x - h * d)
        force_down, energy_down = simulation.elastic_forces(), simulation.elastic_energy()
        assert (energy_up - energy_down) / (2 * h) == pytest.approx(-(force * d).sum(), rel=1e-6)
        slope = (force_down - force_up).ravel() / (2 * h)
        np.testing.assert_allclose(product, slope, atol=1e-6 * np.abs(slope).max())


def test_rigid_motion_gives_no_force(simulation):
    simulation.set_positions(1.2 * BLOCK.points)
    scale = np.abs(simulation.elastic_forces()).max()
    simulation.set_positions(BLOCK.points @ random_rotation(np.random.default_rng(3)).T + 5.0)
    assert np.abs(simulation.elastic_forces()).max() < 1e-10 * scale


def test_small_strains_obey_hooke(simulation):
    """At rest the tangent is that of linear elasticity."""
    simulation.set_positions(BLOCK.points)
    linear = tf.Material(model="linear", youngs=1e5, poisson=0.3)
    other = tf.Simulation(tf.Scene(bodies=[tf.Body(mesh=BLOCK, material=linear)]), precision="f64")
    difference = abs(simulation.stiffness() - other.stiffness()).max()
    assert difference < 1e-9 * abs(other.stiffness()).max()


def test_projected_tangent_is_positive_semi_definite(simulation):
    for seed in range(3):
        simulation.set_positions(0.45 * deformed(seed))
        exact = np.linalg.eigvalsh(simulation.stiffness().toarray())
        projected = np.linalg.eigvalsh(simulation.stiffness(projected=True).toarray())
        assert exact[0] < -1e-2 * exact[-1], "the state is one where it matters"
        assert projected[0] > -1e-9 * projected[-1]


@pytest.mark.slow
def test_mixed_laws_in_one_scene():
    """Each body behaves as it would alone."""
    materials = [*LAWS.values(), tf.Material(youngs=1e5, poisson=0.3)]
    scene = tf.Scene(bodies=[tf.Body(mesh=BLOCK, material=m) for m in materials], gravity=(0, 0, 0))
    together = tf.Simulation(scene, precision="f64")
    x = deformed(5, 0.01)
    together.set_positions(np.tile(x, (len(materials), 1)))
    forces = together.elastic_forces().reshape(len(materials), -1, 3)
    for material, force in zip(materials, forces, strict=True):
        alone = tf.Simulation(tf.Scene(bodies=[tf.Body(mesh=BLOCK, material=material)]), precision="f64")
        alone.set_positions(x)
        np.testing.assert_allclose(alone.elastic_forces(), force, atol=1e-9 * np.abs(force).max())


@pytest.mark.parametrize("model", ["corotational", "invertible", pytest.param("neo-hookean", marks=pytest.mark.slow)])
def test_scrambled_and_flattened_blocks_recover(model):
    """All nodes at random, or squeezed to zero height: the rest shape comes back, without a NaN on the way."""
    material = tf.Material(model=model, youngs=1e5, poisson=0.3, wraps="corotational", stiffness_damping=0.02)
    rng = np.random.default_rng(6)
    for start in (rng.uniform(0, 0.6, size=BLOCK.points.shape), BLOCK.points * [1, 1, 0]):
        simulation = tf.Simulation(tf.Scene(bodies=[tf.Body(mesh=BLOCK, material=material)], gravity=(0, 0, 0)))
        simulation.set_positions(start)
        simulation.advance(seconds=4)
        assert rigid_misfit(BLOCK.points, simulation.positions) < 1e-3


def test_a_law_that_is_new_to_the_scene_is_refused():
    simulation = tf.Simulation(tf.Scene(bodies=[tf.Body(mesh=BLOCK)]))
    with pytest.raises(tf.InputError, match="no 'stvk' material"):
        simulation.set_material(0, LAWS["stvk"])
