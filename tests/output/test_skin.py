"""What is seen of bodies with embedded surfaces: whole, moved, broken."""

from dataclasses import replace

import meshio
import numpy as np
import pytest
from scipy.spatial import cKDTree

import taichifem as tf
from taichifem.mesh.clipping import Inside
from taichifem.output.export import open_export
from taichifem.output.frame import FrameBuilder
from taichifem.output.skin import Skin

BEAR = tf.EmbeddedSurface.from_file("asset:bear")
CAGE = tf.TetMesh.from_file("asset:bear", cage=300)
BODY = tf.Body(mesh=CAGE, embed=BEAR, material=tf.Material(youngs=1e5), position=(0, 0, 1), angle=30.0)


def test_the_frame_shows_the_surface_in_its_place():
    simulation = tf.Simulation(tf.Scene(bodies=[BODY]), precision="f64")
    turn = tf.Motion(angle=(70.0,), axis=(1, 2, 3)).at(0)[0]
    simulation.set_positions(simulation.rest_positions @ turn.T + [1, 2, 3])
    frame = FrameBuilder().build(simulation)
    assert len(frame.triangles) == len(BEAR.triangles)
    shown = frame.points[frame.triangles]
    expected = (BODY.placed(BEAR.points) @ turn.T + [1, 2, 3])[BEAR.triangles]
    np.testing.assert_allclose(shown, expected, atol=1e-5)


def test_values_and_colors_ride_along():
    painted = replace(BEAR, colors=np.tile([0.1, 0.8, 0.3], (len(BEAR.points), 1)))
    scene = tf.Scene(bodies=[replace(BODY, embed=painted), tf.Body(mesh=tf.TetMesh.bar())])
    frame = FrameBuilder().build(tf.Simulation(scene))
    own = np.abs(frame.colors - [0.1, 0.8, 0.3]).max(axis=1) < 1e-6
    assert own.sum() == len(BEAR.triangles) < len(frame.triangles)
    seen = replace(scene, view=tf.View(color="displacement"))
    frame = FrameBuilder().build(tf.Simulation(seen))
    assert frame.values.shape == (len(frame.points),)


@pytest.mark.parametrize("format", ["obj", "ply"])
def test_surfaces_are_exported_in_place_of_the_cage(tmp_path, format):
    import trimesh

    simulation = tf.Simulation(tf.Scene(bodies=[BODY]))
    export = open_export(tmp_path, format, simulation)
    export.write(simulation)
    found = trimesh.load(export.files[0], process=False)
    assert len(found.faces) == len(BEAR.triangles)
    np.testing.assert_allclose(
        found.bounds, [BODY.placed(BEAR.points).min(0), BODY.placed(BEAR.points).max(0)], atol=1e-5
    )


@pytest.mark.parametrize("format", ["obj", "ply"])
def test_colours_and_places_in_a_texture_are_exported(tmp_path, format):
    """Of the surface's own; what has none has its body's colour. The file is read by an independent library."""
    rng = np.random.default_rng(0)
    colors, uv = rng.integers(0, 256, BEAR.points.shape) / 255, rng.random((len(BEAR.points), 2))
    scene = tf.Scene(bodies=[replace(BODY, embed=replace(BEAR, colors=colors, uv=uv)), tf.Body(mesh=tf.TetMesh.bar())])
    simulation = tf.Simulation(scene)
    export = open_export(tmp_path, format, simulation)
    export.write(simulation)
    found = tf.EmbeddedSurface.from_file(str(export.files[0]))
    distance, own = cKDTree(found.points).query(BODY.placed(BEAR.points))
    assert distance.max() < 1e-5
    if format == "ply":
        words = meshio.read(export.files[0]).point_data
        shades = np.column_stack([words[name] for name in ("red", "green", "blue")])[own]
        np.testing.assert_array_equal(shades, np.rint(255 * colors))
        places = np.column_stack([words["s"], words["t"]])[own]
    else:
        lines = [line.split() for line in export.files[0].read_text().splitlines()]
        rows = np.array([line[1:] for line in lines if line[0] == "v"], float)
        _, own = cKDTree(rows[:, :3]).query(BODY.placed(BEAR.points))
        np.testing.assert_allclose(rows[own, 3:], colors, atol=1e-6)
        places = np.array([line[1:] for line in lines if line[0] == "vt"], float)[own]
        _, own = cKDTree(found.points).query(BODY.placed(BEAR.points))
        np.testing.assert_allclose(found.uv[own], uv, atol=1e-6)
    np.testing.assert_allclose(places, uv, atol=1e-6)


