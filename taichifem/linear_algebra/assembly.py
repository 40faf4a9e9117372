"""The block matrix A = M + dt^2 K of a step, gathered pair by pair: no atomics, the same bits every time."""

from taichifem import elements, isotropic_elements, meeting_elements
from taichifem.formulas import hooke
from taichifem.runtime import ti


@ti.func
def _warped(w: ti.template(), e: ti.i32, a: ti.i32, b: ti.i32):
    """Block of corners a and b of a linear or corotational element."""
    first, moduli = e * w.corners, w.moduli[e]
    return hooke.stiffness_block(w.h[first + a], w.h[first + b], moduli[0], moduli[1])


@ti.kernel
def assemble(w: ti.template(), n_pairs: ti.i32, n_elements: ti.i32, mass_factor: ti.f64, drag_factor: ti.f64):
    """Gather `w.block` from `w.h` and `w.moduli`, or from `w.tangent` for isotropic laws and springs.

    Springs between pieces count as elements behind the others, with drag_factor^2 times their stiffness.
    On the diagonal come mass_factor * mass + drag_factor * drag.
    The elements' V and the step's factor of K are already in there.
    """
    for p in range(n_pairs):
        total = ti.Matrix.zero(w.real, w.d, w.d)
        met = ti.Matrix.zero(w.real, 3, 3)
        for k in range(w.pair_start[p], w.pair_start[p + 1]):
            entry = w.pair_entry[k]
            e, a, b = entry >> 4, (entry >> 2) & 3, entry & 3
            if e >= n_elements:
                if ti.static(w.capacity.meetings > 1):
                    met += meeting_elements.block(w, e - n_elements, a, b)
            elif ti.static(w.capacity.tangents):
                if w.table[w.material[e]][elements.MODEL] > elements.QUICK:
                    first = e * w.corner_pairs
                    if a <= b:
                        total += w.tangent[first + isotropic_elements.corner_pair(w, a, b)]
                    else:
                        total += w.tangent[first + isotropic_elements.corner_pair(w, b, a)].transpose()
                else:
                    total += _warped(w, e, a, b)
            else:
                total += _warped(w, e, a, b)
        block = elements.lifted_matrix(total, w) + ti.cast(drag_factor * drag_factor, w.real) * met
        i, j = w.upper[p], w.lower[p]
        if i == j:
            node = w.column[i]
            inertia = ti.cast(mass_factor, w.real) * w.mass[node] + ti.cast(drag_factor, w.real) * w.drag[node]
            for k in ti.static(range(3)):
                block[k, k] += inertia
            w.block[i] = block
            w.own[node] = block
        else:
            w.block[i] = block
            if j >= 0:
                w.block[j] = block.transpose()
