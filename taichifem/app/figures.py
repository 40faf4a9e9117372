"""Figures of a measurement as a JSON file, with what tells where they come from."""

from __future__ import annotations

import json
import platform
import time
from pathlib import Path

from taichifem import __version__
from taichifem.app.info import machine, versions
from taichifem.files import replacing


def write_figures(path: Path, settings: dict, rows: list[dict]) -> None:
    """Write settings and rows, with versions, machine and date. Raises InputError if that fails."""
    content = {
        "taichifem": __version__,
        "python": platform.python_version(),
        "date": time.strftime("%Y-%m-%dT%H:%M:%S%z"),
        "versions": dict(versions()),
        "machine": dict(machine()),
        "settings": settings,
        "rows": rows,
    }
    with replacing(path) as part:
        part.write_text(json.dumps(content, indent=2, allow_nan=False) + "\n", encoding="utf-8")
