"""The recording loop, with a stub in place of simulation and renderer."""

import io
import json
import os
import signal
import threading
import time

import av
import numpy as np
import pytest
from rich.console import Console
from stub_simulation import StubSimulation

from taichifem.errors import Diverged, InputError
from taichifem.output import progress, recorder
from taichifem.output.export import open_export
from taichifem.output.recorder import run_recording
from taichifem.output.stats import StatsWriter
from taichifem.output.video import VideoWriter, open_video

SIZE = (64, 48)


class StubRenderer:
    """Draws the number of the frame as a grey level, always into the same array."""

    def __init__(self) -> None:
        self.image = np.zeros((SIZE[1], SIZE[0], 3), np.uint8)
        self.closed = False

    def draw(self, frame: int) -> np.ndarray:
        self.image[...] = 20 * (frame + 1) % 256
        return self.image

    def close(self) -> None:
        self.closed = True


@pytest.fixture(autouse=True)
def frames_are_numbers(monkeypatch):
    monkeypatch.setattr(recorder, "build_frame", lambda simulation: simulation.frame)


@pytest.fixture
def outputs(tmp_path):
    return {
        "renderer": StubRenderer(),
        "video": open_video(tmp_path / "v.mp4", 30, SIZE),
        "stats": StatsWriter(tmp_path / "s.jsonl"),
        "quiet": True,
    }


def greys(path) -> list[int]:
    with av.open(str(path)) as file:
        return [round(float(frame.to_ndarray(format="gray").mean())) for frame in file.decode(video=0)]


def test_everything_is_recorded_in_order(tmp_path, outputs):
    simulation, seen = StubSimulation(), []
    export = open_export(tmp_path / "meshes", "ply", simulation)
    summary = run_recording(
        simulation,
        frames=6,
        export=export,
        checkpoint=tmp_path / "c.npz",
        checkpoint_every=4,
        on_frame=lambda s, image: seen.append((s.frame, int(image[0, 0, 0]))),
        **outputs,
    )
    assert greys(tmp_path / "v.mp4") == pytest.approx([20 * (k + 1) for k in range(7)], abs=3)
    lines = [json.loads(line) for line in (tmp_path / "s.jsonl").read_text().splitlines()]
    assert [line["frame"] for line in lines] == list(range(7))
    assert lines[3] == {"frame": 3, "energy": {"total": 1.5}, "residual": None}
    assert len(export.files) == 7 and simulation.saved == [4, 6]
    assert seen == [(k, 20 * (k + 1)) for k in range(7)]
    assert (summary.frames, summary.interrupted, summary.simulated) == (7, False, pytest.approx(0.2))
    assert summary.files == tuple(tmp_path / name for name in ("v.mp4", "meshes", "s.jsonl", "c.npz"))
    assert set(summary.seconds) == {"simulate", "render", "wait", "encode", "export"}
    assert summary.real_time_factor == pytest.approx(0.2 / summary.wall)
    assert sum(v for k, v in summary.shares.items() if k != "encode") <= 1
    assert "recorded 7 frames" in str(summary) and outputs["renderer"].closed


def test_nothing_but_the_simulation():
    summary = run_recording(StubSimulation(), frames=3, quiet=True)
    assert (summary.frames, summary.files) == (4, ())


def test_a_video_needs_a_renderer(outputs):
    outputs["renderer"] = None
    with pytest.raises(ValueError, match="renderer"):
        run_recording(StubSimulation(), frames=1, **outputs)


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_ends_the_run_after_the_frame_in_work(tmp_path, outputs, number):
    simulation, before = StubSimulation(), signal.getsignal(number)

    def interrupt(simulation, image):
        if simulation.frame == 3:
            os.kill(os.getpid(), number)

    summary = run_recording(simulation, frames=1000, checkpoint=tmp_path / "c.npz", on_frame=interrupt, **outputs)
    assert summary.interrupted and summary.frames == simulation.frame + 1 == 4
    assert "interrupted after" in str(summary)
    assert simulation.saved == [simulation.frame]  # whole frames only, so that it can be resumed
    assert len(greys(tmp_path / "v.mp4")) == summary.frames
    assert signal.getsignal(number) == before


def test_a_second_ctrl_c_ends_the_run_at_once(tmp_path, outputs, request):
    # What a process has by itself, unless it was started in the background, where SIGINT is ignored.
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    request.addfinalizer(lambda: signal.signal(signal.SIGINT, before))

    def interrupt_twice(simulation, image):
        os.kill(os.getpid(), signal.SIGINT)
        time.sleep(0.2)  # two at the same instant would count as one
        os.kill(os.getpid(), signal.SIGINT)
        time.sleep(1)  # a signal may take a moment
        raise AssertionError("still here")

    summary = run_recording(StubSimulation(), frames=9, on_frame=interrupt_twice, **outputs)
    assert summary.interrupted and summary.frames == 1 and len(greys(tmp_path / "v.mp4")) == 1


