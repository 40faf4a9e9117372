from pathlib import Path

import pytest

EVERYTHING = Path(__file__).with_name("everything.toml")


@pytest.fixture
def everything() -> Path:
    """A scene file that uses every kind of key."""
    return EVERYTHING


@pytest.fixture
def scene_file(tmp_path):
    """Write a text as a scene file and return its path."""

    def write(text: str | bytes, name: str = "scene.toml") -> Path:
        path = tmp_path / name
        path.write_bytes(text if isinstance(text, bytes) else text.encode())
        return path

    return write
