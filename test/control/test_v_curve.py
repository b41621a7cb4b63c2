# SPDX-License-Identifier: Apache-2.0
"""V-curve around a filler: one machine before it, two behind."""

from __future__ import annotations

import pytest
from control.scans import Scans
from facts import stating

from conveyor_sim.control import ControlError
from conveyor_sim.control.level import Count, Eyes
from conveyor_sim.control.v_curve import Neighbour, VCurve

FILLER, WASHER, LABELLER, PACKER = (f"machines/{name}/rate" for name in ("filler", "washer", "labeller", "packer"))


def neighbour(command: str, table: str) -> Neighbour:
    return Neighbour(command, Count(f"zones/{table}/bottles"), low=100, target=200, high=300)


def curve() -> Scans:
    machines = (neighbour(LABELLER, "one"), neighbour(PACKER, "two"))
    controller = VCurve(FILLER, 10.0, 0.1, (neighbour(WASHER, "before"),), machines)
    return Scans(controller, **{f"zones/{name}/bottles": 200.0 for name in ("before", "one", "two")})


def test_with_all_buffers_at_their_level_all_run_alike() -> None:
    assert curve().scan({}) == {FILLER: 10.0, WASHER: 10.0, LABELLER: 10.0, PACKER: 10.0}


@pytest.mark.parametrize(
    ("table", "bottles", "washer", "labeller", "packer"),
    [
        ("before", 100, 11.0, 10.0, 10.0),  # short before the filler: refill
        ("before", 300, 9.0, 10.0, 10.0),
        ("one", 300, 10.0, 11.0, 11.0),  # over behind it: empty; the next one follows
        ("one", 100, 10.0, 9.0, 9.0),
        ("two", 300, 10.0, 10.0, 12.0),  # two steps away
        ("two", 100, 10.0, 10.0, 8.0),
        ("two", 299, 10.0, 10.0, 10.0),
    ],
)
def test_the_further_away_the_faster(table: str, bottles: float, washer: float, labeller: float, packer: float) -> None:
    answer = curve().scan({f"zones/{table}/bottles": bottles})
    assert [answer[name] for name in (FILLER, WASHER, LABELLER, PACKER)] == pytest.approx(
        [10, washer, labeller, packer]
    )


def test_the_rate_of_a_panel_applies_to_all() -> None:
    curve = VCurve(FILLER, "panel/rate/value", 0.1, (neighbour(WASHER, "before"),), (neighbour(LABELLER, "one"),))
    scans = Scans(curve, **{"zones/before/bottles": 100.0, "zones/one/bottles": 200.0})
    for per_hour, rate in ((36_000.0, 10.0), (18_000.0, 5.0)):
        expected = {FILLER: rate, WASHER: 1.1 * rate, LABELLER: rate}
        assert scans.scan({"panel/rate/value": per_hour}) == pytest.approx(expected)


def test_a_surplus_is_worked_off_down_to_the_target() -> None:
    scans = curve()
    rows = ((300, 11.0), (250, 11.0), (201, 11.0), (200, 10.0), (250, 10.0), (100, 9.0), (199, 9.0), (200, 10.0))
    for bottles, rate in rows:
        assert scans.scan({"zones/one/bottles": bottles})[LABELLER] == pytest.approx(rate)


def test_a_buffer_is_back_at_its_level_in_surplus_over_rate_difference() -> None:
    scans, bottles, time = curve(), 200.0 + 10.0 * 60.0, 0.0
    while bottles > 200.0:
        taken = scans.scan({"zones/one/bottles": bottles})[LABELLER]
        bottles += 0.01 * (10.0 - taken)
        time += 0.01
    assert time == pytest.approx(600.0 / 1.0, rel=1e-3)


def test_two_back_up_eyes_tell_short_at_level_and_over() -> None:
    machine = Neighbour(LABELLER, Eyes(("low", "high"), on=0.5, off=0.5), low=0, target=1, high=2)
    low, high = "photo_eyes/low/blocked", "photo_eyes/high/blocked"
    scans = Scans(VCurve(FILLER, 10.0, 0.1, downstream=(machine,)), **{low: 0.0, high: 0.0})
    rows = [(1.0, {}), (1.0, {low: 1}), (0.4, {high: 1}), (0.2, {}), (1.0, {high: 0}), (0.4, {low: 0}), (0.2, {})]
    assert [answer[LABELLER] for answer in scans.table(rows)] == pytest.approx([9, 10, 10, 11, 10, 10, 9])


@pytest.mark.parametrize("margin", [0.0, 0.5])
def test_a_margin_that_would_stop_a_machine_is_refused(margin: float) -> None:
    machines = (neighbour(LABELLER, "one"), neighbour(PACKER, "two"))
    with pytest.raises(ControlError, match=stating("margin", f"{margin:g}", "more than 0", "less than 0.5")):
        VCurve(FILLER, 10.0, margin, downstream=machines)


def test_levels_in_the_wrong_order_are_refused() -> None:
    with pytest.raises(ControlError, match=stating("low, target, high", "2, 1 and 3")):
        Neighbour(LABELLER, Count("zones/one/bottles"), 2, 1, 3)
