"""Condensed bodies and boundary elements in scenes: balance, implicit steps, pokes, what they refuse."""

from dataclasses import replace

import numpy as np
import pytest

import taichifem as tf
from taichifem.errors import InputError
from taichifem.reduced import surface_contact
from taichifem.reduced.active_set import balanced_forces

BAR = tf.TetMesh.bar(size=(0.6, 0.2, 0.2), cells=(9, 3, 3))
HELD = tf.BoxRegion(lower=(-1, -1, -1), upper=(1e-6, 1, 1))
FAR = tf.BoxRegion(lower=(0.599, -1, -1), upper=(1, 1, 1))


def scene_of(model, *, colliders=(), gravity=(0, 0, -9.81), integrator="quasi-static", pins=(HELD,), **body):
    material = tf.Material(model=model, youngs=1e6, poisson=0.3)
    return tf.Scene(
        bodies=[tf.Body(mesh=BAR, material=material, pins=pins, **body)],
        colliders=colliders,
        gravity=gravity,
        integrator=integrator,
    )


def moved(simulation):
    return simulation.positions - simulation.rest_positions


def full(scene):
    """The same scene of linear elasticity, balanced with tight tolerances."""
    body = replace(scene.bodies[0], material=replace(scene.bodies[0].material, model="linear"))
    return tf.simulate(replace(scene, bodies=[body], tolerance=1e-12), precision="f64")


LOADS = dict(
    forces=[tf.Force(region=FAR, force=(0, 30.0, 0))],
    pressures=[tf.Pressure(region=FAR, pressure=2e3)],
    handles=[tf.Handle(region=tf.NearestRegion(point=(0.3, 0.1, 0.2), count=5), stiffness=2e3)],
)


def test_condensed_balance_is_the_full_one():
    """Weight, force, pressure, a handle and a turned pin; all nodes and their stress to 1e-9."""
    turn = tf.Motion(times=(0, 0.01), angle=(0, 2.0), axis=(1, 0, 0))
    scene = scene_of("condensed", pins=[HELD, tf.Pin(region=FAR, motion=turn, axes="yz")], **LOADS)
    condensed, linear = tf.simulate(scene), full(scene)
    condensed.step()
    assert linear.balance(tolerance=1e-13).balanced
    size = np.abs(moved(linear)).max()
    np.testing.assert_allclose(moved(condensed), moved(linear), atol=1e-9 * size)
    np.testing.assert_allclose(condensed.von_mises(), linear.von_mises(), rtol=1e-6)


def test_boundary_elements_are_near_the_full_body():
    """The same loads on a bar of few elements: finite elements are stiffer."""
    scene = scene_of("bem", **LOADS)
    bem, linear = tf.simulate(scene), full(scene)
    bem.step(), linear.balance()
    ratio = (moved(bem)[BAR.points[:, 0] > 0.599] / moved(linear)[BAR.points[:, 0] > 0.599]).mean(axis=0)
    assert 1.0 < ratio[1] < 1.35 and 1.0 < ratio[2] < 1.35


def test_boundary_elements_hang_by_their_weight():
    """A block on a frictionless floor of pins: u_z = -rho g (h z - z^2 / 2) / E, inner nodes too.

    By the edges of the floor the reactions of so few elements are smeared out; above that it is right."""
    mesh = tf.TetMesh.bar(size=(1, 1, 1), cells=(4, 4, 4))
    floor = tf.BoxRegion(lower=(-1, -1, -1), upper=(2, 2, 1e-6))
    corner = tf.NearestRegion(point=(0, 0, 0))
    edge = tf.NearestRegion(point=(1, 0, 0))
    material = tf.Material(model="bem", youngs=1e6, poisson=0.0)
    pins = [tf.Pin(region=floor, axes="z"), tf.Pin(region=corner, axes="xy"), tf.Pin(region=edge, axes="y")]
    body = tf.Body(mesh=mesh, material=material, pins=pins)
    simulation = tf.simulate(tf.Scene(bodies=[body], integrator="quasi-static"))
    simulation.step()
    z = mesh.points[:, 2]
    expected = -9810 * (z - z**2 / 2) / 1e6
    above = z > 0.3
    np.testing.assert_allclose(moved(simulation)[above, 2], expected[above], atol=0.03 * 9810 / 2e6)


