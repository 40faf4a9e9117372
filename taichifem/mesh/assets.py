"""Where the solids that come with the package lie."""

from pathlib import Path

from taichifem.errors import InputError

PACKAGE = Path(__file__).resolve().parents[1]
FOLDERS = (PACKAGE / "assets", PACKAGE.parent / "assets")  # installed; in a checkout
PREFIX = "asset:"


def asset_names() -> list[str]:
    """Names of the solids that come with the package, sorted."""
    return sorted({file.stem for folder in FOLDERS for file in folder.glob("*.vtu")})


def asset_path(name: str) -> Path:
    """The file of the solid with that name, such as "bear".

    Raises:
        InputError: there is none; the message lists those that exist.
    """
    for folder in FOLDERS:
        file = folder / f"{name}.vtu"
        if name in asset_names() and file.is_file():
            return file
    raise InputError(f"there is no asset {name!r}; choose from {', '.join(asset_names()) or 'none installed'}")
