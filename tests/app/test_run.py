"""Runs of a tiny scene, from the scene file to every kind of output."""

import json
import signal
import subprocess
import time

import av
import numpy as np
from calling import assert_refused, call, command, environment

from taichifem.app import demos


def frames_of(video) -> int:
    with av.open(str(video)) as container:
        return sum(1 for _ in container.decode(video=0))


def state(checkpoint) -> dict[str, np.ndarray]:
    with np.load(checkpoint) as file:
        return {name: file[name] for name in ("x", "v")}


def test_video_meshes_figures_and_checkpoint(tiny):
    options = ["--size", "160x90", "--export", "mesh", "--stats", "s.jsonl", "--checkpoint", "c.npz"]
    result = call("run", tiny, *options, "--color", "speed", "--wire")
    assert result.exit_code == 0, result.output
    assert frames_of("out/tiny.mp4") == 7
    assert len(list((tiny.parent / "mesh").glob("*.vtu"))) == 7
    lines = [json.loads(line) for line in (tiny.parent / "s.jsonl").read_text().splitlines()]
    assert [line["frame"] for line in lines] == list(range(7))
    assert (tiny.parent / "c.npz").exists()
    for word in ("recorded 7 frames", "wrote out/tiny.mp4", "wrote mesh", "wrote s.jsonl", "wrote c.npz"):
        assert word in result.output


def test_a_demo_runs_like_its_scene_file(tiny, monkeypatch):
    monkeypatch.setattr(demos, "FOLDERS", (tiny.parent,))
    result = call("demo", "tiny", "--no-video", "--checkpoint", "demo.npz", "--quiet")
    assert (result.exit_code, result.output) == (0, "")
    assert call("run", tiny, "--no-video", "--checkpoint", "run.npz", "-q").exit_code == 0
    assert np.array_equal(state("demo.npz")["x"], state("run.npz")["x"])


def test_a_resumed_run_equals_the_uninterrupted_one(tiny):
    options = ["run", tiny, "--no-video", "--stats", "s.jsonl", "-q"]
    assert call(*options, "--frames", 6, "--checkpoint", "whole.npz").exit_code == 0
    assert call(*options, "--frames", 3, "--checkpoint", "half.npz").exit_code == 0
    assert call(*options, "--seconds", 0.2, "--resume", "half.npz", "--checkpoint", "rest.npz").exit_code == 0
    for name in ("x", "v"):
        assert np.array_equal(state("whole.npz")[name], state("rest.npz")[name])


def test_a_run_that_is_over_cannot_be_resumed_and_keeps_its_video(tiny):
    assert call("run", tiny, "-q", "--size", "160x90", "--checkpoint", "end.npz").exit_code == 0
    assert_refused(call("run", tiny, "--resume", "end.npz"), "frame 6", "--frames")
    assert call("run", tiny, "-q", "--size", "160x90", "--resume", "end.npz", "--frames", 8).exit_code == 0
    assert frames_of("out/tiny.mp4") == 7
    assert frames_of("out/tiny-from-6.mp4") == 3


def test_options_change_the_scene(tiny):
    given = ["--set", "body.0.material.youngs=1e7", "--fps", "60", "--seconds", "0.05", "--precision", "f64"]
    result = call("run", tiny, "--no-video", "--stats", "s.jsonl", *given)
    assert result.exit_code == 0, result.output
    last = json.loads((tiny.parent / "s.jsonl").read_text().splitlines()[-1])
    assert last["frame"] == 3 and abs(last["time"] - 0.05) < 1e-9


def test_ctrl_c_leaves_a_video_and_a_checkpoint(tiny):
    options = ["--frames", 100000, "--size", "64x64", "-o", "long.mp4", "--checkpoint", "at.npz", "--stats", "s.jsonl"]
    running = subprocess.Popen(
        command("run", tiny, *options),
        env=environment(),
        text=True,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.default_int_handler),
    )
    figures = tiny.parent / "s.jsonl"
    end = time.monotonic() + 60
    while time.monotonic() < end and not (figures.exists() and figures.read_text().count("\n") > 3):
        time.sleep(0.05)
    running.send_signal(signal.SIGINT)
    out, err = running.communicate(timeout=60)
    assert running.returncode == 130, err
    assert "Traceback" not in out + err and "interrupted after" in out
    assert frames_of("long.mp4") == figures.read_text().count("\n") > 3
    assert len(state("at.npz")["x"]) == 12
