"""Small meshes for the mechanics of single elements, and derivatives by central differences."""

import numpy as np

import taichifem as tf

AXES = {2: [0, 2], 3: [0, 1, 2]}
"""Coordinates in which elements of dimension d move."""


def loose_elements(d: int, count: int) -> tf.TetMesh | tf.TriMesh:
    """Elements of random shape, none of which touches another."""
    rng = np.random.default_rng(d)
    points, cells = [], []
    while len(cells) < count:
        corners = rng.uniform(-1, 1, size=(d + 1, d))
        if abs(np.linalg.det(corners[1:] - corners[0])) > 0.2:
            cells.append(np.arange(d + 1) + (d + 1) * len(cells))
            points.append(corners + 3.0 * len(points) * np.eye(d)[0])
    mesh = tf.TetMesh if d == 3 else tf.TriMesh
    return mesh(np.concatenate(points), np.array(cells))


def turned(d: int, rng: np.random.Generator) -> np.ndarray:
    """A random rotation (3,3): any in space, one about y in the plane."""
    q, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    return q * np.sign(np.linalg.det(q)) if d == 3 else tf.Motion(angle=(360 * rng.random(),), axis=(0, 1, 0)).at(0)[0]


def direction(d: int, n: int, seed: int) -> np.ndarray:
    """Random displacements (n,3), in the plane if d is 2."""
    u = np.zeros((n, 3))
    u[:, AXES[d]] = np.random.default_rng(seed).normal(size=(n, d))
    return u


def assert_derivatives(simulation: tf.Simulation, x: np.ndarray, d: np.ndarray, *, tangent: bool = True) -> None:
    """At x, along d: force = -dU/dx and K = -df/dx, to 1e-6 by central differences."""
    h = 1e-6
    simulation.set_positions(x)
    force, product = simulation.elastic_forces(), simulation.stiffness() @ d.ravel()
    simulation.set_positions(x + h * d)
    force_up, energy_up = simulation.elastic_forces(), simulation.elastic_energy()
    simulation.set_positions(x - h * d)
    force_down, energy_down = simulation.elastic_forces(), simulation.elastic_energy()
    work = np.abs(force * d).sum()  # single terms are larger than their sum: the error goes with them
    assert abs((energy_up - energy_down) / (2 * h) + (force * d).sum()) < 1e-6 * work
    slope = (force_down - force_up).ravel() / (2 * h)
    if tangent:
        np.testing.assert_allclose(product, slope, atol=1e-6 * np.abs(slope).max())


def tear(simulation, elements: np.ndarray, normal, *, seed: int) -> None:
    """Split a vertex of each of some elements of a simulation that may break, by a plane of this normal."""
    any_corner, normals = np.full(len(elements), -1), np.tile(normal, (len(elements), 1))
    done = simulation._splitting.tear(
        simulation.positions, elements, any_corner, normals, seed=(seed, 0), most=len(elements)
    )
    simulation._reshape(done.parent)
