"""The nearest rotation against the singular value decomposition."""

import numpy as np
import pytest
from motions import random_rotation

from taichifem import runtime
from taichifem.formulas import rotation

ti = runtime.ti


def gradients() -> np.ndarray:
    """Stretched, turned, crushed and inverted deformation gradients (200,3,3)."""
    rng = np.random.default_rng(5)
    cases = []
    for k in range(200):
        stretch = rng.uniform(0.2, 3.0, size=3)
        if k % 4 == 1:
            stretch[2] *= -1
        if k % 4 == 2:
            stretch[2] *= 1e-3
        cases.append(random_rotation(rng) @ np.diag(stretch) @ random_rotation(rng).T)
    return np.array(cases)


def by_svd(F: np.ndarray) -> np.ndarray:
    """Proper rotation that maximises tr(R^T F): the smallest singular value carries the sign."""
    u, _, vt = np.linalg.svd(F)
    return u @ np.diag([1, 1, np.linalg.det(u @ vt)]) @ vt


@pytest.mark.parametrize(("precision", "error"), [("f32", 3e-5), ("f64", 1e-11)])
def test_nearest_rotation_from_a_cold_start(precision, error):
    runtime.start()
    real = runtime.PRECISIONS[precision]
    F = gradients()
    tolerance = 1e-5 if precision == "f32" else 1e-13
    source, result = ti.Matrix.field(3, 3, real, len(F)), ti.Matrix.field(3, 3, real, len(F))
    source.from_numpy(F.astype(np.float32 if precision == "f32" else np.float64))

    @ti.kernel
    def run():
        for i in source:
            q = rotation.nearest_rotation(source[i], ti.Vector([1.0, 0.0, 0.0, 0.0]), ti.cast(tolerance, real), 60)
            result[i] = rotation.rotation_of(q)

    with runtime.precision_of(precision):
        run()
    got = result.to_numpy()
    for k, R in enumerate(got):
        np.testing.assert_allclose(R.T @ R, np.eye(3), atol=error)
        # The rotation is ill-defined where the two smallest signed singular values nearly cancel.
        s = np.linalg.svd(F[k], compute_uv=False)
        gap = s[1] + s[2] * np.sign(np.linalg.det(F[k]))
        assert gap > 0
        np.testing.assert_allclose(R, by_svd(F[k]), atol=error * max(1, s[0] / gap))


def test_a_turn_from_nearby_leaves_an_error_of_third_order():
    """What the search goes by to stop: at most t^3 / (3 c) after a turn by t, with c = det H / (tr H / 3)^3."""
    rng = np.random.default_rng(8)
    F = np.array([f for f in gradients() if np.linalg.det(f) > 0])
    exact = np.array([by_svd(f) for f in F])
    angle, axis = 10 ** rng.uniform(-2.5, -1, size=len(F)), rng.normal(size=(len(F), 3))
    away = axis / np.linalg.norm(axis, axis=1)[:, None] * np.sin(angle / 2)[:, None]
    runtime.start()
    source, result = ti.Matrix.field(3, 3, ti.f64, len(F)), ti.Matrix.field(3, 3, ti.f64, len(F))
    start = ti.Vector.field(4, ti.f64, len(F))
    # In the axes of the nearest rotation it is the identity.
    source.from_numpy(exact.transpose(0, 2, 1) @ F)
    start.from_numpy(np.column_stack([np.cos(angle / 2), away]))

    @ti.kernel
    def run():
        for i in source:
            result[i] = rotation.rotation_of(rotation.nearest_rotation(source[i], start[i], 0.0, 1))

    with runtime.precision_of("f64"):
        run()
    left = result.to_numpy()
    error = np.linalg.norm(left - np.eye(3), axis=(1, 2)) / np.sqrt(2)
    stretch = exact.transpose(0, 2, 1) @ F
    H = np.trace(stretch, axis1=1, axis2=2)[:, None, None] * np.eye(3) - stretch
    c = np.linalg.det(H) / (np.trace(H, axis1=1, axis2=2) / 3) ** 3
    assert (error <= 0.36 * angle**3 / c + 1e-14).all()
    assert (error < 0.05 * angle).mean() > 0.9


