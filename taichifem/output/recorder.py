"""The loop behind `taichifem run`: simulate, draw, write, until the end or Ctrl-C."""

from __future__ import annotations

import os
import queue
import signal
import threading
import time
from collections import defaultdict
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from taichifem.output.export import MeshSequence
from taichifem.output.frame import build_frame
from taichifem.output.progress import ProgressReport
from taichifem.output.renderer import Renderer
from taichifem.output.stats import StatsWriter
from taichifem.output.video import VideoWriter

QUEUED_PICTURES = 4  # enough to ride out a slow picture; each is 2.8 MB at 1280x720


@dataclass(frozen=True, kw_only=True)
class Summary:
    """What a recording came to.

    frames: recorded, the initial state included.  simulated, wall: seconds.
    seconds: wall time by what it went to. "encode" runs beside the rest; "wait" is what the rest waited for it.
    interrupted: stopped by Ctrl-C.  files: what was written.
    """

    frames: int
    simulated: float
    wall: float
    seconds: dict[str, float]
    interrupted: bool
    files: tuple[Path, ...]

    @property
    def real_time_factor(self) -> float:
        """Simulated seconds for each second of waiting: 1 or more is real time."""
        return self.simulated / self.wall if self.wall > 0 else 0.0

    @property
    def shares(self) -> dict[str, float]:
        """`seconds` as parts of the wall time, 0 to 1."""
        return {name: spent / self.wall for name, spent in self.seconds.items()} if self.wall > 0 else {}

    def __str__(self) -> str:
        shares = ", ".join(f"{name} {100 * share:.0f} %" for name, share in self.shares.items())
        begin = "interrupted after" if self.interrupted else "recorded"
        return (
            f"{begin} {self.frames} frames ({self.simulated:.2f} s) in {self.wall:.1f} s, "
            f"{self.real_time_factor:.2f}x real time: {shares}"
        )


def run_recording(
    simulation: Any,
    *,
    frames: int,
    renderer: Renderer | None = None,
    video: VideoWriter | None = None,
    export: MeshSequence | None = None,
    stats: StatsWriter | None = None,
    checkpoint: str | os.PathLike | None = None,
    checkpoint_every: int | None = None,
    on_frame: Callable[[Any, np.ndarray | None], None] | None = None,
    quiet: bool = False,
) -> Summary:
    """Record the present state and `frames` more; then everything given is closed, whatever happened.

    Ctrl-C (or a request to terminate) ends the run after the frame in work; a second one ends it at once.

    Args:
        renderer: draws a picture of each frame, for `video` and `on_frame`.
        checkpoint: file to save the state to at the end, and each `checkpoint_every` frames.
        on_frame: called after each frame with the simulation and the picture (height, width, 3) uint8, or None.
        quiet: no progress report.

    Raises:
        InputError: something could not be written, or the simulation diverged. What was written stays.
    """
    if video is not None and renderer is None:
        raise ValueError("a video needs a renderer")
    spent: dict[str, float] = defaultdict(float)
    start, begin, recorded, interrupted = simulation.time, time.perf_counter(), 0, False
    with ExitStack() as open_things:
        for thing in (renderer, export, stats):
            if thing is not None:
                open_things.callback(thing.close)
        encoder = open_things.enter_context(_Encoder(video, spent)) if video is not None else None
        report = open_things.enter_context(ProgressReport(frames + 1, quiet=quiet))
        stop = open_things.enter_context(_stop_on_signal())
        try:
            for number in range(frames + 1):
                if number:
                    with _timed(spent, "simulate"):
                        simulation.advance_frame()
                image = None
                if renderer is not None:
                    with _timed(spent, "render"):
                        image = renderer.draw(build_frame(simulation))
                if encoder is not None:
                    with _timed(spent, "wait"):
                        encoder.put(image)
                with _timed(spent, "export"):
                    if export is not None:
                        export.write(simulation)
                    if stats is not None:
                        stats.write(simulation.stats.as_dict())
                    if checkpoint is not None and checkpoint_every and number and not number % checkpoint_every:
                        simulation.save(checkpoint)
                recorded += 1
                report.update(recorded, simulation.time - start)
                if on_frame is not None:
                    on_frame(simulation, image)
                if stop.is_set() and number < frames:
                    interrupted = True
                    break
            if checkpoint is not None:
                simulation.save(checkpoint)
        except KeyboardInterrupt:  # in the middle of a step: no state that a checkpoint could keep
            interrupted = True
    written = [video and video.path, export and export.directory, stats and stats.path]
    if checkpoint is not None and Path(checkpoint).exists():
        written.append(Path(checkpoint))
    return Summary(
        frames=recorded,
        simulated=simulation.time - start,
        wall=time.perf_counter() - begin,
        seconds=dict(spent),
        interrupted=interrupted,
        files=tuple(path for path in written if path is not None),
    )


class _Encoder:
    """Feeds a video in a thread of its own: encoding does not hold Python's lock, so it overlaps with the rest.

    An error in the thread is raised by the next `put`, or when the block is left.
    """

    def __init__(self, video: VideoWriter, spent: dict[str, float]) -> None:
        self._video, self._spent = video, spent
        self._pictures: queue.Queue[np.ndarray | None] = queue.Queue(QUEUED_PICTURES)
        self._error: BaseException | None = None
        self._thread = threading.Thread(target=self._work, name="encoder", daemon=True)

    def put(self, image: np.ndarray) -> None:
        """Hand over a picture; waits while too many are queued."""
        self._tell()
        self._pictures.put(image.copy())  # the renderer may draw the next one into the same array

    def __enter__(self) -> _Encoder:
        self._thread.start()
        return self

    def __exit__(self, kind: type | None, *_: object) -> None:
        self._pictures.put(None)
        self._thread.join()
        if kind is None:  # otherwise the error on its way is the one to tell
            self._tell()

    def _tell(self) -> None:
        if self._error is not None:
            error, self._error = self._error, None
            raise error

    def _work(self) -> None:
        while (image := self._pictures.get()) is not None:
            if self._error is None:  # after an error pictures are dropped, so that `put` never waits for ever
                self._guarded(self._video.write, image)
        self._guarded(self._video.close)

    def _guarded(self, action: Callable, *arguments: object) -> None:
        try:
            with _timed(self._spent, "encode"):
                action(*arguments)
        except BaseException as error:
            self._error = self._error or error


@contextmanager
def _timed(spent: dict[str, float], name: str) -> Iterator[None]:
    begin = time.perf_counter()
    try:
        yield
    finally:
        spent[name] += time.perf_counter() - begin


@contextmanager
def _stop_on_signal() -> Iterator[threading.Event]:
    """An event that the first Ctrl-C sets instead of breaking into a step; the second acts as usual."""
    stop = threading.Event()
    before: dict[int, Any] = {}

    def restore() -> None:
        while before:
            signal.signal(*before.popitem())

    def on_signal(*_: object) -> None:
        stop.set()
        restore()

    if threading.current_thread() is threading.main_thread():  # Python allows it nowhere else
        for number in (signal.SIGINT, signal.SIGTERM):
            before[number] = signal.signal(number, on_signal) or signal.SIG_DFL
    try:
        yield stop
    finally:
        restore()
