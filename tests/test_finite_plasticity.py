"""Bodies that flow at large strain: volume, permanence, tangent, and agreement with small strain."""

import numpy as np
import pytest
from convergence import box
from mechanics import direction, loose_elements
from test_plasticity import stretched

import taichifem as tf

LAW = dict(youngs=1e5, poisson=0.35, yield_stress=4e3, hardening=5e3)
SLOW = pytest.mark.slow


def volume(simulation: tf.Simulation) -> float:
    """Of the whole body, in that of its rest shape."""
    corners = simulation.positions[simulation.cells], simulation.rest_positions[simulation.cells]
    now, rest = (np.linalg.det(x[:, 1:] - x[:, :1]).sum() for x in corners)
    return now / rest


def pressed_cube(law: tf.Material) -> tf.Simulation:
    """On slippery ground, under a plate that comes down to half its height within a second, stays one, and leaves."""
    way = tf.Motion(times=(0.0, 1.0, 2.0, 2.5), translation=((0, 0, 0), (0, 0, -0.5), (0, 0, -0.5), (0, 0, 0.3)))
    plate = tf.BoxCollider(size=(4.0, 4.0, 1.0), center=(0.5, 0.5, 1.5), motion=way, friction=0.0)
    body = tf.Body(mesh=tf.TetMesh.bar(size=(1.0, 1.0, 1.0), cells=(3, 3, 3)), material=law)
    return tf.Simulation(
        tf.Scene(bodies=[body], colliders=[tf.PlaneCollider(friction=0.0), plate], gravity=(0, 0, -0.3))
    )


@pytest.mark.parametrize(
    ("model", "law"),
    [
        ("neo-hookean", "von-mises"),
        pytest.param("neo-hookean", "tresca", marks=SLOW),
        pytest.param("invertible", "von-mises", marks=SLOW),
        pytest.param("invertible", "tresca", marks=SLOW),
    ],
)
def test_crushed_and_let_go_it_has_its_volume_back(model, law):
    simulation = pressed_cube(tf.Material(model=model, plasticity=law, mass_damping=2.0, **LAW))
    simulation.advance(seconds=1.0)
    assert np.ptp(simulation.positions[:, 2]) == pytest.approx(0.5, abs=0.03)  # contact gives a little
    assert abs(volume(simulation) - 1) > 0.02
    simulation.advance(seconds=0.7)
    speeds = []
    for _ in range(15):
        simulation.advance_frame()
        speeds.append(abs(simulation.velocities).max())
    assert max(speeds) < 2e-3, "under a plate at rest it is at rest"
    simulation.advance(seconds=4.0)
    assert 0.5 < np.ptp(simulation.positions[:, 2]) < 0.8
    assert volume(simulation) == pytest.approx(1.0, abs=1e-3)
    # The logarithms of det F_p, in the single precision of this scene.
    assert abs(np.trace(simulation.plastic_strain(), axis1=1, axis2=2)).max() < 1e-5
    assert simulation.equivalent_plastic_strain().min() > 0.1


@pytest.mark.parametrize("model", ["neo-hookean", "stvk"])
@pytest.mark.parametrize("law", ["von-mises", "tresca"])
def test_small_strains_follow_the_small_strain_law(model, law):
    path = 1e-3 * np.array([0.2, 0.5, 1.0, 0.6, 0.0, 1.2])
    histories = []
    for each in ("linear", model):
        material = tf.Material(model=each, plasticity=law, youngs=1e5, poisson=0.35, yield_stress=30, hardening=1e4)
        simulation = stretched(path, material)
        history = []
        for _ in path:
            simulation.step()
            assert simulation.report.balanced
            history.append([simulation.cauchy_stress()[0, 0, 0], simulation.equivalent_plastic_strain()[0]])
        assert abs(np.trace(simulation.plastic_strain(), axis1=1, axis2=2)).max() < 1e-14
        histories.append(history)
        del simulation  # the next one takes its world, which is compiled
    for column, near in ((0, 0.05), (1, 1e-6)):
        found, wanted = (np.array(h)[:, column] for h in reversed(histories))
        np.testing.assert_allclose(found, wanted, rtol=5e-3, atol=near)


