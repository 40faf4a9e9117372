"""How fast the product with the matrix is, against a plain read of the same memory by the same threads."""

import time
from dataclasses import dataclass

import numpy as np

from taichifem import runtime
from taichifem.linear_algebra import crew, steps
from taichifem.linear_algebra import program as p
from taichifem.linear_algebra.steps import Limits
from taichifem.runtime import ti
from taichifem.world import Counts, World

REPEATS, TRIALS = 50, 7


@dataclass(frozen=True)
class Bandwidth:
    """Bytes that a product moves at least, and the times [s] of a product and of a plain read of the blocks."""

    bytes: int
    product: float
    read_bytes: int
    read: float

    @property
    def achieved(self) -> float:
        """Of the product [GB/s]."""
        return 1e-9 * self.bytes / self.product

    @property
    def limit(self) -> float:
        """Of the plain read [GB/s]."""
        return 1e-9 * self.read_bytes / self.read


@ti.kernel
def _read(w: ti.template(), blocks: ti.i32, workers: ti.i32, repeats: ti.i32):
    """Each worker reads its part of the blocks again and again."""
    ti.loop_config(block_dim=1)
    for me in range(workers):
        first, last = steps.range_of(blocks, me, workers)
        total = ti.Matrix.zero(w.real, 3, 3)
        for _ in range(repeats):
            for k in range(first, last):
                total += w.block[k]
        w.left[me] = ti.Vector([total[a, 0] + total[a, 1] + total[a, 2] for a in ti.static(range(3))])


def _best(call) -> float:
    """The shortest time of a call [s]: what disturbs it only makes it longer."""
    times = []
    for _ in range(TRIALS):
        begin = time.perf_counter()
        call()
        ti.sync()
        times.append(time.perf_counter() - begin)
    return min(times)


def measure(w: World, counts: Counts, blocks: int) -> Bandwidth:
    """Multiply the matrix that the last step left behind with its last direction; `blocks` of it belong to nodes."""
    n = counts.nodes
    before = [int(k) for k in w.operation[0]]
    w.operation[0] = [p.PRODUCT, 0, counts.pieces]

    def multiply() -> None:
        w.scalar[steps.DONE] = 0
        crew.run(w, n, np.array([[p.PRODUCT, 0, counts.pieces]]), Limits(0.0, 1), repeated=(0, 1), rounds=REPEATS)

    product = _best(multiply) / REPEATS
    w.operation[0] = before
    read = _best(lambda: _read(w, blocks, runtime.threads(), REPEATS)) / REPEATS
    real = {"f32": 4, "f64": 8}[w.precision]
    # A block and its column; of a node its two row pointers, what is multiplied, and the sum, read and written.
    return Bandwidth(blocks * (9 * real + 4) + n * (8 + 9 * real), product, blocks * 9 * real, read)
