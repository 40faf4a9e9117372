"""A body of few vibration modes in a frame that moves with it (Pentland & Williams 1989; Bridson, p. 2).

All forces are constant over a step, those of contact and handles too, so that each mode is advanced exactly; what
they come to is settled by where they would leave the points that they act on at the end of the step.
"""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from taichifem.description import Material
from taichifem.errors import InputError
from taichifem.layout import Group
from taichifem.reduced.frames import DrivenFrame, FreeFrame
from taichifem.reduced.grip import NOTHING, Grip
from taichifem.reduced.modal_load import ModalLoad
from taichifem.reduced.modal_skin import ClusteredSkin, Skin
from taichifem.reduced.modes import Modes, lowest_modes
from taichifem.reduced.oscillators import Oscillators
from taichifem.reduced.parts import Parts
from taichifem.reduced.ritz import quadratic_fields, ritz_modes
from taichifem.reduced.touching import Touch
from taichifem.surroundings import pose

RIGID = 6
FIRM = 1e-4
"""Of the flexibility of the points in a step: what a firm hand gives way by."""


def modes_of(parts: Parts, count: int, *, basis: str = "fem") -> Modes:
    """The `count` lowest elastic modes of a body: of a free one those after the six rigid motions."""
    free = np.ones((len(parts.rest), 3), dtype=bool)
    for pin in parts.pins:
        free[np.ix_(pin.nodes, np.flatnonzero(pin.axes))] = False
    rigid = 0 if parts.pins else RIGID
    try:
        if basis == "quadratic":
            fields = quadratic_fields(parts.rest)
            found = ritz_modes(parts.stiffness, parts.masses, fields, count + rigid, free=free)
        else:
            found = lowest_modes(parts.stiffness, parts.masses, count + rigid, free=free)
    except InputError as error:
        raise InputError(f"{parts.label}: {error}" + (f" less {rigid} rigid motions" if rigid else "")) from None
    return found.part(rigid, rigid + count)


class Trial(NamedTuple):
    """A state that a step may lead to."""

    frame: FreeFrame | DrivenFrame
    q: np.ndarray
    v: np.ndarray


