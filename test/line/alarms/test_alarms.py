# SPDX-License-Identifier: Apache-2.0
"""Several alarms: delays, shelving, suppression, first-out, and their largest number."""

import re

import pytest
from facts import missing
from line.alarms.board import Board

from conveyor_sim.line.alarms.declaration import MOST_ALARMS


def test_the_delays_are_those_of_ton_and_tof() -> None:
    board = Board(jam={"on_delay": 0.5, "off_delay": 0.3})
    board.to(10)
    assert board.say(jam=True) == []
    assert board.to(14) == [] and board.to(15) == ["raised jam"]
    assert board.say(jam=False) == []
    assert board.to(17) == [] and board.to(18) == ["cleared jam"]
    assert board.events == [(15, "raised", "jam"), (18, "cleared", "jam")]


def test_a_condition_that_does_not_last_is_no_alarm() -> None:
    board = Board(jam={"on_delay": 0.5, "off_delay": 0.5})
    board.say(jam=True)
    board.to(4)
    board.say(jam=False)
    board.say(jam=True)  # the delay begins anew
    assert board.to(8) == [] and board.to(9) == ["raised jam"]
    board.say(jam=False)
    board.to(12)
    board.say(jam=True)
    assert board.to(30) == []  # nor does one go that comes back


def test_a_delay_is_rounded_up_to_ticks() -> None:
    board = Board(a={"on_delay": 0.3}, b={"on_delay": 0.31})  # 0.3 / 0.1 is a little less than 3
    board.say(a=True, b=True)
    board.to(9)
    assert board.events == [(3, "raised", "a"), (4, "raised", "b")]


def test_shelved_for_a_time() -> None:
    board = Board(jam={})
    board.say(jam=True)
    assert board.do("shelve", "alarms/jam", values=(2.0,), by="ben") == ""
    assert board.alarms["jam"].changed_by == "ben"
    assert board.states() == {"jam": "SHELVED"}
    assert board.to(19) == [] and board.to(20) == ["unshelved jam", "raised jam"]
    assert board.texts == ["", "by ben", "its time is over", ""]


def test_one_shot_shelving_ends_with_the_condition() -> None:
    board = Board(jam={})
    board.do("shelve", "jam")  # before it comes: its next coming is not shown
    assert board.say(jam=True) == []
    assert board.say(jam=False) == ["unshelved jam"]
    assert board.states() == {"jam": "NORMAL"}
    assert board.say(jam=True) == ["raised jam"]


def test_what_follows_from_an_alarm_is_suppressed_while_it_stands() -> None:
    board = Board(trip={"latching": True}, jam={"suppressed_by": ["trip"]}, starved={"suppressed_by": ["jam"]})
    assert board.say(trip=True) == ["raised trip"]
    assert board.say(jam=True) == ["suppressed jam"]
    assert board.texts[-1] == "follows from trip"
    # What follows from one that is itself not shown is not shown either: its condition is there.
    assert board.say(starved=True) == ["suppressed starved"]
    board.say(starved=False, jam=False)
    board.say(trip=False)  # latched: it still stands
    assert board.say(jam=True) == ["suppressed jam"]
    assert board.do("acknowledge") == "" and board.do("reset") == ""
    assert board.events[-1][1:] == ("raised", "jam")  # which is there yet, and nothing hides it any more


def test_what_comes_in_one_tick_is_told_with_the_cause_first() -> None:
    declared = {"jam": {"suppressed_by": ["trip"], "priority": 1000, "group": "packer"}, "trip": {"group": "packer"}}
    board = Board(**declared)
    assert board.say(jam=True, trip=True) == ["raised trip", "suppressed jam"]
    assert board.alarms.first == {"packer": "trip"}


def test_a_cause_that_comes_later_hides_what_stands() -> None:
    board = Board(trip={}, jam={"suppressed_by": ["trip"]})
    board.say(jam=True)
    assert board.say(trip=True) == ["raised trip", "suppressed jam"]
    assert board.say(trip=False) == ["cleared trip", "raised jam"]


def test_what_follows_has_its_delay_to_end_after_its_cause() -> None:
    board = Board(trip={}, starved={"suppressed_by": ["trip"], "on_delay": 1.0}, empty={"suppressed_by": ["starved"]})
    board.say(trip=True, starved=True)
    assert board.to(30) == ["suppressed starved"]
    assert board.say(empty=True) == ["suppressed empty"]
    board.do("shelve", "starved")  # until its condition ends, which it does not while it is delayed
    assert board.say(trip=False) == ["cleared trip", "raised empty"]
    assert board.states()["starved"] == "SHELVED"
    board.do("unshelve", "starved")
    assert board.to(39) == [] and board.to(40) == ["raised starved", "suppressed empty"]
    board.say(trip=True)
    board.say(trip=False)
    board.to(45)
    board.say(starved=False)  # in time
    assert board.to(70) == []


