"""The core of all implicit methods: M (v1 - base_v) = h (f(x1) + f_ext - C v1) with x1 = base_x + h v1.

Backward Euler, BDF2 and the trapezoidal rule differ in the base and in h alone. The unknown is dv, the change of the
velocity guess v. Linearised about positions x,

    (M + h alpha M + (h^2 + h beta) K) dv
        = M (base_v - v) + h (f_el(x) - K (base_x + h v - x) + f_ext - alpha M v - beta K v)

The first linearisation is about the start of the step, the further ones (Newton's method) about x = base_x + h v.
Without inertia the terms with M and the damping go, and what is left is a static problem.

Far from the end the elements' tangents are projected to positive semi-definite, which always gives a direction that
descends; near it they are exact, for then Newton's method converges quadratically. Where the exact matrix turns out
to be indefinite, as before a body buckles, the projected one takes over again.
"""

from dataclasses import replace

import numpy as np

from taichifem import elements
from taichifem.integrators.constraints import friction, settle, springs
from taichifem.integrators.step import Iteration, Step, StepReport
from taichifem.linear_algebra import assembly, guess, pcg
from taichifem.linear_algebra.galerkin import relax, stay
from taichifem.processes import holding
from taichifem.runtime import ti

OVERSHOOT = 0.9
"""Newton's correction is cut short where the imbalance along it has turned round and kept this part of its size."""

UNDERSHOOT = 0.8
"""A correction that was cut is made longer again while this part of the imbalance along it is left."""

CUTS = 8

LOOSEST = 0.1
"""Residual below which a solve at least goes, whatever the slack."""

NEAR = 0.1
"""Imbalance, relative to the forces at work, below which tangents are exact."""

PASS = 6
"""Iterations of a solve with slack at most: the next one goes on from where it ends, with contacts renewed."""

ALWAYS = 1e30
"""A weight so large that residuals are measured against impulses alone, as befits a static problem."""


@ti.kernel
def start(w: ti.template(), n: ti.i32):
    """Remember where the step begins, and go on from there: the base of backward Euler."""
    ti.loop_config(serialize=ti.static(w.alone(30)))
    for i in range(n):
        guess.remember(w, i)
        w.dv[i] = guess.recall(w, i)
        w.x0[i] = w.x[i]
        w.v0[i] = w.v[i]
        w.base_x[i] = w.x[i]
        w.base_v[i] = w.v[i]


@ti.kernel
def go_back(w: ti.template(), n: ti.i32):
    """Undo a step that failed."""
    ti.loop_config(serialize=ti.static(w.alone(10)))
    for i in range(n):
        w.x[i] = w.x0[i]
        w.v[i] = w.v0[i]
        w.dv[i] = ti.Vector.zero(w.real, 3)


@ti.kernel
def _load(w: ti.template(), n: ti.i32, h: ti.f64, inertia: ti.f64, gx: ti.f64, gy: ti.f64, gz: ti.f64):
    """Right-hand side of the step without contact and handles."""
    gravity = ti.Vector([gx, gy, gz])
    ti.loop_config(serialize=ti.static(w.alone(80)))
    for i in range(n):
        step, share = ti.cast(h, w.real), ti.cast(inertia, w.real)
        w.force[i] = elements.gathered_force(w, i)
        change = share * w.mass[i] * (w.base_v[i] - w.v[i])
        outside = w.mass[i] * ti.cast(gravity, w.real) + w.outside[i] - share * w.drag[i] * w.v[i]
        w.load[i] = change + step * (w.force[i] + outside)


@ti.kernel
def _forget(w: ti.template(), n: ti.i32):
    for i in range(n):
        w.dv[i] = ti.Vector.zero(w.real, 3)


@ti.kernel
def _update(w: ti.template(), n: ti.i32, h: ti.f64):
    ti.loop_config(serialize=ti.static(w.alone(5)))
    for i in range(n):
        w.v[i] += w.dv[i]
        w.x[i] = w.base_x[i] + ti.cast(h, w.real) * w.v[i]
        w.direction[i] = w.free[i] * w.dv[i]


@ti.kernel
def _shorten(w: ti.template(), n: ti.i32, h: ti.f64, back: ti.f64):
    """Take back the part `back` of the last correction."""
    ti.loop_config(serialize=ti.static(w.alone(10)))
    for i in range(n):
        w.v[i] -= ti.cast(back, w.real) * w.direction[i]
        w.x[i] = w.base_x[i] + ti.cast(h, w.real) * w.v[i]


@ti.kernel
def _slope(w: ti.template(), n: ti.i32) -> ti.f64:
    """How much imbalance is left along the last correction: minus the slope of the energy, where there is one."""
    total = ti.cast(0.0, ti.f64)
    ti.loop_config(serialize=True)
    for i in range(n):
        total += ti.cast(w.direction[i].dot(w.load[i] + w.spring_load[i]), ti.f64)
    return total