class ModalBody:
    """One body of a scene. Node arrays are (n,3) [m], [m/s]; q and its rate live in `modes`."""

    def __init__(self, parts: Parts, *, dt: float, precision: str = "f32", modes: Modes | None = None) -> None:
        material = parts.material
        found = modes or modes_of(parts, material.modes, basis=material.basis)
        self.shapes, self._rest = found.shapes, parts.rest
        self.modes = Oscillators(
            found.frequencies, mass_damping=material.mass_damping, stiffness_damping=material.stiffness_damping
        )
        self.frame: FreeFrame | DrivenFrame
        if parts.pins:
            self.frame, self.local = DrivenFrame(_one_motion(parts), 0.0, dt), parts.rest
            relative = parts.velocities
        else:
            self.frame, self.local = FreeFrame.of(parts.rest, parts.masses, parts.velocities)
            relative = parts.velocities - self.frame.velocity_at(parts.rest)
        self.modes.v = np.einsum("n,nak,na->k", parts.masses, self.shapes, relative)
        self._drag = material.mass_damping
        # At run time only rows of the surface are worked with, in the precision of the simulation.
        places, rows = self.local[parts.skin], self.shapes[parts.skin]
        if parts.embedded is not None:
            # The embedded surface meets colliders, by the modes of the mesh that it rides in.
            places, lies = parts.embedded
            places = places - (self.frame.origin if isinstance(self.frame, FreeFrame) else 0.0)
            rows = lies.points(self.shapes.reshape(len(self.shapes), -1), parts.cells).reshape(len(places), 3, -1)
        self.skin = ClusteredSkin(places, rows, np.float32 if precision == "f32" else np.float64)
        self._youngs, self._frequencies = material.youngs, found.frequencies
        self._moment = np.einsum("n,nak->ak", parts.masses, self.shapes)
        self._tensor = np.einsum("n,nb,nak->abk", parts.masses, self.local, self.shapes)
        self._loads = [ModalLoad(load, self.shapes, self.local) for load in parts.loads]
        self._handles = parts.handles
        self.touch = Touch()
        self.contacts = 0

    # State

    @property
    def _nodes(self) -> Skin:
        return Skin(self.local, self.shapes.reshape(-1, self.shapes.shape[2]))

    @property
    def displacement(self) -> np.ndarray:
        """Of the nodes in the frame (n,3) [m]."""
        return self.shapes @ self.modes.q

    @property
    def rotation(self) -> np.ndarray:
        """Of the frame (3,3)."""
        return self.frame.rotation

    @property
    def positions(self) -> np.ndarray:
        """All nodes (n,3) [m], inner ones too."""
        return self._nodes.at(self.keep())

    @property
    def velocities(self) -> np.ndarray:
        """(n,3) [m/s]: those that the model counts with, its rigid part that of the undeformed body."""
        undeformed = self.local @ self.frame.rotation.T + self.frame.origin
        return self.frame.velocity_at(undeformed) + (self.shapes @ self.modes.v) @ self.frame.rotation.T

    @property
    def elastic_energy(self) -> float:
        """[J]"""
        return self.modes.elastic_energy

    @property
    def kinetic_energy(self) -> float:
        """[J]"""
        return self.frame.kinetic_energy + self.modes.kinetic_energy

    def surface_stress(self) -> None:
        """The elements know it as well."""

    @property
    def finite(self) -> bool:
        """Is the state made of numbers?"""
        return all(np.isfinite(values).all() for values in self.state().values())

    def keep(self) -> Trial:
        """The state, also for `take_back`."""
        return Trial(self.frame, self.modes.q, self.modes.v)

    def take_back(self, kept: Trial) -> None:
        """Undo a step."""
        self.frame, self.modes.q, self.modes.v = kept

    def state(self) -> dict[str, np.ndarray]:
        """What the next steps depend on."""
        found = {"q": self.modes.q, "v": self.modes.v}
        if isinstance(self.frame, FreeFrame):
            found |= {name: getattr(self.frame, name) for name in ("rotation", "origin", "velocity", "momentum")}
        return found | self.touch.state()

    def set_state(self, state: dict[str, np.ndarray], time: float) -> None:
        """The inverse of `state`, at `time` [s]."""
        self.modes.q, self.modes.v = state["q"].copy(), state["v"].copy()
        self.touch.set_state(state)
        if isinstance(self.frame, FreeFrame):
            self.frame = replace(
                self.frame, **{name: state[name] for name in ("rotation", "origin", "velocity", "momentum")}
            )
        else:
            self.frame = replace(self.frame, time=time)

    @property
    def holdable(self) -> np.ndarray:
        """Nodes that hands can take hold of (n,): all."""
        return np.arange(len(self.local))

    def set_material(self, material: Material) -> None:
        """Another Young's modulus or damping from the next step on: the shapes stay, frequencies change."""
        before, self._drag = self.modes, material.mass_damping
        self._frequencies = np.sqrt(material.youngs / self._youngs) * self._frequencies
        self._youngs = material.youngs
        self.modes = Oscillators(
            self._frequencies, mass_damping=material.mass_damping, stiffness_damping=material.stiffness_damping
        )
        self.modes.q, self.modes.v = before.q, before.v

    # Steps

    def advance(self, dt: float, time: float, gravity: np.ndarray, obstacles, grip: Grip = NOTHING) -> None:
        """From `time` to `time` + dt [s] under gravity (3,) [m/s^2], with hands on it."""
        push = self._outer_forces(dt, time, gravity)
        if len(grip.pushed):
            push = push + np.einsum("nar,na->r", self._nodes.part(grip.pushed).levers(self.keep()), grip.forces)
        push = push + self._pull(dt, time, push, grip)
        self.frame, self.modes.q, self.modes.v = self.touch.press(self, push, dt, time, obstacles)
        self.touch.stop(self, dt)
        self.contacts = self.touch.count

    def trial(self, dt: float, push: np.ndarray) -> Trial:
        """Frame, q and its rate after dt [s] under generalised forces (r,)."""
        k = self.frame.coordinates
        return Trial(self.frame.after(dt, push[:k]), *self.modes.after(dt, push[k:]))

    def work(self, push: np.ndarray, reached: Trial, alone: Trial) -> float:
        """Work [J] of generalised forces (r,) on the way to `reached`, where the body would be `alone` without them."""
        k = self.frame.coordinates
        done = float(push[k:] @ (reached.q - self.modes.q))
        if k:
            done += float(push[:3] @ (reached.frame.origin - self.frame.origin))
            done += reached.frame.turning_energy - alone.frame.turning_energy
        return done

    def _outer_forces(self, dt: float, time: float, gravity: np.ndarray) -> np.ndarray:
        """Generalised forces of gravity, loads, the motion of the frame: on its coordinates, and on the modes."""
        R = self.frame.rotation
        modal = self._moment.T @ (R.T @ gravity)
        rigid = np.zeros(self.frame.coordinates)
        if isinstance(self.frame, DrivenFrame):
            turn, shift = self.frame.acceleration()
            modal -= np.einsum("ab,abk->k", R.T @ turn, self._tensor) + self._moment.T @ (R.T @ shift)
        else:
            rigid[:3] = self.frame.mass * gravity
            # Drag slows all motion: its mean over the step, so that it never reverses it.
            held = -np.expm1(-self._drag * dt) / dt
            rigid[:3] -= held * self.frame.mass * self.frame.velocity
            rigid[3:] -= held * self.frame.momentum
        for load in self._loads:
            share = load.load.share_at(time + dt)
            if share:
                modal += share * load.modal(R)
                rigid += share * load.rigid(R)[: self.frame.coordinates]
        return np.concatenate([rigid, modal])

    def compliance(self, dt: float) -> np.ndarray:
        """How far (r,r) unit generalised forces move the coordinates over a step."""
        return _diagonal(0.5 * dt * dt * self.frame.answer(), self.modes.step(dt).qf)

    def mobility(self) -> np.ndarray:
        """How unit generalised impulses change the rates of the coordinates (r,r)."""
        return _diagonal(self.frame.answer(), np.ones(len(self.modes.q)))

    def strike(self, impulse: np.ndarray) -> None:
        """Generalised impulses (r,) at once."""
        k = self.frame.coordinates
        self.frame, self.modes.v = self.frame.struck(impulse[:k]), self.modes.v + impulse[k:]

    def _pull(self, dt: float, time: float, push: np.ndarray, grip: Grip) -> np.ndarray:
        """Generalised forces of handles and hands, by where the points will be under them: F = k (target - x)."""
        acting = [group for group in self._handles if group.acts_at(time + dt)]
        if not acting and not len(grip.held):
            return np.zeros_like(push)
        nodes = np.concatenate([grip.held, *(group.nodes for group in acting)])
        springs = [np.full(len(group.nodes), 1 / group.stiffness) for group in acting]
        softness = np.repeat(np.concatenate([grip.softness, *springs]), 3)
        target = np.concatenate([grip.targets, *(self._target(group, time + dt) for group in acting)])
        held = self._nodes.part(nodes)
        free = held.at(self.trial(dt, push))
        J = held.levers(self.keep()).reshape(3 * len(nodes), -1)
        compliance = self.compliance(dt)
        # Firm hands may ask for more than the modes can do: they are springs that are stiff against all else.
        own = np.einsum("ar,rs,as->a", J, compliance, J)
        pulled = J / np.maximum(softness, FIRM * own.max())[:, None]
        return np.linalg.solve(np.eye(len(push)) + pulled.T @ J @ compliance, pulled.T @ (target - free).ravel())

    def _target(self, group: Group, time: float) -> np.ndarray:
        turn, shift = pose(group.motion, time)
        return self._rest[group.nodes] @ turn.T + shift


def _one_motion(parts: Parts):
    """The motion of all pins, which the frame follows."""
    motions = {id(pin.motion): pin.motion for pin in parts.pins}
    if len(motions) > 1 and any(m != next(iter(motions.values())) for m in motions.values()):
        raise InputError(
            f'{parts.label}: its pins move apart, and a modal body follows one motion: use model = "corotational"'
        )
    if any(pin.until is not None for pin in parts.pins):
        raise InputError(
            f"{parts.label}: a pin lets go, which changes the modes: drop its until, pull with a handle instead, "
            'or use model = "corotational"'
        )
    return parts.pins[0].motion


def _diagonal(block: np.ndarray, rest: np.ndarray) -> np.ndarray:
    k = len(block)
    found = np.zeros((k + len(rest), k + len(rest)))
    found[:k, :k] = block
    found[np.arange(k, k + len(rest)), np.arange(k, k + len(rest))] = rest
    return found
