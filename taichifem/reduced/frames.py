"""The frame in which a body vibrates: a rigid body in flight, or one that follows the motion of a pin.

Points at `local` (n,3) in the frame are at rotation @ local + origin. Vibrations act back on the frame through contact
only: what their inertia would do to it is of second order in the displacement (Pentland & Williams 1989).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from taichifem.description import Motion
from taichifem.reduced.vectors import skew
from taichifem.surroundings import pose

MIDPOINT_TURNS = 3


def turned(rotation: np.ndarray, angle: np.ndarray) -> np.ndarray:
    """`rotation` (3,3) followed by a turn by the vector `angle` (3,) [rad] (Rodrigues)."""
    size, cross = math.sqrt(angle @ angle), skew(angle)
    sine = math.sin(size) / size if size > 0 else 1.0
    half = math.sin(0.5 * size) / size if size > 0 else 0.5
    new = rotation + (sine * cross + 2 * half * half * cross @ cross) @ rotation
    return 1.5 * new - 0.5 * new @ new.T @ new  # back to a rotation: round-off must not add up over a long run


@dataclass(frozen=True)
class FreeFrame:
    """A rigid body. mass [kg]; turns: inverse (3,3) of its inertia in the frame [1/(kg m^2)]; velocity (3,) [m/s] of
    its centre of mass, which is the origin; momentum: angular (3,) about it [kg m^2/s]."""

    rotation: np.ndarray
    origin: np.ndarray
    velocity: np.ndarray
    momentum: np.ndarray
    mass: float
    turns: np.ndarray

    coordinates = 6

    @classmethod
    def of(cls, rest: np.ndarray, masses: np.ndarray, velocities: np.ndarray) -> tuple[FreeFrame, np.ndarray]:
        """The frame of point masses at rest (n,3) [m] with velocities (n,3), and their places in it (n,3)."""
        mass = masses.sum()
        origin, velocity = masses @ rest / mass, masses @ velocities / mass
        local = rest - origin
        inertia = (masses * (local**2).sum(axis=1)).sum() * np.eye(3) - (masses[:, None] * local).T @ local
        momentum = (masses[:, None] * np.cross(local, velocities - velocity)).sum(axis=0)
        return cls(np.eye(3), origin, velocity, momentum, mass, np.linalg.inv(inertia)), local

    @cached_property
    def spin(self) -> np.ndarray:
        """Angular velocity (3,) [rad/s]."""
        return self._spin(self.rotation, self.momentum)

    def _spin(self, rotation: np.ndarray, momentum: np.ndarray) -> np.ndarray:
        return rotation @ (self.turns @ (rotation.T @ momentum))

    @property
    def kinetic_energy(self) -> float:
        """[J]"""
        return 0.5 * float(self.mass * self.velocity @ self.velocity) + self.turning_energy

    @property
    def turning_energy(self) -> float:
        """The part of it that is in the turn [J]."""
        return 0.5 * float(self.spin @ self.momentum)

    def after(self, dt: float, push: np.ndarray) -> FreeFrame:
        """The frame after dt [s] under a constant force and torque `push` (6,): exact but for the turn, which is that
        of the implicit midpoint rule."""
        force, torque = push[:3], push[3:]
        mean, middle = self.momentum + 0.5 * dt * torque, self.rotation
        for _ in range(MIDPOINT_TURNS):
            spin = self._spin(middle, mean)
            middle = turned(self.rotation, 0.5 * dt * spin)
        return replace(
            self,
            rotation=turned(self.rotation, dt * spin),
            origin=self.origin + dt * self.velocity + 0.5 * dt * dt / self.mass * force,
            velocity=self.velocity + dt / self.mass * force,
            momentum=self.momentum + dt * torque,
        )

    def struck(self, impulse: np.ndarray) -> FreeFrame:
        """The frame after an impulse and angular impulse (6,)."""
        velocity = self.velocity + impulse[:3] / self.mass
        return replace(self, velocity=velocity, momentum=self.momentum + impulse[3:])

    def velocity_at(self, points: np.ndarray) -> np.ndarray:
        """Velocities (n,3) [m/s] of points (n,3) that are at rest in it."""
        return self.velocity + (points - self.origin) @ skew(self.spin).T

    def levers(self, points: np.ndarray) -> np.ndarray:
        """How points (n,3) move with it: (n,3,6) for a shift and a turn."""
        found = np.zeros((len(points), 3, 6))
        found[:, :, :3] = np.eye(3)
        # d x = turn x arm
        x, y, z = (points - self.origin).T
        found[:, 0, 4], found[:, 0, 5] = z, -y
        found[:, 1, 3], found[:, 1, 5] = -z, x
        found[:, 2, 3], found[:, 2, 4] = y, -x
        return found

    def answer(self) -> np.ndarray:
        """Velocity and angular velocity by impulse and angular impulse (6,6)."""
        found = np.zeros((6, 6))
        found[:3, :3] = np.eye(3) / self.mass
        found[3:, 3:] = self.rotation @ self.turns @ self.rotation.T
        return found


@dataclass(frozen=True)
class DrivenFrame:
    """A frame that follows `motion` (None: at rest), here at `time` [s]; no force moves it."""

    motion: Motion | None
    time: float
    dt: float

    coordinates = 0
    kinetic_energy = 0.0

    @property
    def rotation(self) -> np.ndarray:
        """R (3,3)."""
        return pose(self.motion, self.time)[0]

    @property
    def origin(self) -> np.ndarray:
        """c (3,) [m]."""
        return pose(self.motion, self.time)[1]

    def acceleration(self) -> tuple[np.ndarray, np.ndarray]:
        """A (3,3) and b (3,): points at `local` are accelerated by A local + b [m/s^2] over the next step."""
        if self.motion is None:
            return np.zeros((3, 3)), np.zeros(3)
        before, now, then = (pose(self.motion, max(self.time + k * self.dt, 0.0)) for k in (-1, 0, 1))
        return tuple((a - 2 * b + c) / self.dt**2 for a, b, c in zip(before, now, then, strict=True))

    def after(self, dt: float, push: np.ndarray) -> DrivenFrame:
        """The frame dt [s] later."""
        return replace(self, time=self.time + dt, dt=dt)

    def struck(self, impulse: np.ndarray) -> DrivenFrame:
        """No impulse moves it."""
        return self

    def velocity_at(self, points: np.ndarray) -> np.ndarray:
        """Velocities (n,3) [m/s] of points (n,3) that are at rest in it, as a mean over the last step."""
        if self.motion is None or self.time <= 0:
            return np.zeros_like(points)
        turn, shift = pose(self.motion, self.time - self.dt)
        local = (points - self.origin) @ self.rotation
        return (points - local @ turn.T - shift) / self.dt

    def levers(self, points: np.ndarray) -> np.ndarray:
        """No coordinate of it moves points: (n,3,0)."""
        return np.zeros((len(points), 3, 0))

    def answer(self) -> np.ndarray:
        """(0,0)"""
        return np.zeros((0, 0))
