"""Hands on a body while it moves: what they pull with, what they hold, and that nothing else changes."""

import numpy as np
import pytest
from mechanics import tear

import taichifem as tf
from taichifem.hands import ROOM

WALL = tf.BoxRegion(lower=(-1, -1, -1), upper=(1e-6, 1, 1))


@pytest.fixture(scope="module")
def simulation():
    bar = tf.TetMesh.bar(size=(0.6, 0.3, 0.3), cells=(6, 3, 3))
    material = tf.Material(youngs=1e5, poisson=0.3, mass_damping=4.0, stiffness_damping=0.05)
    scene = tf.Scene(bodies=[tf.Body(mesh=bar, material=material, pins=[WALL])], gravity=(0, 0, 0))
    return tf.Simulation(scene, precision="f64")


@pytest.fixture(autouse=True)
def at_rest(simulation, request):
    if not hasattr(request.module, "_start"):
        request.module._start = simulation.snapshot()
    simulation.restore(*request.module._start)
    return simulation


def tip(simulation):
    return int(np.argmax(simulation.rest_positions @ (1, 0.01, 0.02)))


def test_a_hand_pulls_with_its_spring_and_the_wall_pulls_back(simulation):
    hand = simulation.grab(tip(simulation), radius=0.15, stiffness=800.0)
    assert 4 <= len(hand.nodes) <= 16
    hand.move((0.0, 0.05, 0.2))
    simulation.advance(seconds=3)
    force = hand.force(simulation.positions)
    assert np.linalg.norm(force) > 20
    held = simulation.rest_positions[:, 0] < 1e-6
    np.testing.assert_allclose(simulation.reactions()[held].sum(axis=0), -force, atol=2e-3 * np.linalg.norm(force))
    simulation.hands.set_stiffness(hand, 1600.0)
    simulation.advance(seconds=0.5)
    assert np.linalg.norm(hand.force(simulation.positions)) > 1.05 * np.linalg.norm(force)
    simulation.hands.release(hand)
    simulation.advance(seconds=3)
    np.testing.assert_allclose(simulation.positions, simulation.rest_positions, atol=1e-4)
    with pytest.raises(tf.InputError, match="let go already"):
        simulation.hands.release(hand)


def test_a_firm_hand_keeps_its_nodes_where_it_wants_them(simulation):
    hand = simulation.grab(tip(simulation), radius=0.11, stiffness=None)
    start = simulation.positions[hand.nodes]
    hand.move((0.05, 0.0, 0.1))
    simulation.step()
    np.testing.assert_allclose(
        simulation.positions[hand.nodes] - start, np.tile((0.05, 0, 0.1), (len(start), 1)), atol=1e-12
    )
    simulation.advance(seconds=0.2)
    np.testing.assert_allclose(simulation.velocities[hand.nodes], 0.0, atol=1e-9)
    assert simulation.critical_step() > 0


def test_a_push_gives_its_impulse(simulation):
    before = (simulation.masses[:, None] * simulation.velocities).sum(axis=0)
    simulation.push(tip(simulation), (1.0, -2.0, 0.5), radius=0.2)
    after = (simulation.masses[:, None] * simulation.velocities).sum(axis=0)
    np.testing.assert_allclose(after - before, (1.0, -2.0, 0.5), rtol=1e-12)


def test_there_is_room_for_some_hands_and_no_more(simulation):
    node = tip(simulation)
    with pytest.raises(tf.InputError, match=f"{ROOM} nodes at most"):
        for _ in range(ROOM + 1):
            simulation.grab(node, radius=0.2, stiffness=1.0)
    assert len(simulation.hands) > 10
    simulation.step()
    simulation.hands.clear()
    simulation.step()
    for wrong in (-1, 10**6, 1.5):
        with pytest.raises(tf.InputError, match="node"):
            simulation.grab(wrong, radius=0.1, stiffness=1.0)


def test_colliders_come_and_go(simulation):
    ball = tf.SphereCollider(center=(0.55, 0.15, 0.4), radius=0.2)
    simulation.set_colliders([ball])
    simulation.advance(seconds=0.5)
    pressed = simulation.force_on_ball(0, simulation.time)
    assert simulation.contacts > 0 and pressed[2] > 1
    simulation.set_colliders([])
    simulation.advance(seconds=3)
    np.testing.assert_allclose(simulation.positions, simulation.rest_positions, atol=1e-4)
    with pytest.raises(tf.InputError, match="there is room for"):
        simulation.set_colliders([ball] * 100)


def test_gravity_and_time_step_change_while_it_runs(simulation):
    simulation.adjust(gravity=(0.0, 0.0, -9.81), substeps=4)
    assert simulation.dt == pytest.approx(1 / 240)
    simulation.step()
    drop = simulation.positions[tip(simulation), 2] - simulation.rest_positions[tip(simulation), 2]
    assert -9.81 / 240**2 * 1.01 < drop < 0
    with pytest.raises(tf.InputError, match="tolerance"):
        simulation.adjust(tolerance=3.0)
    for _ in range(3):
        simulation.step()
    simulation.adjust(gravity=(0.0, 0.0, 0.0), substeps=None)
    assert simulation.dt == pytest.approx(1 / 60) and simulation.frame == 1


def test_a_hand_keeps_the_heaviest_copy_of_what_fracture_splits():
    bar = tf.TetMesh.bar(size=(0.6, 0.3, 0.3), cells=(6, 3, 3))
    body = tf.Body(mesh=bar, material=tf.Material(youngs=1e5, fracture=tf.Fracture(toughness=1e9)))
    simulation = tf.Simulation(tf.Scene(bodies=[body], gravity=(0, 0, 0)))
    hands = [simulation.grab(tip(simulation), radius=0.15, stiffness=k) for k in (800.0, None)]
    before = hands[0].nodes
    around = np.flatnonzero(np.isin(simulation.cells, before).any(axis=1))
    tear(simulation, np.random.default_rng(1).permutation(around), (1.0, 0.4, 0.2), seed=1)
    origins, masses = simulation.origins, simulation.masses
    assert np.isin(origins, before).sum() > len(before)
    for hand in hands:
        np.testing.assert_array_equal(origins[hand.nodes], before)
        heaviest = [masses[origins == node].max() for node in before]
        np.testing.assert_allclose(masses[hand.nodes], heaviest, rtol=1e-6)
    hands[1].move((0.0, 0.0, 0.1))
    there = simulation.positions[before]
    simulation.step()
    moved = simulation.positions[hands[1].nodes] - there
    np.testing.assert_allclose(moved, np.tile((0, 0, 0.1), (len(before), 1)), atol=1e-6)