def test_implicit_steps_are_those_of_the_full_body():
    """Guyan's masses: the swing of the held bar is that of the full one to some percent."""
    scene = scene_of("condensed", integrator="backward-euler")
    condensed, linear = tf.simulate(scene), full(scene)
    for _ in range(30):
        condensed.step(), linear.step()
        assert np.abs(moved(condensed) - moved(linear)).max() < 0.03 * np.abs(moved(linear)).max()


@pytest.mark.parametrize("model", ["condensed", "bem"])
def test_a_ball_pokes_and_lets_go(model):
    """The surface gives way to the ball and springs back; nothing sinks in."""
    motion = tf.Motion(times=(0, 0.2, 0.4), translation=[(0, 0, 0), (0, 0, -0.09), (0, 0, 0)])
    ball = tf.SphereCollider(center=(0.6, 0.1, 0.36), radius=0.1, motion=motion)
    simulation = tf.simulate(scene_of(model, gravity=(0, 0, 0), colliders=[ball]))
    lowest, touched = 0.0, 0
    for _ in range(30):
        simulation.step()
        center = np.array([0.6, 0.1, 0.36]) + motion.at(simulation.time)[1]
        assert np.linalg.norm(simulation.positions - center, axis=1).min() > 0.1 - 1e-5
        lowest, touched = min(lowest, moved(simulation)[:, 2].min()), max(touched, simulation.contacts)
    assert lowest < -0.015
    assert touched >= 1
    assert np.abs(moved(simulation)).max() < 1e-9


def test_pins_let_go():
    """The update of what is held: a second pin ends, and the shape is that without it."""
    both = scene_of("condensed", pins=[HELD, tf.Pin(region=FAR, until=0.02)])
    simulation, without = tf.simulate(both), tf.simulate(scene_of("condensed"))
    simulation.step()
    assert np.abs(moved(simulation)[BAR.points[:, 0] > 0.599]).max() < 1e-12
    simulation.step(), without.step()
    np.testing.assert_allclose(moved(simulation), moved(without), atol=1e-9 * np.abs(moved(without)).max())


@pytest.mark.parametrize(
    "model, change, message",
    [
        ("bem", dict(integrator="backward-euler"), 'use integrator = "quasi-static"'),
        ("condensed", dict(integrator="bdf2"), '"backward-euler" and "quasi-static"'),
        ("condensed", dict(pins=()), "pin nodes"),
    ],
)
def test_what_surface_bodies_refuse(model, change, message):
    with pytest.raises(InputError, match=message) as caught:
        tf.simulate(scene_of(model, **change))
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("model", ["condensed", "bem"])
def test_pinned_points_in_a_ball_do_not_hold_the_others_up(model, monkeypatch):
    """The ball covers some of the pinned face: what can move gets out of its way, in a few passes."""
    passes = []

    def counted(*given):
        passes.append(len(given[1]))
        return balanced_forces(*given)

    monkeypatch.setattr(surface_contact, "balanced_forces", counted)
    way = tf.Motion(times=(0, 0.2), translation=((0, 0, 0), (0, 0, -0.05)))
    ball = tf.SphereCollider(center=(0.05, 0.1, 0.36), radius=0.15, friction=0.3, motion=way)
    simulation = tf.simulate(scene_of(model, colliders=[ball], gravity=(0, 0, 0)))
    simulation.advance(seconds=0.2)
    surface = np.unique(simulation.surface)
    outside = np.linalg.norm(simulation.positions[surface] - (0.05, 0.1, 0.31), axis=1) - 0.15
    pinned = BAR.points[surface][:, 0] < 1e-6
    assert outside[pinned].min() < -0.01
    assert outside[~pinned].min() > -1e-5
    assert simulation.contacts > 1
    assert len(passes) < 5 * (0.2 * simulation.scene.fps)
