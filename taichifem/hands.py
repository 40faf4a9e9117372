"""Hands: they take hold of nodes while a simulation runs, pull them or keep them, and let go."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from taichifem.errors import InputError

ROOM = 224
"""Nodes that all hands together may hold: a world has room for them beside pins and handles."""


@dataclass(eq=False)
class Hand:
    """Holds nodes at targets: by an implicit spring each, or firmly.

    nodes (k,): in the order of the scene. Of the copies that fracture makes of a node, the heaviest is held on.
    start, targets (k,3): where the nodes were when it took hold, and where it wants them [m].
    stiffness: of the whole hand [N/m]; None holds firmly, as a pin does.
    """

    nodes: np.ndarray
    start: np.ndarray
    stiffness: float | None
    targets: np.ndarray = field(init=False)

    def __post_init__(self) -> None:
        self.targets = self.start.copy()

    def move(self, offset: np.ndarray) -> None:
        """Want the nodes `offset` (3,) [m] from where the hand took hold."""
        self.targets = self.start + np.asarray(offset, dtype=float)

    def force(self, positions: np.ndarray) -> np.ndarray:
        """Force (3,) [N] with which its springs pull nodes at `positions` (n,3); zero for a firm hand."""
        if self.stiffness is None:
            return np.zeros(3)
        return self.stiffness / len(self.nodes) * (self.targets - positions[self.nodes]).sum(axis=0)


class Hands:
    """The hands of a simulation. changed: some took hold, let go or changed since the world was told."""

    def __init__(self) -> None:
        self._all: list[Hand] = []
        self.changed = False

    def __iter__(self):
        return iter(self._all)

    def __len__(self) -> int:
        return len(self._all)

    def take(self, hand: Hand) -> Hand:
        """Let `hand` act. Raises InputError where all hands would hold too many nodes."""
        if len(hand.nodes) + sum(len(other.nodes) for other in self._all) > ROOM:
            raise InputError(f"hands hold {ROOM} nodes at most: let go somewhere first, or take a smaller radius")
        self._all.append(hand)
        self.changed = True
        return hand

    def release(self, hand: Hand) -> None:
        """Let go. Raises InputError for a hand that has let go before."""
        if hand not in self._all:
            raise InputError("this hand has let go already")
        self._all.remove(hand)
        self.changed = True

    def clear(self) -> None:
        """Let go everywhere."""
        self.changed = self.changed or bool(self._all)
        self._all = []

    def set_stiffness(self, hand: Hand, stiffness: float) -> None:
        """Pull with `stiffness` [N/m] from the next step on."""
        self.changed = self.changed or stiffness != hand.stiffness
        hand.stiffness = stiffness

    def follow(self, parent: np.ndarray, masses: np.ndarray) -> None:
        """Go on after nodes were split: hold the heaviest copy of each, so that no splinter is left in the hand.

        parent (n,): the node before that each is, or is a copy of.  masses (n,) [kg].
        """
        order = np.lexsort((-np.arange(len(parent)), masses, parent))  # of equal ones the first comes last
        last = np.searchsorted(parent[order], np.arange(parent.max() + 1), side="right") - 1
        for hand in self._all:
            hand.nodes = order[last[hand.nodes]]
        self.changed = self.changed or bool(self._all)

    def rows(self, number: np.ndarray, first: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """What they hold (k,5), what they pull (l,2) and how stiffly (l,) [N/m], as `transfer.fill_groups` takes it.

        number (n,): of each node of the scene in the world.  first: the pose of the first node, one for each node.
        """
        held, pulled, stiffness = [np.zeros((0, 5))], [np.zeros((0, 2))], [np.zeros(0)]
        for hand in self._all:
            nodes = np.column_stack([number[hand.nodes], first + np.arange(len(hand.nodes))])
            first += len(hand.nodes)
            if hand.stiffness is None:
                held.append(np.column_stack([nodes, np.ones((len(nodes), 3))]))
            else:
                pulled.append(nodes)
                stiffness.append(np.full(len(nodes), hand.stiffness / len(nodes)))
        return np.concatenate(held), np.concatenate(pulled), np.concatenate(stiffness)

    def poses(self, rest: np.ndarray) -> np.ndarray:
        """Rows of R and c (k,3,4) that take the nodes, at `rest` (n,3) in the order of the scene, to their targets."""
        offsets = [np.zeros((0, 3)), *(hand.targets - rest[hand.nodes] for hand in self._all)]
        offsets = np.concatenate(offsets)
        return np.concatenate([np.broadcast_to(np.eye(3), (len(offsets), 3, 3)), offsets[:, :, None]], axis=2)
