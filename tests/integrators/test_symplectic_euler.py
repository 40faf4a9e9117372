"""Symplectic Euler: its longest step, the steps it chooses, what it conserves."""

import json

import numpy as np
import pytest

import taichifem as tf
from taichifem.integrators import symplectic_euler

TET = tf.TetMesh([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], [[0, 1, 2, 3]])
CUBE = tf.TetMesh.bar(size=(0.3, 0.3, 0.3), cells=(2, 2, 2))


def explicit(mesh, material, *, pins=(), body=None, precision="f64", **scene) -> tf.Simulation:
    chosen = {"gravity": (0, 0, 0), "integrator": "symplectic-euler"} | scene
    bodies = [tf.Body(mesh=mesh, material=material, pins=pins, **(body or {}))]
    return tf.Simulation(tf.Scene(bodies=bodies, **chosen), precision=precision)


@pytest.fixture(scope="module")
def bar(oracles):
    """The oracle's clamped bar and its table."""
    data = np.load(oracles / "transient_bar.npz")
    table = json.loads((oracles / "transient_bar.json").read_text())["linear"]
    pins = [tf.IndexRegion(indices=data["fixed"].tolist())]
    material = tf.Material(model="linear", youngs=table["E"], poisson=table["nu"], density=table["rho"])
    return table, tf.TetMesh(data["X"], data["T"]), material, pins


def test_critical_step_of_a_clamped_bar(bar):
    """2 / omega of the highest mode; Lanczos is told to stop at 1e-3, and errs to the long side by much less."""
    table, mesh, material, pins = bar
    assert explicit(mesh, material, pins=pins).critical_step() == pytest.approx(
        table["symplectic_euler_stable_dt"], rel=1e-4
    )


@pytest.mark.parametrize(("part", "stable"), [(0.98, True), (1.02, False)])
def test_stable_below_the_critical_step_only(bar, part, stable):
    """From a random start: bounded, or doubled many times in 2000 steps. The unstable one is made by hand."""
    table, mesh, material, pins = bar
    fps = 1 / (part * table["symplectic_euler_stable_dt"])
    simulation = explicit(mesh, material, pins=pins, fps=fps if stable else 1e6, substeps=1)
    simulation._clock.fps = fps
    rng = np.random.default_rng(0)
    simulation.set_velocities(0.01 * rng.normal(size=mesh.points.shape) * (mesh.points[:, :1] > 1e-6))
    start = simulation.stats.energy["kinetic"]
    largest = 0.0
    for _ in range(20):
        try:
            for _ in range(100):
                simulation.step()
        except tf.Diverged:
            largest = np.inf
            break
        largest = max(largest, simulation.stats.energy["kinetic"])
    assert largest < 30 * start if stable else largest > 1e6 * start


@pytest.mark.parametrize("damping", [(0.0, 0.0), (3.0, 0.0), (0.0, 2e-4), (40.0, 5e-3)])
def test_critical_step_of_a_damped_oscillator(damping):
    """The amplification matrix of v1 = v - dt (w^2 x + c v), x1 = x + dt v1 reaches the unit circle right there."""
    alpha, beta = damping
    omega = 300.0
    dt, c = symplectic_euler.critical_step(omega, alpha, beta), alpha + beta * omega**2

    def radius(dt):
        decay = 1 - dt * c
        return np.abs(np.linalg.eigvals([[decay, -dt * omega**2], [dt * decay, 1 - dt * dt * omega**2]])).max()

    assert radius(0.999 * dt) < 1 + 1e-9
    assert radius(1.001 * dt) > 1 + 1e-6
    assert symplectic_euler.critical_step(0.0, 0.0, 0.0) == np.inf


