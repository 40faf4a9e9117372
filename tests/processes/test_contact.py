"""Contact with colliders: rest, friction, moving obstacles."""

import numpy as np
import pytest

import taichifem as tf

CUBE = tf.TetMesh.bar(size=(0.3, 0.3, 0.3), cells=(3, 3, 3))


def on_slope(degrees: float, friction: float, **body) -> tf.Simulation:
    """A cube on a slope that falls towards -x."""
    angle = np.radians(degrees)
    plane = tf.PlaneCollider(normal=(-np.sin(angle), 0, np.cos(angle)), friction=friction)
    material = tf.Material(youngs=1e5, poisson=0.3)
    cube = tf.Body(mesh=CUBE, material=material, axis=(0, -1, 0), angle=degrees, **body)
    return tf.Simulation(tf.Scene(bodies=[cube], colliders=[plane]))


@pytest.mark.parametrize(("degrees", "friction"), [(0, 0.0), (0, 0.5), (20, 0.5)])
def test_a_resting_body_rests(degrees, friction):
    """It neither creeps nor jitters nor sinks: 4 s later it lies where it lay."""
    simulation = on_slope(degrees, friction)
    simulation.advance(seconds=4)
    before = simulation.positions
    simulation.advance(seconds=4)
    assert np.abs(simulation.positions - before).max() < 2e-6 * 0.3
    normal = np.array(simulation.scene.colliders[0].normal)
    assert (before @ normal).min() > -2e-3 * 0.3
    assert simulation.stats.max_speed < 1e-5


def test_sliding_follows_coulomb():
    """Acceleration g (sin a - mu cos a) down a slope steeper than friction holds."""
    simulation = on_slope(20, 0.2)
    simulation.advance(seconds=1)
    first = simulation.velocities.mean(axis=0)
    simulation.advance(seconds=1)
    rate = np.linalg.norm(simulation.velocities.mean(axis=0) - first)
    angle = np.radians(20)
    assert rate == pytest.approx(9.81 * (np.sin(angle) - 0.2 * np.cos(angle)), rel=5e-3)


def test_friction_stops_a_sliding_body_after_v2_over_2_mu_g():
    cube = tf.Body(mesh=CUBE, material=tf.Material(youngs=1e6, poisson=0.3), velocity=(1.0, 0, 0))
    scene = tf.Scene(bodies=[cube], colliders=[tf.PlaneCollider(friction=0.3)])
    simulation = tf.Simulation(scene)
    start = simulation.positions[:, 0].mean()
    simulation.advance(seconds=1.0)
    assert simulation.stats.max_speed < 1e-3
    # Backward Euler falls short of v^2 / (2 mu g) by half a step's way.
    expected = 1 / (2 * 0.3 * 9.81) - 0.5 / scene.fps
    assert simulation.positions[:, 0].mean() - start == pytest.approx(expected, rel=0.01)


def test_nodes_stay_outside_of_every_kind_of_collider():
    """A soft block falls on a ball and a tilted box beside it."""
    ball = tf.SphereCollider(center=(0.15, 0.15, 0), radius=0.2)
    box = tf.BoxCollider(center=(0.6, 0.15, 0), size=(0.4, 0.5, 0.3), axis=(0, 1, 0), angle=20)
    mesh = tf.TetMesh.bar(size=(0.6, 0.3, 0.3), cells=(6, 3, 3))
    body = tf.Body(mesh=mesh, material=tf.Material(youngs=5e4, poisson=0.3), position=(0.1, 0, 0.35))
    ground = tf.PlaneCollider(point=(0, 0, -0.5))
    simulation = tf.Simulation(tf.Scene(bodies=[body], colliders=[ball, box, ground]))
    turn = tf.Motion(angle=(20.0,), axis=(0, 1, 0)).at(0)[0]
    touched = 0
    for _ in range(120):
        simulation.step()
        x = simulation.positions
        to_ball = np.linalg.norm(x - ball.center, axis=1) - ball.radius
        local = (x - box.center) @ turn
        to_box = (np.abs(local) - np.array(box.size) / 2).max(axis=1)
        assert min(to_ball.min(), to_box.min()) > -0.01
        touched += simulation.stats.contacts > 0
    assert touched > 20


