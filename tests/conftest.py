"""Shared by all tests: where reference data lies, and small bodies."""

from pathlib import Path

import numpy as np
import pytest

import taichifem as tf

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


def rigid_misfit(before: np.ndarray, after: np.ndarray) -> float:
    """Largest distance [m] between `after` and the best rigid motion of `before` (Kabsch)."""
    a, b = before - before.mean(axis=0), after - after.mean(axis=0)
    u, _, vt = np.linalg.svd(a.T @ b)
    turn = u @ np.diag([1, 1, np.sign(np.linalg.det(u @ vt))]) @ vt
    return float(np.abs(a @ turn - b).max())


def random_rotation(rng: np.random.Generator) -> np.ndarray:
    """A rotation matrix, uniform over all."""
    q, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    return q * np.sign(np.linalg.det(q))
