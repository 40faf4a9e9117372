"""Symmetric eigenvalues and signed singular values against LAPACK."""

import numpy as np
import pytest
from motions import random_rotation

from taichifem import runtime
from taichifem.formulas import eigen, rotation

ti = runtime.ti
ERROR = {"f32": 2e-6, "f64": 5e-15}


def symmetric_matrices(d: int) -> np.ndarray:
    """Random ones, nearly diagonal ones, and some with equal, zero and widely different eigenvalues (:,d,d)."""
    rng = np.random.default_rng(2)
    cases = [np.zeros((d, d)), np.eye(d), np.ones((d, d)), np.diag(np.arange(d)), 1e12 * np.ones((d, d))]
    for k in range(200):
        Q = random_rotation(rng)[:d, :d] if d == 3 else np.linalg.qr(rng.normal(size=(2, 2)))[0]
        values = rng.normal(size=d) * 10.0 ** rng.integers(-12, 12)
        if k % 4 == 1:
            values[1] = values[0]
        if k % 4 == 2:
            values *= 10.0 ** -(4.0 * np.arange(d))
        if k % 4 == 3:
            Q = np.linalg.qr(np.eye(d) + 1e-5 * rng.normal(size=(d, d)))[0]
        S = Q @ np.diag(values) @ Q.T
        cases.append(0.5 * (S + S.T))
    return np.array(cases)


@pytest.mark.parametrize("precision", ["f32", "f64"])
@pytest.mark.parametrize("d", [2, 3])
def test_symmetric_eigen(d, precision):
    runtime.start()
    real = runtime.PRECISIONS[precision]
    S = symmetric_matrices(d).astype(np.float32 if precision == "f32" else np.float64)
    values, vectors = np.zeros(S.shape[:2], S.dtype), np.zeros(S.shape, S.dtype)
    matrix, vector = ti.types.matrix(d, d, real), ti.types.vector(d, real)

    @ti.kernel
    def run(
        source: ti.types.ndarray(dtype=matrix, ndim=1),
        w: ti.types.ndarray(dtype=vector, ndim=1),
        Q: ti.types.ndarray(dtype=matrix, ndim=1),
    ):
        for i in source:
            w[i], Q[i] = eigen.symmetric_eigen(source[i])

    with runtime.precision_of(precision):
        run(S, values, vectors)
    error = ERROR[precision]
    for given, w, Q in zip(S.astype(float), values, vectors.astype(float), strict=True):
        size = np.abs(given).max()
        np.testing.assert_allclose(Q @ np.diag(w) @ Q.T, given, atol=error * size)
        np.testing.assert_allclose(Q.T @ Q, np.eye(d), atol=error)
        assert np.linalg.det(Q) > 0
        np.testing.assert_allclose(np.sort(w), np.linalg.eigvalsh(given), atol=error * size)


@pytest.mark.parametrize("precision", ["f32", "f64"])
def test_signed_svd(precision):
    runtime.start()
    real = runtime.PRECISIONS[precision]
    rng = np.random.default_rng(7)
    F = [np.eye(3), np.diag([1.0, 1.0, -0.5]), np.diag([2.0, 1.0, 0.0]), np.diag([1.0, 0.0, 0.0]), np.zeros((3, 3))]
    for k in range(200):
        stretch = rng.uniform(0.1, 3.0, size=3)
        stretch[2] *= (1, -1, 1e-4, 0)[k % 4]
        F.append(random_rotation(rng) @ np.diag(stretch) @ random_rotation(rng).T)
    F = np.array(F).astype(np.float32 if precision == "f32" else np.float64)
    s, U, V = np.zeros(F.shape[:2], F.dtype), np.zeros_like(F), np.zeros_like(F)
    matrix, vector = ti.types.matrix(3, 3, real), ti.types.vector(3, real)

    @ti.kernel
    def run(
        source: ti.types.ndarray(dtype=matrix, ndim=1),
        U: ti.types.ndarray(dtype=matrix, ndim=1),
        s: ti.types.ndarray(dtype=vector, ndim=1),
        V: ti.types.ndarray(dtype=matrix, ndim=1),
    ):
        for i in source:
            q = rotation.nearest_rotation(source[i], ti.Vector([1.0, 0.0, 0.0, 0.0]), 1e-13, 60)
            U[i], s[i], V[i] = eigen.signed_svd(source[i], rotation.rotation_of(q))

    with runtime.precision_of(precision):
        run(F, U, s, V)
    error = 4 * ERROR[precision]
    for f, u, w, v in zip(F.astype(float), U.astype(float), s, V.astype(float), strict=True):
        np.testing.assert_allclose(u @ np.diag(w) @ v.T, f, atol=error)
        np.testing.assert_allclose([np.linalg.det(u), np.linalg.det(v)], 1, atol=error)
        magnitudes = np.linalg.svd(f, compute_uv=False)
        np.testing.assert_allclose(np.sort(np.abs(w))[::-1], magnitudes, atol=error)
        low, middle, _ = np.sort(w)
        assert low + middle > -error
