"""What a person does to a scene while it runs, as plain data: checked, listed by step, written and read again."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable
from os import PathLike
from pathlib import Path
from typing import Any

from taichifem.description import check
from taichifem.errors import InputError
from taichifem.files import replacing

Action = dict[str, Any]
"""{"do": what, ...} with the fields that KINDS names."""

FORMAT, VERSION = "taichifem-interactions", 1
MOST = 200_000
"""Actions in a list: some hours of a busy hand."""


def _text(name: str, value: object) -> str:
    if not isinstance(value, str) or not 0 < len(value) <= 100:
        raise InputError(f"{name} must be a short text, not {str(value)[:40]!r}")
    return value


def _positive(name: str, value: object) -> float:
    return check.number(name, value, above=0, below=1e12)


def _vector(name: str, value: object) -> tuple[float, float, float]:
    found = check.vector(name, value)
    if max(map(abs, found)) > 1e9:
        raise InputError(f"{name} is {found}: that is too far")
    return found


def _node(name: str, value: object) -> int:
    return check.whole(name, value, at_least=0)


def _value(name: str, value: object) -> object:
    if value is None or isinstance(value, bool | str):
        return value
    return check.number(name, value)


KINDS: dict[str, dict[str, Callable]] = {
    "set": {"path": _text, "value": _value},
    "grab": {"hand": _text, "node": _node, "stiffness": _positive, "radius": _positive},
    "pin": {"hand": _text, "node": _node, "radius": _positive},
    "drag": {"hand": _text, "offset": _vector},
    "strength": {"hand": _text, "stiffness": _positive},
    "release": {"hand": _text},
    "poke": {"node": _node, "impulse": _vector, "radius": _positive},
    "throw": {"origin": _vector, "velocity": _vector, "radius": _positive},
}
"""set a parameter; grab or pin a node, with a name for the hand; drag that by an offset [m] from where it took hold;
change its strength [N/m]; release it; poke a node [N s]; throw a ball [m], [m/s]."""


def checked(message: object) -> Action:
    """The action that `message` says. Raises InputError for what is none."""
    if not isinstance(message, dict) or not isinstance(message.get("do"), str) or message["do"] not in KINDS:
        raise InputError(f"an action is one of {', '.join(KINDS)}")
    fields = KINDS[message["do"]]
    missing = [name for name in fields if name not in message]
    if missing:
        raise InputError(f"{message['do']} needs {missing[0]}")
    return {"do": message["do"], **{name: test(name, message[name]) for name, test in fields.items()}}


class Interactions:
    """Actions and the steps (completed before) at which they were done, in order."""

    def __init__(self, entries: Iterable[tuple[int, Action]] = ()) -> None:
        self.entries: list[tuple[int, Action]] = list(entries)

    def add(self, step: int, action: Action) -> None:
        """Note an action; of repeated ones within a step only the last counts. A full list takes no more."""
        what = action["do"], action.get("path", action.get("hand"))
        if action["do"] in ("set", "drag", "strength") and self.entries:
            before, last = self.entries[-1]
            if before == step and what == (last["do"], last.get("path", last.get("hand"))):
                self.entries[-1] = step, action
                return
        if len(self.entries) < MOST:
            self.entries.append((step, action))

    def write(self, path: str | PathLike) -> None:
        """Write a file that `read` takes. Raises InputError if it cannot be written."""
        actions = ",\n".join(json.dumps({"step": step, **action}) for step, action in self.entries)
        head = f'"format": "{FORMAT}", "version": {VERSION}'
        with replacing(path) as part:
            part.write_text(f'{{{head}, "actions": [\n{actions}\n]}}\n', encoding="utf-8")

    @classmethod
    def read(cls, path: str | PathLike) -> Interactions:
        """The list in a file. Raises InputError for a file that is missing or no such list."""
        try:
            content = json.loads(Path(path).read_text(encoding="utf-8"))
        except OSError as error:
            raise InputError(f"{path}: cannot be read: {error.strerror or error}") from None
        except (ValueError, RecursionError):
            raise InputError(f"{path}: this is no JSON file: give one that `taichifem live` has written") from None
        known = isinstance(content, dict) and (content.get("format"), content.get("version")) == (FORMAT, VERSION)
        if not known or not isinstance(content.get("actions"), list):
            raise InputError(f"{path}: this is no list of interactions: give one that `taichifem live` has written")
        entries = []
        for k, entry in enumerate(content["actions"]):
            try:
                step = check.whole("step", entry.get("step") if isinstance(entry, dict) else None, at_least=0)
                entries.append((step, checked(entry)))
            except InputError as error:
                raise InputError(f"{path}: actions.{k}: {error}") from None
        return cls(sorted(entries, key=lambda entry: entry[0]))
