"""A session as clients see it that only talk to the socket: several at once, bad ones among them, for long."""

import json
import time

import av
import numpy as np
import pytest
from calling import call
from serving import Client, Serving

SCENE = """\
name = "bar"
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


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    made = tmp_path_factory.mktemp("session")
    (made / "bar.toml").write_text(SCENE)
    return made


@pytest.fixture(scope="module")
def serving(folder):
    made = Serving("bar.toml", folder)
    with Client(made.url) as client:
        client.until(lambda: client.updates > 3)
    yield made
    said = made.close()
    assert "Traceback" not in said, said


@pytest.fixture
def client(serving):
    with Client(serving.url) as made:
        made.send(ask="reset", all=True)
        made.send(ask="play")
        made.until(lambda: made.last.get("state", {}).get("paused") is False and "figures" in made.last)
        made.until(lambda: made.updates > 2)
        yield made


def figure(client, name):
    """The next value of a figure."""
    del client.last["figures"]
    client.until(lambda: "figures" in client.last)
    return client.last["figures"][name]


def test_figures_make_sense(client):
    figures = client.last["figures"]
    assert (figures["nodes"], figures["elements"], figures["pieces"]) == (63, 120, 1)
    assert set(figures["energy"]) == {"kinetic", "elastic", "gravity", "total"}
    assert figures["dt"] == pytest.approx(1 / 60) and figures["stress"] > 0
    before = figure(client, "time")
    assert figure(client, "time") > before
    assert {"solve", "forces"} <= set(client.last["figures"]["phases"])


def test_viewers_come_and_go_and_time_goes_on(serving, client):
    for _ in range(5):
        with Client(serving.url) as other:
            other.until(lambda other=other: other.updates >= 2)
            assert len(other.topology[1]) == len(other.points) > 50
            before = other.time
        client.until(lambda before=before: client.time > before)
    with Client(serving.url) as one, Client(serving.url) as two:
        one.send(do="set", path="body.0.material.youngs", value=3e5)

        def told(who):
            rows = {row["path"]: row["value"] for group in who.last["panel"]["groups"] for row in group["rows"]}
            return rows["body.0.material.youngs"]

        for who in (one, two, client):
            who.until(lambda who=who: "panel" in who.last and told(who) == 3e5)


def test_what_is_refused_is_told_and_nothing_ends(client):
    for message, words in (
        ({"do": "fly"}, "an action is one of"),
        ({"ask": "everything"}, "nobody knows"),
        ({"ask": ["x"]}, "nobody knows"),
        ({"ask": "camera", "eye": [0, 0, "x"]}, "eye"),
        ({"ask": "back"}, "no snapshot"),
        ({"do": "set", "path": "body.0.material.poisson", "value": 0.5}, "poisson is 0.5"),
        ({"do": "set", "path": "simulation.integrator", "value": "quasi-static"}, "quasi-static"),
        ({"do": "grab", "hand": "a", "node": 10**7, "stiffness": 1, "radius": 1}, "is not there"),
        ({}, "an action is one of"),
    ):
        client.send(**message)
        client.until(lambda words=words: any(words in text for text in client.notices))
    before = figure(client, "time")
    client.until(lambda: figure(client, "time") > before)


def test_a_film_and_what_was_done_are_written_and_done_again(client, folder, monkeypatch):
    client.send(ask="pause")
    client.send(ask="reset")
    client.send(do="set", path="body.0.material.youngs", value=5e4)
    client.send(do="set", path="body.0.material.yield_stress", value=4e3)
    client.send(ask="record")
    client.send(ask="camera", eye=[0.5, -2.0, 0.4], target=[0.3, 0.1, -0.1], fov=35)
    for _ in range(6):
        client.send(ask="step")
    client.send(do="poke", node=60, impulse=[0, 0, 3.0], radius=0.2)
    for _ in range(6):
        client.send(ask="step")
    client.send(ask="record")
    client.until(lambda: any(text.startswith("wrote") and ".mp4" in text for text in client.notices))
    with av.open(folder / "out" / "bar-live-1.mp4") as film:
        pictures = [frame.to_ndarray(format="rgb24").astype(int) for frame in film.decode(video=0)]
    assert len(pictures) == 13 and pictures[0].shape == (720, 1280, 3)
    assert (np.abs(pictures[-1] - pictures[2]).max(axis=2) > 40).mean() > 0.002

    client.send(ask="save-interactions")
    client.until(lambda: any("--replay" in text for text in client.notices))
    said = next(text for text in client.notices if "--replay" in text)
    assert said.endswith("taichifem run bar.toml --replay out/bar-live-1.json --frames 12")
    client.until(lambda: client.time == pytest.approx(12 / 60, abs=1e-4))
    monkeypatch.chdir(folder)
    arguments = said.partition("taichifem ")[2].split()
    result = call(*arguments, "--no-video", "--export", "meshes", "--format", "npz", "--quiet")
    assert result.exit_code == 0, result.output
    with np.load(sorted((folder / "meshes").glob("*.npz"))[-1]) as mesh:
        points = next(mesh[name] for name in ("points", "positions") if name in mesh.files)
    np.testing.assert_array_equal(points[client.topology[1]].astype(np.float32), client.points)


def test_a_diverged_state_is_noticed_not_shown_and_reset_leads_out(client):
    client.send(do="set", path="simulation.integrator", value="symplectic-euler")
    client.until(lambda: any("the laws change" in text for text in client.notices))
    client.send(do="poke", node=60, impulse=[0, 0, 1e9], radius=0.3)
    client.until(lambda: client.last["state"]["diverged"] and client.last["state"]["paused"])
    assert any("diverged" in text and "reset" in text for text in client.notices)
    assert np.isfinite(client.points).all() and np.abs(client.points).max() < 1e5
    client.send(ask="play")
    client.until(lambda: any("reset it, or go back" in text for text in client.notices))
    client.send(ask="reset", all=True)
    client.send(ask="play")
    client.until(lambda: not client.last["state"]["diverged"])
    before = figure(client, "time")
    client.until(lambda: figure(client, "time") > before)


def storm(serving, client, seconds):
    """Push all sliders to their ends in turn, as fast as the socket takes it; what went wrong on the way."""
    rows = [row for group in client.last["panel"]["groups"] for row in group["rows"] if row["kind"] == "number"]
    rows = [row for row in rows if not row["path"].startswith("tools.pace")]
    memory, halted, end, rng = [], 0, time.monotonic() + seconds, np.random.default_rng(3)
    while time.monotonic() < end:
        row = rows[rng.integers(len(rows))]
        client.send(do="set", path=row["path"], value=float(row[("low", "high")[rng.integers(2)]]))
        if rng.random() < 0.001:
            client.socket.send("nonsense")
        if rng.random() < 0.3:
            client.read()
            assert client.points is None or np.isfinite(client.points).all()
        if client.last["state"]["diverged"] or client.last["state"]["paused"]:
            halted += 1
            client.send(ask="reset", all=True)
            client.send(ask="play")
            client.until(lambda: not client.last["state"]["paused"])
        memory.append(serving.memory)
        time.sleep(0.002)
    return halted, memory


@pytest.mark.parametrize("seconds", [5, pytest.param(120, marks=pytest.mark.slow)])
def test_sliders_at_their_ends_in_quick_succession_break_nothing(serving, client, seconds):
    client.until(lambda: "panel" in client.last)
    halted, memory = storm(serving, client, seconds)
    late = memory[len(memory) // 2 :]
    print(
        f"{seconds} s: {halted} halts, {memory[0]:.0f} MB at first, {max(memory):.0f} at most, {memory[-1]:.0f} at last"
    )
    client.send(ask="reset", all=True)
    client.send(ask="play")
    client.until(lambda: client.last["state"]["paused"] is False)
    before = figure(client, "time")
    client.until(lambda: figure(client, "time") != before)
    assert np.isfinite(client.points).all()
    if seconds > 60:
        assert max(late) < 1.15 * np.median(memory), "memory grows"
    assert json.dumps(client.last["figures"])