def test_a_moving_collider_pushes_and_carries():
    """A plate under the cube rises, then travels: the cube goes with it."""
    motion = tf.Motion(times=(0, 1, 3), translation=((0, 0, 0), (0, 0, 0.5), (0.4, 0, 0.5)), smooth=True)
    plate = tf.BoxCollider(center=(0.15, 0.15, -0.05), size=(1, 1, 0.1), friction=0.8, motion=motion)
    cube = tf.Body(mesh=CUBE, material=tf.Material(youngs=1e5, poisson=0.3))
    simulation = tf.Simulation(tf.Scene(bodies=[cube], colliders=[plate]))
    simulation.advance(seconds=3.5)
    shift = simulation.positions.mean(axis=0) - CUBE.points.mean(axis=0)
    np.testing.assert_allclose(shift, (0.4, 0, 0.5), atol=5e-3)


def test_a_turning_collider_carries_by_friction():
    """A turntable takes the cube round with it."""
    motion = tf.Motion(times=(0, 2), angle=(0, 90), smooth=True, center=(0.15, 0.15, 0))
    table = tf.PlaneCollider(friction=1.0, motion=motion)
    cube = tf.Body(mesh=CUBE, material=tf.Material(youngs=1e5, poisson=0.3))
    simulation = tf.Simulation(tf.Scene(bodies=[cube], colliders=[table]))
    simulation.advance(seconds=2.5)
    top = simulation.positions[CUBE.points[:, 2] > 0.29]
    expected = tf.Motion(angle=(90.0,), center=(0.15, 0.15, 0)).at(0)
    turned = CUBE.points[CUBE.points[:, 2] > 0.29] @ expected[0].T + expected[1]
    np.testing.assert_allclose(top[:, :2], turned[:, :2], atol=0.01)


def test_momentum_balances_the_weight_on_the_ground():
    """Free fall, impact and rest, with energy never above what it was."""
    body = tf.Body(mesh=CUBE, material=tf.Material(youngs=1e5, poisson=0.3), position=(0, 0, 0.5))
    simulation = tf.Simulation(tf.Scene(bodies=[body], colliders=[tf.PlaneCollider()]), precision="f64")
    energy = simulation.stats.energy["total"]
    for _ in range(120):
        simulation.step()
        now = simulation.stats.energy["total"]
        assert now <= energy + 1e-3
        energy = now
    assert simulation.positions[:, 2].min() > -1e-3


def test_many_bodies_come_to_rest_and_steps_then_settle_at_once():
    """Some of many contacts are always on the verge of slipping: they neither let a body creep nor hold steps up."""
    angle, rng = np.radians(20), np.random.default_rng(0)
    plane = tf.PlaneCollider(normal=(-np.sin(angle), 0, np.cos(angle)), friction=0.5)
    mesh = tf.TetMesh.bar(size=(0.2, 0.2, 0.1), cells=(4, 4, 2))
    bodies = [
        tf.Body(
            mesh=mesh,
            material=tf.Material(youngs=10 ** rng.uniform(5, 7), poisson=0.3),
            position=(0.4 * i, 0.4 * j, 0.02 + 0.4 * i * np.tan(angle)),
            velocity=tuple(0.5 * rng.normal(size=3)),
        )
        for i in range(3)
        for j in range(4)
    ]
    simulation = tf.Simulation(tf.Scene(bodies=bodies, colliders=[plane]))
    simulation.advance(seconds=3)
    before, passes = simulation.positions, []
    for _ in range(60):
        simulation.step()
        passes.append(simulation.report.contact_passes)
    assert np.abs(simulation.positions - before).max() < 1e-6
    assert simulation.stats.max_speed < 3e-5
    assert np.mean(passes) < 3
