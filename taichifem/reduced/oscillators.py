"""Damped oscillators advanced by their exact formula: q'' + (alpha + beta omega^2) q' + omega^2 q = f."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.linalg


@dataclass(frozen=True)
class Transition:
    """What a step does, each (k,): q <- qq q + qv v + qf f and v <- vq q + vv v + vf f, f constant over the step."""

    qq: np.ndarray
    qv: np.ndarray
    qf: np.ndarray
    vq: np.ndarray
    vv: np.ndarray
    vf: np.ndarray


def transition(frequencies: np.ndarray, damping: np.ndarray, dt: float) -> Transition:
    """The exact step of oscillators (k,) with angular frequency [1/s] and damping d [1/s] over dt [s].

    Under-, over- and critically damped ones alike, and those without a spring.
    """
    w, a = np.asarray(frequencies, dtype=float), 0.5 * np.asarray(damping, dtype=float)
    inside = w * w - a * a
    rate = np.sqrt(np.abs(inside))
    with np.errstate(over="ignore"):
        wave = np.exp(-a * dt) * np.cos(rate * dt), np.exp(-a * dt) * dt * np.sinc(rate * dt / np.pi)
    # Two decaying exponentials; the slower rate w^2 / (a + rate) without cancellation.
    quick = a + rate
    late = np.divide(w * w, quick, out=np.zeros_like(w), where=quick > 0)
    slow, fast = np.exp(-late * dt), np.exp(-quick * dt)
    apart = np.divide(-np.expm1(-2 * rate * dt), 2 * rate, out=np.full_like(w, dt), where=rate > 0)
    under = inside > 0
    cosine = np.where(under, wave[0], 0.5 * (slow + fast))
    sine = np.where(under, wave[1], slow * apart)
    qq, vv = cosine + a * sine, cosine - a * sine
    # How far a constant unit force moves what is at rest: the integral of `sine`.
    qf = np.divide(1 - qq, w * w, out=np.zeros_like(w), where=w > 0)
    over = ~under & (rate > 0.1 * a)
    qf[over] = ((_decayed(late, dt) - _decayed(quick, dt))[over]) / (2 * rate[over])
    # Where little happens in a step these differences have lost their digits: the exponential of the system has not.
    still = np.maximum(w, 2 * a) * dt <= 1
    system = np.zeros((still.sum(), 3, 3))
    system[:, 0, 1] = system[:, 1, 2] = 1.0
    system[:, 1, 0], system[:, 1, 1] = -((w[still] * dt) ** 2), -2 * a[still] * dt
    qf[still] = dt * dt * scipy.linalg.expm(system)[:, 0, 2]
    return Transition(qq=qq, qv=sine, qf=qf, vq=-w * w * sine, vv=vv, vf=sine)


def _decayed(rate: np.ndarray, dt: float) -> np.ndarray:
    """Integral of exp(-rate t) from 0 to dt."""
    return np.divide(-np.expm1(-rate * dt), rate, out=np.full_like(rate, dt), where=rate > 0)


class Oscillators:
    """Amplitudes q (k,) and rates v (k,) of independent oscillators of unit mass."""

    def __init__(self, frequencies: np.ndarray, *, mass_damping: float = 0.0, stiffness_damping: float = 0.0) -> None:
        self.frequencies = np.asarray(frequencies, dtype=float)
        self.damping = mass_damping + stiffness_damping * self.frequencies**2
        self.q, self.v = np.zeros((2, len(self.frequencies)))
        self._kept: tuple[float, Transition] | None = None

    def step(self, dt: float) -> Transition:
        """The transition of a step of dt [s]."""
        if self._kept is None or self._kept[0] != dt:
            self._kept = dt, transition(self.frequencies, self.damping, dt)
        return self._kept[1]

    def after(self, dt: float, force: np.ndarray | float = 0.0) -> tuple[np.ndarray, np.ndarray]:
        """q and v after dt [s] under constant modal forces (k,)."""
        t = self.step(dt)
        return t.qq * self.q + t.qv * self.v + t.qf * force, t.vq * self.q + t.vv * self.v + t.vf * force

    def advance(self, dt: float, force: np.ndarray | float = 0.0) -> None:
        """Go there."""
        self.q, self.v = self.after(dt, force)

    @property
    def elastic_energy(self) -> float:
        """[J]"""
        return 0.5 * float((self.frequencies**2 * self.q**2).sum())

    @property
    def kinetic_energy(self) -> float:
        """[J]"""
        return 0.5 * float((self.v**2).sum())
