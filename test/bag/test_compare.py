# SPDX-License-Identifier: Apache-2.0
"""First difference of two messages."""

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from bag.hand_made import HEADER, bottles, contacts
from facts import missing

from conveyor_sim.bag.compare import ReplayDifference, first_difference, outcome_difference
from conveyor_sim.bag.messages import encode
from conveyor_sim.bag.messages.encode import Outcome
from conveyor_sim.bag.messages.topics import TOPICS
from conveyor_sim.bag.messages.typestore import typestore
from conveyor_sim.columns.bottles import BottleColumns, ContactColumns
from conveyor_sim.line.commands.inputs import CommandOutcome, Input


class Line:
    """The part of a Line that names things."""

    tick_ns = 10_000_000
    belts = ("one", "two")
    rails = ("left", "right", "a", "b", "c", "stop", "end")
    signal_names = ("belts/one/speed",)


def of_bottles(columns: BottleColumns, header: encode.Header = HEADER) -> Any:
    """A decoded Bottles."""
    return typestore().deserialize_cdr(TOPICS["bottles"].pack(columns, header), TOPICS["bottles"].type)


def of_contacts(columns: ContactColumns) -> Any:
    """A decoded Contacts."""
    return typestore().deserialize_cdr(TOPICS["contacts"].pack(columns, HEADER), TOPICS["contacts"].type)


def compare_x(then: float, now: float, *, exact: bool) -> ReplayDifference | None:
    """Two Bottles that differ in x of bottle 2 only."""
    x = bottles(4).x.copy()
    one, two = x.copy(), x.copy()
    one[2], two[2] = then, now
    recorded, replayed = replace(bottles(4), x=one), replace(bottles(4), x=two)
    return first_difference("bottles", Line, of_bottles(recorded), of_bottles(replayed), exact=exact)


def test_equal_messages_have_no_difference() -> None:
    assert first_difference("bottles", Line, of_bottles(bottles(3)), of_bottles(bottles(3)), exact=True) is None


def test_last_bit_is_a_difference_that_names_bottle_field_and_values() -> None:
    found = compare_x(1.0, math.nextafter(1.0, 2.0), exact=True)
    assert found == ReplayDifference(
        tick=1234,
        time=1234 * 10_000_000 * 1e-9,
        topic="bottles",
        field="x",
        recorded="1.0",
        replayed="1.0000000000000002",
        bottle=2**60 + 2,
        part=f"bottle {2**60 + 2}",
    )
    assert missing(str(found), "1234", "12.34", "bottles", " x ", str(2**60 + 2), " 1.0 ", "1.0000000000000002") == []


@pytest.mark.parametrize(("then", "now"), [(0.0, -0.0), (math.nan, 1.0)])
def test_bits_count_not_values(then: float, now: float) -> None:
    assert compare_x(then, now, exact=True) is not None


def test_the_same_nan_is_equal() -> None:
    assert compare_x(math.nan, math.nan, exact=True) is None


def test_tolerance_lets_rounding_pass_and_nothing_else() -> None:
    assert compare_x(1.0, 1.0 + 1e-7, exact=False) is None
    assert compare_x(1.0, 1.0 + 1e-5, exact=False) is not None
    assert compare_x(math.nan, 1.0, exact=False) is not None


def test_a_bottle_more_is_a_difference() -> None:
    found = first_difference("bottles", Line, of_bottles(bottles(3)), of_bottles(bottles(4)), exact=True)
    assert found is not None
    assert (found.field, found.recorded, found.replayed) == ("the number of entries (id)", "3", "4")


def test_another_stamp_is_a_difference() -> None:
    other = of_bottles(bottles(1), replace(HEADER, stamp_ns=HEADER.stamp_ns + 1))
    found = first_difference("bottles", Line, other, of_bottles(bottles(1)), exact=True)
    assert found is not None
    assert (found.field, found.recorded, found.replayed) == ("header.stamp", "12.340000008 s", "12.340000007 s")


def test_another_tick_is_a_difference() -> None:
    other = of_bottles(bottles(1), replace(HEADER, tick=7))
    found = first_difference("bottles", Line, other, of_bottles(bottles(1)), exact=False)
    assert found is not None
    assert (found.field, found.recorded, found.tick) == ("tick", "7", 1234)


def test_contact_is_named_by_its_bottles_or_rail() -> None:
    columns = contacts(2)
    for entry, name in ((0, "the contact of bottles 0 and 5"), (1, "the contact of bottle 1 and rail end")):
        force = columns.normal_force.copy()
        force[entry] += 1.0
        other = of_contacts(replace(columns, normal_force=force))
        found = first_difference("contacts", Line, other, of_contacts(columns), exact=True)
        assert found is not None
        assert (found.field, found.part, found.bottle) == ("normal_force", name, entry)


GIVEN = Input("commands", "plc", "controller", "set", ("belts/one/cmd_speed",), (math.nan,))
OUTCOME = Outcome.of(CommandOutcome(5, GIVEN, False, "not a number"))


def test_equal_outcomes_have_no_difference_even_with_nan() -> None:
    assert outcome_difference(5, 0.05, [OUTCOME], [replace(OUTCOME, values=(math.nan,))], exact=True) is None


def test_another_outcome_is_a_difference() -> None:
    found = outcome_difference(5, 0.05, [OUTCOME], [replace(OUTCOME, accepted=True)], exact=False)
    assert found is not None
    assert (found.tick, found.topic, found.field) == (5, "outcomes", "accepted")


def test_missing_outcome_is_a_difference() -> None:
    found = outcome_difference(5, 0.05, [OUTCOME], [], exact=False)
    assert found is not None
    assert (found.recorded, found.replayed) == ("1", "0")


def test_arrays_of_integers_are_compared_exactly_within_the_tolerance() -> None:
    columns = bottles(3)
    other = replace(columns, belt=columns.belt + np.int32(1))
    found = first_difference("bottles", Line, of_bottles(other), of_bottles(columns), exact=False)
    assert found is not None
    assert found.field == "belt"


def test_reasons_are_compared_between_equal_versions_only() -> None:
    reworded = [replace(OUTCOME, reason="other words")]
    assert outcome_difference(5, 0.05, [OUTCOME], reworded, exact=False) is None
    found = outcome_difference(5, 0.05, [OUTCOME], reworded, exact=True)
    assert found is not None and (found.field, found.replayed) == ("reason", "other words")
