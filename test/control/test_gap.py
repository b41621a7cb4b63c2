# SPDX-License-Identifier: Apache-2.0
"""Gap control: bottles from a metering belt onto a faster one, by kinematics."""

from __future__ import annotations

from itertools import pairwise

import pytest
from control.scans import LENGTH, Beam, Scans, edges_of

from conveyor_sim.control import ControlError
from conveyor_sim.control.gap import GapControl

DIAMETER, GAP, DISCHARGE, EYE_AT = 0.06, 0.09, 0.6, 0.05  # m, m, m/s, m behind the transfer


def control(gain: float, **others: float) -> GapControl:
    return GapControl("meter", "out", "eye", GAP, DIAMETER, lowest=0.05, highest=0.5, gain=gain, **others)


def gaps(controller: GapControl, pitches: list[float]) -> list[float]:
    """Return the gaps behind the transfer of bottles that arrive with these pitches (m)."""
    scans, beam = Scans(controller), Beam("eye")
    due, fronts, metered = 0.0, list[float](), 0.0
    for tick in range(1, 100_000):
        signals = {"belts/out/speed": DISCHARGE, **beam.signals()}
        speed = scans.scan(signals)["belts/meter/cmd_speed"]
        time, before = tick * LENGTH, metered
        metered += speed * LENGTH
        while len(fronts) < len(pitches) and due <= metered:
            left = time - LENGTH * (metered - due) / (metered - before)
            fronts.append(DISCHARGE * left + EYE_AT)
            due += pitches[len(fronts) - 1]
        travel = DISCHARGE * time
        beam.pass_by(edges_of(fronts, DIAMETER), travel - DISCHARGE * LENGTH, travel, time, LENGTH)
        if len(fronts) == len(pitches):
            break
    return [after - front - DIAMETER for front, after in pairwise(fronts)]


def test_bottles_nose_to_tail_come_out_with_the_wanted_gap() -> None:
    assert gaps(control(gain=0.0), [DIAMETER] * 20) == pytest.approx([GAP] * 19)


def test_what_comes_out_is_measured_and_corrected() -> None:
    loose = [1.1 * DIAMETER] * 40
    assert gaps(control(gain=0.0), loose)[-1] == pytest.approx(1.1 * (GAP + DIAMETER) - DIAMETER)
    controller = control(gain=0.3)
    corrected = gaps(controller, loose)
    assert corrected[0] == pytest.approx(1.1 * (GAP + DIAMETER) - DIAMETER)
    assert corrected[-5:] == pytest.approx([GAP] * 5, abs=1e-4)
    assert controller.measured == pytest.approx(GAP, abs=1e-4)


def test_a_gap_in_the_supply_corrects_nothing() -> None:
    supply = [DIAMETER] * 10 + [0.3] + [DIAMETER] * 10
    came = gaps(control(gain=0.3), supply)
    assert came[10] > 0.6
    assert came[:10] + came[11:] == pytest.approx([GAP] * 19)


def test_the_metering_belt_follows_the_discharge_belt_within_its_limits() -> None:
    signals = {"photo_eyes/eye/edges": 0.0, "photo_eyes/eye/blocked": 0.0, "photo_eyes/eye/rose": 0.0}
    scans = Scans(control(gain=0.3), **signals, **{"photo_eyes/eye/fell": 0.0})
    for discharge, metered in ((2.0, 0.5), (0.6, 0.24), (0.01, 0.05)):
        assert scans.scan({"belts/out/speed": discharge}) == {"belts/meter/cmd_speed": pytest.approx(metered)}


def test_a_gain_that_overshoots_is_refused() -> None:
    with pytest.raises(ControlError, match=r"gain: 1.5 given, expected 0 to 1"):
        control(gain=1.5)
