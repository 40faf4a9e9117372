"""Stress and tangent of the isotropic laws as functions of F, against independent values and their own definitions."""

import numpy as np
import pytest
from motions import random_rotation

from taichifem import runtime
from taichifem.formulas import eigen, isotropic, rotation
from taichifem.formulas.models import MODELS, invertible

ti = runtime.ti
LAWS = {**MODELS, **{f"invertible {name}": invertible.wrap(model) for name, model in MODELS.items()}}
SAMPLES = {"corotational": "corotated", "stvk": "stvk", "neo-hookean": "stable_neohookean"}
LA, MU = 3e5, 1e5


def make_kernel(precision: str):
    """The kernel that evaluates a law: the same body, compiled in one precision."""
    real = runtime.PRECISIONS[precision]
    matrix = ti.types.ndarray(dtype=ti.types.matrix(3, 3, real), ndim=1)
    scalar = ti.types.ndarray(dtype=real, ndim=1)

    @ti.kernel
    def run(
        model: ti.template(),
        F: matrix,
        la: scalar,
        mu: scalar,
        energy: scalar,
        stress: matrix,
        cauchy: matrix,
        tangents: ti.types.ndarray(dtype=real, ndim=4),
        block: matrix,
    ):
        for n in F:
            turn = rotation.nearest_rotation(F[n], ti.Vector([1.0, 0.0, 0.0, 0.0]), 1e-8, 60)
            U, s, V = eigen.signed_svd(F[n], rotation.rotation_of(turn))
            slope = model.slope(s, la[n], mu[n])
            energy[n] = model.energy(s, la[n], mu[n])
            stress[n] = isotropic.first_piola(U, slope, V)
            cauchy[n] = isotropic.cauchy(U, slope, s)
            A, p, q = isotropic.tangent(model, s, la[n], mu[n])
            g_a, g_b = ti.Vector([1.0, 2.0, -3.0]), ti.Vector([-2.0, 0.5, 1.0])
            block[n] = isotropic.stiffness_block(g_a, g_b, U, V, A, p, q)
            for projected in range(2):
                if projected == 1:
                    A, p, q = isotropic.project(A, p, q)
                for k in range(9):
                    dF = ti.Matrix([[1.0 if k == 3 * i + j else 0.0 for j in range(3)] for i in range(3)])
                    dP = isotropic.stress_change(dF, U, V, A, p, q)
                    for i, j in ti.static(ti.ndrange(3, 3)):
                        tangents[n, projected, 3 * i + j, k] = dP[i, j]

    return run


KERNELS = {precision: make_kernel(precision) for precision in runtime.PRECISIONS}


class Response:
    """What a law answers to the deformation gradients F (n,3,3); tangents (n,9,9), rows by P, columns by F."""

    def __init__(self, law: str, F: np.ndarray, la: float = LA, mu: float = MU, precision: str = "f64"):
        runtime.start()
        n, kind = len(F), np.float32 if precision == "f32" else np.float64
        F, moduli = np.ascontiguousarray(F, kind), [np.full(n, value, kind) for value in (la, mu)]
        self.energy, self.stress, self.cauchy = np.zeros(n, kind), np.zeros_like(F), np.zeros_like(F)
        self.block, tangents = np.zeros_like(F), np.zeros((n, 2, 9, 9), kind)
        with runtime.precision_of(precision):
            KERNELS[precision](LAWS[law], F, *moduli, self.energy, self.stress, self.cauchy, tangents, self.block)
        self.tangent, self.projected = tangents[:, 0], tangents[:, 1]


def gradients(n: int = 300, least: float = 0.0) -> np.ndarray:
    """Stretched, crushed and inverted F (n,3,3), turned on both sides; no two stretches cancel to below `least`."""
    rng = np.random.default_rng(8)
    F = []
    while len(F) < n:
        stretch = rng.uniform(0.05, 2.5, size=3)
        stretch[2] *= (1, -1, 1e-3, -1e-3)[len(F) % 4]
        low, middle, _ = np.sort(np.abs(stretch))
        if stretch[2] > 0 or middle - low > least:
            F.append(random_rotation(rng) @ np.diag(stretch) @ random_rotation(rng).T)
    return np.array(F)


def close(got: np.ndarray, expected: np.ndarray, error: float, size: float = MU):
    """Every item agrees within `error` of its largest entry, or of `size` where that is larger."""
    axes = tuple(range(1, np.ndim(expected)))
    sizes = np.maximum(np.abs(expected).max(axis=axes, keepdims=True), size)
    np.testing.assert_allclose((got - expected) / sizes, 0, atol=error)


