"""Boundary elements against closed forms, their order of convergence, and finite elements."""

import numpy as np
import pytest
import trimesh

import taichifem as tf
from taichifem.errors import InputError
from taichifem.reduced.boundary_elements import BoundaryElements

STEEL = dict(youngs=2.0, poisson=0.3)


def ball(radius: float, level: int):
    sphere = trimesh.creation.icosphere(subdivisions=level, radius=radius)
    return np.array(sphere.vertices), np.array(sphere.faces)


def cube(cells: int):
    mesh = tf.TetMesh.bar(size=(1, 1, 1), cells=(cells, cells, cells))
    nodes, triangles = np.unique(mesh.surface(), return_inverse=True)
    return mesh.points[nodes], triangles.reshape(-1, 3)


def thick(level: int):
    """A ball of radius 2 with a hole of radius 1."""
    outer, faces = ball(2.0, level)
    inner, holes = ball(1.0, level)
    return np.concatenate([outer, inner]), np.concatenate([faces, holes[:, ::-1] + len(outer)])


@pytest.fixture(scope="module")
def unit_cube():
    return BoundaryElements(*cube(4), **STEEL)


@pytest.mark.parametrize("level", [1, 2, 3])
def test_sphere_under_pressure(level):
    """u = -p (1 - 2 nu) / E x: linear, so that only the quadrature errs."""
    body = BoundaryElements(*ball(1.0, level), **STEEL)
    u = body.displacement(-0.1 * body.normals)
    np.testing.assert_allclose(u, -0.1 * (1 - 2 * 0.3) / 2.0 * body.points, atol=2e-5 * 0.02)


def test_stretched_cube(unit_cube):
    """A linear field is in the space of the elements: only the quadrature errs."""
    body, tractions = unit_cube, np.zeros((len(unit_cube.triangles), 3))
    ends = np.abs(body.normals[:, 2]) > 0.5
    tractions[ends] = 0.1 * body.normals[ends]
    u = body.displacement(tractions)
    middle = body.points - 0.5
    expected = 0.1 / 2.0 * np.column_stack([-0.3 * middle[:, 0], -0.3 * middle[:, 1], middle[:, 2]])
    assert np.abs(u - expected).max() < 2e-3 * np.abs(expected).max()
    stress = body.stress(u, tractions)
    np.testing.assert_allclose(stress, np.broadcast_to(np.diag([0, 0, 0.1]), stress.shape), atol=1e-3)


def test_thick_sphere_converges():
    """Lame's solution under inner pressure: u(r) = p a^3 / (b^3 - a^3) [(1 - 2 nu) r + (1 + nu) b^3 / (2 r^2)] / E."""
    a, b, p, nu, E = 1.0, 2.0, 0.1, 0.3, 2.0
    errors = []
    for level in (1, 2, 3):
        body = BoundaryElements(*thick(level), **STEEL)
        inner = np.linalg.norm(body.points[body.triangles].mean(axis=1), axis=1) < 1.5
        u = body.displacement(-p * body.normals * inner[:, None])
        r = np.linalg.norm(body.points, axis=1)
        expected = p * a**3 / (b**3 - a**3) * ((1 - 2 * nu) * r + (1 + nu) * b**3 / (2 * r**2)) / E
        radial = (u * body.points).sum(axis=1) / r
        errors.append(np.abs(radial / expected - 1).max())
    order = np.log2(errors[1] / errors[2])
    print(f"thick sphere: errors {errors}, order {order:.2f}")
    assert errors[2] < 0.03
    assert order > 1.5


def test_rigid_motion_has_no_traction(unit_cube):
    body = unit_cube
    motion = (body.rigid @ np.arange(1.0, 7.0)).reshape(-1, 3)
    stretch = 0.1 * body.points * [0, 0, 1]
    scale = np.abs(body.reactions(stretch)).max() / np.abs(stretch).max()
    assert np.abs(body.reactions(motion)).max() < 1e-8 * scale * np.abs(motion).max()
    assert body.quadrature_error < 1e-3, "before that is taken out"


def test_a_shift_of_what_is_held_shifts_all(unit_cube):
    body = unit_cube
    held = np.flatnonzero(body.points[:, 0] < 1e-9)
    u = body.displacement(
        np.zeros((len(body.triangles), 3)), held=held, target=np.tile([0.1, 0.2, 0.3], (len(held), 1))
    )
    np.testing.assert_allclose(u, np.broadcast_to([0.1, 0.2, 0.3], u.shape), atol=1e-10)


def finite_elements(cells: int, pressure: float) -> np.ndarray:
    """Displacement of the pressed middle of a unit cube that stands on a held face."""
    mesh = tf.TetMesh.bar(size=(1, 1, 1), cells=(cells, cells, cells))
    floor = tf.BoxRegion(lower=(-1, -1, -1), upper=(2, 2, 1e-6))
    top = tf.BoxRegion(lower=(0.249, 0.249, 0.999), upper=(0.751, 0.751, 2))
    material = tf.Material(model="linear", **STEEL)
    body = tf.Body(mesh=mesh, material=material, pins=[floor], pressures=[tf.Pressure(region=top, pressure=pressure)])
    scene = tf.Scene(bodies=[body], gravity=(0, 0, 0), integrator="quasi-static")
    simulation = tf.Simulation(scene, precision="f64")
    assert simulation.balance().balanced
    at = tf.NearestRegion(point=(0.5, 0.5, 1)).select(mesh.points)[0]
    return (simulation.positions - mesh.points)[at]


@pytest.mark.slow
def test_agrees_with_refined_finite_elements():
    """A cube pressed on a quarter of its top, to 2 %; finite elements extrapolated from 16 and 24 cells a side."""
    points, triangles = cube(8)
    body = BoundaryElements(points, triangles, **STEEL)
    corners = points[triangles]
    pressed = ((corners >= [0.249, 0.249, 0.999]) & (corners <= [0.751, 0.751, 2])).all(axis=(1, 2))
    held = np.flatnonzero(points[:, 2] < 1e-9)
    u = body.displacement(-0.1 * body.normals * pressed[:, None], held=held)
    middle = np.argmin(np.linalg.norm(points - [0.5, 0.5, 1], axis=1))
    coarse, fine = finite_elements(16, 0.1), finite_elements(24, 0.1)
    limit = fine + (fine - coarse) / ((24 / 16) ** 2 - 1)
    print(f"bem {u[middle, 2]:.6g}, fem {coarse[2]:.6g} {fine[2]:.6g} -> {limit[2]:.6g}")
    assert u[middle, 2] == pytest.approx(limit[2], rel=0.02)


def test_inner_points_of_a_stretched_cube(unit_cube):
    body, tractions = unit_cube, np.zeros((len(unit_cube.triangles), 3))
    ends = np.abs(body.normals[:, 2]) > 0.5
    tractions[ends] = 0.1 * body.normals[ends]
    u = body.displacement(tractions)
    places = np.array([[0.5, 0.5, 0.5], [0.3, 0.6, 0.8]])
    found = body.inside(places).displacement(u, np.zeros_like(u), tractions)
    middle = places - 0.5
    expected = 0.05 * np.column_stack([-0.3 * middle[:, 0], -0.3 * middle[:, 1], middle[:, 2]])
    np.testing.assert_allclose(found, expected, atol=2e-4 * 0.05)


def test_an_open_surface_is_refused():
    points, triangles = cube(2)
    with pytest.raises(InputError, match=r'not closed.*model = "condensed"'):
        BoundaryElements(points, triangles[:-1], **STEEL)
