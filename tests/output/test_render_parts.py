"""What pictures are made of, without drawing: colours, camera, frame, overlay."""

from types import SimpleNamespace

import numpy as np
import pytest

from taichifem.description import Body, BoxCollider, Camera, PlaneCollider, Scene, SphereCollider, View
from taichifem.errors import InputError
from taichifem.mesh import TetMesh
from taichifem.output import colors
from taichifem.output.camera import Framing, Viewpoint, frame_points
from taichifem.output.frame import Frame, build_frame, pose, triangulate
from taichifem.output.overlay import annotate, engineering, nice_ticks
from taichifem.output.renderer import make_renderer
from taichifem.output.solids import Solids


class FakeSimulation:
    """The part of a simulation that a frame is taken from: one bar, stretched by half along x."""

    def __init__(self, **view) -> None:
        mesh = TetMesh.bar(size=(1.0, 0.5, 0.5), cells=(4, 2, 2))
        self.scene = Scene(bodies=[Body(mesh=mesh)], view=View(**view), name="bar")
        self.rest_positions, self.cells, self.surface = mesh.points, mesh.cells, mesh.surface()
        self.positions = mesh.points * [1.5, 1, 1]
        self.velocities = np.tile([3.0, 0.0, 4.0], (len(mesh.points), 1))
        self.surface_bodies = np.zeros(len(self.surface), int)
        self.crack_faces = np.zeros(len(self.surface), bool)
        self.node_bodies = np.zeros(len(mesh.points), int)
        self.time = 1.5
        self.stress = np.full(len(self.cells), 2e3)

    def von_mises(self):
        return self.stress

    def collider_poses(self):
        return [(PlaneCollider(), np.eye(3), np.zeros(3))]

    @property
    def stats(self):
        figures = {"elements": 96, "nodes": 45, "iterations": 7, "ms": {"solve": 2.5}, "time": 1.5}
        return SimpleNamespace(as_dict=lambda: figures)


def test_color_map_ends_and_order():
    ends = colors.color_map(np.array([-5.0, 0.0, 1.0, 9.0, np.nan]), 0.0, 1.0)
    np.testing.assert_allclose(ends[[0, 1]], np.tile(colors.parse_hex("#440154"), (2, 1)), atol=1e-6)
    np.testing.assert_allclose(ends[[2, 3]], np.tile(colors.parse_hex("#fde725"), (2, 1)), atol=1e-6)
    np.testing.assert_allclose(ends[4], 0.5)
    light = colors.to_linear(colors.color_map(np.linspace(0, 1, 64), 0.0, 1.0)) @ [0.2126, 0.7152, 0.0722]
    assert (np.diff(light) >= -1e-4).all(), "brighter must mean more"


def test_hex_and_palette():
    np.testing.assert_allclose(colors.parse_hex("#ff8000"), [1, 128 / 255, 0], atol=1e-6)
    chosen = colors.body_colors(10, ("#000000",))
    assert (chosen[0] == 0).all() and (chosen[1] == colors.body_colors(2)[1]).all()
    assert (chosen[9] == colors.body_colors(2)[1]).all(), "the palette starts again"
    with pytest.raises(InputError, match="#rrggbb"):
        colors.parse_hex("red")


def test_srgb_round_trip_and_film():
    x = np.linspace(0, 1, 50)
    np.testing.assert_allclose(colors.to_srgb(colors.to_linear(x)), x, atol=2e-4)
    np.testing.assert_allclose(colors.developed(colors.light_shown_as(x[:-1])), colors.to_linear(x[:-1]), atol=1e-5)


@pytest.mark.parametrize(("value", "unit", "expected"), [(12.5e3, "Pa", (1e3, "kPa")), (3e-3, "m", (1e-3, "mm"))])
def test_engineering_units(value, unit, expected):
    assert engineering(value, unit) == expected


def test_ticks_are_round_and_inside():
    np.testing.assert_allclose(nice_ticks(0, 12.4), [0, 2.5, 5, 7.5, 10])
    np.testing.assert_allclose(nice_ticks(-1, 1), [-1, -0.5, 0, 0.5, 1])


@pytest.mark.parametrize("size", [(640, 360), (300, 500)])
def test_framing_shows_everything(size):
    rng = np.random.default_rng(3)
    points = rng.uniform([-3, 0, 0], [1, 0.5, 2], (200, 3))
    view = frame_points(points, Camera(), size)
    pixels = view.project(points, size)
    assert (pixels[:, 2] > 0).all()
    assert (pixels[:, :2] > 0).all() and (pixels[:, :2] < size).all()
    filled = np.ptp(pixels[:, :2], axis=0) / size
    assert filled.max() > 0.6, "and does not stand too far off"
    assert view.forward[2] < 0, "from above"


def test_camera_given_is_kept_and_framing_does_not_jitter():
    view = frame_points(np.eye(3), Camera(eye=(5, 0, 0), target=(0, 0, 0), fov=60), (100, 100))
    np.testing.assert_allclose(view.project([[0, 1, 0]], (100, 100)), [[50 + 50 / np.tan(np.pi / 6) / 5, 50, 5]])
    framing = Framing(None, (100, 100))
    first = framing.of(lambda: np.eye(3))
    assert framing.of(lambda: np.eye(3) + 100) is first
    looking_down = Viewpoint.looking(np.array([0, 0, 3.0]), np.zeros(3), 40)
    assert np.isfinite(looking_down.right).all()


