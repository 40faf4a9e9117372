"""Pictures of the rasteriser, checked against geometry."""

import numpy as np
import pytest

from taichifem.description import Camera
from taichifem.output import light_kernels, raster_kernels, shading_kernels
from taichifem.output.camera import Viewpoint
from taichifem.output.frame import Frame, Shape, triangulate
from taichifem.output.rasterizer import Rasterizer

SIZE = (320, 240)
GROUND = Shape(kind="plane", rotation=np.eye(3), center=np.zeros(3))
EYE, TARGET = (3.0, -4.0, 2.5), (0.0, 0.0, 0.5)
RED, BLUE = (0.8, 0.05, 0.05), (0.05, 0.05, 0.8)


def frame_of(points, triangles, color=RED, **more) -> Frame:
    triangles = np.asarray(triangles, np.int32)
    shades = np.broadcast_to(np.asarray(color, np.float32), (len(triangles), 3))
    return Frame(points=np.asarray(points, np.float32), triangles=triangles, colors=shades, **more)


def sphere(center, radius, **more) -> Frame:
    shape = Shape(kind="sphere", rotation=np.eye(3), center=np.asarray(center, float), radius=radius)
    return frame_of(*triangulate(shape), **more)


def picture(frame, *, quality="final", eye=EYE, target=TARGET, size=SIZE) -> np.ndarray:
    return Rasterizer(size, Camera(eye=eye, target=target), quality=quality).draw(frame).astype(int)


def reddish(image) -> np.ndarray:
    return image[..., 0] > image[..., 2] + 30


def bluish(image) -> np.ndarray:
    return image[..., 2] > image[..., 0] + 30


@pytest.mark.parametrize("quality", ["draft", "final"])
def test_sphere_has_the_right_size_and_place(quality):
    center, radius = np.array([0.2, 0.1, 0.6]), 0.5
    seen = reddish(picture(sphere(center, radius), quality=quality))
    view = Viewpoint.looking(np.array(EYE), np.array(TARGET), 35.0)
    # A sphere is seen as the cone that touches it, cut by the picture plane: count its pixels one by one.
    x, y = np.meshgrid(np.arange(SIZE[0]) + 0.5 - SIZE[0] / 2, np.arange(SIZE[1]) + 0.5 - SIZE[1] / 2)
    f = view.focal_pixels(SIZE[1])
    rays = x[..., None] / f * view.right - y[..., None] / f * view.up + view.forward
    axis = (center - view.eye) / np.linalg.norm(center - view.eye)
    cosine = rays @ axis / np.linalg.norm(rays, axis=-1)
    exact = cosine > np.sqrt(1 - (radius / np.linalg.norm(center - view.eye)) ** 2)
    assert seen.sum() == pytest.approx(exact.sum(), rel=0.02)
    for axis_index in (0, 1):
        middle = np.argwhere(seen)[:, axis_index].mean()
        assert middle == pytest.approx(np.argwhere(exact)[:, axis_index].mean(), abs=0.5)


def test_nearer_hides_farther_in_either_order():
    quad = np.array([[0, -1, -1], [0, 1, -1], [0, 1, 1], [0, -1, 1]], float)
    two = np.array([[0, 1, 2], [0, 2, 3]])
    for first, colors, middle in ((1.0, (RED, BLUE), reddish), (-1.0, (RED, BLUE), bluish)):
        points = np.vstack([0.3 * quad + [first, 0, 0], quad])
        shades = np.repeat(np.array(colors, np.float32), 2, axis=0)
        frame = Frame(points=points.astype(np.float32), triangles=np.vstack([two, two + 4]).astype(np.int32))
        frame = Frame(points=frame.points, triangles=frame.triangles, colors=shades)
        image = picture(frame, eye=(5, 0, 0), target=(0, 0, 0))
        assert middle(image)[115:125, 155:165].all()
        assert bluish(image)[115:125, 110:115].all()


def test_triangle_through_the_eye_plane_still_fills():
    # Runs from far in front to far behind the eye, just under it.
    floor = frame_of([[-100, -100, -1], [100, -100, -1], [0, 200, -1]], [[0, 1, 2]])
    image = picture(floor, eye=(0, 0, 0), target=(0, 1, 0))
    assert reddish(image)[130:].all(), "all below the horizon"
    assert not reddish(image)[:118].any(), "nothing above"


def test_neighbouring_triangles_leave_no_cracks():
    side = 40
    grid = np.stack(np.meshgrid(np.linspace(-1, 1, side), np.linspace(-1, 1, side)), -1).reshape(-1, 2)
    rng = np.random.default_rng(0)
    points = np.column_stack([grid + rng.normal(0, 0.008, grid.shape), np.zeros(len(grid))])
    i, j = np.meshgrid(np.arange(side - 1), np.arange(side - 1))
    a = (i + side * j).ravel()
    triangles = np.vstack([np.stack([a, a + 1, a + side + 1], axis=1), np.stack([a, a + side + 1, a + side], axis=1)])
    image = picture(frame_of(points, triangles), eye=(0.3, -0.4, 1.2), target=(0, 0, 0), quality="draft")
    assert reddish(image)[60:180, 80:240].all()


def test_objects_shade_the_ground():
    lit = picture(sphere([0, 0, 40], 0.1, colliders=(GROUND,)))
    shaded = picture(sphere([0, 0, 0.6], 0.5, colliders=(GROUND,)))
    ground = ~reddish(shaded)
    darker = (lit - shaded).sum(axis=2) / 3
    assert (ground & (darker > 40)).sum() > 300, "a shadow"
    beside = ground[:, :40] & (np.abs(darker[:, :40]) < 8)
    assert beside.mean() > 0.9, "and light beside it"
    edge = ground & (darker > 8) & (darker < 30)
    assert edge.sum() > 50, "with a soft edge"


