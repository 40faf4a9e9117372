"""Hundreds of elements inside out all come back to the rest shape, let go by pins or put at random places."""

from dataclasses import replace

import numpy as np

import taichifem as tf


def inside_out(simulation):
    """Number of elements whose volume is below 0, for each body."""
    corners = simulation.positions[simulation.cells]
    turned = np.linalg.det(corners[:, 1:] - corners[:, :1]) < 0
    return np.bincount(simulation.cell_bodies, turned)


def shape_error(simulation):
    """Largest distance of a node from the rest shape, moved and turned to fit best [m]."""
    rest = simulation.rest_positions - simulation.rest_positions.mean(axis=0)
    now = simulation.positions - simulation.positions.mean(axis=0)
    u, _, v = np.linalg.svd(now.T @ rest)
    turn = u @ np.diag([1, 1, np.linalg.det(u @ v)]) @ v
    return np.abs(now - rest @ turn.T).max()


def check(frames):
    """`frames` yields the simulation after every frame."""
    most = np.zeros(4)
    for simulation in frames:
        assert np.isfinite(simulation.positions).all()
        most = np.maximum(most, inside_out(simulation))
    assert (most[:2] > 300).all() and (most[2:] > 200).all()
    assert not inside_out(simulation).any()
    moved = np.linalg.norm(simulation.positions - simulation.rest_positions, axis=1)
    for body in range(4):
        assert moved[simulation.node_bodies == body].max() < 0.08, "back, but for the last swings"

    scene = simulation.scene
    mesh = tf.TetMesh.bar(size=(0.4, 0.4, 0.4), cells=(4, 4, 4))
    for body in scene.bodies[2:]:
        block = replace(body, mesh=mesh, pins=(), position=(-0.2, -0.2, -0.2))
        scrambled = tf.Simulation(replace(scene, bodies=[block], colliders=()))
        places = np.random.default_rng(1).uniform(-0.2, 0.2, scrambled.positions.shape)
        scrambled.set_positions(places)
        assert inside_out(scrambled)[0] > 100
        scrambled.advance(seconds=3.0)
        assert shape_error(scrambled) < 0.004 and not inside_out(scrambled).any(), body.name
