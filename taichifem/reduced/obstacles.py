"""How far points end up inside colliders, and which way out is."""

import numpy as np

from taichifem import runtime
from taichifem.description import Scene
from taichifem.formulas import collision
from taichifem.reduced.vectors import cross
from taichifem.runtime import ti
from taichifem.surroundings import collider_table

_array = ti.types.ndarray
COLUMNS = 35
"""Of a row of `surroundings.collider_table`."""


@ti.kernel
def _gaps(data: _array(), n: ti.i32, colliders: ti.i32):
    """data: rows of the table (colliders,35), start and end of the points (2,n,3), and room for gaps and normals
    (n,colliders,4), behind one another, as in `contact`.
    """
    # A few thousand points at most: to wake threads up takes longer.
    ti.loop_config(serialize=True)
    for i, c in ti.ndrange(n, colliders):
        start, end = ti.Vector.zero(ti.f64, 3), ti.Vector.zero(ti.f64, 3)
        size, normal = ti.Vector.zero(ti.f64, 3), ti.Vector.zero(ti.f64, 3)
        R0, R1 = ti.Matrix.zero(ti.f64, 3, 3), ti.Matrix.zero(ti.f64, 3, 3)
        row, point = COLUMNS * c, COLUMNS * colliders + 3 * i
        for a in ti.static(range(3)):
            start[a] = data[point + a] - data[row + 14 + a]
            end[a] = data[point + 3 * n + a] - data[row + 5 + a]
            size[a] = data[row + 2 + a]
            for b in ti.static(range(3)):
                R1[a, b] = data[row + 17 + 3 * a + b]
                R0[a, b] = data[row + 26 + 3 * a + b]
        p0, p1 = R0.transpose() @ start, R1.transpose() @ end
        kind = ti.cast(data[row], ti.i32)
        gap, local = collision.gap_to_half_space(p1)
        normal = ti.cast(local, ti.f64)
        if kind == collision.SPHERE:
            gap, normal = collision.gap_to_sphere(p0, p1, size[0])
        elif kind == collision.BOX:
            gap, normal = collision.gap_to_box(p0, p1, 0.5 * size)
        outward = R1 @ normal
        found = COLUMNS * colliders + 6 * n + 4 * (colliders * i + c)
        data[found] = gap
        for a in ti.static(range(3)):
            data[found + 1 + a] = outward[a]


class Obstacles:
    """The colliders of a scene over time."""

    def __init__(self, scene: Scene) -> None:
        self.count = len(scene.colliders)
        self._scene = scene
        self.friction = np.array([collider.friction for collider in scene.colliders])
        self._still = all(collider.motion is None for collider in scene.colliders)
        self._tables: dict[tuple[float, float], np.ndarray] = {}

    def table(self, time: float, dt: float) -> np.ndarray:
        """Where they stand at `time` [s], the end of a step of dt [s] (`surroundings.collider_table`)."""
        when = (0.0, dt) if self._still else (time, dt)
        if when not in self._tables:
            # A step looks at its beginning, which may be the end of the last one, and at its end.
            last = list(self._tables.items())[-2:]
            self._tables = dict(last) | {when: collider_table(self._scene.colliders, *when)}
        return self._tables[when]

    def near(self, table: np.ndarray, before: np.ndarray, after: np.ndarray, radius: np.ndarray) -> np.ndarray:
        """May balls that go from `before` to `after` (n,3) meet a collider on their way (n,)? Errs to yes.

        radius: theirs (n,) [m].
        """
        way = np.linalg.norm(after - before, axis=1)
        met = np.zeros(len(after), dtype=bool)
        for row in table:
            kind, own = row[0], row[5:8] - row[14:17]
            if kind == collision.PLANE:
                normal = row[17:26].reshape(3, 3)[:, 2]
                clear = np.minimum((after - row[5:8]) @ normal, (before - row[5:8]) @ normal)
            else:
                size = row[2] if kind == collision.SPHERE else 0.5 * np.linalg.norm(row[2:5])
                clear = np.linalg.norm(after - row[5:8], axis=1) - size - way
            met |= clear < radius + np.linalg.norm(own)
        return met

    def gaps(self, table: np.ndarray, before: np.ndarray, after: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Gaps (n,colliders) [m] of points that go from `before` to `after` (n,3), negative inside, and the outward
        normals (n,colliders,3)."""
        n = len(after)
        given = [table[: self.count].ravel(), before.ravel(), after.ravel()]
        everything = np.concatenate([*given, np.zeros(4 * n * self.count)])
        if self.count and n:
            with runtime.precision_of("f64"):
                _gaps(everything, n, self.count)
        found = everything[len(everything) - 4 * n * self.count :].reshape(n, self.count, 4)
        return found[..., 0], found[..., 1:]

    def standing(
        self, table: np.ndarray, which: np.ndarray, points: np.ndarray, gaps: np.ndarray, normals: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Gaps (m,) and normals (m,3) of points (m,3) that touch the colliders `which` (m,): from balls, those where
        they are and not where they came in, which is the same for flat faces, unless the middle lies between."""
        arm = points - table[which, 5:8]
        away = np.linalg.norm(arm, axis=1)
        own = arm / np.maximum(away, 1e-300)[:, None]
        ball = (table[which, 0] == collision.SPHERE) & ((own * normals).sum(axis=1) > 0.5)
        return np.where(ball, away - table[which, 2], gaps), np.where(ball[:, None], own, normals)

    def carried(self, table: np.ndarray, which: np.ndarray, points: np.ndarray, dt: float) -> np.ndarray:
        """How far (n,3) [m] the colliders `which` (n,) take points (n,3) along that stick to them, over dt [s]."""
        rows = table[which]
        return dt * (rows[:, 8:11] + cross(rows[:, 11:14], points - rows[:, 5:8]))
