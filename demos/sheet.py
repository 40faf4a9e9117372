"""No energy from nothing, no element inside out; Young's modulus, Poisson's ratio and density act as they must."""

from dataclasses import replace

import numpy as np

import taichifem as tf


def areas(simulation):
    """Areas of all triangles now, below 0 where turned over [m^2]."""
    corners = simulation.positions[simulation.cells][:, :, ::2]
    return np.linalg.det(corners[:, 1:] - corners[:, :1]) / 2


def hung(scene, **changes):
    """Sag of the lower edge and narrowing at half height [m] of a coarse sheet hung along its upper edge."""
    body = scene.bodies[0]
    edge = tf.BoxRegion(lower=(-1, -1, 2.899), upper=(4, 1, 3))
    mesh = tf.TriMesh.rectangle(size=(3.9, 2.9), cells=(8, 6))
    sheet = replace(body, mesh=mesh, material=replace(body.material, **changes), pins=[edge])
    simulation = tf.Simulation(replace(scene, bodies=[sheet], integrator="quasi-static", substeps=1), precision="f64")
    simulation.step()
    assert simulation.report.balanced
    moved = simulation.positions - simulation.rest_positions
    sides = [np.isclose(simulation.rest_positions, (x, 0, 1.45)).all(axis=1) for x in (0.0, 3.9)]
    return -moved[:, 2].min(), float((moved[sides[0], 0] - moved[sides[1], 0])[0])


def check(frames):
    """`frames` yields the simulation after every frame."""
    energies, lowest = [], 3 * [np.inf]
    for simulation in frames:
        if not simulation.frame % 5:
            assert np.isfinite(simulation.positions).all() and areas(simulation).min() > 0
            energies.append(simulation.stats.energy["total"])
        for body in range(3):
            lowest[body] = min(lowest[body], simulation.positions[simulation.node_bodies == body, 2].min())
    assert simulation.dt == 1e-3 and simulation.dt < simulation.critical_step()
    energies = np.array(energies)
    assert (np.diff(energies) < 1e-3 * np.ptp(energies)).all(), "damped, so energy only goes down"
    assert lowest[0] < -1.0 and lowest[1] > -0.5 and lowest[2] > -0.5, "one pin lets it swing, more do not"

    sag, narrowed = hung(simulation.scene)
    assert 0 < sag < 0.2 and narrowed > 0
    twice = [hung(simulation.scene, **changes)[0] / sag for changes in ({"youngs": 2.4e5}, {"density": 200.0})]
    np.testing.assert_allclose(twice, (0.5, 2.0), rtol=0.15)
    assert hung(simulation.scene, poisson=0.0)[1] < 0.1 * narrowed < 0.1 * hung(simulation.scene, poisson=0.45)[1]
