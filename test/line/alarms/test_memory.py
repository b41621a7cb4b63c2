# SPDX-License-Identifier: Apache-2.0
"""Alarms in checkpoints, and refused data of checkpoint files."""

import copy
import json
import random
from collections.abc import Callable
from typing import Any

import pytest
from line.alarms.board import Board

from conveyor_sim.line.alarms import memory
from conveyor_sim.line.alarms.operations import OPERATIONS


def line() -> Board:
    board = Board()
    board.declare(own=True, trip={"latching": True, "group": "g"}, jam={"suppressed_by": ["trip"], "on_delay": 0.5})
    return board


def busy(seed: int, ticks: int = 60) -> Board:
    """Return alarms after many events of all kinds."""
    board, draw = line(), random.Random(seed)
    board.declare(
        full={"suppressed_by": ["jam", "trip"], "group": "g", "off_delay": 0.7},
        hot={"group": "h", "latching": True, "confirm": seed % 2 == 1},
    )
    for _ in range(ticks):
        turn(board, draw)
    return board


def turn(board: Board, draw: random.Random) -> None:
    ids = ["trip", "jam", "full", "hot", "said", "said too"]
    board.say(**{id: draw.random() < 0.5 for id in draw.sample(ids, 2)})
    board.do(draw.choice(list(OPERATIONS)), draw.choice(ids), by=draw.choice(["anna", "ben"]))
    board.do("shelve", draw.choice(ids), values=(draw.choice([0.0, 0.3, 2.0]),))
    board.to(board.tick + 1)


def kept(board: Board) -> Any:
    return json.loads(json.dumps(memory.snapshot(board.alarms)))


@pytest.mark.parametrize("seed", range(20))
def test_it_goes_on_as_if_nothing_had_been(seed: int) -> None:
    board = busy(seed)
    other = line()
    other.tick = board.tick
    memory.restore(other.alarms, board.tick, kept(board))
    assert kept(other) == kept(board)
    draws = random.Random(-seed - 1), random.Random(-seed - 1)
    before = len(board.events)
    for _ in range(40):
        for one, draw in zip((board, other), draws, strict=True):
            turn(one, draw)
        assert kept(other) == kept(board)
        assert other.alarms.counts() == board.alarms.counts()
        assert vars(other.alarms.columns())["id"] == vars(board.alarms.columns())["id"]
    assert other.events == board.events[before:] and len(other.events) > 10


def alarm(memory: Any, id: str) -> list[Any]:
    return next(one for one in memory["alarms"] if one[0] == id)


FIELDS = list(memory._StoredAlarm._fields)


def set_field(id: str, /, **fields: Any) -> Callable[[Any], None]:
    def change(memory: Any) -> None:
        for field, value in fields.items():
            alarm(memory, id)[FIELDS.index(field)] = value

    return change


@pytest.mark.parametrize(
    ("change", "problem"),
    [
        (lambda m: m.pop("first"), "other entries"),
        (lambda m: m.update(numbered="3"), "line.alarms.numbered is not of its type"),
        (lambda m: m.update(numbered=2), "number that was never assigned"),
        (lambda m: m["alarms"].append(m["alarms"][-1]), "numbers out of order"),
        (lambda m: m["alarms"].pop(0), "belong to another line"),
        (lambda m: m["alarms"].reverse(), "belong to another line"),
        (lambda m: m.update(first={"g": "said"}), "a first-out alarm that is not in its group"),
        (lambda m: m.update(first={"g": "nobody"}), "a first-out alarm that is not in its group"),
        (lambda m: m.update(first={"g": "trip"}), "a first-out without an alarm"),
        (set_field("said", id="hot"), "have one alarm twice"),
        (set_field("said", id=""), "invalid texts"),
        (set_field("said", changed_by="a\nb"), "invalid texts"),
        (set_field("said", number=99), "number that was never assigned"),
        (set_field("hot", declared="{"), "has an invalid declaration"),
        (set_field("hot", declared=""), "has an invalid declaration"),
        (set_field("said", declared="{}"), "has an invalid declaration"),
        (set_field("hot", declared='{"suppressed_by": ["nobody"]}'), "lack what suppresses hot"),
        (set_field("hot", declared='{"suppressed_by": ["hot"]}'), "have an alarm that suppresses itself"),
        (set_field("said", own=True), "belong to another line"),
        (set_field("said", main=6), "in an impossible state"),
        (set_field("said", main=-1), "in an impossible state"),
        (set_field("said", main=0), "in an impossible state"),
        (set_field("said", main=3), "in an impossible state"),
        (set_field("hot", main=1), "in an impossible state"),
        (set_field("said", out_of_service=True), "in an impossible state"),
        (set_field("said", due=9), "a delay without a reason"),
        (set_field("said", active=False), "a delay without a reason"),
        (set_field("said", active=False, due=5), "an impossible delay"),
        (set_field("said", active=False, due=2**52), "an impossible delay"),
        (set_field("said", shelved="timed"), "is shelved without a time"),
        (set_field("hot", shelved="timed", shelved_until=2**52), "is shelved too long"),
        (set_field("hot", shelved="timed", shelved_until=3), "is shelved too long"),
        (set_field("hot", shelved="for fun"), r"line.alarms.alarms\[3\]\[9\] is not of its type"),
        (set_field("said", since=6), "changed after the checkpoint"),
    ],
)
def test_what_can_not_be_is_refused(change: Callable[[Any], None], problem: str) -> None:
    board = line()
    board.declare(full={"group": "g"}, hot={"group": "h"})
    board.to(5)
    board.say(said=True)
    good = kept(board)
    memory.restore(line().alarms, board.tick, copy.deepcopy(good))
    change(good)
    with pytest.raises(ValueError, match=problem):
        memory.restore(line().alarms, board.tick, good)
