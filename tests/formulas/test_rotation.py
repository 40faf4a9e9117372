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
    tolerance = 2e-4 if precision == "f32" else 1e-8
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
