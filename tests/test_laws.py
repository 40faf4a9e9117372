"""Every law on meshes of both dimensions: forces, tangents, and the way through inversion."""

import numpy as np
import pytest
from mechanics import AXES, assert_derivatives, direction, loose_elements, turned
from motions import random_rotation, rigid_misfit

import taichifem as tf

MODULI = {"youngs": 1e5, "poisson": 0.3}
LAWS = {
    "stvk": tf.Material(model="stvk", **MODULI),
    "neo-hookean": tf.Material(model="neo-hookean", **MODULI),
    "invertible": tf.Material(model="invertible", **MODULI, threshold=0.4),
}
OTHERS = {
    "linear": tf.Material(model="linear", **MODULI),
    "corotational": tf.Material(model="corotational", **MODULI),
    "invertible corotational": tf.Material(model="invertible", wraps="corotational", **MODULI),
    "invertible neo-hookean": tf.Material(model="invertible", wraps="neo-hookean", **MODULI),
    "mass-spring": tf.Material(model="mass-spring", youngs=1e5),
    "given springs": tf.Material(model="mass-spring", spring_stiffness=2e3),
}
ALL = LAWS | OTHERS
BLOCK = tf.TetMesh.bar(size=(0.6, 0.3, 0.3), cells=(4, 2, 2))
SHEET = tf.TriMesh.rectangle(size=(0.6, 0.3), cells=(6, 3))
LOOSE = 50


def marked(law: str, *values):
    """A law that wraps another costs a compilation more, and `tests/formulas` has its derivatives."""
    return pytest.param(*values, marks=pytest.mark.slow if law.startswith("invertible ") else ())


@pytest.fixture(
    scope="module", params=[marked(law, (law, d)) for law in ALL for d in (2, 3)], ids=lambda p: f"{p[0]}-{p[1]}d"
)
def simulation(request):
    """A mesh and 50 elements apart, of one law; this integrator asks for the exact tangents of all."""
    law, d = request.param
    meshes = (BLOCK if d == 3 else SHEET), loose_elements(d, LOOSE)
    bodies = [tf.Body(mesh=mesh, material=ALL[law], thickness=0.2) for mesh in meshes]
    scene = tf.Scene(bodies=bodies, gravity=(0, 0, 0), integrator="backward-euler-newton")
    return tf.Simulation(scene, precision="f64")


def is_linear(simulation) -> bool:
    return simulation.scene.bodies[0].material.model == "linear"


def scrambled(simulation, seed: int, amount: float) -> np.ndarray:
    """Its nodes moved at random, and all of it turned."""
    d, x = simulation.dimension, simulation.rest_positions
    return (x + amount * direction(d, len(x), seed)) @ turned(d, np.random.default_rng(seed)).T


def deformed(seed: int, amount: float = 0.03) -> np.ndarray:
    rng = np.random.default_rng(seed)
    return (BLOCK.points + amount * rng.normal(size=BLOCK.points.shape)) @ random_rotation(rng).T


def test_forces_and_tangent_are_derivatives(simulation):
    """For a little deformed mesh, and for a scrambled one with inverted elements."""
    x = simulation.rest_positions
    for seed, amount in ((0, 0.02), (1, 0.08)):
        assert_derivatives(simulation, scrambled(simulation, seed, amount), direction(simulation.dimension, len(x), 9))


def test_rigid_motion_gives_no_force(simulation):
    """The lesson of the slides: linear elements, and no others, take a turn for a stretch."""
    x = simulation.rest_positions
    simulation.set_positions(1.2 * x)
    scale = np.abs(simulation.elastic_forces()).max()
    turn = turned(simulation.dimension, np.random.default_rng(3))
    simulation.set_positions(x @ turn.T + [5.0, 0.0 if simulation.dimension == 2 else 5.0, 5.0])
    size = np.abs(simulation.elastic_forces()).max()
    assert size > 0.5 * scale if is_linear(simulation) else size < 1e-10 * scale
    simulation.set_positions(x + np.array([5.0, 0.0, 5.0]))
    assert np.abs(simulation.elastic_forces()).max() < 1e-10 * scale


def test_forces_turn_with_the_body(simulation):
    """And are balanced: they neither push nor turn the whole. Not so for linear elements."""
    x = scrambled(simulation, 2, 0.05)
    simulation.set_positions(x)
    forces = simulation.elastic_forces()
    turn, size = turned(simulation.dimension, np.random.default_rng(4)), np.abs(forces).max()
    simulation.set_positions(x @ turn.T)
    difference = np.abs(simulation.elastic_forces() - forces @ turn.T).max()
    assert difference > 0.1 * size if is_linear(simulation) else difference < 1e-10 * size
    assert np.abs(forces.sum(axis=0)).max() < 1e-10 * size
    torque = np.abs(np.cross(x, forces).sum(axis=0)).max()
    assert torque > 0.1 * size if is_linear(simulation) else torque < 1e-10 * size