def test_sides_of_a_box_differ_but_a_sphere_is_smooth():
    points, triangles = triangulate(
        Shape(kind="box", rotation=np.eye(3), center=np.array([0, 0, 0.5]), size=(1.0, 1.0, 1.0))
    )
    image = picture(frame_of(points, triangles), quality="draft")
    view = Viewpoint.looking(np.array(EYE), np.array(TARGET), 35.0)
    levels = []
    for spot in ([0, 0, 1], [0.5, 0, 0.5], [0, -0.5, 0.5]):
        x, y, _ = view.project([spot], SIZE)[0].astype(int)
        patch = image[y - 4 : y + 5, x - 4 : x + 5, 0]
        assert np.ptp(patch) <= 12, "a side is flat"
        levels.append(patch.mean())
    assert min(np.diff(sorted(levels))) > 10, "and its edges are sharp"
    ball = picture(sphere([0, 0, 0.5], 0.6), quality="draft")[..., 0]
    inside = reddish(picture(sphere([0, 0, 0.5], 0.5), quality="draft"))
    steps = np.abs(np.diff(ball, axis=1))[inside[:, 1:]]
    assert steps.max() < 15


def test_wire_shows_edges():
    points, triangles = triangulate(
        Shape(kind="box", rotation=np.eye(3), center=np.array([0, 0, 0.5]), size=(1.0, 1.0, 1.0))
    )
    plain = picture(frame_of(points, triangles))
    wired = picture(frame_of(points, triangles, wire=True))
    darker = (plain - wired).sum(axis=2) > 30
    assert 100 < darker.sum() < 0.2 * reddish(plain).sum()


def test_same_frame_same_bits():
    frame = sphere([0, 0, 0.6], 0.5, colliders=(GROUND,), wire=True, hud=("x",))
    renderer = Rasterizer(SIZE, None)
    first = renderer.draw(frame)
    assert (renderer.draw(frame) == first).all()
    assert (Rasterizer(SIZE, None).draw(frame) == first).all()


def test_nothing_recompiles_when_sizes_change():
    def compiled() -> int:
        kernels = (
            raster_kernels.visibility,
            raster_kernels.corner_normals,
            raster_kernels.ground_occlusion,
            light_kernels.shadow_map,
            shading_kernels.shade,
        )
        return sum(len(kernel._primal.compiled_kernels) for kernel in kernels)

    picture(sphere([0, 0, 0.6], 0.5, colliders=(GROUND,)))
    before = compiled()
    assert before >= 5
    box = Shape(kind="box", rotation=np.eye(3), center=np.zeros(3))
    picture(frame_of(*triangulate(box)), size=(200, 100))
    picture(sphere([0, 0, 0.6], 0.5, colliders=(GROUND, box), wire=True))
    assert compiled() == before


def test_odd_frames_are_drawn():
    nothing = frame_of(np.zeros((0, 3)), np.zeros((0, 3), int), colliders=(GROUND,))
    assert np.isfinite(picture(nothing)).all()
    broken = frame_of([[0, 0, 0], [np.nan, 0, 0], [1e25, 0, 1], [0, 1, 0]], [[0, 1, 2], [0, 2, 3]])
    assert not reddish(picture(broken)).any()
    from_below = picture(sphere([0, 0, 0.6], 0.5, colliders=(GROUND,)), eye=(0, -4, -1), target=(0, 0, 0.6))
    assert reddish(from_below).sum() > 1000, "the ground does not hide what is above it from below"


SHEET = ([[-1, 0, -1], [1, 0, -1], [1, 0, 1], [-1, 0, 1]], [[0, 1, 2], [0, 2, 3]])
DARK = (0.267, 0.004, 0.329)


@pytest.mark.parametrize("color", [RED, DARK, (0.99, 0.9, 0.15)])
def test_wire_shows_on_dark_and_on_bright(color):
    plain, wired = (picture(frame_of(*SHEET, color, wire=wire), eye=(0, -5, 0), target=(0, 0, 0)) for wire in (0, 1))
    apart = np.abs(plain - wired).sum(axis=2)
    assert 100 < (apart > 60).sum() < 2000


def test_wire_of_tiny_triangles_does_not_darken():
    grid = np.stack(np.meshgrid(np.linspace(-1, 1, 121), np.linspace(-1, 1, 121)), -1).reshape(-1, 2)
    a = (np.arange(120)[:, None] + 121 * np.arange(120)).ravel()
    triangles = np.vstack([np.stack([a, a + 1, a + 122], axis=1), np.stack([a, a + 122, a + 121], axis=1)])
    points = np.column_stack([grid[:, 0], np.zeros(len(grid)), grid[:, 1]])
    frames = [frame_of(points, triangles, wire=wire) for wire in (False, True)]
    plain, wired = (picture(frame, eye=(0, -5, 0), target=(0, 0, 0)) for frame in frames)
    assert np.abs(plain - wired).max() < 12


def test_a_sheet_is_lit_from_both_sides():
    renderer = Rasterizer(SIZE, Camera(eye=(0, -5, 0.5), target=(0, 0, 0)), quality="draft")
    levels = []
    for y in (-5, 5):
        renderer.move(Camera(eye=(0, y, 0.5), target=(0, 0, 0)))
        levels.append(int(renderer.draw(frame_of(*SHEET))[100:140, 140:180, 0].mean()))
    shown = 255 * RED[0]
    assert min(levels) > 0.85 * shown and max(levels) < 1.15 * shown, "and about in its own colour"
