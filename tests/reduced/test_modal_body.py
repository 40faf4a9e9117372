"""Bodies of few modes: flight, swing, contact, what they cannot do."""

from dataclasses import replace

import numpy as np
import pytest

import taichifem as tf
from taichifem.errors import InputError
from taichifem.reduced.modal_body import ModalBody
from taichifem.reduced.parts import linear_twin, take_apart

BAR = tf.TetMesh.bar(size=(0.6, 0.2, 0.2), cells=(6, 2, 2))
SOFT = tf.Material(model="modal", modes=20, youngs=1e5, poisson=0.3)
HELD = tf.BoxRegion(lower=(-1, -1, -1), upper=(1e-6, 1, 1))


def scene_of(
    material=SOFT, *, colliders=(), gravity=(0, 0, -9.81), mesh=BAR, fps=60, integrator="backward-euler", **body
):
    body = tf.Body(mesh=mesh, material=material, **body)
    return tf.Scene(bodies=[body], colliders=colliders, gravity=gravity, fps=fps, integrator=integrator)


def test_free_fall_and_spin():
    """The centre of mass falls exactly; angular momentum and energy stay."""
    start = dict(position=(0, 0, 5), velocity=(1, 0, 2), spin=(3, 1, 0.5))
    simulation = tf.simulate(scene_of(**start), precision="f64")
    before = simulation.stats
    centre = simulation.masses @ simulation.positions / simulation.masses.sum()
    simulation.advance(seconds=1.0)
    after = simulation.stats
    expected = centre + np.array([1, 0, 2 - 0.5 * 9.81])
    np.testing.assert_allclose(simulation.masses @ simulation.positions / simulation.masses.sum(), expected, rtol=1e-12)
    assert after.energy["total"] == pytest.approx(before.energy["total"], rel=1e-4)
    spun = simulation.bodies[0].frame.momentum
    np.testing.assert_allclose(spun, tf.simulate(scene_of(**start)).bodies[0].frame.momentum, rtol=1e-12)


def test_sag_is_the_balance_of_the_full_body():
    """With all modes and damping, the held bar comes to rest in the shape of K u = f."""
    mesh = tf.TetMesh.bar(size=(0.6, 0.2, 0.2), cells=(3, 1, 1))
    material = replace(SOFT, modes=3 * 12, mass_damping=20.0)
    scene = scene_of(material, mesh=mesh, pins=[HELD])
    simulation = tf.simulate(scene, precision="f64")
    simulation.advance(seconds=4.0)
    twin = linear_twin(scene)
    free = np.repeat(twin.rest_positions[:, :1] > 1e-6, 3, axis=1).ravel()
    load = (twin.masses[:, None] * [0, 0, -9.81]).ravel()
    u = np.zeros(len(load))
    u[free] = np.linalg.solve(twin.stiffness().toarray()[np.ix_(free, free)], load[free])
    moved = (simulation.positions - simulation.rest_positions).ravel()
    np.testing.assert_allclose(moved, u, rtol=0, atol=1e-6 * np.abs(u).max())


def test_swings_like_the_full_body():
    """A few modes follow the full linear body, integrated without damping in small steps."""
    scene = scene_of(pins=[HELD], gravity=(0, 0, -1.0))
    modal = tf.simulate(scene, precision="f64")
    linear = replace(scene.bodies[0], material=replace(SOFT, model="linear"))
    full = tf.simulate(replace(scene, bodies=[linear], integrator="newmark", substeps=8), precision="f64")
    tip, largest = scene.bodies[0].mesh.points[:, 0] > 0.6 - 1e-9, 0.0
    for _ in range(60):
        modal.advance_frame(), full.advance_frame()
        sag = [(s.positions - s.rest_positions)[tip, 2].mean() for s in (modal, full)]
        largest = max(largest, abs(sag[1]))
        assert abs(sag[0] - sag[1]) < 0.03 * largest + 1e-5


