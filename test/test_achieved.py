"""What a run reached beside what was expected of it."""

import math
from typing import Any

import pytest
from scenes import MASS, NO_FLOOR, PEAKS, RADIUS, bottle, contact, kind, scene, simulation

from conveyor_sim.achieved import Achieved, PeakWatch, achieved
from conveyor_sim.model import build_model

K = 5e3
TWO: dict[str, Any] = {"contacts": [contact(K)], "bottles": [bottle(0.0, 0.0, 1.0), bottle(1.0, 0.0)], **NO_FLOOR}
PEAK = math.sqrt(K * MASS / 2)
"""N, of the two head on at 1 m/s."""


def reached(peak_force: float, **fields: Any) -> Achieved:
    found = achieved(build_model(scene(**{**TWO, **fields})), peak_force)
    assert found is not None
    return found


def test_the_force_of_the_fastest_impact_is_expected() -> None:
    """And a little more, for damping adds to it."""
    assert reached(PEAK).as_expected
    assert reached(1.04 * PEAK).as_expected
    assert not reached(1.06 * PEAK).as_expected


def test_the_sentence_says_what_was_exceeded() -> None:
    assert reached(PEAK).sentence == (
        "peak force 22.4 N, within the 22.4 N that the predicted error rests on "
        "(an impact of two bottles at k = 5000 N/m and 1 m/s); overlap at most 3.4 % of the smaller diameter"
    )
    assert "peak force 44.7 N, more than the 22.4 N that the predicted error rests on" in reached(2 * PEAK).sentence


@pytest.mark.parametrize(
    ("law", "overlap"),
    [
        ({"stiffness": K}, 10.0 / K),
        ({"hertz_stiffness": 1e7}, (10.0 / 1e7) ** (2 / 3)),
        ({"table": [[1e-3, 5.0], [2e-3, 15.0], [3e-3, 16.0]]}, 1.5e-3),
        ({"table": [[1e-3, 5.0], [2e-3, 8.0]]}, 2e-3 + 1e-3 * 2.0 / 3.0),
        ({"table": [[1e-3, 5.0], [2e-3, 5.0]]}, math.inf),
    ],
    ids=["linear", "Hertz", "table", "beyond the table", "beyond a level end"],
)
def test_the_overlap_follows_from_the_force(law: dict[str, Any], overlap: float) -> None:
    found = reached(10.0, contacts=[{"between": ["glass", "glass"], **law}])
    assert found.overlap == pytest.approx(overlap / (2.0 * RADIUS))


def test_the_overlap_is_that_of_the_softest_contact_and_the_smaller_bottle() -> None:
    types = {"bottle": kind(), "small": kind(0.03, 0.2)}
    assert reached(10.0, bottle_types=types).overlap == pytest.approx(10.0 / K / 0.06)


def test_where_nothing_touches_nothing_is_said() -> None:
    alone = build_model(scene(bottles=[bottle(0.0, 0.0)], **NO_FLOOR))
    assert achieved(alone, 0.0) is None
    assert achieved(build_model(scene(**TWO)), None) is None


def test_the_largest_force_of_a_run_outlives_the_outputs() -> None:
    """Peaks begin anew after each output of bottles; the watch remembers."""
    fields = {**TWO, "bottles": [bottle(0.0, 0.0, 1.0), bottle(2.0 * RADIUS + 0.01, 0.0)], "outputs": {"bottles": 100}}
    sim = simulation(**fields, accuracy="fine")
    watch = PeakWatch(sim)
    for _ in range(10):
        sim.advance()
        watch.after_tick()
    assert sim.peak_force == 0.0
    assert watch.force == pytest.approx(PEAK, rel=1e-3)


def test_without_peaks_the_largest_force_is_not_known() -> None:
    sim = simulation(**TWO)
    assert sim.peak_force is None
    assert PeakWatch(sim).force is None
    assert simulation(**TWO, **PEAKS).peak_force == 0.0
