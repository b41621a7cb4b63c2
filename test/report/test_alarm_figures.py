# SPDX-License-Identifier: Apache-2.0
"""Figures of the alarms of a run."""

import numpy as np
from facts import missing

from conveyor_sim.columns.alarms import AlarmColumns
from conveyor_sim.report.alarm_figures import AlarmTally


def tally(times: list[float]) -> AlarmTally:
    counted = AlarmTally()
    for time in times:
        counted.event(time, "alarm_raised", "alarms/jam")
        counted.event(time + 1.0, "alarm_cleared", "alarms/jam")
    return counted


def test_rates_are_for_ten_minutes_and_the_worst_ten_minutes_are_found() -> None:
    figures = tally([10.0, 20.0, 615.0, 619.0, 1190.0]).figures(1200.0, 0.01)
    assert (figures.raised, figures.per_window) == (5, 2.5)
    assert figures.most_in_window == 3  # 20 to 619 s, and 615 to 1190 s; that of 10 s is more than ten minutes before
    assert figures.by_alarm == {"jam": 5}
    assert not figures.flood and figures.lines == ["5 raised: 5 x jam"]


def test_more_than_ten_are_a_flood() -> None:
    assert not tally([float(n) for n in range(10)]).figures(60.0, 0.01).flood
    flood = tally([float(n) for n in range(11)]).figures(60.0, 0.01)
    assert flood.flood
    assert missing(flood.lines[0], ["11 x jam", "flood", "11 in ten minutes"]) == []


def test_none() -> None:
    figures = AlarmTally().figures(0.0, 0.01)
    assert (figures.raised, figures.per_window, figures.most_in_window, figures.any) == (0, 0.0, 0, False)


def test_what_stands_is_listed_by_priority_then_by_age() -> None:
    ids, states = ["old", "new", "urgent", "normal", "shelved"], [2, 1, 4, 0, 6]
    counted = AlarmTally()
    counted.states = AlarmColumns(
        number=np.arange(1, 6, dtype=np.uint64),
        id=ids,
        text=[f"{id}!" for id in ids],
        alarm_class=["warning"] * 5,
        priority=np.array([500, 500, 800, 900, 900], dtype=np.uint16),
        tag=[""] * 5,
        group=[""] * 5,
        suppressed_by=[()] * 5,
        latching=np.zeros(5, dtype=np.bool_),
        declared_by=[""] * 5,
        state=np.array(states, dtype=np.uint8),
        active=np.ones(5, dtype=np.bool_),
        first_out=np.zeros(5, dtype=np.bool_),
        shelved_until=np.full(5, -1),
        since=np.array([100, 200, 300, 0, 50], dtype=np.uint64),
        changed_by=[""] * 5,
    )
    figures = counted.figures(10.0, 0.01)
    assert [(one.id, one.since) for one in figures.standing] == [("urgent", 3.0), ("old", 1.0), ("new", 2.0)]
    assert [one.text for one in figures.hidden] == ["shelved!"]
    (active,) = figures.lines
    assert active.endswith(": urgent since 3 s, old since 1 s, new since 2 s")
