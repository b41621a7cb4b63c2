# SPDX-License-Identifier: Apache-2.0
"""Declarations of alarms in inputs."""

import json
import re

import pytest

from conveyor_sim.line.alarms.declaration import LONGEST_TEXT, Declared, as_text, parse
from conveyor_sim.scene.parts.alarm import AlarmFields

FULL = AlarmFields(
    text="Störung",
    alarm_class="error",
    priority=900,
    tag="zones/table/bottles",
    high=40.0,
    low=1.0,
    deadband=2.0,
    on_delay=0.5,
    off_delay=1.5,
    latching=True,
    suppressed_by=["trip", "belts/feeder/trip"],
    group="table",
)


@pytest.mark.parametrize("fields", [AlarmFields(), FULL])
def test_what_is_written_is_read(fields: AlarmFields) -> None:
    assert parse(["table full"], [as_text(fields)]) == [Declared("table full", fields)]


def test_what_is_left_out_is_as_by_default() -> None:
    assert as_text(AlarmFields()) == "{}"
    fields = parse(["a"], ["{}"])[0].fields  # type: ignore[union-attr]
    assert (fields.severity, fields.alarm_class, fields.latching, fields.measured) == (500, "warning", False, False)
    assert [AlarmFields(alarm_class=kind).severity for kind in ("error", "warning", "message")] == [800, 500, 200]  # type: ignore[arg-type]


def test_a_long_text_is_cut_and_escaped() -> None:
    (declared,) = parse(["a"], [json.dumps({"text": "jam\n" * 100})])
    assert len(declared.fields.text) == 200 and declared.fields.text.startswith("jam\\njam\\n")  # type: ignore[union-attr]


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        ("{", "alarm a: { given, expected a JSON object"),
        ("[" * 5000, r"alarm a: \[\[.* given, expected a JSON object"),
        ("[1]", r"alarm a: \[1\] given, expected a mapping with the fields text, alarm_class"),
        ('{"texts": "x"}', "alarm a: texts: no such field, did you mean text?"),
        ('{"alarm_class": "fatal"}', 'alarm a: alarm_class: "fatal" given, expected "error", "warning" or "message"'),
        ('{"priority": 1001}', "alarm a: priority: 1001 given, expected a whole number from 1 to 1000"),
        ('{"priority": 1.5}', "alarm a: priority: 1.5 given, expected a whole number from 1 to 1000"),
        ('{"high": NaN, "tag": "x"}', r"alarm a: high: \.nan given, expected a number"),
        ('{"high": 1}', "alarm a: tag: missing, expected the name of a signal, as `high` or `low` is given"),
        ('{"deadband": 1}', "alarm a: deadband: 1 given, expected `high` or `low` beside it"),
        ('{"tag": "x", "high": 5, "low": 4, "deadband": 1}', "alarm a: low: 4 given, expected .*: 3 at most"),
        ('{"on_delay": -1}', r"alarm a: on_delay: -1 given, expected a number from 0 to 86400 \(s\)"),
        ('{"latching": 1}', "alarm a: latching: 1 given, expected true or false"),
        ('{"suppressed_by": "b"}', 'alarm a: suppressed_by: "b" given, expected a list of at most 100 ids of alarms'),
        ('{"suppressed_by": [""]}', r'alarm a: suppressed_by\[0\]: "" given, expected an id of 1 to 100 printable'),
        (json.dumps({"text": "x" * LONGEST_TEXT}), f"characters given, expected {LONGEST_TEXT} at most"),
    ],
)
def test_what_can_not_be_is_said_in_one_sentence(text: str, problem: str) -> None:
    found = parse(["a"], [text])
    assert isinstance(found, str) and re.search(problem, found) and "\n" not in found and len(found) < 2100


@pytest.mark.parametrize(
    ("ids", "texts", "problem"),
    [
        ([], [], "0 ids and 0 declarations of alarms given"),
        (["a"], [], "1 ids and 0 declarations of alarms given"),
        (["a", "a"], ["{}", "{}"], "alarm a: declared twice in one input"),
        *(
            ([id], ["{}"], "expected an id of 1 to 100 printable characters, without `alarms/` before it")
            for id in ("", " a", "a\n", "x" * 101, "alarms/a")
        ),
    ],
)
def test_so_is_what_is_no_id(ids: list[str], texts: list[str], problem: str) -> None:
    found = parse(ids, texts)
    assert isinstance(found, str) and problem in found
