"""The coarse half of the preconditioner: rigid motions of aggregates of nodes (Bulgakov 1993; DESIGN: two levels).

Block Jacobi deals with errors that change from node to node; what it leaves, large groups of nodes that move almost
rigidly against each other, lies near the span Z of the aggregates' six rigid motions. There the matrix is small
enough to be inverted: the preconditioner is D^-1 + Z (Z^T A Z)^-1 Z^T, positive definite whatever the inverse's age.

Z follows the nodes, and the inverse turns with each aggregate, so it stays good while bodies tumble; it is renewed
when the iterations tell that it has aged.
"""

import numpy as np
import scipy.linalg

from taichifem import transfer
from taichifem.formulas import rotation
from taichifem.linear_algebra.aggregates import Aggregates
from taichifem.runtime import ti
from taichifem.world import World

AGED = 1.25
"""Iterations, relative to those just after renewal, at which the inverse counts as aged."""

PATIENCE = 4
"""Solves between renewals, at least; and iterations above the reference that never matter."""


@ti.func
def _arm(w: ti.template(), g: ti.i32, i: ti.i32):
    return w.x[i] - w.centre[g]


@ti.kernel
def place(w: ti.template(), n: ti.i32, fresh: ti.i32):
    """Centre of each of the n aggregates, and how far it has turned since the inverse was made; 0 turn if `fresh`."""
    for g in range(n):
        centre = ti.Vector.zero(w.real, 3)
        begin, end = w.aggregate_start[g], w.aggregate_start[g + 1]
        for k in range(begin, end):
            centre += w.x[w.aggregate_node[k]]
        w.centre[g] = centre / ti.cast(end - begin, w.real)
        spread = ti.Matrix.zero(w.real, 3, 3)
        size = ti.cast(0.0, w.real)
        for k in range(begin, end):
            i = w.aggregate_node[k]
            arm = _arm(w, g, i)
            if fresh:
                w.arm[i] = arm
            spread += arm.outer_product(w.arm[i])
            size += w.arm[i].norm_sqr()
        turn = ti.Vector([1.0, 0.0, 0.0, 0.0])
        if fresh:
            w.turn[g] = turn
            # Scaled such that shifts and turns are of one size: the coarse matrix is better conditioned.
            w.reach[g] = ti.max(ti.sqrt(size / ti.cast(end - begin, w.real)), ti.cast(1e-12, w.real))
        elif size > 0:
            w.turn[g] = rotation.nearest_rotation(spread / size, w.turn[g], ti.cast(1e-3, w.real), 20)


@ti.kernel
def gather(w: ti.template(), n: ti.i32):
    """The coarse matrix Z^T A Z, row by row of aggregates."""
    for g in range(n):
        for a in range(6):
            for b in range(6 * n):
                w.coarse[6 * g + a, b] = 0.0
        for k in range(w.aggregate_start[g], w.aggregate_start[g + 1]):
            i = w.aggregate_node[k]
            arm_i = ti.cast(_arm(w, g, i) / w.reach[g], ti.f64)
            for m in range(w.row_start[i], w.row_start[i + 1]):
                j = w.column[m]
                block = ti.cast(w.block[m], ti.f64)
                if i == j:
                    block += ti.cast(w.spring[i], ti.f64)
                o = w.aggregate[j]
                arm_j = ti.cast(_arm(w, o, j) / w.reach[o], ti.f64)
                for a in ti.static(range(3)):
                    for b in ti.static(range(3)):
                        block[a, b] *= ti.cast(w.free[i][a] * w.free[j][b], ti.f64)
                # Columns of the turns: A (e_b x arm) = -(A [arm])_b, row by row a cross product with the arm.
                right = _crossed(block, arm_j)
                turned = _crossed(block.transpose(), arm_i).transpose()
                both = _crossed(turned, arm_j)
                for a in ti.static(range(3)):
                    for b in ti.static(range(3)):
                        w.coarse[6 * g + a, 6 * o + b] += block[a, b]
                        w.coarse[6 * g + a, 6 * o + 3 + b] += right[a, b]
                        w.coarse[6 * g + 3 + a, 6 * o + b] += turned[a, b]
                        w.coarse[6 * g + 3 + a, 6 * o + 3 + b] += both[a, b]


@ti.func
def _crossed(M, arm):
    """The matrix whose column b is M (e_b x arm): its rows are arm x (rows of M)."""
    rows = [arm.cross(ti.Vector([M[a, 0], M[a, 1], M[a, 2]])) for a in ti.static(range(3))]
    return ti.Matrix.rows(rows)


@ti.kernel
def _set_inverse(w: ti.template(), inverse: ti.types.ndarray()):
    for a, b in ti.ndrange(inverse.shape[0], inverse.shape[1]):
        w.coarse_inverse[a, b] = inverse[a, b]


@ti.kernel
def _get(field: ti.template(), matrix: ti.types.ndarray()):
    for a, b in ti.ndrange(matrix.shape[0], matrix.shape[1]):
        matrix[a, b] = field[a, b]


