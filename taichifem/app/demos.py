"""The demos that come with the package: scene files in `demos/`."""

from __future__ import annotations

import tomllib
from dataclasses import dataclass
from pathlib import Path

from taichifem.app.program import suggestion
from taichifem.errors import InputError

PACKAGE = Path(__file__).resolve().parents[1]
FOLDERS = (PACKAGE / "demos", PACKAGE.parent / "demos")
"""Where demos lie: in an installed package; in a checkout."""


@dataclass(frozen=True)
class Demo:
    """name: what `taichifem demo` takes.  title, description: what the scene file says of itself."""

    name: str
    title: str
    description: str
    path: Path


def demos() -> dict[str, Demo]:
    """All demos by name, sorted; only the head of each scene file is looked at."""
    files = {file.stem: file for folder in FOLDERS for file in folder.glob("*.toml")}
    return {name: _demo(files[name]) for name in sorted(files)}


def find_demo(name: str) -> Demo:
    """The demo called `name`. Raises InputError with the nearest name if there is none."""
    known = demos()
    if name not in known:
        raise InputError(f"there is no demo {name!r}: {suggestion(name, known)}")
    return known[name]


def _demo(file: Path) -> Demo:
    try:
        tree = tomllib.loads(file.read_text(encoding="utf-8-sig"))
    except (OSError, ValueError) as error:
        return Demo(file.stem, file.stem, f"(cannot be read: {error})", file)
    description = " ".join(str(tree.get("description", "")).split())
    return Demo(file.stem, str(tree.get("name", file.stem)), description, file)
