"""How far a run has come, for whoever waits for it."""

from __future__ import annotations

import time
from types import TracebackType

from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

SECONDS_BETWEEN_LINES = 5.0


class ProgressReport:
    """A bar in a terminal, a plain line every few seconds in a pipe or file, nothing if `quiet`."""

    def __init__(self, total: int, *, quiet: bool = False, console: Console | None = None) -> None:
        """total: frames to come."""
        self.total, self.quiet = max(total, 1), quiet
        self._console = console or Console()
        self._last = time.perf_counter()
        self._first: tuple[float, int, float] | None = None
        self._bar: Progress | None = None
        if not quiet and self._console.is_terminal:
            self._bar = Progress(
                TextColumn("frame {task.completed}/{task.total}"),
                BarColumn(),
                TextColumn("{task.percentage:3.0f} %  {task.fields[rates]}  ETA"),
                TimeRemainingColumn(),
                console=self._console,
            )

    def __enter__(self) -> ProgressReport:
        if self._bar:
            self._task = self._bar.add_task("", total=self.total, rates="")
            self._bar.start()
        return self

    def __exit__(self, kind: type | None, error: BaseException | None, trace: TracebackType | None) -> None:
        if self._bar:
            self._bar.stop()

    def update(self, done: int, simulated: float) -> None:
        """`done` frames are recorded, which is `simulated` seconds."""
        if self.quiet:
            return
        now = time.perf_counter()
        if self._first is None:  # rates count from here: the first frame waits for kernels to compile
            self._first = now, done, simulated
        wall = max(now - self._first[0], 1e-9)
        frames = done - self._first[1]
        rates = f"{frames / wall:.1f} fps  {(simulated - self._first[2]) / wall:.2f}x real time"
        if self._bar:
            self._bar.update(self._task, completed=done, rates=rates)
        elif now - self._last >= SECONDS_BETWEEN_LINES or done == self.total:
            self._last = now
            line = f"frame {done}/{self.total}  {100 * done / self.total:.0f} %"
            if frames:
                line += f"  {rates}  {wall / frames * (self.total - done):.0f} s left"
            self._console.print(line, highlight=False, soft_wrap=True)