def test_a_cause_out_of_service_suppresses_nothing_a_shelved_one_does() -> None:
    board = Board(trip={}, jam={"suppressed_by": ["trip"]})
    board.say(trip=True, jam=True)
    board.do("shelve", "trip")
    assert board.states() == {"trip": "SHELVED", "jam": "SUPPRESSED"}
    board.do("remove_from_service", "trip")
    assert board.states() == {"trip": "OUT_OF_SERVICE", "jam": "UNACKNOWLEDGED"}


def test_the_first_of_a_group_is_marked_until_all_of_it_is_normal() -> None:
    board = Board(a={"group": "g"}, b={"group": "g", "latching": True}, c={"group": "h"}, d={})
    board.say(d=True)
    board.say(b=True)
    board.say(a=True, c=True)
    assert board.alarms.first == {"g": "b", "h": "c"}
    assert list(board.alarms.columns().first_out) == [False, True, True, False]
    board.say(b=False)
    board.do("acknowledge", "b", "a")
    board.do("reset", "b")
    assert board.alarms.first == {"g": "b", "h": "c"}  # a stands yet; b was what began it
    board.say(a=False)
    assert board.alarms.first == {"h": "c"}
    board.say(a=True)
    assert board.alarms.first == {"h": "c", "g": "a"}


def test_of_those_that_come_together_the_most_urgent_is_first() -> None:
    board = Board(a={"group": "g"}, b={"group": "g", "priority": 501}, c={"group": "g", "alarm_class": "message"})
    board.say(c=True, a=True, b=True)
    assert board.alarms.first == {"g": "b"}


def test_one_that_is_hidden_is_not_the_first() -> None:
    board = Board(a={"group": "g"}, b={"group": "g"})
    board.do("shelve", "a")
    board.say(a=True)
    board.say(b=True)
    assert board.alarms.first == {"g": "b"}


def test_counts() -> None:
    board = Board(
        a={"alarm_class": "error"}, b={"alarm_class": "error", "latching": True}, c={}, d={"alarm_class": "message"}
    )
    assert board.alarms.counts() == (0, 0, 0, 0, 0)
    board.declare(e={"group": "g"})
    board.say(a=True, b=True, c=True, d=True, e=True)
    assert board.alarms.counts() == (2, 2, 1, 5, 5)  # the fifth is the first of its group
    board.say(a=False, b=False, c=False, e=False)
    assert board.alarms.counts() == (1, 0, 1, 5, 5)  # b is latched; all wait to be acknowledged
    board.do("acknowledge")
    assert board.alarms.counts() == (1, 0, 1, 0, 0)
    board.do("shelve", "d")
    assert board.alarms.counts() == (1, 0, 0, 0, 0)


def test_an_alarm_to_which_nothing_happens_is_not_looked_at() -> None:
    board = Board(a={"on_delay": 1.0})
    board.alarms.changed = False
    board.to(100)
    assert not board.alarms.changed


def test_the_same_declaration_again_changes_nothing_another_one_holds_from_then_on() -> None:
    board = Board(jam={"text": "jam", "latching": True})
    board.say(jam=True)
    board.alarms.changed = False
    assert board.declare(jam={"text": "jam", "latching": True}) == "" and not board.alarms.changed
    assert board.declare(jam={"text": "a jam"}) == "" and board.alarms.changed
    assert board.alarms["jam"].text == "a jam"
    assert board.say(jam=False) == ["cleared jam"]


def test_one_that_is_declared_after_it_was_said_keeps_its_state() -> None:
    board = Board()
    assert board.say(jam=True) == ["raised jam"]
    board.declare(jam={"group": "g", "alarm_class": "error"})
    assert board.states() == {"jam": "UNACKNOWLEDGED"}
    assert board.alarms.first == {"g": "jam"}
    assert board.alarms.columns().declared_by == ["plc"]