def one_degree_of_freedom(**material) -> tuple[tf.Simulation, float]:
    """A tetrahedron of which one node may move along z; and its angular frequency [1/s], in closed form."""
    stuff = tf.Material(model="linear", youngs=1e4, poisson=0.25, density=24.0, **material)
    pins = [tf.IndexRegion(indices=[0, 1, 2]), tf.Pin(region=tf.IndexRegion(indices=[3]), axes="xy")]
    # K_zz = V (lambda + 2 mu) |g|^2 with V = 1/6 and g = (0, 0, 1); m = rho V / 4.
    omega = np.sqrt((stuff.lame_lambda + 2 * stuff.shear_modulus) / 6 / (24.0 / 24))
    return explicit(TET, stuff, pins=pins, fps=10), omega


@pytest.mark.parametrize("damping", [{}, {"mass_damping": 5.0, "stiffness_damping": 1e-3}])
def test_one_degree_of_freedom(damping):
    """The critical step, and the steps themselves, against the recurrence done by hand."""
    simulation, omega = one_degree_of_freedom(**damping)
    c = damping.get("mass_damping", 0.0) + damping.get("stiffness_damping", 0.0) * omega**2
    critical = simulation.critical_step()
    assert (omega * critical) ** 2 + 2 * c * critical == pytest.approx(4, rel=1e-9)
    assert critical * 0.9 / 2 < simulation.dt <= 0.9 * critical
    x = TET.points.copy()
    x[3, 2] = 1.1
    simulation.set_positions(x)
    u, v = 0.1, 0.0
    for _ in range(50):
        simulation.step()
        v -= simulation.dt * (omega**2 * u + c * v)
        u += simulation.dt * v
    assert simulation.positions[3, 2] == pytest.approx(1 + u, abs=1e-12)


@pytest.mark.parametrize("model", ["linear", pytest.param("stvk", marks=pytest.mark.slow)])
def test_energy_stays_bounded(model):
    """Neither grows nor fades over 1e4 steps at 0.9 of the critical step."""
    check_energy(model, 10_000)


@pytest.mark.slow
def test_energy_stays_bounded_for_long():
    check_energy("corotational", 100_000)


