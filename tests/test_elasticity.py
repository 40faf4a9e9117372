"""Forces, stiffness and stress against independent codes, and the identities they must obey."""

import json

import numpy as np
import pytest
from motions import random_rotation

import taichifem as tf

MESHES = ("bar12x3x3", "polyfem_bar-651", "bullet_torus")


def relative(got: np.ndarray, expected: np.ndarray) -> float:
    return float(np.abs(got - expected).max() / np.abs(expected).max())


def simulation_of(data, case: int, **scene) -> tf.Simulation:
    material = tf.Material(
        model="linear",
        youngs=float(data["E"][case]),
        poisson=float(data["nu"][case]),
        density=float(data["rho"][case]),
    )
    pins = [tf.IndexRegion(indices=data["fixed"].tolist())]
    body = tf.Body(mesh=tf.TetMesh(data["X"], data["T"]), material=material, pins=pins)
    return tf.Simulation(tf.Scene(bodies=[body], gravity=tuple(data["gravity"]), **scene), precision="f64")


@pytest.mark.parametrize("mesh", MESHES)
@pytest.mark.parametrize("case", range(4))
def test_linear_forces_and_stiffness_match_scikit_fem(oracles, mesh, case):
    data = np.load(oracles / f"linear_{mesh}.npz")
    simulation = simulation_of(data, case)
    stiffness = simulation.stiffness()
    for u, expected in zip(data["U"], data["KU"][case], strict=True):
        simulation.set_positions(data["X"] + u)
        assert relative(-simulation.elastic_forces(), expected) < 1e-12
        assert relative((stiffness @ u.ravel()).reshape(-1, 3), expected) < 1e-12


@pytest.mark.parametrize("mesh", MESHES)
@pytest.mark.parametrize("case", (0, 1))
def test_linear_stress_matches_scikit_fem(oracles, mesh, case):
    data = np.load(oracles / f"linear_{mesh}.npz")
    simulation = simulation_of(data, case)
    simulation.set_positions(data["X"] + data["u_static"][case])
    stress = simulation.cauchy_stress()
    voigt = stress[:, [0, 1, 2, 0, 1, 2], [0, 1, 2, 1, 2, 0]]
    assert relative(voigt, data["stress"][case]) < 1e-9
    assert relative(simulation.von_mises(), data["von_mises"][case]) < 1e-9


@pytest.mark.parametrize("mesh", MESHES)
@pytest.mark.parametrize("case", range(4))
def test_static_displacement_under_gravity(oracles, mesh, case):
    """One backward Euler step of a million seconds leaves no inertia: it is the static solution."""
    data = np.load(oracles / f"linear_{mesh}.npz")
    simulation = simulation_of(data, case, fps=1e-6, tolerance=1e-10, max_iterations=20000)
    simulation.step()
    assert simulation.stats.converged
    assert relative(simulation.positions - data["X"], data["u_static"][case]) < 1e-6


def test_single_precision_forces(oracles):
    data = np.load(oracles / "linear_bar12x3x3.npz")
    material = tf.Material(model="linear", youngs=float(data["E"][0]), poisson=float(data["nu"][0]))
    body = tf.Body(mesh=tf.TetMesh(data["X"], data["T"]), material=material)
    simulation = tf.Simulation(tf.Scene(bodies=[body]))
    simulation.set_positions(data["X"] + data["U"][0])
    assert relative(-simulation.elastic_forces(), data["KU"][0, 0]) < 1e-5


@pytest.fixture(scope="module")
def soft_block():
    mesh = tf.TetMesh.bar(size=(0.6, 0.3, 0.3), cells=(6, 3, 3))
    body = tf.Body(mesh=mesh, material=tf.Material(youngs=1e5, poisson=0.3))
    return tf.Simulation(tf.Scene(bodies=[body]), precision="f64")


def test_rigid_motion_of_corotational_gives_no_force(soft_block):
    x = soft_block.rest_positions
    soft_block.set_positions(1.3 * x)
    scale = np.abs(soft_block.elastic_forces()).max()
    rng = np.random.default_rng(1)
    for _ in range(10):
        soft_block.set_positions(x @ random_rotation(rng).T + rng.normal(size=3))
        assert np.abs(soft_block.elastic_forces()).max() < 1e-10 * scale


def test_rigid_rotation_of_linear_swells(block):
    """The lesson of the slides: linear strain takes a rotation for a stretch."""
    body = tf.Body(mesh=block, material=tf.Material(model="linear", youngs=1e5, poisson=0.3))
    simulation = tf.Simulation(tf.Scene(bodies=[body]), precision="f64")
    turned = block.points @ tf.Motion(angle=(60.0,), axis=(0, 1, 0)).at(0)[0].T
    simulation.set_positions(turned)
    forces = simulation.elastic_forces()
    outwards = ((turned - turned.mean(axis=0)) * forces).sum()
    assert outwards > 0.1 * np.abs(forces).max()


def test_forces_turn_with_the_body(soft_block):
    rng = np.random.default_rng(2)
    x = soft_block.rest_positions + 0.02 * rng.normal(size=soft_block.rest_positions.shape)
    turn = random_rotation(rng)
    soft_block.set_positions(x)
    forces = soft_block.elastic_forces()
    soft_block.set_positions(x @ turn.T)
    np.testing.assert_allclose(soft_block.elastic_forces(), forces @ turn.T, atol=1e-10 * np.abs(forces).max())
    assert np.abs(forces.sum(axis=0)).max() < 1e-10 * np.abs(forces).max()
    assert np.abs(np.cross(x, forces).sum(axis=0)).max() < 1e-10 * np.abs(forces).max()


