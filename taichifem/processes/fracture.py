"""Where elements are torn: the largest principal stress tells (slides 35 to 43). `Splitting` does the rest."""

from taichifem.formulas.eigen import symmetric_eigen
from taichifem.runtime import ti


@ti.kernel
def find_tension(w: ti.template(), n_elements: ti.i32):
    """Largest principal stress [Pa] to `w.energy`, from `w.stress`."""
    for e in range(n_elements):
        values, _Q = symmetric_eigen(w.stress[e])
        w.energy[e] = values.max()
