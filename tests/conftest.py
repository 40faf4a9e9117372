"""Shared by all tests: where reference data lies, and small bodies."""

import os
from pathlib import Path

import pytest

import taichifem as tf
from taichifem import runtime

if "PYTEST_XDIST_WORKER" in os.environ:
    # The workers have a core each: more threads would wait for one another.
    runtime.start(threads=1)

SHARED = Path(__file__).resolve().parents[2] / "shared"


@pytest.fixture(scope="session")
def oracles() -> Path:
    """Folder of the reference solutions; tests that need it skip where it is absent."""
    folder = SHARED / "oracles"
    if not folder.is_dir():
        pytest.skip("the reference solutions (../shared/oracles) are not here")
    return folder


@pytest.fixture(scope="session")
def meshes() -> Path:
    """Folder of the real meshes; tests that need it skip where it is absent."""
    folder = SHARED / "meshes"
    if not folder.is_dir():
        pytest.skip("the real meshes (../shared/meshes) are not here")
    return folder


@pytest.fixture
def block() -> tf.TetMesh:
    """A bar of 6 x 3 x 3 cubes, 270 tetrahedra."""
    return tf.TetMesh.bar(size=(0.6, 0.3, 0.3), cells=(6, 3, 3))