@pytest.mark.parametrize(
    "collider",
    [SphereCollider(center=(1, 2, 3), radius=0.5), BoxCollider(center=(1, 2, 3), size=(1, 2, 3), angle=30)],
)
def test_colliders_become_closed_outward_surfaces(collider):
    turn = np.array([[0, -1, 0], [1, 0, 0], [0, 0, 1.0]])
    points, triangles = triangulate(pose(collider, turn, np.array([0, 0, 5.0])))
    a, b, c = (points[triangles[:, k]].astype(float) for k in range(3))
    volume = np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6
    exact = 4 / 3 * np.pi * 0.5**3 if isinstance(collider, SphereCollider) else 6.0
    assert volume == pytest.approx(exact, rel=0.02)
    np.testing.assert_allclose((points.min(axis=0) + points.max(axis=0)) / 2, [-2, 1, 8], atol=1e-5)


def test_planes_face_their_normal():
    for normal in [(0, 0, 1), (0, 0, -1), (1, 0, 0), (1, -2, 0.5)]:
        shape = pose(PlaneCollider(point=(0, 0, 1), normal=normal), np.eye(3), np.zeros(3))
        np.testing.assert_allclose(shape.normal, np.array(normal) / np.linalg.norm(normal), atol=1e-12)
        assert np.linalg.det(shape.rotation) == pytest.approx(1)


def test_frame_of_a_simulation():
    frame = build_frame(FakeSimulation())
    assert frame.values is None and frame.points.dtype == np.float32 and frame.triangles.dtype == np.int32
    assert frame.colors.shape == (len(frame.triangles), 3)
    assert frame.colliders[0].kind == "plane"
    assert any("1.50 s" in line for line in frame.hud) and any("2.5 ms" in line for line in frame.hud)
    assert build_frame(FakeSimulation(hud=False)).hud == ()


def test_frame_values():
    simulation = FakeSimulation(color="von-mises")
    simulation.stress = np.arange(len(simulation.cells), dtype=float)
    frame = build_frame(simulation)
    node = 7
    around = (simulation.cells == node).any(axis=1)
    assert frame.values[node] == pytest.approx(simulation.stress[around].mean())
    assert frame.value_unit == "Pa"

    top = frame.value_range[1]
    simulation.stress = simulation.stress / 2
    assert build_frame(simulation).value_range == (0.0, top), "the top only grows"
    assert build_frame(FakeSimulation(color="von-mises", range=(1.0, 2.0))).value_range == (1.0, 2.0)
    np.testing.assert_allclose(build_frame(FakeSimulation(color="speed")).values, 5.0)
    assert build_frame(FakeSimulation(color="displacement")).values.max() == pytest.approx(0.5, rel=1e-3)


def test_lost_nodes_are_left_out():
    points = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [np.nan, 0, 0], [1e30, 0, 0]], np.float32)
    solids = Solids(Frame(points=points, triangles=np.array([[0, 1, 2], [0, 1, 3], [1, 2, 4]], np.int32)))
    assert np.isfinite(solids.points).all() and solids.radius < 2
    assert (solids.triangles[1] == 0).all() and (solids.triangles[2] == 0).all()


def test_overlay_draws_text_and_bar():
    points = np.eye(3, dtype=np.float32)
    plain = np.full((360, 640, 3), 120, np.uint8)
    frame = Frame(
        points=points,
        triangles=np.array([[0, 1, 2]], np.int32),
        values=np.ones(3, np.float32),
        value_range=(0.0, 12.5e3),
        value_label="stress",
        value_unit="Pa",
        hud=("hello", "t = 1 s"),
    )
    drawn = annotate(plain.copy(), frame)
    changed = (drawn != plain).any(axis=2)
    assert changed[:120, :200].any() and changed[100:260, 500:].any()
    assert not changed[:, 250:450].any(), "and nothing else"
    assert (drawn[:120, :200].min() < 80) and (drawn[:120, :200].max() > 150), "dark ink on light paper"
    bar = drawn[:, 500:].reshape(-1, 3).astype(int)
    for end in ("#440154", "#fde725"):
        distance = np.abs(bar - 255 * colors.parse_hex(end)).max(axis=1).min()
        assert distance < 6, f"the bar ends in {end}"
    annotate(np.zeros((20, 20, 3), np.uint8), frame)  # too small for it all: cut, not failing


def test_bad_requests_are_refused():
    with pytest.raises(InputError, match="renderer"):
        make_renderer("opengl")
    with pytest.raises(InputError, match="size"):
        make_renderer(size=(5, 0))
    with pytest.raises(InputError, match="quality"):
        make_renderer(quality="best")


def test_what_cracks_opened_is_paler_and_pieces_have_colours():
    simulation = FakeSimulation(colors=("#204060",))
    simulation.crack_faces[:3] = True
    found = build_frame(simulation).colors
    assert (found[:3] > found[3] + 0.3).all() and (found[3:] == found[3]).all()
    simulation = FakeSimulation(color="piece")
    simulation.piece_count, simulation.surface_pieces = 2, np.arange(len(simulation.surface)) % 2
    found = build_frame(simulation).colors
    assert (found[0] == found[2]).all() and (found[0] != found[1]).any()