QUICK_CASES = {
    "identity": np.eye(3),
    "nothing": np.zeros((3, 3)),
    "first column zero": np.diag([0.0, 2.0, 0.5]),
    "last column zero": np.diag([1.5, 2.0, 0.0]),
    "parallel columns": np.array([[1.0, 2.0, 0.3], [2.0, 4.0, -1.0], [-1.0, -2.0, 0.5]]),
    "nearly parallel columns": np.array([[1.0, 2.0, 0.3], [2.0, 4.0 + 1e-4, -1.0], [-1.0, -2.0, 0.5]]),
    "first axis along x": np.array([[3.0, 3.0, 1.0], [0.0, 0.0, 1.0], [0.0, 0.0, 1.0]]),
    "tiny": 1e-12 * np.diag([1.0, -2.0, 3.0]),
    "inverted": np.diag([1.0, 1.0, -1.0]),
}


def orthonormal(F: np.ndarray, precision: str) -> np.ndarray:
    """`rotation.orthonormal` of the gradients (n,d,d)."""
    runtime.start()
    real, d = runtime.PRECISIONS[precision], F.shape[-1]
    source, result = ti.Matrix.field(d, d, real, len(F)), ti.Matrix.field(d, d, real, len(F))
    source.from_numpy(F.astype(np.float32 if precision == "f32" else np.float64))

    @ti.kernel
    def run():
        for i in source:
            result[i] = rotation.orthonormal(source[i])

    with runtime.precision_of(precision):
        run()
    return result.to_numpy().astype(float)


@pytest.mark.parametrize(("precision", "error"), [("f32", 2e-6), ("f64", 1e-14)])
@pytest.mark.parametrize("d", [2, 3])
def test_quick_rotation_is_proper_for_every_gradient(d, precision, error):
    F = np.concatenate([gradients(), list(QUICK_CASES.values())])[:, :d, :d]
    got = orthonormal(F, precision)
    np.testing.assert_allclose(got.transpose(0, 2, 1) @ got, np.tile(np.eye(d), (len(F), 1, 1)), atol=error)
    np.testing.assert_allclose(np.linalg.det(got), 1, atol=error)


@pytest.mark.parametrize("d", [2, 3])
def test_quick_rotation_keeps_the_first_edge(d):
    """R^T F is upper triangular with a first entry above zero: the first edge keeps its direction."""
    F = gradients()[:, :d, :d]
    upper = orthonormal(F, "f64").transpose(0, 2, 1) @ F
    assert (upper[:, 0, 0] > 0).all()
    np.testing.assert_allclose(upper[:, *np.tril_indices(d, -1)], 0, atol=1e-10)
    if d == 3:
        assert (upper[:, 1, 1] >= 0).all()


@pytest.mark.parametrize("d", [2, 3])
def test_quick_rotation_is_the_polar_one_for_stretch_along_the_axes(d):
    rng = np.random.default_rng(8)
    turns = np.array([np.eye(3) if d == 2 else random_rotation(rng) for _ in range(50)])[:, :d, :d]
    if d == 2:
        c, s = np.cos(np.arange(50)), np.sin(np.arange(50))
        turns = np.array([[c, -s], [s, c]]).transpose(2, 0, 1)
    got = orthonormal(turns * rng.uniform(0.1, 3.0, size=(50, 1, d)), "f64")
    np.testing.assert_allclose(got, turns, atol=1e-13)


@pytest.mark.parametrize(("precision", "error"), [("f32", 1e-6), ("f64", 1e-14)])
def test_nearest_rotation_in_the_plane(precision, error):
    """Against the singular value decomposition; where all rotations are as near, the identity."""
    runtime.start()
    real = runtime.PRECISIONS[precision]
    F = np.concatenate([gradients()[:, :2, :2], [np.zeros((2, 2)), np.diag([1.0, -1.0])]])
    source, result = ti.Matrix.field(2, 2, real, len(F)), ti.Matrix.field(2, 2, real, len(F))
    source.from_numpy(F.astype(np.float32 if precision == "f32" else np.float64))

    @ti.kernel
    def run():
        for i in source:
            result[i] = rotation.nearest_rotation_2d(source[i])

    with runtime.precision_of(precision):
        run()
    got = result.to_numpy().astype(float)
    np.testing.assert_array_equal(got[-2:], [np.eye(2), np.eye(2)])
    for f, R in zip(F[:-2], got[:-2], strict=True):
        u, s, vt = np.linalg.svd(f)
        sign = np.sign(np.linalg.det(f))
        np.testing.assert_allclose(R, u @ np.diag([1, sign]) @ vt, atol=error * s[0] / (s[0] + sign * s[1]) + error)
