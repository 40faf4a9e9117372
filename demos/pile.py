"""Stiffness over five orders of magnitude in one solve: nothing sinks, nothing explodes, all comes to rest."""

import numpy as np


def check(frames):
    """`frames` yields the simulation after every frame."""
    for simulation in frames:
        x = simulation.positions
        assert np.isfinite(x).all()
        assert x[:, 2].min() > -0.02
        to_ball = np.linalg.norm(x - (-0.95, 0.0, 0.1), axis=1) - 0.4
        assert to_ball.min() > -0.02
    assert simulation.stats.converged
    moving = [np.linalg.norm(simulation.velocities[simulation.node_bodies == body].mean(axis=0)) for body in range(9)]
    assert np.median(moving) < 0.05
