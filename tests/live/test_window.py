"""The window's mouse, keys and widgets, by a stand-in for GGUI that is told what a person does."""

import re
from contextlib import nullcontext
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

import taichifem as tf
from taichifem.live import controls
from taichifem.live.keeping import Keeper
from taichifem.live.messages import Surface
from taichifem.live.picking import pick, ray_through
from taichifem.live.session import Session
from taichifem.live.stage import Stage
from taichifem.live.window import SIZE, Window
from taichifem.output.camera import Viewpoint
from taichifem.output.frame import build_frame
from taichifem.runtime import ti

CAMERA = tf.Camera(eye=(0.5, -2.2, 0.5), target=(0.35, 0.1, 0.0))
HELD = tf.BoxRegion(lower=(-1, -1, -1), upper=(1e-6, 1, 1))
BAR = tf.TetMesh.bar(size=(0.6, 0.2, 0.2), cells=(6, 2, 2))
SOFT = tf.Material(youngs=1e5, poisson=0.3, stiffness_damping=0.02)


class Gui:
    """Widgets: `clicked` and `moved` say which of them a person uses in the next picture."""

    def __init__(self):
        self.clicked, self.moved, self.said, self.buttons = set(), {}, [], set()

    def sub_window(self, *_):
        return nullcontext()

    def text(self, words):
        self.said.append(words)

    def button(self, label):
        self.buttons.add(label)
        return label in self.clicked

    def checkbox(self, label, value):
        return self.moved.get(label, value)

    def slider_float(self, label, value, low, high):
        return self.moved.get(label, value)


class Stand:
    """In place of the renderer and its window: knows where the mouse is, which buttons are down, what is shown."""

    def __init__(self, camera):
        self.gui, self.at, self.down, self.pressed, self.running = Gui(), (0.5, 0.5), set(), [], True
        self.window, self.shown = self, 0
        self.move(camera)

    def move(self, camera):
        self.viewpoint = Viewpoint.looking(camera.eye, camera.target, camera.fov)

    def place(self, frame):
        self.frame = frame
        return self.viewpoint

    def get_gui(self):
        return self.gui

    def get_cursor_pos(self):
        return self.at

    def is_pressed(self, key):
        return key in self.down

    def get_events(self, tag):
        found, self.pressed = [SimpleNamespace(key=key) for key in self.pressed], []
        return found

    def show(self):
        self.shown += 1
        self.gui.clicked, self.gui.moved = set(), {}

    def point_at(self, place):
        x, y, _ = self.viewpoint.project(np.asarray(place)[None], SIZE)[0]
        self.at = x / SIZE[0], 1 - y / SIZE[1]


@pytest.fixture(scope="module")
def session(tmp_path_factory):
    body = tf.Body(mesh=BAR, material=SOFT, pins=[HELD], name="bar")
    scene = tf.Scene(bodies=[body], colliders=[tf.PlaneCollider(point=(0, 0, -0.6))], camera=CAMERA)
    keeper = Keeper(command_line=("run", "bar.toml"), name="bar", folder=tmp_path_factory.mktemp("window"))
    return Session(Stage(scene), keeper=keeper, paused=True)


@pytest.fixture
def window(session):
    session.stage.reset(parameters_too=True)
    session.paused = True
    return Window(session, Stand(session.camera))


def go(window, *, steps=0, **doing):
    """One picture, while a person does something, and all that comes of it; then some steps."""
    stand = window._renderer
    for name, value in doing.items():
        setattr(stand.gui if name in ("clicked", "moved") else stand, name, value)
    window.show()
    window._session.turn()
    for _ in range(steps):
        window._session.stage.step()


def tip(window):
    """The middle of the edge at the free end that faces the camera."""
    node = int(np.argmin(np.linalg.norm(BAR.points - (0.6, 0.0, 0.1), axis=1)))
    return window._session.stage.simulation.positions[node] - (0.03, 0.0, 0.0)


def take(window, tool):
    """Press the left button on the tip with a tool."""
    go(window, clicked={tool})
    window._renderer.point_at(tip(window))
    go(window, down={ti.ui.LMB})


def test_a_pull_moves_what_is_under_the_mouse_until_it_lets_go(window):
    stage, stand = window._session.stage, window._renderer
    go(window)
    take(window, "pull")
    ((name, hand),) = stage.hands.items()
    stand.at = stand.at[0], stand.at[1] + 0.15
    go(window, steps=20)
    lifted = hand.targets - hand.start
    assert lifted[0, 2] > 0.1 and np.ptp(lifted, axis=0).max() < 1e-12, name
    assert stage.simulation.positions[hand.nodes, 2].mean() > stage.simulation.rest_positions[hand.nodes, 2].mean()
    go(window, moved={"spring (tools)": 0.9})
    assert hand.stiffness == stage.tools.strength
    assert len(stand.frame.colliders) == 3, "both ends of the hand are shown"
    assert any(words.startswith("pulls with") for words in stand.gui.said)
    go(window, down=set())
    assert not stage.hands


