"""The live view in a real browser, headless: what a person would do with the mouse, and what is then to be seen."""

import itertools
import time

import numpy as np
import pytest
from browser import Browser, chromium
from serving import Serving

import taichifem as tf

pytestmark = pytest.mark.skipif(chromium() is None, reason="Chromium is not installed: nothing to look at pages with")

SCENE = """\
name = "bar"
[camera]
eye = [0.5, -2.2, 0.5]
target = [0.35, 0.1, 0.0]
[[body]]
name = "bar"
mesh = { shape = "bar", size = [0.6, 0.2, 0.2], cells = [6, 2, 2] }
[body.material]
youngs = 2e5
poisson = 0.3
stiffness_damping = 0.03
plasticity = "von-mises"
yield_stress = 1e9
fracture = { toughness = 1e9 }
[[body.pin]]
box = { lower = [-1, -1, -1], upper = [1e-6, 1, 1] }
[[collider]]
type = "plane"
point = [0, 0, -0.6]
"""
SIZE = (1000, 600)
MATERIAL = "body.0.material"
BLUE = (91, 143, 201)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    made = tmp_path_factory.mktemp("live")
    (made / "bar.toml").write_text(SCENE)
    return made


@pytest.fixture(scope="module")
def page(folder):
    serving = Serving("bar.toml", folder)
    with Browser(SIZE) as browser:
        browser.url = serving.url
        browser.open(serving.url)
        browser.wait("taichifem.state.updates > 3 && taichifem.panel.rows.size", 180)
        yield browser
        assert not browser.problems
    said = serving.close()
    assert "Traceback" not in said, said


@pytest.fixture(autouse=True)
def afresh(page):
    """As the scene was given, running."""
    page.click("[data-ask=reset-all]")
    page.click("[data-ask=play]")
    done(page)
    page.wait("!taichifem.state.paused && taichifem.view.update.time > 0.05")


MARKS = itertools.count()


def done(page):
    """Wait until all that was asked for is done, and what came of it is drawn."""
    name = f"mark {next(MARKS)}"
    page.value(f"taichifem.ask('mark', {{ name: '{name}' }})")
    page.wait(f"taichifem.state.mark.name === '{name}' && taichifem.view.update.number >= taichifem.state.mark.update")


def points(page):
    return np.array(page.value("Array.from(taichifem.view.update.points)"), dtype=np.float32).reshape(-1, 3)


def clock(page):
    return page.value("taichifem.view.update.time")


def set_value(page, path, value):
    """Type a value into the field of a parameter."""
    field = f"document.querySelector('input[type=text][data-path=\"{path}\"]')"
    page.value(f"{field}.value = '{value}', {field}.onchange()")
    page.wait(f"taichifem.panel.value('{path}') === {value}")


def settle(page):
    """Slow it down until nothing moves any more; the points then."""
    set_value(page, f"{MATERIAL}.mass_damping", 8)
    done(page)
    before, now = None, points(page)
    end = time.monotonic() + 60
    while before is None or np.abs(now - before).max() > 2e-5:
        assert time.monotonic() < end, "it does not come to rest"
        at = clock(page)
        page.wait(f"taichifem.view.update.time > {at} + 0.25", 60)
        before, now = now, points(page)
    set_value(page, f"{MATERIAL}.mass_damping", 0)
    return now


def on_screen(page, point):
    """Where a point [m] is on the screen."""
    matrix = page.value("Array.from(taichifem.camera.matrix(taichifem.view.aspect))")
    x, y, _, w = np.array(matrix).reshape(4, 4).T @ [*point, 1]
    return (0.5 + 0.5 * x / w) * SIZE[0], (0.5 - 0.5 * y / w) * SIZE[1]


def front_of_tip(page):
    """The node in the middle of the edge at the free end that faces the camera, on the screen."""
    now = points(page)
    tip = now[np.argmax(now @ (1.0, -0.5, 0.0))]
    return on_screen(page, tip + np.array([-0.03, 0.0, -0.02]))


def pull(page, by, seconds=0.5):
    """Take hold of the tip with the mouse, pull it by some pixels, keep it for a while, let go."""
    start = front_of_tip(page)
    end = start[0] + by[0], start[1] + by[1]
    page.press(*start)
    page.wait("taichifem.hand.held")
    page.pull(start, end)
    at = clock(page)
    page.wait(f"taichifem.view.update.time > {at} + {seconds}", 60)
    held = page.value("document.getElementById('pulled').textContent")
    page.mouse("mouseReleased", *end)
    return held


def test_the_body_is_seen_and_moves(page, folder):
    page.click("[data-ask=pause]")
    page.click("[data-ask=reset]")
    done(page)
    first = page.picture(folder / "page.png").astype(int)
    shade = first / np.maximum(first.sum(axis=2, keepdims=True), 1)
    blue = np.abs(shade - np.array(BLUE) / sum(BLUE)).max(axis=2) < 0.03
    assert blue[:, 270:650].mean() > 0.03, "no body of its colour is seen"
    still = page.picture().astype(int)
    assert not (still - first)[100:, 270:650].any(), "time stands still, and the picture changes"
    set_value(page, f"{MATERIAL}.youngs", 60000)
    page.click("[data-ask=play]")
    settle(page)
    later = page.picture(folder / "sagged.png").astype(int)
    assert (np.abs(later - first).max(axis=2) > 30)[100:, 270:650].mean() > 0.01, "nothing has moved"
    assert "nodes" in page.value("document.getElementById('counts').textContent")