def check_energy(model: str, steps: int) -> None:
    material = tf.Material(model=model, youngs=1e4, poisson=0.3)
    critical = explicit(TET, material).critical_step()
    simulation = explicit(TET, material, fps=1 / (0.9 * critical), substeps=1)
    simulation.set_positions(TET.points * [1.02, 1.0, 0.99])
    energies = []
    for _ in range(50):
        for _ in range(steps // 50):
            simulation.step()
        energies.append(simulation.stats.energy["total"])
    # Symplectic Euler conserves an energy of its own: the true one swings, the more so the nearer to the critical step.
    assert max(energies) < 10 * min(energies)
    assert np.mean(energies[25:]) == pytest.approx(np.mean(energies[:25]), rel=0.25)


def test_too_long_a_step_is_refused_in_one_line():
    material = tf.Material(youngs=1e6)
    with pytest.raises(tf.InputError, match=r"simulation\.substeps is 1, .* give at least \d+") as refusal:
        explicit(CUBE, material, substeps=1)
    assert "\n" not in str(refusal.value)
    least = int(str(refusal.value).split("at least ")[1].split(",")[0])
    assert explicit(CUBE, material, substeps=least).substeps == least
    with pytest.raises(tf.InputError):
        explicit(CUBE, material, substeps=least - 1)


@pytest.mark.parametrize("model", ["linear", "corotational"])
def test_steps_follow_the_material(model):
    """A hundred times stiffer, ten times the steps: at once, within a frame too, and time goes on from where it was."""
    soft, stiff = (tf.Material(model=model, youngs=youngs, poisson=0.3) for youngs in (1e5, 1e7))
    simulation = explicit(CUBE, soft, body={"velocity": (1, 0, 0)}, fps=10)
    few = simulation.substeps
    assert few > 1
    assert simulation.dt <= 0.9 * simulation.critical_step() * (1 + 1e-9)
    simulation.advance_frame()
    simulation.step()
    time = simulation.time
    simulation.set_material(0, stiff)
    assert simulation.time == pytest.approx(time, rel=1e-12)
    assert simulation.dt <= 0.9 * simulation.critical_step() * (1 + 1e-9)
    simulation.advance_frame()
    assert simulation.frame == 2
    assert simulation.time == pytest.approx(2 / 10)
    simulation.advance_frame()
    assert 9 * few <= simulation.substeps <= 11 * few
    simulation.set_material(0, soft)
    simulation.advance_frame()
    assert simulation.substeps == few
    assert simulation.time == pytest.approx(4 / 10)
    np.testing.assert_allclose(simulation.positions - CUBE.points, np.tile([4 / 10, 0, 0], (27, 1)), atol=1e-9)


def test_a_material_too_stiff_for_the_given_steps_is_refused_and_the_old_one_kept():
    soft = tf.Material(youngs=1e5, poisson=0.3)
    simulation = explicit(CUBE, soft, substeps=20)
    simulation.set_positions(1.1 * CUBE.points)
    before = simulation.elastic_forces()
    with pytest.raises(tf.InputError, match="substeps is 20"):
        simulation.set_material(0, tf.Material(youngs=1e9, poisson=0.3))
    np.testing.assert_array_equal(simulation.elastic_forces(), before)
    simulation.step()


def test_steps_allow_for_pins_that_let_go():
    """A pinned body is slower than a free one: the steps are those of what may move later."""
    material = tf.Material(model="linear", youngs=1e5, poisson=0.3)
    held = tf.IndexRegion(indices=list(range(18)))
    forever = explicit(CUBE, material, pins=[held])
    released = explicit(CUBE, material, pins=[tf.Pin(region=held, until=0.05)])
    free = explicit(CUBE, material)
    assert forever.critical_step() > 1.01 * free.critical_step()
    assert released.critical_step() == pytest.approx(free.critical_step(), rel=1e-3)


def test_falls_and_comes_to_rest():
    """On the ground, damped: it lies still, carries its weight, and took no energy from the impact."""
    material = tf.Material(youngs=1e5, poisson=0.3, stiffness_damping=1e-2)
    body = {"position": (0, 0, 0.1)}
    simulation = explicit(
        CUBE, material, body=body, gravity=(0, 0, -9.81), colliders=[tf.PlaneCollider()], precision="f32"
    )
    most = simulation.stats.energy["total"]
    for _ in range(60):
        simulation.advance_frame()
        assert simulation.stats.energy["total"] < most * (1 + 1e-3)
    assert simulation.stats.max_speed < 1e-3
    assert -2e-3 < simulation.positions[:, 2].min() < 1e-3


def test_free_flight_keeps_both_momenta():
    """Exactly: forces act at the positions whose velocities they change, and they neither push nor turn the whole."""
    for law in ("corotational", "neo-hookean"):
        material = tf.Material(model=law, youngs=1e5, poisson=0.3)
        simulation = explicit(CUBE, material, body={"velocity": (1, 2, 3), "spin": (3, 1, 2)})
        simulation.set_positions(CUBE.points * [1.1, 0.9, 1.0])
        linear, angular = (np.array(getattr(simulation.stats, k)) for k in ("momentum", "angular_momentum"))
        simulation.advance(seconds=0.5)
        np.testing.assert_allclose(simulation.stats.momentum, linear, atol=1e-12 * np.linalg.norm(linear))
        np.testing.assert_allclose(simulation.stats.angular_momentum, angular, atol=1e-11 * np.linalg.norm(angular))
        del simulation  # the next one takes its world, which is compiled


def test_first_order():
    """Half the step, half the error, against a run with steps a thirtieth as long."""
    material = tf.Material(model="stvk", youngs=1e4, poisson=0.3)

    def end(substeps):
        simulation = explicit(CUBE, material, fps=100, substeps=substeps, body={"spin": (0, 2, 0)})
        simulation.set_positions(CUBE.points * [1.1, 0.95, 1.0])
        simulation.advance(seconds=0.1)
        return simulation.positions

    exact = end(480)
    coarse, fine = (np.abs(end(n) - exact).max() for n in (8, 16))
    assert coarse / fine == pytest.approx(2, abs=0.3)
