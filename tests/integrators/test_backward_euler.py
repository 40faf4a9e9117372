"""Time stepping against independent histories, closed forms and conservation laws."""

import json

import numpy as np
import pytest
import scipy.sparse.linalg

import taichifem as tf


@pytest.fixture(scope="module")
def transient(oracles):
    return json.loads((oracles / "transient_bar.json").read_text()), np.load(oracles / "transient_bar.npz")


def clamped_bar(data, model, youngs, **scene):
    pins = [tf.IndexRegion(indices=data["fixed"].tolist())]
    material = tf.Material(model=model, youngs=youngs, poisson=0.3)
    body = tf.Body(mesh=tf.TetMesh(data["X"], data["T"]), material=material, pins=pins)
    return tf.Simulation(tf.Scene(bodies=[body], fps=100, tolerance=1e-10, **scene), precision="f64")


def test_linear_history(transient):
    table, data = transient
    simulation = clamped_bar(data, "linear", table["linear"]["E"])
    tip = data["X"][:, 0] > 1 - 1e-9
    history = np.array(table["linear"]["backward_euler"])
    got = []
    for _ in history:
        simulation.step()
        got.append((simulation.positions - data["X"])[tip].mean(axis=0))
    assert np.abs(got - history).max() < 1e-8 * np.abs(history).max()
    final = data["linear_backward_euler_final_u"]
    assert np.abs(simulation.positions - data["X"] - final).max() < 1e-8 * np.abs(final).max()


@pytest.mark.parametrize(
    ("model", "law"),
    [
        ("linear", "linear"),
        ("corotational", "corotated"),
        ("stvk", "stvk"),
        ("neo-hookean", "stable_neohookean"),
    ],
)
def test_nonlinear_history(transient, model, law):
    """Converged backward Euler, 40 steps."""
    _, data = transient
    simulation = clamped_bar(data, model, 2e5, integrator="backward-euler-newton", newton_tolerance=1e-10)
    for step in range(1, 41):
        simulation.step()
        if step in (10, 40):
            expected = data[f"be_{law}_step{step}"]
            assert np.abs(simulation.positions - data["X"] - expected).max() < 1e-8 * np.abs(expected).max()


@pytest.mark.parametrize(("precision", "error"), [("f32", 2e-6), ("f64", 1e-13)])
def test_free_flight_keeps_momentum(block, precision, error):
    """Whatever tolerance the solver stops at: gravity is all that changes the momentum."""
    body = tf.Body(mesh=block, material=tf.Material(youngs=1e5, poisson=0.3), velocity=(1, 2, 3), spin=(3, 1, 2))
    simulation = tf.Simulation(tf.Scene(bodies=[body]), precision=precision)
    start, mass = np.array(simulation.stats.momentum), simulation.masses.sum()
    for _ in range(60):
        simulation.step()
    expected = start + mass * simulation.time * np.array(simulation.scene.gravity)
    assert np.abs(np.array(simulation.stats.momentum) - expected).max() < error * np.linalg.norm(expected)


def test_free_fall_is_exact_for_backward_euler(block):
    simulation = tf.Simulation(tf.Scene(bodies=[tf.Body(mesh=block)]), precision="f64")
    for _ in range(30):
        simulation.step()
    dt, n = simulation.dt, 30
    drop = -9.81 * dt**2 * n * (n + 1) / 2
    np.testing.assert_allclose(simulation.positions - block.points, np.tile([0, 0, drop], (112, 1)), atol=1e-10)


def axial_period(cells: int, fps: float) -> float:
    """Period of a bar pulled along and let go, from the zero crossings of its end; nu = 0."""
    mesh = tf.TetMesh.bar(size=(1, 0.1, 0.1), cells=(cells, 1, 1))
    body = tf.Body(
        mesh=mesh,
        material=tf.Material(model="linear", youngs=1e6, poisson=0.0, density=1000),
        pins=[tf.BoxRegion(lower=(-1, -1, -1), upper=(1e-6, 1, 1))],
    )
    scene = tf.Scene(bodies=[body], gravity=(0, 0, 0), fps=fps, tolerance=1e-6)
    simulation = tf.Simulation(scene, precision="f64")
    shape = np.sin(0.5 * np.pi * mesh.points[:, :1])
    simulation.set_positions(mesh.points + 0.01 * shape * [1, 0, 0])
    end = mesh.points[:, 0] > 1 - 1e-9
    times, values = [], []
    while simulation.time < 0.32:
        simulation.step()
        times.append(simulation.time)
        values.append(simulation.positions[end, 0].mean() - 1)
    signs = np.flatnonzero(np.diff(np.sign(values)))
    crossings = [times[k] - values[k] * (times[k + 1] - times[k]) / (values[k + 1] - values[k]) for k in signs]
    return 2 * (crossings[2] - crossings[0]) / 2