@pytest.mark.parametrize("d", [2, 3])
@pytest.mark.parametrize("law", [marked(law, law) for law, m in ALL.items() if m.model != "mass-spring"])
def test_small_strains_obey_hooke(law, d):
    """At rest the tangent is that of linear elasticity."""
    tangents = []
    for material in (ALL[law], ALL["linear"]):
        body = tf.Body(mesh=BLOCK if d == 3 else SHEET, material=material)
        tangents.append(tf.Simulation(tf.Scene(bodies=[body]), precision="f64").stiffness())
    assert abs(tangents[0] - tangents[1]).max() < 1e-9 * abs(tangents[1]).max()


def test_projected_tangent_is_positive_semi_definite(simulation):
    for seed in range(3):
        simulation.set_positions(0.45 * scrambled(simulation, seed, 0.03))
        exact = np.linalg.eigvalsh(simulation.stiffness().toarray())
        projected = np.linalg.eigvalsh(simulation.stiffness(projected=True).toarray())
        if not is_linear(simulation):
            assert exact[0] < -1e-2 * exact[-1], "the state is one where it matters"
        assert projected[0] > -1e-9 * projected[-1]


def test_projected_tangent_of_single_elements(simulation):
    """1000 elements: stretched, crushed flat or to a point, turned inside out."""
    d, rng, x = simulation.dimension, np.random.default_rng(1), simulation.rest_positions
    first, size = len(x) - LOOSE * (d + 1), 3 * (d + 1)
    rest = x[first:].reshape(LOOSE, d + 1, 3)[:, :, AXES[d]]
    for _ in range(20):
        F = rng.normal(size=(LOOSE, d, d))
        F[::4] *= 0.1
        F[1::4, :, 0] = 0.0
        F[2::40] = 0.0
        moved = x.copy()
        moved[first:, AXES[d]] = np.einsum("eij,eaj->eai", F, rest).reshape(-1, d)
        simulation.set_positions(moved)
        K = simulation.stiffness(projected=True)[3 * first :, 3 * first :].tocoo()
        blocks = np.zeros((LOOSE, size, size))
        blocks[K.row // size, K.row % size, K.col % size] = K.data
        assert np.isfinite(blocks).all()
        eigenvalues = np.linalg.eigvalsh(blocks)
        assert (eigenvalues[:, 0] >= -1e-11 * eigenvalues[:, -1]).all()


@pytest.mark.parametrize("d", [2, 3])
def test_quick_rotations_are_right_for_stretch_and_turn(d):
    """Corotational by QR is exempt from derivatives and symmetry; where F = R S with S diagonal it is the polar one."""
    mesh, rng = (BLOCK if d == 3 else SHEET), np.random.default_rng(2)
    bodies = [tf.Body(mesh=mesh, material=tf.Material(rotation=r, **MODULI)) for r in ("polar", "qr")]
    polar, quick = (tf.Simulation(tf.Scene(bodies=[body]), precision="f64") for body in bodies)
    x, turn = quick.rest_positions, turned(d, rng)
    quick.set_positions(1.2 * x)
    scale = np.abs(quick.elastic_forces()).max()
    quick.set_positions(x @ turn.T)
    assert np.abs(quick.elastic_forces()).max() < 1e-10 * scale
    for stretch in ((1.3, 1.0, 0.8), (0.7, 1.0, 1.4)):
        for simulation in (polar, quick):
            simulation.set_positions(x * stretch @ turn.T)
        np.testing.assert_allclose(quick.elastic_forces(), polar.elastic_forces(), atol=1e-10 * scale)
        assert abs(quick.stiffness() - polar.stiffness()).max() < 1e-10 * abs(polar.stiffness()).max()
    sheared = x + 0.3 * x[:, [2, 1, 0]] * [1, 0, 0]
    quick.set_positions(sheared)
    forces = quick.elastic_forces()
    quick.set_positions(sheared @ turn.T)
    np.testing.assert_allclose(quick.elastic_forces(), forces @ turn.T, atol=1e-10 * scale)


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


@pytest.mark.parametrize(
    "model",
    [
        "corotational",
        pytest.param("invertible", marks=pytest.mark.slow),
        pytest.param("neo-hookean", marks=pytest.mark.slow),
    ],
)
def test_scrambled_and_flattened_blocks_recover(model):
    """All nodes at random, or squeezed to zero height: the rest shape comes back, without a NaN on the way."""
    material = tf.Material(model=model, youngs=1e5, poisson=0.3, wraps="corotational", stiffness_damping=0.02)
    rng = np.random.default_rng(6)
    for start in (rng.uniform(0, 0.6, size=BLOCK.points.shape), BLOCK.points * [1, 1, 0]):
        simulation = tf.Simulation(tf.Scene(bodies=[tf.Body(mesh=BLOCK, material=material)], gravity=(0, 0, 0)))
        simulation.set_positions(start)
        simulation.advance(seconds=4)
        assert rigid_misfit(BLOCK.points, simulation.positions) < 1e-3
        del simulation  # the next one takes its world, which is compiled


def test_a_law_that_is_new_to_the_scene_is_refused():
    simulation = tf.Simulation(tf.Scene(bodies=[tf.Body(mesh=BLOCK)]))
    with pytest.raises(tf.InputError, match="no 'stvk' material"):
        simulation.set_material(0, LAWS["stvk"])
