"""Figures of a run: a line of JSON for each frame."""

from __future__ import annotations

import json
import math
import os
from pathlib import Path
from typing import Any

from taichifem.errors import InputError


class StatsWriter:
    """Writes JSON lines, each complete in the file before the next frame begins. Replaces an older file.

    A figure that is not finite becomes null, since JSON has neither NaN nor infinity.
    """

    def __init__(self, path: str | os.PathLike) -> None:
        """Raises InputError if the file cannot be written."""
        self.path = Path(path)
        try:
            self.path.parent.mkdir(parents=True, exist_ok=True)
            self._file = self.path.open("w", encoding="utf-8")
        except OSError as error:
            raise self._refused(error) from None

    def write(self, figures: dict[str, Any]) -> None:
        """Append a line, for example `simulation.stats.as_dict()`. Raises InputError if that fails."""
        try:
            self._file.write(json.dumps(_finite(figures), allow_nan=False) + "\n")
            self._file.flush()
        except OSError as error:
            raise self._refused(error) from None

    def close(self) -> None:
        """Close the file; closing again does nothing."""
        try:
            self._file.close()
        except OSError as error:
            raise self._refused(error) from None

    def _refused(self, error: OSError) -> InputError:
        return InputError(f"{self.path}: cannot be written: {error.strerror}")


def _finite(value: Any) -> Any:
    """`value` in types that JSON has."""
    if isinstance(value, dict):
        return {str(key): _finite(entry) for key, entry in value.items()}
    if isinstance(value, list | tuple):
        return [_finite(entry) for entry in value]
    if hasattr(value, "tolist"):  # NumPy's scalars and arrays
        return _finite(value.tolist())
    return None if isinstance(value, float) and not math.isfinite(value) else value