def test_copies_at_a_crack_keep_their_colour():
    painted = replace(BEAR, colors=np.tile([0.1, 0.8, 0.3], (len(BEAR.points), 1)))
    material = tf.Material(youngs=1e6, fracture=tf.Fracture(toughness=1e4))
    high = tf.Pin(
        region=tf.BoxRegion(lower=(-9, -9, 1.6), upper=(9, 9, 9)),
        motion=tf.Motion(times=(0, 0.3), translation=[(0, 0, 0), (0, 0, 1.0)]),
    )
    low = tf.BoxRegion(lower=(-9, -9, -9), upper=(9, 9, 1.25))
    body = replace(BODY, embed=painted, material=material, pins=[low, high])
    simulation = tf.Simulation(tf.Scene(bodies=[body], gravity=(0, 0, 0)))
    simulation.advance(seconds=0.5)
    seen = Skin().of(simulation)
    own = np.unique(seen.triangles[~seen.cracked])
    assert len(own) > len(BEAR.points)
    np.testing.assert_allclose(seen.paint[own, :3], np.tile([0.1, 0.8, 0.3], (len(own), 1)))


def test_triangles_go_with_the_piece_that_holds_them():
    """A cage torn in two: no triangle is stretched across the gap, and crack faces close it."""
    material = tf.Material(youngs=1e6, fracture=tf.Fracture(toughness=1e4))
    low = tf.BoxRegion(lower=(-9, -9, -9), upper=(9, 9, 0.25))
    high = tf.BoxRegion(lower=(-9, -9, 0.6), upper=(9, 9, 9))
    away = tf.Motion(times=(0, 0.3), translation=[(0, 0, 0), (0, 0, 1.0)])
    body = tf.Body(mesh=CAGE, embed=BEAR, material=material, pins=[low, tf.Pin(region=high, motion=away)])
    simulation = tf.Simulation(tf.Scene(bodies=[body], gravity=(0, 0, 0)))
    simulation.advance(seconds=0.5)
    assert simulation.piece_count > 1
    seen = Skin().of(simulation)
    points = seen.follow(simulation.positions)
    own = ~seen.cracked
    assert own.sum() == len(BEAR.triangles) and seen.cracked.any()
    edges = points[seen.triangles[own]]
    rest = BEAR.points[BEAR.triangles]
    longest = np.linalg.norm(edges - np.roll(edges, 1, axis=1), axis=2).max()
    assert longest < 0.5 < points[:, 2].max() - 1.0
    assert longest < 6 * np.linalg.norm(rest - np.roll(rest, 1, axis=1), axis=2).max()
    assert seen.pieces.max() < simulation.piece_count
    # What is drawn of the crack lies inside of the surface: its rim is that of the skin.
    crack = seen.follow(simulation.rest_positions)[np.unique(seen.triangles[seen.cracked])]
    depth = Inside(BEAR.points, BEAR.triangles).depth(crack)
    assert depth.min() > -0.015 and depth.max() > 0.05


def test_modal_bodies_touch_with_what_is_embedded():
    """The embedded vertices stay out of the ground, which the cage may enter."""
    material = tf.Material(model="modal", modes=10, youngs=2e5, mass_damping=2.0)
    body = replace(BODY, material=material, position=(0, 0, 0.1), angle=0.0)
    simulation = tf.simulate(tf.Scene(bodies=[body], colliders=[tf.PlaneCollider()]))
    simulation.advance(seconds=1.5)
    seen = Skin().of(simulation)
    height = seen.follow(simulation.positions)[np.unique(seen.triangles), 2]
    assert -2e-3 < height.min() < 2e-3
    assert simulation.positions[:, 2].min() < -2e-3
