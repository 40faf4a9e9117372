"""Reduced bodies that one can lay hands on while they move: grab, pin, push, and turn what their model knows."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import fields, replace

import numpy as np

from taichifem.description import Material, Scene, check
from taichifem.errors import InputError
from taichifem.hands import Hand, Hands
from taichifem.interactive import MOST_NODES
from taichifem.reduced.grip import DENT, Grip, Poke
from taichifem.reduced.reduced_bodies import ReducedBodies
from taichifem.reduced.refusals import adjustable


class GrippedBodies(ReducedBodies):
    """Bodies with hands on them. What is done acts at the next step."""

    time: float
    dt: float

    def __init__(self, scene: Scene, *, precision: str, arch: str | None, threads: int | None, dt: float) -> None:
        super().__init__(scene, precision=precision, arch=arch, threads=threads, dt=dt)
        self._hands, self._pokes = Hands(), []

    @property
    def hands(self) -> Hands:
        """The hands that hold or pull now."""
        return self._hands

    def grab(self, node: int, *, radius: float, stiffness: float | None) -> Hand:
        """Take hold of the body around `node`: of the nodes that its model knows, the nearest within `radius` [m].

        At least one, at most MOST_NODES. stiffness: of the implicit spring by which the hand pulls [N/m]; None holds
        firmly, as a pin does. Raises InputError for a node that is not there, and where hands would hold too many.
        """
        nodes = self._around(node, radius)
        if stiffness is not None:
            check.number("stiffness", stiffness, above=0, unit="N/m")
        return self._hands.take(Hand(nodes, self.positions[nodes], stiffness))

    def push(self, node: int, impulse: Sequence[float], *, radius: float) -> None:
        """Strike the body around `node` with `impulse` [N s], within the next step; its nodes as in `grab`.

        A body without inertia would not notice: there it is a force that comes and goes within DENT seconds.
        """
        nodes = self._around(node, radius)
        impulse = np.asarray(check.vector("impulse", impulse, unit="N s"))
        span = max(DENT, self.dt) if self.scene.integrator == "quasi-static" else self.dt
        self._pokes.append(Poke(nodes, impulse, self.time, span))

    def let_go(self) -> None:
        """Of everything."""
        self._hands.clear()
        self._pokes = []

    def takes(self, material: Material) -> bool:
        """Nothing that `set_material` refuses could be had by a new simulation of the same bodies."""
        return True

    def set_material(self, body: int, material: Material, *, region: int | None = None) -> None:
        """Change a body's material from the next step on. Raises InputError for what its model has worked into it."""
        said = self.scene.bodies[body]
        before = said.material if region is None else said.materials[region]
        for name in (f.name for f in fields(Material) if getattr(material, f.name) != getattr(before, f.name)):
            if name not in adjustable(self.scene, body):
                raise InputError(
                    f"body.{said.name or body}: {name} cannot change while it runs, model {before.model!r} is made "
                    "with it: change it in the scene file"
                )
        self._twin.set_material(body, replace(material, model="linear"))
        self.bodies[body].set_material(material)
        bodies = list(self.scene.bodies)
        bodies[body] = replace(said, material=material)
        self.adjust(bodies=bodies)

    def adjust(self, **changes: object) -> None:
        """Change plain fields of the scene from the next step on."""
        self.scene = replace(self.scene, **changes)

    def _around(self, node: int, radius: float) -> np.ndarray:
        rest = self.rest_positions
        check.number("radius", radius, at_least=0, unit="m")
        if check.whole("node", node, at_least=0) >= len(rest):
            raise InputError(f"node {node} is not there: the scene has {len(rest)} nodes")
        b = int(self.node_bodies[node])
        known = self._range[b][0] + self.bodies[b].holdable
        distance = np.linalg.norm(rest[known] - rest[node], axis=1)
        nearest = np.argsort(distance, kind="stable")[:MOST_NODES]
        within = nearest[distance[nearest] <= max(radius, distance[nearest[0]])]
        return np.sort(known[within])

    def _grips(self, time: float, dt: float) -> Iterator[Grip]:
        """What hands do to each body in the step from `time` to `time` + dt [s]."""
        self._pokes = [poke for poke in self._pokes if poke.begin + poke.span > time + 1e-9 * dt]
        for first, last in self._range:
            hands = [hand for hand in self._hands if first <= hand.nodes[0] < last]
            pokes = [poke for poke in self._pokes if first <= poke.nodes[0] < last]
            if not hands and not pokes:
                yield Grip()
                continue
            none, nowhere = [np.zeros(0, dtype=int)], [np.zeros((0, 3))]
            hands = sorted(hands, key=lambda hand: hand.stiffness is not None)  # where firm ones are, others give way
            soft = [np.full(len(h.nodes), len(h.nodes) / h.stiffness if h.stiffness else 0.0) for h in hands]
            shares = [np.tile(p.force(time, dt) / len(p.nodes), (len(p.nodes), 1)) for p in pokes]
            held, once = np.unique(np.concatenate([*none, *(hand.nodes for hand in hands)]), return_index=True)
            yield Grip(
                held=held - first,
                targets=np.concatenate([*nowhere, *(hand.targets for hand in hands)])[once],
                softness=np.concatenate([np.zeros(0), *soft])[once],
                pushed=np.concatenate([*none, *(poke.nodes - first for poke in pokes)]),
                forces=np.concatenate([*nowhere, *shares]),
            )
