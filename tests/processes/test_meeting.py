"""Bodies and pieces that are in each other's way."""

import numpy as np
import pytest
from mechanics import tear

import taichifem as tf
from taichifem.errors import Diverged

SOLID = tf.Material(youngs=1e6, poisson=0.3, density=1000)
CUBE = tf.TetMesh.bar(size=(0.4, 0.4, 0.4), cells=(4, 4, 4))


def simulated(bodies, **options) -> tf.Simulation:
    return tf.Simulation(tf.Scene(bodies=bodies, **{"body_contact": True, **options}))


def momenta(simulation) -> tuple[np.ndarray, np.ndarray]:
    """Linear and angular momentum."""
    p = simulation.masses[:, None] * simulation.velocities
    return p.sum(axis=0), np.cross(simulation.positions, p).sum(axis=0)


def inside(simulation, one: int, other: int) -> int:
    """Nodes of one body within elements of another."""
    corners = simulation.positions[simulation.cells[simulation.cell_bodies == other]]
    nodes = simulation.positions[simulation.node_bodies == one]
    edges = np.linalg.inv((corners[:, 1:] - corners[:, :1]).transpose(0, 2, 1))
    shares = np.einsum("mij,mnj->mni", edges, nodes[None] - corners[:, :1])
    return int(((shares > 0.01).all(axis=2) & (shares.sum(axis=2) < 0.99)).sum())


def energy_of(simulation) -> float:
    """Kinetic and elastic energy."""
    kinetic = 0.5 * (simulation.masses[:, None] * simulation.velocities**2).sum()
    return kinetic + simulation.elastic_energy()


def test_bodies_that_collide_keep_their_momentum():
    bodies = [
        tf.Body(mesh=CUBE, material=SOLID, velocity=(5, 0, 0)),
        tf.Body(mesh=CUBE, material=SOLID, position=(0.6, 0.03, 0.02)),
    ]
    simulation = simulated(bodies, gravity=(0, 0, 0))
    (before, turning), energy = momenta(simulation), energy_of(simulation)
    met = 0
    for _ in range(40):
        simulation.step()
        met = max(met, simulation.meetings)
        after, spinning = momenta(simulation)
        np.testing.assert_allclose(after, before, atol=1e-5 * before[0])
        assert simulation.report.converged
        assert energy_of(simulation) < energy * (1 + 1e-5)
    assert met > 10 and simulation.meetings == 0, "they part again"
    np.testing.assert_allclose(spinning, turning, atol=0.05 * before[0] * 0.4)
    assert not inside(simulation, 0, 1) and not inside(simulation, 1, 0)


def test_a_stack_stands():
    bodies = [tf.Body(mesh=CUBE, material=SOLID, position=(0.03 * k, 0.02 * k, 0.41 * k + 0.01)) for k in range(3)]
    simulation = simulated(bodies, colliders=[tf.PlaneCollider()])
    simulation.advance(seconds=2)
    body, x = simulation.node_bodies, simulation.positions
    lowest = [x[body == b, 2].min() for b in range(3)]
    assert lowest == pytest.approx([0.0, 0.4, 0.8], abs=0.02)
    assert [x[body == b, 0].mean() for b in range(3)] == pytest.approx([0.2, 0.23, 0.26], abs=0.01)
    assert abs(simulation.velocities).max() < 0.1
    weight = 9.81 * simulation.masses.sum()
    assert momenta(simulation)[0][2] / simulation.dt < 0.05 * weight


def test_pieces_that_have_just_split_feel_nothing():
    material = tf.Material(youngs=1e6, poisson=0.3, fracture=tf.Fracture(toughness=1e9))
    simulation = tf.Simulation(tf.Scene(bodies=[tf.Body(mesh=CUBE, material=material)], gravity=(0, 0, 0)))
    rng = np.random.default_rng(0)
    for k in range(30):
        tear(simulation, rng.permutation(len(CUBE.cells)), rng.normal(size=3), seed=k)
    assert simulation.piece_count > 50
    for _ in range(10):
        simulation.step()
        assert abs(simulation.velocities).max() < 1e-5
    assert abs(simulation.positions - simulation.rest_positions).max() < 1e-6


def test_without_contact_bodies_pass_through_each_other():
    bodies = [
        tf.Body(mesh=CUBE, material=SOLID, velocity=(5, 0, 0)),
        tf.Body(mesh=CUBE, material=SOLID, position=(0.6, 0.1, 0.05)),
    ]
    simulation = simulated(bodies, gravity=(0, 0, 0), body_contact=None)
    simulation.advance(seconds=0.3)
    assert simulation.velocities[simulation.node_bodies == 0, 0].min() > 4.99 and simulation.meetings == 0


def test_what_cannot_meet_is_told():
    with pytest.raises(tf.InputError, match="body_contact"):
        simulated([tf.Body(mesh=CUBE)], integrator="symplectic-euler")
    with pytest.raises(tf.InputError, match="planar"):
        simulated([tf.Body(mesh=tf.TriMesh.rectangle(size=(1, 1), cells=(2, 2)))])


def test_what_flies_to_the_ends_of_the_grid_is_not_searched_for():
    """Cells that far away have no numbers: the search between two of them once took forever."""
    bodies = [tf.Body(mesh=CUBE, material=SOLID), tf.Body(mesh=CUBE, material=SOLID, position=(0, 0, 0.41))]
    simulation = simulated(bodies, gravity=(0, 0, 0))
    velocities, element = simulation.velocities, simulation.cells[31]
    velocities[element[:2], 0] = -1.2e10, 1.2e10
    simulation.set_velocities(velocities)
    try:
        simulation.step()
    except Diverged:
        return
    assert simulation.meetings < 100
