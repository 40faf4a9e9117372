"""Quasi-static steps: balance under the loads, pins and handles of every step."""

import numpy as np
import pytest

import taichifem as tf

BAR = tf.TetMesh.bar(size=(0.8, 0.2, 0.2), cells=(8, 2, 2))
STRIP = tf.TriMesh.rectangle(size=(0.8, 0.2), cells=(16, 4))
LEFT = tf.BoxRegion(lower=(-1, -1, -1), upper=(1e-6, 1, 1))
RIGHT = tf.BoxRegion(lower=(0.799, -1, -1), upper=(1, 1, 1))


def simulate(mesh=BAR, *, material=None, body=None, precision="f64", **scene) -> tf.Simulation:
    material = material or tf.Material(model="neo-hookean", youngs=1e5, poisson=0.3)
    bodies = [tf.Body(mesh=mesh, material=material, **({"pins": [LEFT]} | (body or {})))]
    chosen = {"gravity": (0, 0, 0), "integrator": "quasi-static", "tolerance": 1e-6} | scene
    return tf.Simulation(tf.Scene(bodies=bodies, **chosen), precision=precision)


@pytest.mark.parametrize("mesh", [BAR, pytest.param(STRIP, marks=pytest.mark.slow)], ids=["3d", "2d"])
def test_slow_motions_end_in_the_shape_of_a_long_damped_run(mesh):
    """A pin turns one end and a handle pulls at its middle while gravity acts."""
    motion = tf.Motion(times=(0, 0.5), angle=(0, 40), axis=(0, 1, 0), center=(0.8, 0.1, 0.1))
    shift = tf.Motion(times=(0, 0.5), translation=((0, 0, 0), (0, 0, 0.1)))
    middle = tf.BoxRegion(lower=(0.39, -1, 0.19), upper=(0.41, 1, 1))
    body = {"handles": [tf.Handle(region=middle, stiffness=300, motion=shift)]}
    body["pins"] = [LEFT, tf.Pin(region=RIGHT, motion=motion)]
    scene = {"gravity": (0, 0, -3), "fps": 20}
    static = simulate(mesh, body=body, **scene)
    for _ in range(12):
        static.step()
        assert static.report.balanced
    material = tf.Material(model="neo-hookean", youngs=1e5, poisson=0.3, mass_damping=10.0)
    moving = simulate(mesh, body=body, material=material, **scene | {"integrator": "backward-euler-newton"})
    moving.advance(seconds=6)
    assert np.abs(moving.velocities).max() < 1e-6
    assert np.abs(static.positions - static.rest_positions).max() > 0.05
    np.testing.assert_allclose(static.positions, moving.positions, atol=1e-5)


def test_what_is_left_of_the_forces_is_small_and_pins_carry_the_rest():
    simulation = simulate(gravity=(0, 0, -9.81), newton_tolerance=1e-9)
    simulation.step()
    free = np.setdiff1d(np.arange(len(BAR.points)), LEFT.select(BAR.points))
    reactions = simulation.reactions()
    weight = simulation.masses.sum() * 9.81
    assert np.abs(reactions[free]).max() < 1e-6 * weight
    np.testing.assert_allclose(reactions.sum(axis=0), [0, 0, weight], atol=1e-5 * weight)


def test_velocities_are_those_from_one_balance_to_the_next():
    motion = tf.Motion(times=(0, 1), translation=((0, 0, 0), (0.1, 0, 0)))
    simulation = simulate(body={"pins": [LEFT, tf.Pin(region=RIGHT, motion=motion)]}, fps=10)
    simulation.step()
    before = simulation.positions
    simulation.step()
    np.testing.assert_allclose(simulation.velocities, (simulation.positions - before) * 10, atol=1e-9)


@pytest.mark.parametrize(
    "pins", [[], [tf.IndexRegion(indices=[0])], [tf.Pin(region=LEFT, axes="z")]], ids=["none", "one node", "one axis"]
)
def test_a_body_that_nothing_holds_is_refused_in_one_line(pins):
    with pytest.raises(tf.InputError, match=r"body\.0 can shift or turn without strain") as refusal:
        simulate(body={"pins": pins})
    assert "\n" not in str(refusal.value)


def test_mass_and_damping_do_not_matter():
    ends = []
    for material in (
        tf.Material(youngs=1e5, poisson=0.3),
        tf.Material(youngs=1e5, poisson=0.3, density=5000, mass_damping=9, stiffness_damping=0.5),
    ):
        pull = tf.Force(region=RIGHT, force=(0, 0, -20))
        simulation = simulate(material=material, body={"forces": [pull]}, newton_tolerance=1e-9)
        simulation.step()
        simulation.step()
        ends.append(simulation.positions)
        del simulation  # the next one takes its world, which is compiled
    np.testing.assert_allclose(ends[0], ends[1], atol=1e-8)


def test_a_linear_bar_takes_one_linearisation_and_bends_as_scipy_says():
    import scipy.sparse.linalg

    material = tf.Material(model="linear", youngs=1e5, poisson=0.3)
    body = {"forces": [tf.Force(region=RIGHT, force=(0, 0, -10))]}
    simulation = simulate(material=material, body=body, tolerance=1e-10, newton_tolerance=1e-9)
    K, n = simulation.stiffness(), len(BAR.points)
    free = np.setdiff1d(np.arange(3 * n), [3 * i + k for i in LEFT.select(BAR.points) for k in range(3)])
    force, tip = np.zeros((n, 3)), RIGHT.select(BAR.points)
    force[tip, 2] = -10 / len(tip)
    u = np.zeros(3 * n)
    u[free] = scipy.sparse.linalg.spsolve(K[free][:, free].tocsc(), force.ravel()[free])
    simulation.step()
    assert simulation.report.linearisations <= 2
    np.testing.assert_allclose(simulation.positions - BAR.points, u.reshape(-1, 3), atol=1e-7 * np.abs(u).max())
