"""Planar bodies: plane strain is space with the stretch across the plane held at 1."""

import numpy as np
import pytest
from mechanics import direction, turned
from motions import rigid_misfit

import taichifem as tf

SHEET = tf.TriMesh.rectangle(size=(0.6, 0.3), cells=(6, 3))
THICKNESS = 0.2
MODULI = {"youngs": 1e5, "poisson": 0.3}
LAWS = {
    "linear": tf.Material(model="linear", **MODULI),
    "corotational": tf.Material(**MODULI),
    "stvk": tf.Material(model="stvk", **MODULI),
    "neo-hookean": tf.Material(model="neo-hookean", **MODULI),
    "invertible": tf.Material(model="invertible", wraps="neo-hookean", **MODULI),
}


def layer() -> tf.TetMesh:
    """The sheet as one layer of prisms, three tetrahedra each; nodes k and k + n lie behind each other."""
    n, sides = len(SHEET.points), np.sort(SHEET.cells, axis=1)
    x, z = np.tile(SHEET.points, (2, 1)).T
    points = np.column_stack([x, np.repeat([0, THICKNESS], n), z])
    a, b, c = sides.T
    cells = np.stack([(a, b, c, c + n), (a, b, b + n, c + n), (a, a + n, b + n, c + n)]).transpose(2, 0, 1)
    return tf.TetMesh(points, cells.reshape(-1, 4))


def deformation(x: np.ndarray) -> np.ndarray:
    """Deformation gradients (m,2,2) of the sheet at the positions x (n,3)."""
    rest, now = SHEET.points[SHEET.cells], x[SHEET.cells][:, :, [0, 2]]
    edges = (rest[:, 1:] - rest[:, :1]).transpose(0, 2, 1)
    return (now[:, 1:] - now[:, :1]).transpose(0, 2, 1) @ np.linalg.inv(edges)


def simulate(mesh, material=None, *, thickness=THICKNESS, precision="f64", **scene) -> tf.Simulation:
    body = tf.Body(mesh=mesh, material=material or tf.Material(**MODULI), thickness=thickness)
    return tf.Simulation(tf.Scene(bodies=[body], **({"gravity": (0, 0, 0)} | scene)), precision=precision)


@pytest.mark.parametrize(
    "law", [law if law in ("linear", "neo-hookean") else pytest.param(law, marks=pytest.mark.slow) for law in LAWS]
)
def test_a_sheet_is_a_layer_held_at_its_thickness(law):
    """Energy, forces, stress (across the plane too) and von Mises stress, with some elements turned inside out.

    They are turned by stretches above -1: below that, space has a nearer way round, through the third axis.
    """
    flat, solid = simulate(SHEET, LAWS[law]), simulate(layer(), LAWS[law])
    n = len(SHEET.points)
    for scale, amount in ((1.0, 0.01), (0.5, 0.04)):
        x = scale * flat.rest_positions + amount * direction(2, n, 3)
        if scale < 1:
            F = deformation(x)
            inverted = np.linalg.det(F) < 0
            assert inverted.any()
            assert np.linalg.svd(F[inverted], compute_uv=False)[:, 1].max() < 1
        x = x @ turned(2, np.random.default_rng(5)).T
        flat.set_positions(x)
        solid.set_positions(np.concatenate([x, x + np.array([0, THICKNESS, 0])]))
        assert flat.elastic_energy() == pytest.approx(solid.elastic_energy(), rel=1e-10)
        forces = solid.elastic_forces()
        both = (forces[:n] + forces[n:]) * [1, 0, 1]
        np.testing.assert_allclose(flat.elastic_forces(), both, atol=1e-10 * np.abs(both).max())
        expected = solid.cauchy_stress().reshape(len(SHEET.cells), 3, 3, 3)
        got = flat.cauchy_stress()
        sizes = np.abs(expected).max(axis=(1, 2, 3), keepdims=True)
        np.testing.assert_allclose((got[:, None] - expected) / sizes, 0, atol=1e-9)
        assert np.abs(got[:, 1, 1]).min() > 0
        mises = solid.von_mises().reshape(-1, 3)
        np.testing.assert_allclose(flat.von_mises(), mises[:, 0], rtol=1e-8)


