"""The bytes that go to a browser, and what the mouse meets."""

import numpy as np
import pytest

import taichifem as tf
from taichifem.description import SphereCollider
from taichifem.live.messages import Surface, smoothing, topology, update
from taichifem.live.parameters import MATERIAL
from taichifem.live.picking import pick, ray_through
from taichifem.live.window import _from_slider, _to_slider
from taichifem.output.camera import Viewpoint
from taichifem.output.frame import Frame, pose


@pytest.fixture
def frame():
    bar = tf.TetMesh.bar(size=(1.0, 1.0, 1.0), cells=(2, 2, 2))
    ball = pose(SphereCollider(center=(1, 2, 3), radius=0.5), np.eye(3), np.zeros(3))
    values = bar.points[:, 0].astype(np.float32)
    return Frame(
        points=bar.points.astype(np.float32),
        triangles=bar.surface().astype(np.int32),
        values=values,
        value_range=(0.0, 2.0),
        colliders=(ball,),
    )


def test_corners_are_smooth_within_the_faces_of_a_cube_and_sharp_between_them(frame):
    surface = Surface(frame)
    points, triangles = frame.points[surface.nodes], surface.triangles
    normals = np.cross(
        points[triangles[:, 1]] - points[triangles[:, 0]], points[triangles[:, 2]] - points[triangles[:, 0]]
    )
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    assert surface.normals == 6 * 9  # nine nodes on each of the six faces
    for number in range(surface.normals):
        of = np.argwhere(surface.corners == number)
        assert len({int(triangles[t, k]) for t, k in of}) == 1
        assert np.ptp(normals[of[:, 0]], axis=0).max() < 1e-6
    ball = tf.TetMesh.sphere(radius=1.0, resolution=5)
    used, local = np.unique(ball.surface(), return_inverse=True)
    assert smoothing(ball.points[used], local.reshape(-1, 3)).max() + 1 == len(used)


def test_the_bytes_read_back(frame):
    surface = Surface(frame)
    n, k = len(surface.nodes), len(surface.triangles)
    data = topology(surface, np.tile([1.0, 0.5, 0.0], (k, 1)), 7)
    assert np.frombuffer(data, "<u4", 6).tolist() == [1, 7, n, k, surface.normals, 0]
    assert len(data) == 24 + 4 * (n + 3 * k + 3 * k + k)
    assert np.frombuffer(data, np.uint8)[-4:].tolist() == [255, 128, 0, 0]
    data = update(frame, surface, version=7, number=9, time=1.5, hands=np.arange(8.0)[None])
    assert np.frombuffer(data, "<u4", 8).tolist() == [2, 7, 9, n, 1, 1, 1, 0]
    assert np.frombuffer(data, "<f4", 4, 32).tolist() == [1.5, 0.0, 2.0, 0.0]
    assert len(data) == 48 + 4 * (3 * n + 16 + 8) + n
    sent = np.frombuffer(data, "<f4", 3 * n, 48).reshape(n, 3)
    np.testing.assert_array_equal(sent, frame.points[surface.nodes])
    collider = np.frombuffer(data, "<f4", 16, 48 + 12 * n)
    assert collider.tolist() == [1, 0, 0, 1, 0, 1, 0, 2, 0, 0, 1, 3, 1, 0.5, 0.5, 0.5]
    shades = np.frombuffer(data, np.uint8)[-n:]
    np.testing.assert_array_equal(shades, np.rint(255 * frame.values[surface.nodes] / 2))


def test_a_ray_meets_the_nearest_face(frame):
    viewpoint = Viewpoint.looking(np.array([0.3, -4.0, 0.4]), np.array([0.3, 0.0, 0.4]), 35.0)
    hit = pick(frame, viewpoint, ray_through(viewpoint, 0.0, 0.0, 1.5))
    np.testing.assert_allclose(hit.point, (0.3, 0.0, 0.4), atol=1e-6)
    assert hit.depth == pytest.approx(4.0)
    assert np.linalg.norm(frame.points[hit.node] - hit.point) < 0.6
    assert pick(frame, viewpoint, ray_through(viewpoint, 0.9, 0.9, 1.5)) is None
    spot = np.array([0.9, 0.0, 0.8])
    x, y, _ = viewpoint.project(spot[None], (300, 200))[0]
    hit = pick(frame, viewpoint, ray_through(viewpoint, x / 150 - 1, 1 - y / 100, 1.5))
    np.testing.assert_allclose(hit.point, spot, atol=1e-6)


def test_sliders_of_the_window_go_both_ways():
    for parameter in MATERIAL:
        if parameter.kind != "number":
            continue
        row = {name: getattr(parameter, name) for name in ("low", "high", "log", "whole")}
        assert _from_slider(row, 0.0) == parameter.low and _from_slider(row, 1.0) == parameter.high
        for at in (0.2, 0.5, 0.9):
            assert _to_slider(row, _from_slider(row, at)) == pytest.approx(at, abs=2e-3)
