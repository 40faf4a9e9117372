"""A scene that is acted upon while it runs: every action at a step of its own, so that all can be repeated."""

from __future__ import annotations

import gc
from collections.abc import Callable
from dataclasses import dataclass, replace
from os import PathLike

import numpy as np

from taichifem.description import Material, PlaneCollider, Scene
from taichifem.errors import Diverged, InputError
from taichifem.factory import is_reduced, simulate
from taichifem.hands import Hand
from taichifem.live import parameters
from taichifem.live.ball import LIFE, Ball
from taichifem.live.interactions import Action, Interactions
from taichifem.live.panel import check_offered
from taichifem.live.tools import Tools, tools_for

FAR = 1e4
"""Sizes of the scene that a node may be away from its rest before the simulation counts as diverged."""

REBUILDS = ("integrator", "solver")


@dataclass(frozen=True)
class Kept:
    """A state to come back to: arrays and header of the simulation, the scene then, how much had been done."""

    state: tuple[dict[str, np.ndarray], dict]
    scene: Scene
    done: Interactions


class Stage:
    """A simulation, the scene as it is now (materials, gravity ...), and what has been done since its start.

    original: the scene as it was given.  hands: by name.  on_rebuild: called before a change of laws, which may have
    to compile.
    """

    def __init__(
        self,
        scene: Scene,
        *,
        precision: str = "f32",
        arch: str | None = None,
        threads: int | None = None,
        on_rebuild: Callable[[], None] = lambda: None,
    ) -> None:
        if scene.integrator == "quasi-static" and not is_reduced(scene):
            raise InputError('integrator "quasi-static" knows no time to act in: choose another, as with --set')
        self.original = self.scene = scene
        self.tools: Tools = tools_for(scene)
        self.done = Interactions()
        self.hands: dict[str, Hand] = {}
        self.on_rebuild = on_rebuild
        self._machine = {"precision": precision, "arch": arch, "threads": threads}
        self._ball: Ball | None = None
        self._make(scene)

    def _make(self, scene: Scene) -> None:
        self.simulation = simulate(scene, **self._machine)
        self._start = self.simulation.snapshot()
        x = self.simulation.rest_positions
        self._reach = FAR * max(float(np.abs(x).max()), float(np.ptp(x, axis=0).max()))

    # Time

    def step(self) -> None:
        """One step. Raises Diverged on numbers that are not finite or out of all bounds; `reset` leads out of it."""
        simulation, ball = self.simulation, self._ball
        if ball is not None:
            colliders = self.scene.colliders
            if simulation.time >= ball.until:
                self._ball = ball = None
                simulation.set_colliders(colliders)
            else:
                simulation.set_colliders([*colliders, ball.collider(simulation.time, simulation.dt)], kept=True)
        dt = simulation.dt
        simulation.step()
        if ball is not None:
            force = simulation.force_on_ball(len(self.scene.colliders), simulation.time)
            planes = [c for c in self.scene.colliders if isinstance(c, PlaneCollider) and c.motion is None]
            ball.fly(dt, np.asarray(self.scene.gravity), force, planes)

    def check(self, positions: np.ndarray) -> None:
        """Raise Diverged where nodes (n,3) are out of all bounds, or nowhere."""
        if not (np.abs(positions) < self._reach).all():
            raise Diverged(f"the simulation diverged at t = {self.simulation.time:.4g} s: bodies are out of all bounds")

    def finish_frame(self) -> None:
        """Go on until a frame is complete: the only instants at which the time step and the laws can change."""
        while self.simulation.substep:
            self.step()

    # Actions

    def do(self, action: Action) -> None:
        """Do a checked action before the next step, and note it. Raises InputError for what is impossible."""
        act = getattr(self, f"_{action['do']}")
        act(**{name: value for name, value in action.items() if name != "do"})
        if not action.get("path", "").startswith(("tools.", "view.")):
            self.done.add(self.simulation.step_count, action)

    def _set(self, path: str, value: parameters.Value) -> None:
        place, parameter = parameters.find(path)
        check_offered(self.scene, place, parameter)
        value = parameters.check_value(parameter, value)
        if place == "tools":
            self.tools = parameters.changed(self.tools, parameter.name, value)
        elif place == "view":
            view = parameters.changed(self.scene.view, parameter.name, value)
            self.scene = replace(self.scene, view=view)
            self.simulation.adjust(view=view)
        elif place == "simulation":
            self._set_simulation(parameters.changed(self.scene, parameter.name, value), parameter.name.split(".")[0])
        else:
            self._set_material(place, parameter.name, value)

    def _set_simulation(self, scene: Scene, name: str) -> None:
        if name in REBUILDS:
            self._rebuild(scene)
            return
        if name == "substeps":
            self.finish_frame()
        self.simulation.adjust(**{name: getattr(scene, name)})
        self.scene = scene

    def _set_material(self, place: str, name: str, value: parameters.Value) -> None:
        b, region = _place(place)
        if b >= len(self.scene.bodies):
            raise InputError(f"there is no parameter {place}.{name}")
        body = self.scene.bodies[b]
        if region is not None and region not in body.materials:
            raise InputError(f"there is no parameter {place}.{name}")
        before = body.material if region is None else body.materials[region]
        material = parameters.changed(before, name, value)
        scene = _with_material(self.scene, b, region, material)
        if self.simulation.takes(material):
            self.simulation.set_material(b, material, region=region)
            self.scene = scene
        else:
            self._rebuild(scene)

    def _rebuild(self, scene: Scene) -> None:
        """Make the simulation anew for `scene`, of the same bodies, and go on from where it is."""
        self.finish_frame()
        self.on_rebuild()
        self._drop_ball()
        state, before = self.simulation.snapshot(), self.scene
        hands = {name: (hand.nodes, hand.start, hand.targets, hand.stiffness) for name, hand in self.hands.items()}
        self.simulation = self._start = None  # so that its world, compiled already, can be used again
        gc.collect()
        try:
            self._make(scene)
            self.simulation.restore(*state)
            self.scene = scene
        except InputError:
            self._make(before)
            self.simulation.restore(*state)
            raise
        finally:
            self.hands = {}
            for name, (nodes, start, targets, stiffness) in hands.items():
                self.hands[name] = self.simulation.hands.take(Hand(nodes, start, stiffness))
                self.hands[name].targets = targets

    def _grab(self, hand: str, node: int, stiffness: float, radius: float) -> None:
        self._hold(hand, node, stiffness, radius)

    def _pin(self, hand: str, node: int, radius: float) -> None:
        self._hold(hand, node, None, radius)

    def _hold(self, name: str, node: int, stiffness: float | None, radius: float) -> None:
        if name in self.hands:
            raise InputError(f"the hand {name!r} holds something already")
        self.hands[name] = self.simulation.grab(node, radius=radius, stiffness=stiffness)

    def _drag(self, hand: str, offset: tuple[float, float, float]) -> None:
        self._named(hand).move(np.asarray(offset))

    def _strength(self, hand: str, stiffness: float) -> None:
        self.simulation.hands.set_stiffness(self._named(hand), stiffness)

    def _release(self, hand: str) -> None:
        self.simulation.hands.release(self._named(hand))
        del self.hands[hand]

    def _named(self, name: str) -> Hand:
        if name not in self.hands:
            raise InputError(f"the hand {name!r} holds nothing")
        return self.hands[name]

    def _poke(self, node: int, impulse: tuple[float, float, float], radius: float) -> None:
        self.simulation.push(node, impulse, radius=radius)

    def _throw(self, origin: tuple, velocity: tuple, radius: float) -> None:
        simulation = self.simulation
        if is_reduced(self.scene):
            raise InputError("reduced models meet no ball: poke them, pull them, or have a collider in the scene file")
        mass = 4.2 * radius**3 * max(m.density for _, _, m in parameters.materials(self.scene))
        self._ball = Ball(np.array(origin), np.array(velocity), radius, mass, simulation.time + LIFE)
        simulation.set_colliders([*self.scene.colliders, self._ball.collider(simulation.time, simulation.dt)])

    def _drop_ball(self) -> None:
        if self._ball is not None:
            self._ball = None
            self.simulation.set_colliders(self.scene.colliders)

    def save_state(self, path: str | PathLike) -> None:
        """Write a checkpoint of the scene as it is now; a ball in the air is no part of it."""
        if self._ball is None:
            self.simulation.save(path)
            return
        with_ball = self.simulation.scene.colliders
        self.simulation.set_colliders(self.scene.colliders)
        try:
            self.simulation.save(path)
        finally:
            self.simulation.set_colliders(with_ball)

    # Back

    def keep(self) -> Kept:
        """A state for `back`; what holds or flies is no part of it."""
        return Kept(self.simulation.snapshot(), self.scene, Interactions(self.done.entries))

    def back(self, kept: Kept) -> None:
        """State, parameters and what had been done, as they were kept."""
        self._let_go()
        self._become(kept.scene)
        self._restore(kept.state)
        self.done = Interactions(kept.done.entries)

    def reset(self, *, parameters_too: bool = False) -> None:
        """Begin again, with the parameters of now or those of the scene as it was given."""
        self._let_go()
        if parameters_too:
            self._become(self.original)
        self._restore(self._start)
        self.done = Interactions()
        for path, value in parameters.differences(self.original, self.scene):
            if not path.startswith("view."):
                self.done.entries.append((0, {"do": "set", "path": path, "value": value}))

    def _restore(self, state: tuple[dict[str, np.ndarray], dict]) -> None:
        arrays, header = state
        # A ball that flew then is gone now.
        n = max(len(self.scene.colliders), 1)
        self.simulation.restore(
            {k: v[:n] if k in ("slip", "pressed", "touching") else v for k, v in arrays.items()}, header
        )

    def _let_go(self) -> None:
        self._drop_ball()
        self.hands = {}
        self.simulation.hands.clear()

    def _become(self, scene: Scene) -> None:
        """Have the parameters of `scene`, of the same bodies."""
        now = {prefix: material for _, prefix, material in parameters.materials(self.scene)}
        fits = all(getattr(scene, name) == getattr(self.scene, name) for name in REBUILDS)
        if not fits or not all(self.simulation.takes(m) for *_, m in parameters.materials(scene)):
            self.on_rebuild()
            self.simulation = self._start = None
            gc.collect()
            self._make(scene)
        else:
            for _, prefix, material in parameters.materials(scene):
                if material != now[prefix]:
                    b, region = _place(prefix)
                    self.simulation.set_material(b, material, region=region)
            names = ("gravity", "substeps", "tolerance", "max_iterations", "newton_tolerance", "max_splits", "view")
            self.simulation.adjust(**{name: getattr(scene, name) for name in names})
        self.scene = scene


def _place(place: str) -> tuple[int, int | None]:
    """Number of the body, and of the region or None, of "body.0.material" or "body.0.materials.3"."""
    parts = place.split(".")
    known = parts[0] == "body" and all(part.isdecimal() for part in parts[1::2])
    if known and parts[2:] == ["material"]:
        return int(parts[1]), None
    if known and len(parts) == 4 and parts[2] == "materials":
        return int(parts[1]), int(parts[3])
    raise InputError(f"there is no material {place!r}")


def _with_material(scene: Scene, b: int, region: int | None, material: Material) -> Scene:
    body = scene.bodies[b]
    if region is None:
        body = replace(body, material=material)
    else:
        body = replace(body, materials={**body.materials, region: material})
    return replace(scene, bodies=[*scene.bodies[:b], body, *scene.bodies[b + 1 :]])
