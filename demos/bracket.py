"""What the foot holds balances the loads at every instant, force for force and turn for turn."""

import numpy as np

INNER, OUTER, PRESSURE, TRACTION, FORCE = 0.14, 0.24, 9e4, 2.2e4, (300.0, 0.0, -600.0)


def ramp(time, start, seconds):
    """The part of a load that acts at `time` [s]."""
    return float(np.clip((time - start) / seconds, 0, 1))


def loads(simulation):
    """What acts on each node now (n,3) [N], worked out anew: weight, pressure, traction and the hook."""
    t, x, rest = simulation.time, simulation.positions, simulation.rest_positions
    total = simulation.masses[:, None] * np.array(simulation.scene.gravity)

    def spread(nodes, points, load):
        faces = simulation.surface[nodes[simulation.surface].all(axis=1)]
        a, b, c = np.moveaxis(points[faces], 1, 0)
        areas = np.cross(b - a, c - a) / 2
        for corner in faces.T:
            np.add.at(total, corner, load(areas) / 3)

    inside = (np.abs(rest[:, :2]) < 0.141).all(axis=1) & (rest[:, 2] > 0.01) & (rest[:, 2] < 0.79)
    spread(inside, x, lambda areas: -PRESSURE * ramp(t, 0.0, 1.0) * areas)
    sideways = np.array([TRACTION * ramp(t, 1.0, 1.2), 0, 0])
    spread(rest[:, 2] > 0.799, rest, lambda areas: np.linalg.norm(areas, axis=1)[:, None] * sideways)
    hooked = np.argsort(np.linalg.norm(rest - (OUTER, 0, 0.8), axis=1), kind="stable")[:6]
    total[hooked] += ramp(t, 2.2, 0.8) * np.array(FORCE) / 6
    return total


def check(frames):
    """`frames` yields the simulation after every frame."""
    width, reach = {}, {}
    for simulation in frames:
        assert simulation.report.balanced
        x, time = simulation.positions, round(simulation.time, 2)
        upper = simulation.rest_positions[:, 2] > 0.799
        width[time], reach[time] = np.ptp(x[:, 1]), x[upper, 0].mean()
        if simulation.frame % 10:
            continue
        acting, held = loads(simulation), simulation.reactions()
        scale = np.linalg.norm(acting, axis=1).sum()
        foot = simulation.rest_positions[:, 2] < 1e-6
        assert np.linalg.norm(held[~foot], axis=1).max() < 1e-3 * scale
        assert np.linalg.norm((acting + held).sum(axis=0)) < 1e-3 * scale
        assert np.linalg.norm(np.cross(x, acting + held).sum(axis=0)) < 1e-3 * scale
    assert width[1.0] > 1.05 * 2 * OUTER, "blown up"
    assert abs(reach[1.0]) < 0.01 < 0.1 < reach[2.2] < reach[3.2], "then bent"
