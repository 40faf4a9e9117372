"""Contact of embedded vertices: they rest, slide and stay out as nodes do, and the mesh around them does not touch."""

from dataclasses import replace

import numpy as np
import pytest

import taichifem as tf
from taichifem.output.skin import Skin
from taichifem.processes import contact

SIDE = 0.3
CUBE = tf.TetMesh.bar(size=(SIDE,) * 3, cells=(3, 3, 3))
LARGER = tf.TetMesh.bar(size=(1.4 * SIDE,) * 3, cells=(3, 3, 3))
CAGE = tf.TetMesh(LARGER.points - 0.2 * SIDE, LARGER.cells)
MATERIAL = tf.Material(youngs=1e5, poisson=0.3)


def surface(cells: int) -> tf.EmbeddedSurface:
    mesh = tf.TetMesh.bar(size=(SIDE,) * 3, cells=(cells,) * 3)
    nodes, triangles = np.unique(mesh.boundary(), return_inverse=True)
    return tf.EmbeddedSurface(mesh.points[nodes], triangles.reshape(-1, 3))


def on_slope(degrees: float, friction: float, embed: tf.EmbeddedSurface | None, **options) -> tf.Simulation:
    angle = np.radians(degrees)
    plane = tf.PlaneCollider(normal=(-np.sin(angle), 0, np.cos(angle)), friction=friction)
    cube = tf.Body(mesh=CUBE, embed=embed, material=MATERIAL, axis=(0, -1, 0), angle=degrees)
    return tf.Simulation(tf.Scene(bodies=[cube], colliders=[plane], **options))


def seen(simulation: tf.Simulation) -> np.ndarray:
    """Points of what is seen (p,3) [m]."""
    found = Skin().of(simulation)
    return found.follow(simulation.positions)[np.unique(found.triangles)]


@pytest.mark.parametrize("degrees", [0, 20])
def test_vertices_rest_and_sink_no_deeper_than_nodes(degrees):
    depth = []
    for embed in (None, surface(8)):
        simulation = on_slope(degrees, 0.5, embed)
        simulation.advance(seconds=2)
        before = simulation.positions
        simulation.advance(seconds=2)
        assert np.abs(simulation.positions - before).max() < 2e-5 * SIDE
        normal = np.array(simulation.scene.colliders[0].normal)
        depth.append(-(seen(simulation) @ normal).min())
        weight = 9.81 * simulation.masses.sum() * np.cos(np.radians(degrees))
        assert simulation._pressed_points(0)[1].sum() == pytest.approx(weight, rel=1e-3)
    assert 0 < depth[1] <= depth[0] < 2e-3 * SIDE


def test_nodes_in_whose_place_a_surface_touches_do_not_count():
    """They lie in the ground, and would vouch for other contacts that have not settled."""
    body = tf.Body(mesh=CAGE, embed=surface(4), material=MATERIAL, position=(0, 0, 0.1 * SIDE))
    simulation = tf.Simulation(tf.Scene(bodies=[body], colliders=[tf.PlaneCollider()], gravity=(0, 0, 0)))
    simulation.step()
    assert simulation.positions[:, 2].min() < -0.05 * SIDE
    with simulation._kernels():
        counts = simulation._counts
        assert contact.touch(simulation._world, counts.nodes, 1, 1 / 60, 1 / 60, 1.0, 0.03) == 0


def test_sliding_follows_coulomb():
    simulation = on_slope(20, 0.2, surface(8))
    simulation.advance(seconds=1)
    first = simulation.velocities.mean(axis=0)
    simulation.advance(seconds=1)
    rate = np.linalg.norm(simulation.velocities.mean(axis=0) - first)
    angle = np.radians(20)
    assert rate == pytest.approx(9.81 * (np.sin(angle) - 0.2 * np.cos(angle)), rel=5e-3)


def falling(mesh: tf.TetMesh, embed: tf.EmbeddedSurface | None, **options) -> tf.Simulation:
    """A cube falls askew on a ball, a box and the ground."""
    ball = tf.SphereCollider(center=(0.15, 0.15, 0), radius=0.2, friction=0.3)
    box = tf.BoxCollider(center=(0.55, 0.15, 0), size=(0.4, 0.5, 0.3), axis=(0, 1, 0), angle=20)
    ground = tf.PlaneCollider(point=(0, 0, -0.2), friction=0.4)
    body = tf.Body(mesh=mesh, embed=embed, material=MATERIAL, position=(0.2, 0.0, 0.35), angle=25, axis=(1, 2, 0))
    return tf.Simulation(tf.Scene(bodies=[body], colliders=[ball, box, ground], **options))


def depths(simulation: tf.Simulation, x: np.ndarray) -> np.ndarray:
    """How deep each point (p,3) lies in any collider [m]."""
    ball, box, ground = simulation.scene.colliders
    local = (x - box.center) @ tf.Motion(angle=(20.0,), axis=(0, 1, 0)).at(0)[0]
    to_box = (np.abs(local) - np.array(box.size) / 2).max(axis=1)
    gaps = np.linalg.norm(x - ball.center, axis=1) - ball.radius, to_box, x[:, 2] - ground.point[2]
    return -np.minimum.reduce(gaps)


