"""Whatever a person gets wrong: one line, exit code 2."""

import sys

import pytest
from calling import assert_refused, call, in_process

from taichifem.app import demos


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["rnu"], ["'rnu'", "did you mean 'run'?"]),
        (["run"], ["SCENE", "run --help"]),
        (["run", "nowhere.toml"], ["nowhere.toml", "no such scene file"]),
        (["run", "."], ["folder"]),
        (["run", "tiny.toml", "--precision", "f16"], ["--precision", "f16", "f32"]),
        (["run", "tiny.toml", "--no-such"], ["--no-such"]),
        (["run", "tiny.toml", "--size", "big"], ["--size", "'big'", "1280x720"]),
        (["run", "tiny.toml", "--size", "3x0"], ["--size", "16 to 8192"]),
        (["run", "tiny.toml", "--set", "youngs"], ["'youngs'", "KEY=VALUE"]),
        (["run", "tiny.toml", "--set", "body.0.material.yongs=3"], ["yongs", "youngs"]),
        (["run", "tiny.toml", "--set", "body.0.material.youngs=-3"], ["body.0.material.youngs", "-3"]),
        (["run", "tiny.toml", "--fps", "nan"], ["simulation.fps"]),
        (["run", "tiny.toml", "--seconds", "-1"], ["simulation.seconds"]),
        (["run", "tiny.toml", "--seconds", "1", "--frames", "9"], ["--frames", "--seconds"]),
        (["run", "tiny.toml", "--frames", "0"], ["--frames"]),
        (["run", "tiny.toml", "--format", "vtu"], ["--export"]),
        (["run", "tiny.toml", "--checkpoint-every", "2"], ["--checkpoint"]),
        (["run", "tiny.toml", "--no-video", "-o", "a.mp4"], ["--output", "--no-video"]),
        (["run", "tiny.toml", "--no-video", "--checkpoint", "tiny.toml/a.npz"], ["tiny.toml/a.npz"]),
        (["run", "tiny.toml", "--no-video", "--resume", "tiny.toml"], ["tiny.toml", "checkpoint"]),
        (["run", "tiny.toml", "--no-video", "--resume", "nowhere.npz"], ["nowhere.npz"]),
        (["run", "tiny.toml", "--no-video", "--stats", "tiny.toml/s.jsonl"], ["tiny.toml/s.jsonl"]),
        (["run", "tiny.toml", "--no-video", "--export", "tiny.toml/x"], ["tiny.toml/x"]),
        (["run", "tiny.toml", "-o", "a.mov"], ["a.mov", ".mp4"]),
        (["run", "tiny.toml", "-o", "tiny.toml/a.mp4"], ["tiny.toml/a.mp4"]),
        (["mesh", "nowhere.obj"], ["nowhere.obj"]),
        (["mesh", "tiny.toml"], ["tiny.toml"]),
        (["mesh", "a.obj", "--tets", "3"], ["--tets"]),
        (["bench", "--sizes", "many"], ["--sizes", "'many'"]),
        (["bench", "--sizes", "1e12"], ["--sizes"]),
        (["bench", "--stiffness", "0"], ["--stiffness"]),
        (["bench", "--budget", "nan"], ["--budget"]),
        (["bench", "--sizes", "20", "--json", "tiny.toml/b.json"], ["tiny.toml/b.json"]),
    ],
)
def test_one_line_and_exit_code_2(tiny, arguments, words):
    assert_refused(call(*arguments), *words)
    assert not (tiny.parent / "out").exists()


def test_an_unknown_demo_is_answered_with_the_nearest(tiny, monkeypatch):
    monkeypatch.setattr(demos, "FOLDERS", (tiny.parent,))
    assert_refused(call("demo", "tinny"), "'tinny'", "did you mean 'tiny'?")
    monkeypatch.setattr(demos, "FOLDERS", ())
    assert_refused(call("demo", "tinny"), "'tinny'")


def test_what_taichi_raises_at_its_start_is_one_line(tiny, monkeypatch):
    def broken(**_):
        raise RuntimeError("driver is too old\nand more lines")

    monkeypatch.setattr("taichifem.runtime.start", broken)
    assert_refused(call("run", "tiny.toml", "--no-video"), "driver is too old", "--arch cpu")


def test_a_full_disk_and_a_missing_package_are_one_line(tiny, monkeypatch):
    def raising(error):
        def start(*_):
            raise error

        monkeypatch.setattr("taichifem.app.run.start_taichi", start)
        return call("run", "tiny.toml", "--no-video")

    assert_refused(raising(OSError(28, "No space left on device", "a.mp4")), "a.mp4", "No space left")
    assert_refused(raising(ModuleNotFoundError("no", name="vtk")), "'vtk'", "not installed")
    assert_refused(raising(MemoryError()), "out of memory")


def test_a_process_tells_an_arch_that_is_not_here_in_one_line(tiny):
    result = in_process("run", tiny, "--no-video", "--arch", "cuda" if sys.platform == "darwin" else "metal")
    assert result.returncode == 2
    assert result.stderr.count("\n") == 1 and "not available" in result.stderr
