"""Ways to advance time by one step, by the name a scene gives."""

from taichifem.integrators import backward_euler, bdf2, newmark, quasi_static, symplectic_euler

ADVANCE = {
    "backward-euler": backward_euler.advance_once,
    "backward-euler-newton": backward_euler.advance,
    "bdf2": bdf2.advance,
    "newmark": newmark.advance,
    "symplectic-euler": symplectic_euler.advance,
    "quasi-static": quasi_static.advance,
}
"""Each takes a Step and returns a StepReport; new positions and velocities are in the world then."""

EXACT = ("backward-euler-newton", "bdf2", "newmark", "quasi-static")
"""Integrators that solve with Newton's method, and so want exact tangents."""

HISTORY = ("bdf2", "newmark")
"""Integrators that look further back than the last positions and velocities."""