@pytest.mark.parametrize(
    ("integrator", "most"), [("backward-euler", 1.1), pytest.param("symplectic-euler", 1.5, marks=pytest.mark.slow)]
)
def test_vertices_stay_outside_of_every_kind_of_collider(integrator, most):
    """In a fall they go in no deeper than the nodes of the same cube do; a little where steps are explicit."""
    worst = []
    for embed in (None, surface(8)):
        simulation, deepest, touched = falling(CUBE, embed, integrator=integrator), 0.0, 0
        for _ in range(45):
            simulation.advance_frame()
            deepest = max(deepest, depths(simulation, seen(simulation)).max())
            touched += simulation.contacts > 0
        assert touched > 10
        worst.append(deepest)
    assert 0 < worst[1] < most * worst[0]


def test_a_cage_does_not_keep_out():
    """What is seen of a cube in a larger cage lies on the ground, in which the cage is."""
    simulation, deepest, cage = falling(CAGE, surface(8)), 0.0, 0.0
    for _ in range(60):
        simulation.advance_frame()
        deepest = max(deepest, depths(simulation, seen(simulation)).max())
        cage = max(cage, depths(simulation, simulation.positions).max())
    assert 0 < deepest < 0.02 * SIDE
    assert cage > 0.1 * SIDE


@pytest.mark.slow
def test_a_body_in_balance_is_held_by_its_vertices():
    """Quasi-static: a plate lifts the surface by what the plate is lifted, and carries the weight."""
    top = tf.BoxRegion(lower=(-1, -1, 0.9 * SIDE), upper=(1, 1, 1))
    plate = tf.BoxCollider(center=(0.15, 0.15, -0.04), size=(1, 1, 0.1))
    body = tf.Body(mesh=CUBE, embed=surface(8), material=MATERIAL, pins=[top])
    simulation = tf.Simulation(tf.Scene(bodies=[body], colliders=[plate], integrator="quasi-static"))
    simulation.step()
    lowest = seen(simulation)[:, 2].min()
    assert 0.009 < lowest < 0.0101
    pressed = simulation._pressed_points(0)[1].sum()
    balance = simulation.reactions()
    assert pressed == pytest.approx(balance[simulation.rest_positions[:, 2] < 0.5 * SIDE, 2].sum(), rel=1e-3)


@pytest.mark.slow
def test_pieces_without_vertices_come_to_rest_on_their_nodes():
    """Of a tower in which only the upper half has vertices, the lower one comes off, and does not fall for ever."""
    small = surface(6)
    small = replace(small, points=0.4 * small.points + [0.1, 0.1, 0.2])
    mesh = tf.TetMesh.bar(size=(SIDE, SIDE, 0.4), cells=(2, 2, 4))
    material = tf.Material(youngs=1e5, poisson=0.3, fracture=tf.Fracture(toughness=2e3))
    held = tf.BoxRegion(lower=(-1, -1, 0.89), upper=(1, 1, 2))
    low = tf.BoxRegion(lower=(-1, -1, 0), upper=(1, 1, 0.55))
    down = tf.Motion(times=(0, 0.1), translation=[(0, 0, 0), (0, 0, -0.2)])
    pins = [held, tf.Pin(region=low, motion=down, until=0.1)]
    body = tf.Body(mesh=mesh, embed=small, material=material, position=(0, 0, 0.5), pins=pins)
    simulation = tf.Simulation(tf.Scene(bodies=[body], colliders=[tf.PlaneCollider(friction=0.5)]))
    assert simulation._world.shielded.to_numpy()[: len(mesh.points)].sum() >= len(mesh.points) - 2
    simulation.advance(seconds=1.5)
    carried = simulation.cell_pieces[body.embedding.element]
    bare = ~np.isin(simulation.cell_pieces, carried)
    assert bare.sum() > 0.2 * len(bare)
    assert -0.01 < simulation.positions[simulation.cells[bare], 2].min() < 0.05


def test_a_checkpoint_goes_on_bit_for_bit(tmp_path):
    simulation = on_slope(20, 0.3, surface(8))
    simulation.advance(seconds=0.5)
    simulation.save(tmp_path / "state.npz")
    simulation.advance(seconds=0.3)
    other = on_slope(20, 0.3, surface(8))
    other.advance(seconds=0.1)
    other.load(tmp_path / "state.npz")
    other.advance(seconds=0.3)
    np.testing.assert_array_equal(simulation.positions, other.positions)


def test_without_embedded_surfaces_nothing_is_made():
    simulation = on_slope(0, 0.5, None)
    assert simulation._riding is None
    assert not simulation._world.shielded.to_numpy()[: simulation._counts.nodes].any()