def test_forces_are_minus_the_gradient_of_the_energy(soft_block):
    rng = np.random.default_rng(3)
    x = soft_block.rest_positions + 0.02 * rng.normal(size=soft_block.rest_positions.shape)
    soft_block.set_positions(x)
    forces = soft_block.elastic_forces()
    for _ in range(5):
        d = rng.normal(size=x.shape)
        h = 1e-6
        soft_block.set_positions(x + h * d)
        up = soft_block.elastic_energy()
        soft_block.set_positions(x - h * d)
        down = soft_block.elastic_energy()
        assert (up - down) / (2 * h) == pytest.approx(-(forces * d).sum(), rel=1e-6)


def test_patch_test(soft_block):
    """An affine displacement strains every element alike, to the Hooke stress, and inner nodes feel nothing."""
    x = soft_block.rest_positions
    F = np.eye(3) + 1e-2 * np.array([[1.0, 0.3, 0.0], [0.3, -0.5, 0.2], [0.0, 0.2, 0.7]])
    soft_block.set_positions(x @ F.T)
    material = soft_block.scene.bodies[0].material
    strain = F - np.eye(3)
    sigma = material.lame_lambda * np.trace(strain) * np.eye(3) + 2 * material.shear_modulus * strain
    cauchy = sigma @ F.T / np.linalg.det(F)
    np.testing.assert_allclose(soft_block.cauchy_stress(), np.tile(cauchy, (270, 1, 1)), atol=1e-10 * 1e5)
    inner = np.setdiff1d(np.arange(len(x)), soft_block.surface)
    assert len(inner)
    forces = soft_block.elastic_forces()
    assert np.abs(forces[inner]).max() < 1e-12 * np.abs(forces).max()


def test_stiffness_is_symmetric_and_blind_to_rigid_motion(soft_block):
    rng = np.random.default_rng(4)
    x = soft_block.rest_positions @ random_rotation(rng).T
    soft_block.set_positions(x)
    K = soft_block.stiffness()
    size = abs(K).max()
    assert abs(K - K.T).max() < 1e-12 * size
    for k in range(3):
        shift = np.tile(np.eye(3)[k], (len(x), 1))
        spin = np.cross(np.eye(3)[k], x)
        assert np.abs(K @ shift.ravel()).max() < 1e-10 * size
        assert np.abs(K @ spin.ravel()).max() < 1e-10 * size


def test_inverted_element_is_pushed_back():
    """A tetrahedron pushed inside out finds its rest shape again."""
    points = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], dtype=float)
    mesh = tf.TetMesh(points, [[0, 1, 2, 3]])
    material = tf.Material(youngs=1e4, poisson=0.2, mass_damping=5.0)
    scene = tf.Scene(bodies=[tf.Body(mesh=mesh, material=material)], gravity=(0, 0, 0))
    simulation = tf.Simulation(scene, precision="f64")
    pushed = points.copy()
    pushed[3] = [0.3, 0.3, -0.6]
    simulation.set_positions(pushed)
    simulation.advance(seconds=4.0)
    from motions import rigid_misfit

    assert rigid_misfit(points, simulation.positions) < 1e-3


def test_materials_by_region(block):
    """Half soft, half stiff under the same stretch: stress in the ratio of the moduli."""
    centre = block.points[block.cells].mean(axis=1)
    mesh = tf.TetMesh(block.points, block.cells, regions=(centre[:, 0] > 0.3).astype(int))
    soft, stiff = tf.Material(youngs=1e5, poisson=0.0), tf.Material(youngs=7e5, poisson=0.0)
    body = tf.Body(mesh=mesh, material=soft, materials={1: stiff})
    simulation = tf.Simulation(tf.Scene(bodies=[body]), precision="f64")
    simulation.set_positions(mesh.points * [1.01, 1, 1])
    stress = simulation.cauchy_stress()[:, 0, 0]
    np.testing.assert_allclose(stress[mesh.regions == 0], 1e3, rtol=1e-9)
    np.testing.assert_allclose(stress[mesh.regions == 1], 7e3, rtol=1e-9)


def test_set_material_acts_at_once(soft_block):
    x = soft_block.rest_positions * [1.1, 1, 1]
    soft_block.set_positions(x)
    before = soft_block.elastic_forces()
    old = soft_block.scene.bodies[0].material
    soft_block.set_material(0, tf.Material(youngs=3e5, poisson=0.3))
    np.testing.assert_allclose(soft_block.elastic_forces(), 3 * before, rtol=1e-9, atol=1e-9)
    soft_block.set_material(0, old)


@pytest.mark.parametrize("case", (0, 1))
def test_vibration_modes_match_scikit_fem(oracles, case):
    """The first ten frequencies of the clamped bar, with lumped masses."""
    known = json.loads((oracles / "modes_bar.json").read_text())["cases"][case]
    mesh = tf.TetMesh.bar(size=(1, 0.2, 0.2), cells=(12, 3, 3), split=6)
    material = tf.Material(model="linear", youngs=known["E"], poisson=known["nu"], density=known["rho"])
    simulation = tf.Simulation(tf.Scene(bodies=[tf.Body(mesh=mesh, material=material)]), precision="f64")
    free = np.repeat(mesh.points[:, 0] > 1e-9, 3)
    scale = 1 / np.sqrt(np.repeat(simulation.masses, 3)[free])
    matrix = simulation.stiffness().toarray()[np.ix_(free, free)] * scale * scale[:, None]
    hertz = np.sqrt(np.linalg.eigvalsh(matrix)[:10]) / (2 * np.pi)
    np.testing.assert_allclose(hertz, known["hz_skfem_lumped"], rtol=1e-9)
