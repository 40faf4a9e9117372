"""The second-order methods: order, energy, moving pins, and what goes on when pins let go."""

import json

import numpy as np
import pytest

import taichifem as tf

BAR = tf.TetMesh.bar(size=(0.6, 0.2, 0.2), cells=(3, 1, 1))
LEFT = tf.BoxRegion(lower=(-1, -1, -1), upper=(1e-6, 1, 1))
RIGHT = tf.BoxRegion(lower=(0.599, -1, -1), upper=(1, 1, 1))


def simulate(integrator, *, material=None, pins=(), **scene) -> tf.Simulation:
    chosen = {"gravity": (0, 0, 0), "tolerance": 1e-10, "newton_tolerance": 1e-10} | scene
    body = tf.Body(mesh=BAR, material=material or tf.Material(model="stvk", youngs=1e5, poisson=0.3), pins=pins)
    return tf.Simulation(tf.Scene(bodies=[body], integrator=integrator, **chosen), precision="f64")


def bend(simulation, amount: float) -> None:
    x = simulation.rest_positions
    simulation.set_positions(x + amount * x[:, :1] ** 2 * [0, 0, 1] + 0.1 * amount * x[:, :1] * [1, 0, 0])


def released(integrator, fps) -> np.ndarray:
    """Where a bar under its weight, damped and let go from a bend, is after 0.24 s."""
    material = tf.Material(model="stvk", youngs=2e4, poisson=0.3, mass_damping=0.5, stiffness_damping=1e-3)
    simulation = simulate(integrator, material=material, pins=[LEFT], fps=fps, gravity=(0, 0, -2))
    bend(simulation, 0.2)
    simulation.advance(seconds=0.24)
    return simulation.positions


@pytest.fixture(scope="module")
def exact():
    """The same, extrapolated from two fine runs."""
    coarse, fine = (released("newmark", fps) for fps in (800, 1600))
    return fine + (fine - coarse) / 3


@pytest.mark.parametrize(
    ("integrator", "order", "fps"),
    [
        ("newmark", 2, 100),
        ("bdf2", 2, 100),
        pytest.param("backward-euler", 1, 800, marks=pytest.mark.slow),
        pytest.param("backward-euler-newton", 1, 800, marks=pytest.mark.slow),
    ],
)
def test_order(exact, integrator, order, fps):
    """The error falls as dt^order, once the steps resolve the motion: those of backward Euler damp it up to then."""
    coarse, fine = (np.abs(released(integrator, rate) - exact).max() for rate in (fps, 2 * fps))
    assert coarse / fine == pytest.approx(2.0**order, rel=0.15)


def test_newmark_is_the_trapezoidal_rule(oracles):
    """For the linear law the implicit midpoint rule takes the same steps, but for how loads at the start come in."""
    table = json.loads((oracles / "transient_bar.json").read_text())["linear"]
    data = np.load(oracles / "transient_bar.npz")
    material = tf.Material(model="linear", youngs=table["E"], poisson=table["nu"])
    pins = [tf.IndexRegion(indices=data["fixed"].tolist())]
    body = tf.Body(mesh=tf.TetMesh(data["X"], data["T"]), material=material, pins=pins)
    scene = tf.Scene(bodies=[body], fps=100, tolerance=1e-12, newton_tolerance=1e-12, integrator="newmark")
    simulation = tf.Simulation(scene, precision="f64")
    tip = data["X"][:, 0] > 1 - 1e-9
    history = np.array(table["midpoint"])
    for expected in history:
        simulation.step()
        got = (simulation.positions - data["X"])[tip].mean(axis=0)
        assert np.abs(got - expected).max() < 1e-9 * np.abs(history).max()


