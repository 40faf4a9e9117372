"""What of faces lies inside of a surface: depths, and areas by the circle that a plane cuts out of a ball."""

import numpy as np
import trimesh

from taichifem.mesh.clipping import Inside, clip


def ball(subdivisions=4):
    sphere = trimesh.creation.icosphere(subdivisions=subdivisions)
    return Inside(np.asarray(sphere.vertices), np.asarray(sphere.faces))


def areas(faces, shares, of):
    corners = shares @ faces[of]
    return 0.5 * np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)


def test_depth_is_the_distance_from_the_surface():
    inside, rng = ball(), np.random.default_rng(0)
    places = rng.uniform(-1.5, 1.5, (500, 3))
    np.testing.assert_allclose(inside.depth(places), 1 - np.linalg.norm(places, axis=1), atol=3e-3)
    box = trimesh.creation.box(extents=(1, 1, 1)).subdivide().subdivide()
    box = Inside(np.asarray(box.vertices), np.asarray(box.faces))
    # Nearest to an edge and to a corner, where the triangles around disagree about the side.
    np.testing.assert_allclose(
        box.depth(np.array([[0.6, 0.6, 0.1], [0.7, 0.7, 0.7], [0.4, 0, 0]])), [-(0.02**0.5), -(0.12**0.5), 0.1]
    )


def test_a_face_through_a_ball_keeps_a_disc():
    """At half the radius: a disc of radius sqrt(3)/2, from a triangle that holds all of it."""
    faces = np.array([[[-3, -2, 0.5], [3, -2, 0.5], [0, 4, 0.5]]])
    shares, of = clip(faces, ball())
    assert abs(areas(faces, shares, of).sum() / (0.75 * np.pi) - 1) < 0.2
    assert np.linalg.norm(shares @ faces[of], axis=-1).max() < 1.1
    fine = trimesh.Trimesh(faces[0], [[0, 1, 2]]).subdivide().subdivide().subdivide()
    faces = np.asarray(fine.triangles)
    shares, of = clip(faces, ball())
    assert abs(areas(faces, shares, of).sum() / (0.75 * np.pi) - 1) < 6e-3
    np.testing.assert_allclose(shares.sum(axis=2), 1)
    normals = np.cross(*(shares @ faces[of])[:, 1:].transpose(1, 0, 2) - (shares @ faces[of])[:, 0])
    assert (normals[:, 2] > -1e-12).all(), "they face the way their faces do"


def test_faces_deep_inside_stay_whole_and_those_outside_go():
    small = 0.1 * np.array([[[0, 0, 0], [1, 0, 0], [0, 1, 0]]])
    faces = np.concatenate([small, small + 2, small - 0.2])
    shares, of = clip(faces, ball())
    assert of.tolist() == [0, 2]
    np.testing.assert_array_equal(shares, [np.eye(3)] * 2)
