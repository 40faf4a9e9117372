"""Actions as plain data: checked, listed, written and read."""

import json

import pytest

from taichifem import InputError
from taichifem.live.inbox import MOST as MOST_WAITING
from taichifem.live.inbox import Inbox
from taichifem.live.interactions import Interactions, checked

GRAB = {"do": "grab", "hand": "a", "node": 3, "stiffness": 10.0, "radius": 0.1}


def test_an_action_keeps_what_it_needs():
    assert checked({**GRAB, "more": 1}) == GRAB
    assert checked({"do": "drag", "hand": "a", "offset": [1, 2, 3]})["offset"] == (1.0, 2.0, 3.0)
    assert checked({"do": "set", "path": "simulation.substeps", "value": None})["value"] is None


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"do": "fly"}, "an action is one of"),
        ({"do": ["grab"]}, "an action is one of"),
        ({"node": -1}, "node must be a whole number"),
        ({"node": 1.5}, "node must be a whole number"),
        ({"stiffness": float("nan")}, "stiffness is nan"),
        ({"stiffness": 1e300}, "below"),
        ({"radius": 0}, "above 0"),
        ({"hand": "x" * 200}, "short text"),
        ({"hand": 7}, "short text"),
    ],
)
def test_what_is_no_action_is_refused_in_one_line(change, words):
    with pytest.raises(InputError, match=words) as refusal:
        checked(GRAB | change)
    assert "\n" not in str(refusal.value)


def test_missing_fields_and_foreign_things_are_refused():
    with pytest.raises(InputError, match="release needs hand"):
        checked({"do": "release"})
    for thing in (None, 3, "grab", [GRAB]):
        with pytest.raises(InputError):
            checked(thing)


def test_of_repeated_changes_within_a_step_the_last_counts():
    done = Interactions()
    for step, value in ((4, 1.0), (4, 2.0), (5, 3.0)):
        done.add(step, {"do": "set", "path": "p", "value": value})
    done.add(5, {"do": "set", "path": "q", "value": 0.0})
    assert [(step, action["value"]) for step, action in done.entries] == [(4, 2.0), (5, 3.0), (5, 0.0)]


def test_a_list_reads_back_as_it_was_written(tmp_path):
    done = Interactions()
    done.add(0, checked(GRAB))
    done.add(7, checked({"do": "drag", "hand": "a", "offset": [0.1, 0.2, 1 / 3]}))
    done.add(9, checked({"do": "set", "path": "body.0.material.toughness", "value": None}))
    done.write(tmp_path / "done.json")
    assert Interactions.read(tmp_path / "done.json").entries == done.entries
    Interactions().write(tmp_path / "nothing.json")
    assert Interactions.read(tmp_path / "nothing.json").entries == []


def test_files_that_are_no_list_are_refused(tmp_path):
    file = tmp_path / "x.json"
    good = {"format": "taichifem-interactions", "version": 1}
    for content, words in (
        ("{", "no JSON"),
        ("[1]", "no list of interactions"),
        (json.dumps({**good, "version": 99, "actions": []}), "no list of interactions"),
        (json.dumps({**good, "actions": [{"step": -1, **GRAB}]}), "actions.0: step"),
        (json.dumps({**good, "actions": [3]}), "actions.0: step"),
        (json.dumps({**good, "actions": [{"step": 1, "do": "fly"}]}), "actions.0: an action"),
    ):
        file.write_text(content)
        with pytest.raises(InputError, match=words):
            Interactions.read(file)
    with pytest.raises(InputError, match="cannot be read"):
        Interactions.read(tmp_path / "none.json")


def test_the_inbox_keeps_the_last_of_what_is_repeated_and_is_bounded():
    inbox = Inbox()
    for value in range(1000):
        assert inbox.put({"do": "set", "path": "a", "value": value})
    assert inbox.put({"do": "set", "path": "b", "value": 1})
    assert [m["value"] for m in inbox.take()] == [999, 1] and inbox.take() == []
    taken = [inbox.put({"ask": "step"}) for _ in range(MOST_WAITING + 10)]
    assert sum(taken) == MOST_WAITING and len(inbox.take()) == MOST_WAITING