@pytest.mark.parametrize("spin", [(0, 0, 0), (2, 5, 1)])
@pytest.mark.parametrize("friction", [0.0, 0.6])
def test_contact_never_creates_energy(spin, friction):
    """Undamped bodies thrown on the ground and against a ball: what they lose is what contact took, at least 0."""
    ground = [tf.PlaneCollider(friction=friction), tf.SphereCollider(center=(0.9, 0.1, 0.0), radius=0.3)]
    thrown = dict(position=(0, 0, 0.5), velocity=(1.5, 0, -1), spin=spin)
    simulation = tf.simulate(scene_of(colliders=ground, **thrown), precision="f64")
    start, touched = simulation.stats.energy["total"], 0
    kinetic = simulation.stats.energy["kinetic"]
    for _ in range(180):
        simulation.step()
        energy, taken = simulation.stats.energy["total"], simulation.bodies[0].touch.dissipated
        touched += simulation.contacts > 0
        assert taken >= -1e-12
        # In flight only the implicit midpoint rule of the turn errs.
        assert energy + taken == pytest.approx(start, abs=0.01 * kinetic)
    assert touched > 20
    assert simulation.positions[:, 2].min() > -2e-3
    assert energy < start - 20


def test_a_resting_body_rests():
    """On the ground it neither creeps, nor sinks, nor jitters."""
    scene = scene_of(replace(SOFT, mass_damping=2.0), colliders=[tf.PlaneCollider()], position=(0, 0, 0.02))
    simulation = tf.simulate(scene, precision="f64")
    simulation.advance(seconds=3.0)
    at = simulation.positions
    for _ in range(60):
        simulation.step()
        assert np.abs(simulation.positions - at).max() < 1e-4
    assert at[:, 2].min() > -1e-4


def test_friction_holds_on_a_slope_and_lets_slide():
    """Below the angle of friction it stays, above it slides as fast as a point mass."""
    slope = np.radians(20)
    normal = (np.sin(slope), 0, np.cos(slope))
    gone = {}
    for friction in (0.6, 0.1):
        plane = tf.PlaneCollider(normal=normal, friction=friction)
        turn = dict(axis=(0, 1, 0), angle=20.0)
        scene = scene_of(replace(SOFT, youngs=1e7, mass_damping=0.0), colliders=[plane], **turn)
        simulation = tf.simulate(scene, precision="f64")
        start = simulation.positions.mean(axis=0)
        simulation.advance(seconds=1.0)
        gone[friction] = np.linalg.norm(simulation.positions.mean(axis=0) - start)
        del simulation  # the next one takes its world, which is compiled
    assert gone[0.6] < 5e-3
    expected = 0.5 * 9.81 * (np.sin(slope) - 0.1 * np.cos(slope))
    assert gone[0.1] == pytest.approx(expected, rel=0.03)


def test_a_shaken_pin_swings_the_body():
    """The bar follows its pin, and lags behind it."""
    motion = tf.Motion(times=(0, 0.2), translation=[(0, 0, 0), (0, 0, 0.1)], smooth=True)
    scene = scene_of(pins=[tf.Pin(region=HELD, motion=motion)], gravity=(0, 0, 0))
    full = replace(scene.bodies[0], material=replace(SOFT, model="linear"))
    modal = tf.simulate(scene, precision="f64")
    linear = tf.simulate(replace(scene, bodies=[full], integrator="newmark", substeps=4), precision="f64")
    off, lag = [], []
    for _ in range(30):
        modal.advance_frame(), linear.advance_frame()
        off.append(np.abs(modal.positions - linear.positions).max())
        lag.append(np.ptp((linear.positions - linear.rest_positions)[:, 2]))
    assert max(off) < 0.1 * max(lag)


def test_a_handle_pulls():
    """At rest the spring of the handle and the weight are in balance."""
    top = tf.NearestRegion(point=(0.3, 0.1, 0.2), count=6)
    handle = tf.Handle(region=top, stiffness=1e4)
    simulation = tf.simulate(scene_of(replace(SOFT, mass_damping=5.0), handles=[handle]), precision="f64")
    simulation.advance(seconds=4.0)
    nodes = top.select(simulation.rest_positions)
    stretched = (simulation.rest_positions - simulation.positions)[nodes, 2].mean()
    assert stretched == pytest.approx(simulation.masses.sum() * 9.81 / 1e4, rel=1e-3)


