"""Time per phase of a step, always kept."""

from __future__ import annotations

import contextlib
import time
from collections.abc import Iterator

from taichifem import runtime
from taichifem.runtime import ti


class PhaseTimer:
    """Adds up wall time by phase name [ms]. Kernels on a GPU run on by themselves, so a phase waits for them."""

    def __init__(self) -> None:
        self.ms: dict[str, float] = {}
        self._waits = runtime.running_arch() != "cpu"

    def reset(self) -> None:
        """Start the next step."""
        self.ms = {}

    @contextlib.contextmanager
    def phase(self, name: str) -> Iterator[None]:
        """Add the time of the `with` block to `name`."""
        begin = time.perf_counter()
        try:
            yield
        finally:
            if self._waits:
                ti.sync()
            self.ms[name] = self.ms.get(name, 0.0) + 1e3 * (time.perf_counter() - begin)
