"""A ball that is thrown: a sphere that flies, strikes bodies and is thrown back by them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from taichifem.description import Motion, PlaneCollider, SphereCollider

LIFE = 5.0
"""Seconds after which it is taken away."""

BOUNCE = 0.4
"""Share of its speed that is left after it has met something."""


@dataclass
class Ball:
    """Where it is [m], how fast [m/s], how heavy [kg], and until when it is there [s]."""

    position: np.ndarray
    velocity: np.ndarray
    radius: float
    mass: float
    until: float

    def collider(self, time: float, dt: float) -> SphereCollider:
        """As an obstacle that moves during the step from `time` on."""
        ends = [[0.0, 0.0, 0.0], (dt * self.velocity).tolist()]
        motion = Motion(times=[time, time + dt], translation=ends)
        return SphereCollider(center=tuple(self.position.tolist()), radius=self.radius, friction=0.3, motion=motion)

    def fly(self, dt: float, gravity: np.ndarray, force: np.ndarray, planes: list[PlaneCollider]) -> None:
        """Go through a step under gravity and the contact force (3,) [N] of what it met during it.

        The force was found as if nothing could stop the ball; one that would throw it back faster than it came is too
        large for its mass, and cut down to what leaves it BOUNCE times its speed.
        """
        self.position = self.position + dt * self.velocity
        change = dt * force / self.mass
        size = float(np.linalg.norm(change))
        if size > 0:
            towards = -float(self.velocity @ change) / size
            self.velocity = self.velocity + change * min(1.0, max(0.0, (1 + BOUNCE) * towards) / size)
        self.velocity = self.velocity + dt * gravity
        for plane in planes:
            normal = np.asarray(plane.normal) / np.linalg.norm(plane.normal)
            depth = self.radius - float((self.position - plane.point) @ normal)
            speed = float(self.velocity @ normal)
            if depth > 0 and speed < 0:
                self.position = self.position + depth * normal
                self.velocity = self.velocity - (1 + BOUNCE) * speed * normal