@ti.kernel
def _at_work(w: ti.template(), n: ti.i32, h: ti.f64) -> ti.f64:
    """Size of the impulses of the elastic forces, those on held nodes included."""
    total = ti.cast(0.0, ti.f64)
    ti.loop_config(serialize=True)
    for i in range(n):
        total += ti.cast(w.force[i].norm_sqr(), ti.f64)
    return h * ti.sqrt(total)


def solve(step: Step, *, h: float, newton: int, inertia: bool = True) -> StepReport:
    """Find the end of the step: `w.x` and `w.v`, from `w.x0`, `w.v`, `w.base_x` and `w.base_v`.

    `w.dv` starts from what the last steps did, which is close when motion is smooth.
    newton: most linearisations; 1 is the linearly implicit method.
    """
    w, n = step.w, step.counts.nodes
    # What presses on a body from another one, or on what rides in it, stands in the matrix: such bodies do not fly.
    flies = inertia and not (step.counts.meetings or step.counts.riding)
    counts = step.counts if flies else replace(step.counts, flying=0)
    weight = float(np.linalg.norm(step.gravity)) * h if inertia else ALWAYS
    noise = float(np.finfo(np.float32 if w.precision == "f32" else np.float64).eps) / h
    report, first = StepReport(balanced=newton == 1), 0.0

    def solve_linear(passes: int, slack: float) -> pcg.Convergence:
        with step.timer.phase("solve"):
            return pcg.solve(
                w,
                counts,
                step.plan,
                tolerance=min(step.options.tolerance * slack, LOOSEST),
                max_iterations=step.options.max_iterations if slack == 1 else PASS,
                noise=noise,
                weight=weight,
                drag_factor=h * inertia,
                guessed=inertia and passes == 1 and report.linearisations == 0,
                # Springs of vertices that ride in tetrahedra stand between nodes as well.
                springs_only=passes > 1 and not counts.riding,
            )

    def solve_step() -> pcg.Convergence:
        with step.timer.phase("assembly"):
            assembly.assemble(w, counts.pairs, counts.elements, float(inertia), h * inertia)
        return settle(step, h, report, solve_linear, weight=weight / h if inertia else 0.0)

    exact = False
    _linearise(step, h, inertia, first=True)
    for k in range(newton):
        done = solve_step()
        if not done.definite:
            exact = False
            _linearise(step, h, inertia)
            done = solve_step()
        with step.timer.phase("update"):
            _update(w, n, h)
        report.linearisations = k + 1
        first = first or done.load
        # Never against forces of the past: a shape that blew up and came back need not be balanced.
        at_work = first if inertia else max(first, _at_work(w, n, h))
        imbalance, length = done.load / max(at_work, 1e-150), 1.0
        if k > 0 and done.load <= max(step.options.newton_tolerance * at_work, done.noise):
            report.balanced = True
        elif k + 1 < newton:
            exact = exact or (imbalance < NEAR and k > 0)
            length = _linearise_and_search(step, h, inertia, exact=exact)
        report.history.append(Iteration(imbalance, done.iterations, length))
        if report.balanced:
            break
    friction(step, h)
    return report


def _linearise(step: Step, h: float, inertia: bool, *, first: bool = False, exact: bool = False) -> None:
    """Forces, right-hand side and what the matrix needs."""
    w, n, damped = step.w, step.counts.nodes, float(inertia)
    with step.timer.phase("forces"):
        if step.follow is not None:
            step.follow()
        rate = step.dt if first and inertia else 0.0
        step.laws.deform(
            w,
            step.counts,
            stiffness=h * h,
            damping=h * damped,
            rate=rate,
            rate_damping=damped,
            due=step.take_due(),
            within=step.dt,
            projected=not exact,
            keep=True,
        )
        _load(w, n, h, damped, *step.gravity)
        if step.plan.galerkin is not None:
            relax(w, n, step.counts.elements) if step.counts.split else stay(w, n)
        if not first:
            _forget(w, n)
        holding.hold(w, n, step.counts.held, step.dt, h)


def _linearise_and_search(step: Step, h: float, inertia: bool, *, exact: bool) -> float:
    """Linearise about the corrected state, and cut the correction where it overshoots; the part that stays.

    Cut too short, it is made longer again: where the tangent jumps (the corners of Tresca's law), the slope next to
    the jump tells nothing of what lies beyond, and steps of a tenth would follow one another.
    """
    w, n = step.w, step.counts.nodes

    def linearise() -> None:
        _linearise(step, h, inertia, exact=exact)
        springs(step, h)

    before, length = _slope(w, n), 1.0
    lower, below, upper, above = 0.0, before, 0.0, 0.0
    linearise()
    for _ in range(CUTS):
        after = _slope(w, n)
        if after < -OVERSHOOT * abs(before):
            upper, above = length, after
        elif not upper or after <= UNDERSHOOT * before:
            break
        else:
            lower, below = length, after
        middle = lower + (upper - lower) * min(0.5, max(0.1, below / (below - above)))
        _shorten(w, n, h, length - middle)
        length = middle
        linearise()
    return length
