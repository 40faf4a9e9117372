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


def make_kernels(precision: str):
    """Kernels in one precision: singular values; a law's answer; the tangents written out. Apart they compile fast."""
    real = runtime.PRECISIONS[precision]
    matrix = ti.types.ndarray(dtype=ti.types.matrix(3, 3, real), ndim=1)
    vector = ti.types.ndarray(dtype=ti.types.vector(3, real), ndim=1)
    scalar = ti.types.ndarray(dtype=real, ndim=1)

    @ti.kernel
    def decompose(F: matrix, U: matrix, s: vector, V: matrix):
        for n in F:
            turn = rotation.nearest_rotation(F[n], ti.Vector([1.0, 0.0, 0.0, 0.0]), 1e-13, 60)
            U[n], s[n], V[n] = eigen.signed_svd(F[n], rotation.rotation_of(turn))

    @ti.kernel
    def answer(
        model: ti.template(),
        moduli: scalar,
        U: matrix,
        s: vector,
        V: matrix,
        energy: scalar,
        stress: matrix,
        cauchy: matrix,
        A: matrix,
        p: vector,
        q: vector,
    ):
        for n in s:
            la, mu = moduli[0], moduli[1]
            slope = model.slope(s[n], la, mu)
            energy[n] = model.energy(s[n], la, mu)
            stress[n] = isotropic.first_piola(U[n], slope, V[n])
            cauchy[n] = isotropic.cauchy(U[n], slope, s[n])
            A[n], p[n], q[n] = isotropic.tangent(model, s[n], la, mu)

    @ti.kernel
    def project(A: matrix, p: vector, q: vector):
        for n in A:
            A[n], p[n], q[n] = isotropic.project(A[n], p[n], q[n])

    @ti.kernel
    def change(U: matrix, V: matrix, A: matrix, p: vector, q: vector, units: matrix, changes: matrix):
        for n in A:
            for k in range(9):
                changes[9 * n + k] = isotropic.stress_change(units[k], U[n], V[n], A[n], p[n], q[n])

    @ti.kernel
    def couple(U: matrix, V: matrix, A: matrix, p: vector, q: vector, g: vector, block: matrix):
        for n in A:
            block[n] = isotropic.stiffness_block(g[0], g[1], U[n], V[n], A[n], p[n], q[n])

    return decompose, answer, project, change, couple


KERNELS = {precision: make_kernels(precision) for precision in runtime.PRECISIONS}
SHAPE_GRADIENTS = np.array([[1.0, 2.0, -3.0], [-2.0, 0.5, 1.0]])


class Response:
    """What a law answers to the deformation gradients F (n,3,3); tangents (n,9,9), rows by P, columns by F."""

    def __init__(self, law: str, F: np.ndarray, la: float = LA, mu: float = MU, precision: str = "f64"):
        runtime.start()
        self.kind = np.float32 if precision == "f32" else np.float64
        self.kernels, n = KERNELS[precision], len(F)
        F = np.ascontiguousarray(F, self.kind)
        U, V, A = np.zeros_like(F), np.zeros_like(F), np.zeros_like(F)
        s, p, q = (np.zeros((n, 3), self.kind) for _ in range(3))
        self.energy, self.stress, self.cauchy = np.zeros(n, self.kind), np.zeros_like(F), np.zeros_like(F)
        decompose, answer, project, _, couple = self.kernels
        with runtime.precision_of(precision):
            decompose(F, U, s, V)
            moduli = np.array([la, mu], self.kind)
            answer(LAWS[law], moduli, U, s, V, self.energy, self.stress, self.cauchy, A, p, q)
            self.tangent = self._matrices(U, V, A, p, q)
            if precision == "f64":
                self.block = np.zeros_like(F)
                couple(U, V, A, p, q, SHAPE_GRADIENTS, self.block)
                project(A, p, q)
                self.projected = self._matrices(U, V, A, p, q)

    def _matrices(self, U, V, A, p, q):
        """Tangents (n,9,9), from the changes of stress that unit changes of F make."""
        changes, units = np.zeros((9 * len(A), 3, 3), self.kind), np.eye(9, dtype=self.kind).reshape(9, 3, 3)
        self.kernels[3](U, V, A, p, q, units, changes)
        return changes.reshape(-1, 9, 9).transpose(0, 2, 1)


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
    F = gradients(least=0.1)
    got = Response(law, F)
    g_a, g_b = SHAPE_GRADIENTS
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
    assert (np.linalg.eigvalsh(got.tangent)[:, 0] > 0).sum() > 10


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
    """Quotients and limits pass into each other: all lie on one parabola in the gap."""
    rng = np.random.default_rng(9)
    left, right = random_rotation(rng), random_rotation(rng)
    gaps = np.concatenate([[0], np.logspace(-9, -4, 60)])
    F = np.array([left @ np.diag([0.9, 0.9 + gap, 1.3]) @ right for gap in gaps])
    tangent = Response(law, F).tangent.reshape(len(gaps), -1)
    powers = np.vander(gaps / gaps[-1], 3)
    parabola = powers @ np.linalg.lstsq(powers, tangent, rcond=None)[0]
    close(tangent, parabola, 1e-10)


def test_two_dimensions_are_plane_strain():
    runtime.start()
    law, flat, n = LAWS["neo-hookean"], ti.types.ndarray(dtype=ti.types.matrix(2, 2, ti.f64), ndim=1), 50
    rng = np.random.default_rng(10)
    angles, F = rng.uniform(0, 2 * np.pi, size=n), rng.normal(size=(n, 2, 2))
    R = np.array([[[c, -s], [s, c]] for c, s in zip(np.cos(angles), np.sin(angles), strict=True)])
    S = F + F.transpose(0, 2, 1) + 2 * np.eye(2)
    stress, change, block = np.zeros_like(F), np.zeros_like(F), np.zeros_like(F)

    @ti.kernel
    def run(F: flat, R: flat, dF: flat, stress: flat, change: flat, block: flat):
        for k in F:
            U, s, V = eigen.signed_svd(F[k], R[k])
            stress[k] = isotropic.first_piola(U, law.slope(s, LA, MU), V)
            A, p, q = isotropic.tangent(law, s, LA, MU)
            change[k] = isotropic.stress_change(dF[k], U, V, A, p, q)
            block[k] = isotropic.stiffness_block(ti.Vector([1.0, 2.0]), ti.Vector([-2.0, 0.5]), U, V, A, p, q)

    with runtime.precision_of("f64"):
        run(R @ S, R, F, stress, change, block)
    solid = np.tile(np.eye(3), (n, 1, 1))
    solid[:, :2, :2] = R @ S
    expected = Response("neo-hookean", solid)
    close(stress, expected.stress[:, :2, :2], 1e-11)
    tangent = expected.tangent.reshape(n, 3, 3, 3, 3)[:, :2, :2, :2, :2]
    close(change, np.einsum("nijkl,nkl->nij", tangent, F), 1e-10)
    close(block, np.einsum("nijkl,j,l->nik", tangent, [1, 2], [-2, 0.5]), 1e-10)