@pytest.mark.parametrize("law", ["von-mises", "tresca"])
def test_green_strain_follows_its_closed_form(law):
    """Uniaxial: the second Piola-Kirchhoff stress is Y + H alpha, and E = S / E + alpha."""
    youngs, limit, hardening = 1e5, 2e3, 1e4
    material = tf.Material(
        model="stvk", plasticity=law, youngs=youngs, poisson=0.3, yield_stress=limit, hardening=hardening
    )
    simulation = stretched([0.01, 0.1, 0.3], material)
    for pulled in (0.01, 0.1, 0.3):
        simulation.step()
        assert simulation.report.balanced
        green = pulled + pulled**2 / 2
        alpha = max(0.0, (youngs * green - limit) / (youngs + hardening))
        piola = youngs * (green - alpha)
        stretch, across = 1 + pulled, np.prod(np.ptp(simulation.positions, axis=0)[1:])
        assert simulation.equivalent_plastic_strain() == pytest.approx(alpha, rel=1e-8)
        assert simulation.cauchy_stress()[:, 0, 0].mean() == pytest.approx(piola * stretch / across, rel=1e-6)


@pytest.mark.parametrize("d", [2, 3])
@pytest.mark.parametrize("model", ["neo-hookean", "stvk"])
@pytest.mark.parametrize("law", ["von-mises", pytest.param("tresca", marks=SLOW)])
def test_tangent_of_what_flows_is_the_derivative_of_the_force(d, model, law):
    """Without commitment: the state is that at rest, the flow that of one step."""
    body = tf.Body(mesh=loose_elements(d, 12), material=tf.Material(model=model, plasticity=law, **LAW))
    simulation = tf.Simulation(
        tf.Scene(bodies=[body], gravity=(0, 0, 0), integrator="backward-euler-newton"), precision="f64"
    )
    rest = simulation.rest_positions
    x = rest + 0.05 * direction(d, len(rest), 3)
    h, along = 1e-6, direction(d, len(rest), 4)

    def forces(where):
        simulation._due = 0.0  # nothing has flowed for good
        simulation.set_positions(where)
        simulation._due = 0.1
        return simulation.elastic_forces()

    slope = -(forces(x + h * along) - forces(x - h * along)) / (2 * h)
    forces(x)
    assert (simulation.equivalent_plastic_strain() > 0).mean() > 0.5
    product = (simulation.stiffness() @ along.ravel()).reshape(-1, 3)
    np.testing.assert_allclose(product, slope, atol=1e-5 * abs(slope).max())


@pytest.mark.parametrize("model", ["neo-hookean", pytest.param("invertible", marks=SLOW), "stvk"])
@pytest.mark.parametrize("law", ["creep", pytest.param("von-mises", marks=SLOW)])
def test_a_permanent_shape_turns_with_the_body(model, law):
    """Bent, let go and thrown: what is left does not know which way it looks, nor flows on."""
    flow = dict(yield_strain=0.03, creep_rate=20.0, max_plastic_strain=0.2) if law == "creep" else LAW
    material = tf.Material(**(dict(model=model, plasticity=law, youngs=1e5, poisson=0.35, mass_damping=4.0) | flow))
    mesh = tf.TetMesh.bar(size=(1.0, 0.25, 0.25), cells=(8, 2, 2))
    push = tf.Force(region=box(lower=(1 - 1e-6, -1e3, -1e3)), force=(0, 0, -60), ramp=0.2, until=0.5)
    body = tf.Body(mesh=mesh, material=material, pins=[box(upper=(1e-6, 1e3, 1e3))], forces=[push])
    simulation = tf.Simulation(tf.Scene(bodies=[body], gravity=(0, 0, 0)))
    simulation.advance(seconds=4.0)
    left, flowed = simulation.positions, simulation.equivalent_plastic_strain()
    assert left[:, 2].min() < -0.02
    assert flowed.max() > 0.01
    if law == "creep":
        assert np.linalg.norm(simulation.plastic_strain(), axis=(1, 2)).max() <= 0.2 * (1 + 1e-5)
    energy = simulation.elastic_energy()
    turn = np.array([[0.0, -0.6, 0.8], [1.0, 0.0, 0.0], [0.0, 0.8, 0.6]])
    simulation.set_positions(left @ turn.T)
    assert simulation.elastic_energy() == pytest.approx(energy, rel=2e-3)
    np.testing.assert_allclose(simulation.equivalent_plastic_strain(), flowed, rtol=1e-3, atol=1e-5)
