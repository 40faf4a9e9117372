"""A tiny scene."""

from pathlib import Path

import pytest

TINY = """\
name = "tiny bar"
description = "A bar of two cubes bends."
[simulation]
fps = 30
seconds = 0.2
[[body]]
mesh = { shape = "bar", size = [0.4, 0.2, 0.2], cells = [2, 1, 1] }
material = { youngs = 1e5 }
[[body.pin]]
box = { lower = [-1, -1, -1], upper = [1e-6, 1, 1] }
"""


@pytest.fixture
def tiny(tmp_path, monkeypatch) -> Path:
    """A scene file of ten elements and 6 frames, in the current folder."""
    monkeypatch.chdir(tmp_path)
    path = tmp_path / "tiny.toml"
    path.write_text(TINY)
    return path