def test_forces_push_and_pressures_follow():
    everywhere = tf.BoxRegion(lower=(-9, -9, -9), upper=(9, 9, 9))
    force = tf.Force(region=everywhere, force=(0, 48.0, 0))
    squeezed = tf.Pressure(region=everywhere, pressure=1e3)
    simulation = tf.simulate(
        scene_of(replace(SOFT, stiffness_damping=0.01), gravity=(0, 0, 0), forces=[force], pressures=[squeezed]),
        precision="f64",
    )
    simulation.advance(seconds=1.0)
    mass = simulation.masses.sum()
    assert simulation.stats.momentum[1] == pytest.approx(48.0, rel=1e-9)
    assert simulation.positions[:, 1].mean() - simulation.rest_positions[:, 1].mean() == pytest.approx(
        24 / mass, rel=1e-3
    )
    assert np.ptp(simulation.positions[:, 0]) < 0.6


def test_checkpoints_continue_bit_for_bit(tmp_path):
    scene = scene_of(colliders=[tf.PlaneCollider()], position=(0, 0, 0.1), spin=(1, 2, 0))
    one, other = tf.simulate(scene), tf.simulate(scene)
    one.advance(seconds=0.5)
    one.save(tmp_path / "half.npz")
    other.load(tmp_path / "half.npz")
    one.advance(seconds=0.5), other.advance(seconds=0.5)
    assert (one.positions == other.positions).all()


def test_stress_is_that_of_the_full_body():
    scene = scene_of(pins=[HELD])
    simulation = tf.simulate(scene, precision="f64")
    simulation.advance(seconds=0.2)
    twin = linear_twin(scene)
    twin.set_positions(simulation.positions)
    np.testing.assert_allclose(simulation.von_mises(), twin.von_mises(), rtol=1e-9)


@pytest.mark.parametrize(
    "change, message",
    [
        (dict(material=replace(SOFT, modes=10_000)), "degrees of freedom"),
        (dict(material=replace(SOFT, basis="quadratic", modes=25)), 'basis = "fem"'),
        (dict(pins=[tf.Pin(region=HELD, until=1.0)]), "lets go"),
        (dict(integrator="quasi-static"), 'use model = "condensed"'),
    ],
)
def test_what_modal_bodies_refuse(change, message):
    with pytest.raises(InputError, match=message) as caught:
        tf.simulate(scene_of(**change))
    assert "\n" not in str(caught.value)


def test_what_reduced_materials_refuse():
    with pytest.raises(InputError, match=r'plasticity changes the body.*use model = "corotational"'):
        replace(SOFT, plasticity="creep", yield_strain=0.1, creep_rate=1.0)
    with pytest.raises(InputError, match=r'fracture changes the body.*use model = "corotational"'):
        replace(SOFT, fracture=tf.Fracture(toughness=1e4))
    with pytest.raises(InputError, match=r"taichifem\.simulate"):
        tf.Simulation(scene_of())
    mixed = scene_of()
    with pytest.raises(InputError, match="cannot share a scene"):
        tf.simulate(replace(mixed, bodies=[*mixed.bodies, tf.Body(mesh=BAR)]))


def test_all_rows_belong_to_the_surface():
    """What a step works with are rows of the surface, in the precision of the simulation."""
    body = ModalBody(take_apart(scene_of(), linear_twin(scene_of()))[0], dt=1 / 60)
    assert body.skin.all.rows.shape == (3 * len(np.unique(BAR.surface())), 20)
    assert body.skin.all.rows.dtype == np.float32


def test_colliders_far_away_are_left_alone():
    """What may touch on its way is never missed: the same flight with and without looking first."""
    ground = [tf.PlaneCollider(), tf.BoxCollider(center=(1.2, 0, 0.4), size=(0.3, 2, 0.2))]
    scene = scene_of(colliders=ground, position=(0, 0, 0.6), velocity=(3, 0, 0), spin=(0, 4, 1))
    one, other = tf.simulate(scene, precision="f64"), tf.simulate(scene, precision="f64")
    other._obstacles.near = lambda _table, _before, _after, radius: np.ones(len(radius), dtype=bool)
    for _ in range(60):
        one.step(), other.step()
        np.testing.assert_allclose(one.positions, other.positions, rtol=0, atol=1e-9)
    assert one.bodies[0].touch.dissipated > 0
