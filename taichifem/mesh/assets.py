"""Where the solids and surfaces that come with the package lie."""

from pathlib import Path

from taichifem.errors import InputError

PACKAGE = Path(__file__).resolve().parents[1]
FOLDERS = (PACKAGE / "assets", PACKAGE.parent / "assets")  # installed; in a checkout
PREFIX = "asset:"
KINDS = (".vtu", ".ply")
"""Solids, and surfaces to embed."""


def asset_names() -> list[str]:
    """Names of the solids that come with the package, sorted."""
    return sorted({file.stem for folder in FOLDERS for file in folder.glob("*.vtu")})


def asset_path(name: str) -> Path:
    """The file of the solid or surface with that name, such as "bear".

    Raises:
        InputError: there is none; the message lists those that exist.
    """
    files = {file.stem: file for folder in reversed(FOLDERS) for kind in KINDS for file in folder.glob(f"*{kind}")}
    if name not in files:
        raise InputError(f"there is no asset {name!r}; choose from {', '.join(sorted(files)) or 'none installed'}")
    return files[name]