@ti.func
def restrict(w: ti.template(), g: ti.i32):
    """Z^T of the residual for aggregate g, turned back to where the inverse was made, to `w.coarse_residual`."""
    shift, turn = ti.Vector.zero(w.real, 3), ti.Vector.zero(w.real, 3)
    for k in range(w.aggregate_start[g], w.aggregate_start[g + 1]):
        i = w.aggregate_node[k]
        r = w.free[i] * w.residual[i]
        shift += r
        turn += _arm(w, g, i).cross(r)
    Q = rotation.rotation_of(w.turn[g]).transpose()
    shift, turn = Q @ shift, Q @ turn / w.reach[g]
    for a in ti.static(range(3)):
        w.coarse_residual[6 * g + a] = shift[a]
        w.coarse_residual[6 * g + 3 + a] = turn[a]


@ti.func
def solve_row(w: ti.template(), n: ti.i32, a: ti.i32):
    """Row a of the inverse times the restricted residual, to `w.coarse_solution`."""
    # Six sums that do not wait for each other.
    sums = ti.Vector.zero(w.real, 6)
    for g in range(n):
        for k in ti.static(range(6)):
            sums[k] += w.coarse_inverse[a, 6 * g + k] * w.coarse_residual[6 * g + k]
    w.coarse_solution[a] = sums.sum()


@ti.func
def prolong(w: ti.template(), g: ti.i32):
    """Turn the coarse solution of aggregate g to where the aggregate is now: its shift and its spin."""
    Q = rotation.rotation_of(w.turn[g])
    w.shift[g] = Q @ ti.Vector([w.coarse_solution[6 * g + a] for a in ti.static(range(3))])
    w.spin[g] = Q @ ti.Vector([w.coarse_solution[6 * g + 3 + a] for a in ti.static(range(3))]) / w.reach[g]


@ti.func
def correction(w: ti.template(), i: ti.i32):
    """What the coarse solution says of node i."""
    g = w.aggregate[i]
    return w.free[i] * (w.shift[g] + w.spin[g].cross(_arm(w, g, i)))


class Coarse:
    """The coarse space of a world: knows when to renew the inverse."""

    def __init__(self, w: World, aggregates: Aggregates) -> None:
        self.count, self._nodes = aggregates.count, len(aggregates.of)
        self._w = w
        self._reference: int | None = None
        self._solves = 0
        transfer.fill_aggregates(w, aggregates)

    def forget(self) -> None:
        """Renew the inverse at the next solve: pins or the method's matrix have changed."""
        self._reference = None

    def state(self) -> dict[str, np.ndarray]:
        """What the next solves depend on, for a checkpoint; see `restore`."""
        learnt = np.array([-1 if self._reference is None else self._reference, self._solves])
        if not self.count:
            return {"coarse_learnt": learnt}
        w = self._w
        inverse = np.empty((6 * self.count, 6 * self.count), transfer.dtype_of(w))
        _get(w.coarse_inverse, inverse)
        arm = transfer.read(w, w.arm, self._nodes)
        turn, reach = transfer.read(w, w.turn, self.count), transfer.read(w, w.reach, self.count)
        return {
            "coarse_learnt": learnt,
            "coarse_inverse": inverse,
            "coarse_arm": arm,
            "coarse_turn": turn,
            "coarse_reach": reach[:, None],
        }

    def restore(self, arrays: dict[str, np.ndarray]) -> None:
        """The inverse of `state`."""
        reference, self._solves = (int(value) for value in arrays["coarse_learnt"])
        self._reference = None if reference < 0 else reference
        if self.count:
            w = self._w
            _set_inverse(w, arrays["coarse_inverse"])
            transfer.write(w, w.arm, arrays["coarse_arm"])
            transfer.write(w, w.turn, arrays["coarse_turn"])
            w.reach.from_numpy(np.resize(arrays["coarse_reach"][:, 0], w.reach.shape))

    def prepare(self) -> int:
        """Make ready for a solve with the matrix as it stands; returns the number of aggregates in use."""
        if not self.count:
            return 0
        stale = self._reference is None
        place(self._w, self.count, stale)
        if stale:
            gather(self._w, self.count)
            self._invert()
            self._solves = 0
        return self.count

    def observe(self, iterations: int) -> None:
        """Learn from a solve whether the inverse has aged."""
        self._solves += 1
        if self._reference is None:
            self._reference = iterations
        elif self._solves > PATIENCE and iterations > AGED * self._reference + PATIENCE:
            self._reference = None

    def _invert(self) -> None:
        matrix = np.empty((6 * self.count, 6 * self.count))
        _get(self._w.coarse, matrix)
        # A motion that no node can follow (all pinned, or all in a line) has a zero diagonal: it is left out.
        diagonal = matrix.diagonal().copy()
        use = diagonal > 1e-9 * diagonal.max()
        scale = np.where(use, 1 / np.sqrt(np.where(use, diagonal, 1.0)), 0.0)
        matrix = scale[:, None] * matrix * scale
        shift = 1e-12 if self._w.precision == "f64" else 1e-6
        while True:
            factor, failed = scipy.linalg.lapack.dpotrf(matrix + np.diag(np.where(use, shift, 1.0)), lower=1)
            if not failed:
                break
            shift *= 10
            if shift > 1:
                factor = np.eye(len(matrix))
                break
        lower, _ = scipy.linalg.lapack.dpotri(factor, lower=1)
        inverse = np.tril(lower) + np.tril(lower, -1).T
        _set_inverse(self._w, np.ascontiguousarray(scale[:, None] * inverse * scale, transfer.dtype_of(self._w)))