def test_pins_come_and_go(window):
    stage = window._session.stage
    take(window, "pin")
    (hand,) = stage.hands.values()
    assert hand.stiffness is None
    go(window, down=set())
    assert len(stage.hands) == 1
    window._renderer.point_at(stage.simulation.positions[hand.nodes].mean(axis=0))
    go(window, down={ti.ui.LMB})
    assert not stage.hands


def test_a_poke_and_a_ball(window):
    stage = window._session.stage
    take(window, "poke")
    v = stage.simulation.velocities
    struck = (stage.simulation.masses[:, None] * v).sum(axis=0)
    assert np.linalg.norm(struck) == pytest.approx(stage.tools.impulse, rel=1e-5)
    go(window, down=set())
    stage.reset()
    take(window, "throw")
    assert len(stage.simulation.scene.colliders) == 2
    ball = stage._ball
    assert np.linalg.norm(ball.velocity) == pytest.approx(stage.tools.ball_speed)
    assert ball.velocity @ (tip(window) - ball.position) > 0


def test_buttons_and_keys_ask_and_cut_gravity(window):
    session, stage = window._session, window._session.stage
    go(window)
    assert window._renderer.gui.buttons >= {*controls.ASKS, *controls.TOOLS[1:], "[pull]", "gravity"}
    go(window, clicked={"step"})
    assert stage.simulation.step_count == 1 and session.paused
    go(window, pressed=["s", " "])
    assert not session.paused
    go(window, pressed=[" ", "r", "3", ""])
    assert session.paused and stage.simulation.step_count == 0 and window._pointer.tool == "poke"
    go(window, clicked={"gravity"})
    assert stage.scene.gravity == (0.0, 0.0, 0.0)
    go(window, pressed=["g"])
    assert stage.scene.gravity == (0.0, 0.0, -9.81)
    go(window, clicked={"command"})
    go(window, clicked={"keep"})
    assert any("taichifem run bar.toml" in words for words in window._renderer.gui.said)
    go(window, clicked={"step"})
    go(window, clicked={"back"})
    assert stage.simulation.step_count == 0


def test_sliders_set_parameters_and_the_mouse_on_them_touches_no_body(window):
    stage, stand = window._session.stage, window._renderer
    go(window)
    go(window, moved={"Young's modulus (bar)": 0.5})
    assert stage.scene.bodies[0].material.youngs != SOFT.youngs
    go(window, at=(0.9, 0.5), down={ti.ui.LMB})
    stand.point_at(tip(window))
    go(window)  # still the same press
    assert not stage.hands
    go(window, down=set())
    go(window, down={ti.ui.LMB})
    assert len(stage.hands) == 1


def test_where_nothing_is_met_the_camera_turns_and_shifts(window):
    stand = window._renderer
    before = stand.viewpoint
    for button, same in ((ti.ui.LMB, "target"), (ti.ui.RMB, "forward")):
        go(window, at=(0.5, 0.95), down={button})
        go(window, at=(0.55, 0.9))
        after = stand.viewpoint
        assert np.linalg.norm(after.eye - before.eye) > 0.05
        np.testing.assert_allclose(getattr(after, same), getattr(before, same), atol=1e-6)
        go(window, down=set())
        before = after
    go(window, down={ti.ui.UP})
    assert stand.viewpoint.reach < before.reach


def test_the_page_has_the_same_buttons_tools_and_keys():
    page = Path(controls.__file__).parent / "page"
    html, script = (page / "index.html").read_text(), (page / "main.js").read_text()
    assert sorted(re.findall(r'data-ask="([\w-]+)"', html)) == sorted(controls.ASKS)
    assert tuple(re.findall(r'data-tool="(\w+)"', html)) == controls.TOOLS
    assert f"'{' '.join(controls.TOOLS)}'.split" in script
    for key, what in controls.KEYS.items():
        assert f"{key}: () => ask('{what}')" in script


def test_what_is_embedded_is_taken_by_the_mesh_that_it_rides_in():
    coarse = tf.TetMesh.bar(size=(0.6, 0.2, 0.2), cells=(3, 1, 1))
    fine = tf.EmbeddedSurface(BAR.points, BAR.surface())
    simulation = tf.Simulation(tf.Scene(bodies=[tf.Body(mesh=coarse, embed=fine, material=SOFT)]))
    frame = build_frame(simulation)
    surface = Surface(frame)
    assert len(surface.points) == len(np.unique(fine.triangles)) > len(coarse.points) > surface.nodes.max()
    away = frame.points[surface.points] - simulation.positions[surface.nodes]
    assert np.linalg.norm(away, axis=1).max() < 0.2
    viewpoint = Viewpoint.looking((0.3, -2.0, 0.1), (0.3, 0.0, 0.1), 35.0)
    hit = pick(frame, viewpoint, ray_through(viewpoint, 0.0, 0.0, 1.5))
    assert hit.node < len(coarse.points)
    assert len(simulation.grab(hit.node, radius=0.1, stiffness=100.0).nodes) > 0