def test_an_interrupt_inside_a_step_saves_no_checkpoint(tmp_path, outputs):
    simulation = StubSimulation(interrupted_at=3)
    summary = run_recording(simulation, frames=10, checkpoint=tmp_path / "c.npz", **outputs)
    assert summary.interrupted and summary.frames == 3 and simulation.saved == []
    assert len(greys(tmp_path / "v.mp4")) == 3 and len((tmp_path / "s.jsonl").read_text().splitlines()) == 3
    assert tmp_path / "c.npz" not in summary.files


def test_divergence_closes_the_video(tmp_path, outputs):
    with pytest.raises(Diverged, match="diverged"):
        run_recording(StubSimulation(diverges_at=5), frames=10, **outputs)
    assert len(greys(tmp_path / "v.mp4")) == 5
    with av.open(str(tmp_path / "v.mp4")) as file:
        assert file.streams.video[0].frames == 5  # closed properly: an index was written
    assert outputs["renderer"].closed


class FailingVideo(VideoWriter):
    """Fails at the third picture."""

    def _put(self, image):
        if self.frames == 2:
            raise OSError(28, "No space left on device")


def test_an_error_in_the_encoder_surfaces_in_one_line(tmp_path, outputs):
    outputs["video"].close()
    outputs["video"] = FailingVideo(tmp_path / "x.mp4", SIZE)
    simulation = StubSimulation()
    with pytest.raises(InputError, match=r"x\.mp4: cannot be written: No space left on device \(after 2"):
        run_recording(simulation, frames=200, **outputs)
    assert simulation.frame < 200
    assert not [t for t in threading.enumerate() if t.name == "encoder"]


def test_an_error_at_the_last_picture_is_told_too(tmp_path, outputs):
    outputs["video"].close()
    outputs["video"] = FailingVideo(tmp_path / "x.mp4", SIZE)
    with pytest.raises(InputError, match="No space left"):
        run_recording(StubSimulation(), frames=2, **outputs)


class WaitingVideo(VideoWriter):
    """Takes no picture before `gate` opens."""

    gate = threading.Event()

    def _put(self, image):
        if not self.gate.wait(timeout=20):
            raise OSError("the simulation did not go on meanwhile")


def test_the_simulation_goes_on_while_a_picture_is_encoded(tmp_path, outputs):
    outputs["video"].close()
    outputs["video"] = WaitingVideo(tmp_path / "x.mp4", SIZE)
    ahead = recorder.QUEUED_PICTURES
    summary = run_recording(
        StubSimulation(),
        frames=8,
        on_frame=lambda s, image: s.frame == ahead and WaitingVideo.gate.set(),
        **outputs,
    )
    assert outputs["video"].frames == summary.frames == 9


def test_progress_is_plain_lines_where_there_is_no_terminal(monkeypatch):
    monkeypatch.setattr(progress, "SECONDS_BETWEEN_LINES", 0.0)
    text = io.StringIO()
    with progress.ProgressReport(4, console=Console(file=text, width=40)) as report:
        for done in range(1, 5):
            report.update(done, done / 30)
    lines = text.getvalue().splitlines()
    assert len(lines) == 4 and "\x1b" not in text.getvalue()
    assert lines[1].startswith("frame 2/4  50 %") and "real time" in lines[1] and "left" in lines[1]


def test_progress_in_a_terminal_shows_the_end():
    text = io.StringIO()
    with progress.ProgressReport(4, console=Console(file=text, force_terminal=True, width=100)) as report:
        report.update(4, 0.1)
    assert "frame 4/4" in text.getvalue() and "100 %" in text.getvalue() and "real time" in text.getvalue()


def test_quiet_is_quiet(capsys):
    run_recording(StubSimulation(), frames=3, quiet=True)
    assert capsys.readouterr() == ("", "")


def test_stats_are_in_the_file_line_by_line(tmp_path):
    (tmp_path / "s.jsonl").write_text("an older file\n")
    writer = StatsWriter(tmp_path / "s.jsonl")
    writer.write({"a": np.arange(3), "b": [np.float64(np.inf), (1, None)], "c": True})
    assert json.loads((tmp_path / "s.jsonl").read_text()) == {"a": [0, 1, 2], "b": [None, [1, None]], "c": True}
    writer.close()
    with pytest.raises(InputError, match=r"file/s\.jsonl: cannot be written"):
        (tmp_path / "file").write_text("")
        StatsWriter(tmp_path / "file" / "s.jsonl")