@pytest.mark.parametrize(
    ("declared", "problem"),
    [
        (
            {"a": {"suppressed_by": ["b"]}},
            r"alarm a: suppressed_by: b given, expected an alarm that is declared before",
        ),
        ({"a": {"suppressed_by": ["tripp"]}}, "together with it, such as trip$"),
        ({"a": {"suppressed_by": ["a"]}}, "suppressed_by: a by a given, expected no alarm that suppresses itself"),
        (
            {"a": {"suppressed_by": ["b"]}, "b": {"suppressed_by": ["c"]}, "c": {"suppressed_by": ["a"]}},
            "suppressed_by: . by . by . by . given",
        ),
        ({"trip": {}}, "alarm trip: id: is declared by the line, expected another id"),
        (
            {"a": {"tag": "zone/table/bottles", "high": 3}},
            "alarm a: tag: zone/table/bottles given, expected a signal of a device, such as zones/table/bottles",
        ),
    ],
)
def test_a_declaration_is_refused_whole(declared: dict[str, dict[str, object]], problem: str) -> None:
    board = Board()
    board.declare(own=True, trip={})
    assert re.search(problem, board.declare(**{"good": {}, **declared}))
    assert board.states() == {"trip": "NORMAL"}


def test_only_so_many() -> None:
    board = Board()
    board.declare(own=True, trip={})
    many = {f"a{n}": True for n in range(MOST_ALARMS)}
    assert board.alarms.room_problem(many) == ""
    board.say(**many)
    assert missing(board.alarms.room_problem({"one more": True}), "1 alarm", f"expected {MOST_ALARMS}") == []
    board.say(**{"one more": True})
    assert len(board.alarms) == 1 + MOST_ALARMS and "one more" not in board.alarms
    assert missing(board.declare(b={}), "alarm b", "1 alarm", f"expected {MOST_ALARMS}") == []
    # In place of one that goes at the same time, and one that is there already, there is room.
    assert board.alarms.room_problem({"a0": False, "one more": True}) == ""
    assert board.declare(a7={"text": "seven"}) == ""
    board.say(a0=False)
    assert board.say(**{"one more": True}) == ["raised one more"]
    assert "a0" not in board.alarms  # returned, but forgotten: nobody declared it
    assert board.alarms.numbered == MOST_ALARMS + 2


def test_more_alarms_at_once_than_there_can_be() -> None:
    """Alarms that hold come first, at any place in the message. Others are taken as long as there is room."""
    board = Board()
    said = {f"a{n}": n >= MOST_ALARMS + 400 for n in range(MOST_ALARMS + 500)}
    assert board.alarms.room_problem(said) == ""
    board.say(**said)
    assert len(board.alarms) == MOST_ALARMS and {id for id in said if id in board.alarms} >= {
        id for id, on in said.items() if on
    }
    assert board.alarms.counts()[1] == 100
    board.say(**dict.fromkeys(said, False))
    assert len(board.alarms) == MOST_ALARMS and board.alarms.counts()[1] == 0
    board.say(**{f"b{n}": True for n in range(MOST_ALARMS + 1)})  # of which the line refuses the message
    assert len(board.alarms) == MOST_ALARMS and f"b{MOST_ALARMS}" not in board.alarms


def test_one_that_others_follow_from_is_not_forgotten() -> None:
    board = Board()
    board.say(cause=False)
    board.declare(effect={"suppressed_by": ["cause"]})
    board.say(**{f"a{n}": True for n in range(MOST_ALARMS)})
    assert "cause" in board.alarms and f"a{MOST_ALARMS - 2}" not in board.alarms


def test_operations_are_refused_with_what_was_expected() -> None:
    board = Board(jam={}, full={})
    assert missing(board.do("acknowledge", "jamm"), "jamm", "jam, full") == []
    assert missing(board.do("acknowledge", "jam"), "jam", "normal", "acknowledged") == []
    board.say(jam=True)
    assert board.do("acknowledge", "jam", "alarms/jam") == "jam: given twice"
    assert board.do("acknowledge", "jam", values=(1.0,)) == "1 values given, expected none"
    assert missing(board.do("shelve"), "name", "id of an alarm") == []
    assert missing(board.do("shelve", "jam", values=(1.0, 2.0)), "2 values", "(1)", "none") == []
    nan = float("nan")
    for value, shown in ((-1.0, "-1"), (1e9, "1e+09"), (nan, "nan")):
        expected = f"{shown} given, expected a shelving time of 0 to 86400 s"
        assert board.do("shelve", "jam", values=(value,)) == expected
    assert board.states() == {"jam": "UNACKNOWLEDGED", "full": "NORMAL"}


def test_without_names_all_are_meant_that_it_can_be_done_to() -> None:
    board = Board(a={}, b={"latching": True}, c={})
    board.say(a=True, b=True)
    board.say(b=False)
    assert board.do("acknowledge") == ""
    assert board.states() == {"a": "ACKNOWLEDGED", "b": "LATCHED_ACKNOWLEDGED", "c": "NORMAL"}
    assert board.do("reset") == "" and board.do("reset") == ""
    assert board.states() == {"a": "ACKNOWLEDGED", "b": "NORMAL", "c": "NORMAL"}