@pytest.mark.parametrize("law", MODELS)
@pytest.mark.parametrize("material", [0, 1])
@pytest.mark.parametrize(("precision", "error"), [("f64", 1e-10), ("f32", 1e-3)])
def test_samples(oracles, law, material, precision, error):
    data = np.load(oracles / "constitutive_samples.npz")
    energy, P, A = (data[f"{what}_{SAMPLES[law]}_{material}"] for what in ("psi", "P", "A"))
    youngs, poisson = data["E"][material], data["nu"][material]
    la, mu = youngs * poisson / ((1 + poisson) * (1 - 2 * poisson)), youngs / (2 * (1 + poisson))
    got = Response(law, data["F"], la, mu, precision)
    close(got.energy, energy - energy[0], error, youngs)  # sample 0 is rest
    close(got.stress, P, error, youngs)
    close(got.tangent, A.reshape(-1, 9, 9), error, youngs)


@pytest.mark.parametrize("law", LAWS)
def test_stress_and_tangent_are_derivatives(law):
    F, h = gradients(least=0.1), 1e-6
    steps = h * np.eye(9).reshape(9, 3, 3)
    centre = Response(law, F)
    plus, minus = (Response(law, (F[:, None] + sign * steps).reshape(-1, 3, 3)) for sign in (1, -1))
    slope = (plus.energy - minus.energy).reshape(-1, 3, 3) / (2 * h)
    close(centre.stress, slope, 1e-6)
    change = (plus.stress - minus.stress).reshape(-1, 9, 9).transpose(0, 2, 1) / (2 * h)
    # The curvature of a continued law jumps where a stretch passes the threshold.
    s = np.linalg.svd(F, compute_uv=False)
    smooth = (np.abs(s - 0.3) > 1e-4).all(axis=1)
    assert smooth.sum() > 250
    close(centre.tangent[smooth], change[smooth], 1e-6)


@pytest.mark.parametrize("law", LAWS)
def test_block_and_cauchy_stress_follow_from_tangent_and_stress(law):
    F = gradients()
    got = Response(law, F)
    g_a, g_b = np.array([1, 2, -3]), np.array([-2, 0.5, 1])
    close(got.block, np.einsum("nijkl,j,l->nik", got.tangent.reshape(-1, 3, 3, 3, 3), g_a, g_b), 1e-13)
    J = np.linalg.det(F)[:, None, None]
    close(got.cauchy, got.stress @ F.transpose(0, 2, 1) / J, 1e-9)


@pytest.mark.parametrize("law", LAWS)
def test_projection(law):
    crushed = np.array([np.zeros((3, 3)), np.diag([1.0, 0, 0]), np.diag([1.0, 1, 0]), np.diag([1.0, 0.5, -0.5])])
    F = np.concatenate([gradients(1000), crushed, -0.5 * crushed, 1e-9 * gradients(10)])
    got = Response(law, F)
    for tangent, projected in zip(got.tangent, got.projected, strict=True):
        assert np.isfinite(tangent).all()
        np.testing.assert_allclose(tangent, tangent.T, atol=1e-12 * np.abs(tangent).max())
        size = np.abs(projected).max()
        own, clamped = np.linalg.eigvalsh(tangent), np.linalg.eigvalsh(projected)
        assert clamped.min() >= -1e-12 * size
        np.testing.assert_allclose(clamped, np.maximum(own, 0), atol=1e-12 * np.abs(tangent).max())
        if own.min() >= 0:
            np.testing.assert_allclose(projected, tangent, atol=1e-14 * size)
    assert (np.linalg.eigvalsh(got.tangent)[:, 0] > 0).sum() > 20


@pytest.mark.parametrize("law", LAWS)
def test_objective_and_isotropic(law):
    rng = np.random.default_rng(6)
    F = gradients(least=0.1)
    Q = np.array([random_rotation(rng) for _ in F])
    P = Response(law, F)
    before, after = Response(law, Q @ F), Response(law, F @ Q)
    close(before.energy, P.energy, 1e-12)
    close(after.energy, P.energy, 1e-12)
    close(before.stress, Q @ P.stress, 1e-12)
    close(after.stress, P.stress @ Q, 1e-12)


@pytest.mark.parametrize("law", LAWS)
def test_nearly_equal_stretches(law):
    """The quotients and their limits agree where one takes over from the other, to 1e-10."""
    rng = np.random.default_rng(9)
    left, right = random_rotation(rng), random_rotation(rng)
    gaps = np.concatenate([[0], np.logspace(-9, -3, 40)])
    F = np.array([left @ np.diag([0.9, 0.9 + gap, 1.3]) @ right for gap in gaps])
    tangent = Response(law, F).tangent
    slope = (tangent[-1] - tangent[0]) / gaps[-1]
    expected = tangent[0] + gaps[:, None, None] * slope
    bent = gaps < 3e-5  # beyond, the tangent is no longer a straight line in the gap
    close(tangent[bent], expected[bent], 1e-7)