@pytest.mark.parametrize("model", ["stvk", pytest.param("corotational", marks=pytest.mark.slow)])
def test_newmark_keeps_energy(model):
    """Within 1 % over 10 s, a dozen swings of a bar by a third of its length, with steps that resolve them."""
    material = tf.Material(model=model, youngs=1e5, poisson=0.3)
    simulation = simulate("newmark", material=material, pins=[LEFT], fps=60, tolerance=1e-6, newton_tolerance=1e-8)
    simulation.set_velocities(3 * BAR.points[:, :1] ** 2 * [0, 0, 1])
    energies, heights = [simulation.stats.energy["total"]], []
    for k in range(600):
        simulation.step()
        heights.append(simulation.positions[-1, 2])
        if k % 5 == 0:
            energies.append(simulation.stats.energy["total"])
    assert np.ptp(heights) > 0.2
    assert np.abs(np.array(energies) / energies[0] - 1).max() < 0.01


@pytest.mark.slow
def test_bdf2_loses_less_than_backward_euler_and_never_gains():
    lost = {}
    for integrator in ("bdf2", "backward-euler-newton"):
        simulation = simulate(integrator, pins=[LEFT], fps=120)
        bend(simulation, 0.3)
        energies = [simulation.stats.energy["total"]]
        for _ in range(60):
            simulation.step()
            energies.append(simulation.stats.energy["total"])
        assert max(energies) < energies[0] * (1 + 1e-9)
        lost[integrator] = 1 - energies[-1] / energies[0]
        del simulation  # the next one takes its world, which is compiled
    assert 0 < lost["bdf2"] < 0.9 * lost["backward-euler-newton"]


@pytest.mark.parametrize("integrator", ["newmark", "bdf2", "symplectic-euler", "backward-euler-newton"])
def test_moving_pins_do_not_ring(integrator):
    """Their nodes have the mean velocity of every step, also where the motion starts and stops with a jerk."""
    motion = tf.Motion(times=(0, 0.1, 0.2), translation=((0, 0, 0), (0, 0, 0), (0.1, 0, 0)))
    simulation = simulate(integrator, pins=[tf.Pin(region=LEFT, motion=motion)], tolerance=1e-4)
    chosen = LEFT.select(BAR.points)
    for _ in range(18):
        before = simulation.positions[chosen]
        simulation.step()
        x = simulation.positions[chosen]
        np.testing.assert_allclose(simulation.velocities[chosen], (x - before) / simulation.dt, atol=1e-9)
        R, c = motion.at(simulation.time)
        np.testing.assert_allclose(x, BAR.points[chosen] @ R.T + c, atol=1e-12)


@pytest.mark.parametrize("integrator", ["newmark", "bdf2", "symplectic-euler", "backward-euler-newton"])
def test_nodes_that_are_let_go_keep_their_velocity(integrator):
    """A body carried along by all of its nodes, set off with a jerk, then let go: it flies on at the same speed."""
    motion = tf.Motion(times=(0, 0.05, 1.05), translation=((0, 0, 0), (0, 0, 0), (2, 0, 0)))
    everything = tf.BoxRegion(lower=(-1, -1, -1), upper=(1, 1, 1))
    simulation = simulate(integrator, pins=[tf.Pin(region=everything, motion=motion, until=0.2)], fps=40)
    simulation.advance(seconds=0.5)
    np.testing.assert_allclose(simulation.velocities, np.tile([2.0, 0, 0], (len(BAR.points), 1)), atol=1e-8)


@pytest.mark.parametrize("integrator", ["newmark", "bdf2", "backward-euler-newton"])
def test_free_flight_keeps_linear_momentum(integrator):
    """With the body shaking, and whatever tolerance the solver stops at."""
    body = tf.Body(mesh=BAR, material=tf.Material(youngs=1e4, poisson=0.3), velocity=(1, 2, 3), spin=(3, 1, 2))
    simulation = tf.Simulation(tf.Scene(bodies=[body], integrator=integrator), precision="f64")
    simulation.set_positions(BAR.points * [1.1, 0.9, 1])
    start, mass = np.array(simulation.stats.momentum), simulation.masses.sum()
    for _ in range(30):
        simulation.step()
    expected = start + mass * simulation.time * np.array(simulation.scene.gravity)
    assert np.abs(np.array(simulation.stats.momentum) - expected).max() < 1e-12 * np.linalg.norm(expected)
