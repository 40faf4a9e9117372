"""Pins, prescribed motions and handles."""

import numpy as np
import pytest

import taichifem as tf
from taichifem import InputError

LEFT = tf.BoxRegion(lower=(-1, -1, -1), upper=(1e-6, 1, 1))
RIGHT = tf.BoxRegion(lower=(0.599, -1, -1), upper=(1, 1, 1))


def simulate(block, *, pins=(), handles=(), precision="f64", material=None, **scene):
    body = tf.Body(mesh=block, material=material or tf.Material(youngs=1e5), pins=pins, handles=handles)
    return tf.Simulation(tf.Scene(bodies=[body], **scene), precision=precision)


@pytest.mark.parametrize(
    ("region", "count"),
    [
        (LEFT, 16),
        (tf.SphereRegion(center=(0, 0, 0), radius=0.11), 4),
        (tf.IndexRegion(indices=[0, 5, 7]), 3),
        (tf.NearestRegion(point=(0.6, 0.3, 0.3)), 1),
    ],
)
def test_pinned_nodes_do_not_move(block, region, count):
    chosen = region.select(block.points)
    assert len(chosen) == count
    simulation = simulate(block, pins=[region])
    simulation.advance(seconds=0.2)
    np.testing.assert_array_equal(simulation.positions[chosen], block.points[chosen])
    assert np.abs(simulation.positions - block.points).max() > 1e-3


def test_single_axes_can_be_held(block):
    simulation = simulate(block, pins=[tf.Pin(region=LEFT, axes="z")], gravity=(1.0, 0, -9.81))
    chosen = LEFT.select(block.points)
    simulation.advance(seconds=0.2)
    moved = simulation.positions[chosen] - block.points[chosen]
    np.testing.assert_allclose(moved[:, 2], 0, atol=1e-12)
    assert np.abs(moved[:, 0]).min() > 1e-3


def test_prescribed_motion_is_followed_exactly(block):
    motion = tf.Motion(times=(0, 0.5), angle=(0, 90), axis=(1, 0, 0), translation=((0, 0, 0), (0.1, 0, 0)))
    simulation = simulate(block, pins=[LEFT, tf.Pin(region=RIGHT, motion=motion)], precision="f32")
    chosen = RIGHT.select(block.points)
    for _ in range(30):
        simulation.step()
        R, c = motion.at(simulation.time)
        np.testing.assert_allclose(simulation.positions[chosen], block.points[chosen] @ R.T + c, atol=2e-6)


def test_released_pin_lets_go(block):
    simulation = simulate(block, pins=[tf.Pin(region=LEFT, until=0.1)])
    simulation.advance(seconds=0.1)
    chosen = LEFT.select(block.points)
    np.testing.assert_array_equal(simulation.positions[chosen], block.points[chosen])
    momentum, mass = np.array(simulation.stats.momentum), simulation.masses.sum()
    simulation.advance(seconds=0.5)
    expected = momentum + mass * 0.5 * np.array([0, 0, -9.81])
    np.testing.assert_allclose(simulation.stats.momentum, expected, atol=1e-9 * mass)


def test_handle_carries_the_weight_at_its_stretch(block):
    """At rest the spring holds the body: k stretch = m g."""
    stiffness = 2000.0
    handle = tf.Handle(region=RIGHT, stiffness=stiffness)
    material = tf.Material(youngs=1e6, mass_damping=8.0)
    simulation = simulate(block, handles=[handle], material=material)
    simulation.advance(seconds=6)
    chosen = RIGHT.select(block.points)
    stretch = (block.points[chosen] - simulation.positions[chosen]).mean(axis=0)
    weight = simulation.masses.sum() * 9.81
    assert stiffness * stretch[2] == pytest.approx(weight, rel=1e-3)


def test_handle_acts_between_its_times(block):
    handle = tf.Handle(region=RIGHT, stiffness=500, start=0.1, until=0.2, motion=tf.Motion(translation=((0.2, 0, 0),)))
    simulation = simulate(block, handles=[handle], gravity=(0, 0, 0))
    simulation.advance(seconds=0.1)
    assert np.abs(simulation.stats.momentum).max() < 1e-12
    simulation.advance(seconds=0.1)
    pulled = np.array(simulation.stats.momentum)
    assert pulled[0] > 0.1
    simulation.advance(seconds=0.3)
    np.testing.assert_allclose(simulation.stats.momentum, pulled, atol=1e-9)


def test_a_region_without_nodes_is_named(block):
    with pytest.raises(InputError, match=r"body\.0\.pin\.0 selects no node"):
        simulate(block, pins=[tf.SphereRegion(center=(9, 9, 9), radius=0.1)])