def test_forces_and_masses_grow_with_thickness_and_scale():
    thin, thick = (simulate(SHEET, tf.Material(density=700, **MODULI), thickness=t) for t in (0.1, 0.3))
    x = thin.rest_positions + 0.02 * direction(2, len(SHEET.points), 1)
    for simulation in (thin, thick):
        simulation.set_positions(x)
    np.testing.assert_allclose(thick.elastic_forces(), 3 * thin.elastic_forces(), rtol=1e-9, atol=1e-9)
    assert thick.elastic_energy() == pytest.approx(3 * thin.elastic_energy(), rel=1e-12)
    np.testing.assert_allclose(thick.cauchy_stress(), thin.cauchy_stress(), rtol=1e-12)
    assert thick.masses.sum() == pytest.approx(700 * 0.6 * 0.3 * 0.3, rel=1e-12)
    scaled = tf.Body(mesh=SHEET, material=tf.Material(density=700), scale=2.0, thickness=0.1)
    assert tf.Simulation(tf.Scene(bodies=[scaled])).masses.sum() == pytest.approx(700 * 1.2 * 0.6 * 0.1, rel=1e-6)


def test_patch_test():
    """An affine displacement strains every triangle alike, to Hooke's stress of plane strain."""
    simulation = simulate(SHEET, LAWS["linear"])
    x = simulation.rest_positions
    strain = 1e-2 * np.array([[1.0, 0, 0.3], [0, 0, 0], [0.3, 0, -0.5]])
    simulation.set_positions(x + x @ strain.T)
    material = LAWS["linear"]
    sigma = material.lame_lambda * np.trace(strain) * np.eye(3) + 2 * material.shear_modulus * strain
    np.testing.assert_allclose(simulation.cauchy_stress(), np.tile(sigma, (len(SHEET.cells), 1, 1)), atol=1e-8)
    inner = np.setdiff1d(np.arange(len(x)), SHEET.boundary())
    forces = simulation.elastic_forces()
    assert len(inner)
    assert np.abs(forces[inner]).max() < 1e-12 * np.abs(forces).max()


@pytest.mark.parametrize("integrator", ["backward-euler", "symplectic-euler", "newmark"])
def test_nothing_leaves_the_plane(integrator):
    """Also where gravity points out of it; and a planar body flies as a solid one does."""
    body = tf.Body(mesh=SHEET, material=LAWS["corotational"], velocity=(1, 0, 2), spin=(0, 3, 0))
    scene = tf.Scene(bodies=[body], gravity=(1, 5, -9.81), integrator=integrator)
    simulation = tf.Simulation(scene, precision="f64")
    start, mass = np.array(simulation.stats.momentum), simulation.masses.sum()
    simulation.advance(seconds=0.2)
    assert np.abs(simulation.positions[:, 1]).max() == 0
    expected = start + mass * 0.2 * np.array([1, 0, -9.81])
    np.testing.assert_allclose(simulation.stats.momentum, expected, atol=1e-10 * np.linalg.norm(expected))


def test_a_resting_sheet_rests():
    """On a slope that friction holds: 2 s later it lies where it lay, and the ground carries its weight."""
    angle = np.radians(15)
    plane = tf.PlaneCollider(normal=(-np.sin(angle), 0, np.cos(angle)), friction=0.5)
    body = tf.Body(mesh=SHEET, material=LAWS["corotational"], axis=(0, 1, 0), angle=-15)
    simulation = tf.Simulation(tf.Scene(bodies=[body], colliders=[plane]))
    simulation.advance(seconds=3)
    before = simulation.positions
    simulation.advance(seconds=2)
    assert np.abs(simulation.positions - before).max() < 2e-6
    assert (before @ plane.normal).min() > -1e-3


@pytest.mark.parametrize(
    "model", ["corotational", *(pytest.param(m, marks=pytest.mark.slow) for m in ("invertible", "neo-hookean"))]
)
def test_scrambled_and_crushed_sheets_recover(model):
    """All nodes at random, or squeezed to a line: the rest shape comes back in single precision, without a NaN."""
    material = tf.Material(model=model, wraps="corotational", stiffness_damping=0.02, **MODULI)
    rng = np.random.default_rng(6)
    simulation = simulate(SHEET, material, precision="f32")
    rest = simulation.rest_positions
    for start in (rng.uniform(0, 0.6, size=rest.shape) * [1, 0, 1], rest * [1, 0, 0]):
        simulation.set_positions(start)
        simulation.set_velocities(np.zeros_like(start))
        simulation.advance(seconds=4)
        assert rigid_misfit(rest, simulation.positions) < 1e-3