def test_first_axial_frequency_by_refinement():
    """Clamped-free bar: f = c / (4 L), c = sqrt(E / rho); the error falls with mesh and step together."""
    exact = 4 * 1.0 / np.sqrt(1e6 / 1000)
    errors = [abs(axial_period(cells, fps) / exact - 1) for cells, fps in ((4, 400), (8, 800), (16, 1600))]
    assert errors[0] > errors[1] > errors[2]
    assert errors[2] < 0.3 * errors[0]
    assert errors[2] < 5e-3


def test_rayleigh_mass_damping_slows_free_flight(block):
    """dv/dt = -alpha v; backward Euler gives v0 / (1 + alpha dt)^n."""
    body = tf.Body(mesh=block, material=tf.Material(mass_damping=2.0), velocity=(1, 0, 0))
    simulation = tf.Simulation(tf.Scene(bodies=[body], gravity=(0, 0, 0)), precision="f64")
    for _ in range(10):
        simulation.step()
    np.testing.assert_allclose(simulation.velocities[:, 0], (1 + 2.0 / 60) ** -10, rtol=1e-9)


def test_rayleigh_stiffness_damping_leaves_rotation_alone(block):
    """beta K damps deformation only: a spinning body keeps its spin as one without damping does."""
    spins = []
    for beta in (0.0, 0.2):
        material = tf.Material(youngs=1e6, poisson=0.3, stiffness_damping=beta)
        body = tf.Body(mesh=block, material=material, spin=(0, 0, 1))
        scene = tf.Scene(bodies=[body], gravity=(0, 0, 0), fps=300, tolerance=1e-6)
        simulation = tf.Simulation(scene, precision="f64")
        start = simulation.stats.angular_momentum[2]
        simulation.advance(seconds=0.2)
        spins.append(simulation.stats.angular_momentum[2] / start)
        del simulation  # the next one takes its world, which is compiled
    assert spins[0] == pytest.approx(1, abs=2e-3)
    assert spins[1] == pytest.approx(spins[0], abs=2e-3)


def test_rayleigh_damping_is_alpha_m_plus_beta_k(block):
    """The damped linear step, solved directly by a sparse factorisation of the same M and K."""
    alpha, beta, dt = 3.0, 0.02, 1 / 60
    material = tf.Material(model="linear", youngs=1e5, poisson=0.3, mass_damping=alpha, stiffness_damping=beta)
    body = tf.Body(mesh=block, material=material)
    scene = tf.Scene(bodies=[body], gravity=(0, 0, 0), tolerance=1e-11)
    simulation = tf.Simulation(scene, precision="f64")
    K, m = simulation.stiffness(), np.repeat(simulation.masses, 3)
    u, v = 0.01 * np.sin(7 * block.points).ravel(), np.zeros(3 * len(block.points))
    simulation.set_positions(block.points + u.reshape(-1, 3))
    solve = scipy.sparse.linalg.factorized((scipy.sparse.diags((1 + dt * alpha) * m) + (dt**2 + dt * beta) * K).tocsc())
    for _ in range(30):
        simulation.step()
        v = solve(m * v - dt * (K @ u))
        u = u + dt * v
    assert np.abs((simulation.positions - block.points).ravel() - u).max() < 1e-8 * np.abs(u).max()


def test_same_scene_twice_is_bit_identical(block):
    def run():
        body = tf.Body(mesh=block, material=tf.Material(youngs=1e5), position=(0, 0, 0.05), spin=(1, 1, 0))
        simulation = tf.Simulation(tf.Scene(bodies=[body], colliders=[tf.PlaneCollider()]))
        for _ in range(40):
            simulation.step()
        return simulation.positions

    np.testing.assert_array_equal(run(), run())


def test_iteration_cap_is_told(block):
    body = tf.Body(mesh=block, material=tf.Material(youngs=1e7), pins=[tf.NearestRegion(point=(0, 0, 0), count=4)])
    simulation = tf.Simulation(tf.Scene(bodies=[body], max_iterations=2))
    simulation.step()
    assert not simulation.stats.converged
    assert "cap" in str(simulation.stats)