def test_a_dragged_slider_changes_the_sag_as_stiffness_says(page):
    sags, stiffness = [], []
    for share in (0.40, 0.46):
        page.slide(f"{MATERIAL}.youngs", share)
        stiffness.append(page.value(f"taichifem.panel.value('{MATERIAL}.youngs')"))
        sags.append(-settle(page)[:, 2].min())
    assert stiffness[1] > 1.5 * stiffness[0]
    assert sags[0] / sags[1] == pytest.approx(stiffness[1] / stiffness[0], rel=0.06)


def test_pause_stops_time_step_takes_one_and_reset_restores(page):
    page.click("[data-ask=pause]")
    done(page)
    at, there = clock(page), points(page)
    time.sleep(0.5)
    assert clock(page) == at
    page.click("[data-ask=step]")
    done(page)
    assert clock(page) == pytest.approx(at + 1 / 60, abs=1e-5) and np.abs(points(page) - there).max() > 0
    page.click("[data-ask=reset]")
    done(page)
    assert clock(page) == 0
    rest = tf.TetMesh.bar(size=(0.6, 0.2, 0.2), cells=(6, 2, 2)).points
    nodes = page.value("Array.from(taichifem.view.topology.nodes)")
    np.testing.assert_allclose(points(page), rest[nodes], atol=1e-6)


def test_a_lower_yield_stress_leaves_a_dent_after_a_pull(page, folder):
    straight = settle(page)
    assert " N" in pull(page, (0, -110))
    np.testing.assert_allclose(settle(page), straight, atol=2e-3)
    set_value(page, f"{MATERIAL}.yield_stress", 8000)
    pull(page, (0, -110))
    bent = settle(page)
    assert np.abs(bent - straight).max() > 0.02
    page.picture(folder / "bent.png")


def test_a_lower_toughness_lets_a_pull_with_the_mouse_break_the_body(page, folder):
    settle(page)
    set_value(page, f"{MATERIAL}.toughness", 30000)
    assert page.value("taichifem.state.figures.pieces") == 1
    set_value(page, "tools.strength", 50000)
    pull(page, (300, -40))
    page.wait("taichifem.state.figures.pieces > 1")
    page.picture(folder / "broken.png")


def test_a_saved_scene_runs_to_the_same_numbers(page, folder):
    set_value(page, f"{MATERIAL}.youngs", 60000)
    set_value(page, "simulation.gravity.x", 3)
    page.click("[data-ask=pause]")
    page.click("[data-ask=reset]")
    done(page)
    assert clock(page) == 0
    for frame in range(12):
        page.click("[data-ask=step]")
        done(page)
        assert clock(page) == pytest.approx((frame + 1) / 60, abs=1e-5)
    page.click("[data-ask=save-scene]")
    saved = folder / "out" / "bar-live-1.toml"
    page.wait("document.getElementById('notices').textContent.includes('--resume')")
    nodes = page.value("Array.from(taichifem.view.topology.nodes)")
    there = points(page)
    simulation = tf.Simulation(tf.Scene.from_file(saved))
    simulation.advance(seconds=12 / 60)
    np.testing.assert_array_equal(simulation.positions[nodes].astype(np.float32), there)
    simulation.load(saved.with_suffix(".npz"))
    np.testing.assert_array_equal(simulation.positions[nodes].astype(np.float32), there)


def test_another_browser_that_is_killed_holds_up_nothing(page):
    with Browser((400, 300)) as other:
        other.open(page.url)
        other.wait("taichifem.state.updates > 3", 60)
        other.kill()
    at = clock(page)
    page.wait(f"taichifem.view.update.time > {at} + 0.2")


def test_a_ball_and_a_poke_move_the_body_and_a_pin_holds_it(page, folder):
    settle(page)
    page.click("[data-tool=throw]")
    page.press(*front_of_tip(page))
    page.wait("taichifem.view.update.colliders.length === 32")
    page.wait("taichifem.view.update.time > 0 && taichifem.state.figures.energy.kinetic > 0.5")
    page.picture(folder / "ball.png")
    page.click("[data-ask=reset]")
    settle(page)
    page.click("[data-tool=pin]")
    place = front_of_tip(page)
    page.press(*place)
    page.mouse("mouseReleased", *place)
    page.wait("taichifem.view.update.hands.length === 8 && taichifem.hand.names.length === 1")
    there = points(page)
    page.click("#weightless")
    page.wait("taichifem.panel.value('simulation.gravity.z') === 0")
    tip = np.argmax(there @ (1.0, -0.5, 0.0))
    assert np.abs(settle(page)[tip] - there[tip]).max() < 1e-3
    page.picture(folder / "pin.png")
    place = on_screen(page, page.value("Array.from(taichifem.view.update.hands.slice(0, 3))"))
    page.press(*place)
    page.mouse("mouseReleased", *place)
    page.wait("taichifem.view.update.hands.length === 0")
    page.click("#weightless")
    page.click("[data-tool=poke]")
    settle(page)
    set_value(page, "tools.impulse", 5)
    page.press(*front_of_tip(page))
    page.wait("taichifem.state.figures.energy.kinetic > 0.05")
    page.click("[data-tool=pull]")
