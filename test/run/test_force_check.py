# SPDX-License-Identifier: Apache-2.0
"""Forces of a run compared with the expected forces."""

import math
from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner
from facts import missing
from scenes import MASS, NO_FLOOR, PEAKS, RADIUS, base, belt, bottle, contact, kind, scene, segment, simulation

from conveyor_sim.cli import main
from conveyor_sim.physics.model import build_model
from conveyor_sim.physics.timestep.prediction import DEEP, percent
from conveyor_sim.run.force_check import ForceCheck, PeakWatch, achieved, pressed

K = 5e3
TWO: dict[str, Any] = {"contacts": [contact(K)], "bottles": [bottle(0.0, 0.0, 1.0), bottle(1.0, 0.0)], **NO_FLOOR}
PEAK = math.sqrt(K * MASS / 2)
"""N, of the two head on at 1 m/s."""


def reached(peak_force: float, **fields: Any) -> ForceCheck:
    found = achieved(build_model(scene(**{**TWO, **fields})), peak_force)
    assert found is not None
    return found


def test_the_force_of_the_fastest_impact_is_expected() -> None:
    """And a little more, for damping adds to it."""
    assert reached(PEAK).as_expected
    assert reached(1.04 * PEAK).as_expected
    assert not reached(1.06 * PEAK).as_expected


def test_the_sentence_says_what_was_exceeded() -> None:
    facts = ["peak force 22.4 N", "within", "predicted error", "impact of two bottles", "k = 5000 N/m", "1 m/s"]
    assert missing(reached(PEAK).sentence, [*facts, "overlap", "3.4 %", "smaller diameter"]) == []
    assert missing(reached(2 * PEAK).sentence, ["peak force 44.7 N", "more than", "22.4 N", "predicted error"]) == []


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
    both = [bottle(0.0, 0.0, 1.0), bottle(1.0, 0.0, type="small")]
    assert reached(10.0, bottle_types=types, bottles=both).overlap == pytest.approx(10.0 / K / 0.06)


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


def test_what_presses_for_long_is_half_of_the_forces_on_a_bottle() -> None:
    """Five in a queue against a stop, each dragged by mu m g: the first has 5 of the stop and 4 of the next."""
    places = [bottle(-2.0 * RADIUS * n, 0.0) for n in range(5)]
    sim = simulation(
        contacts=[contact(5e3, damping=("normal", 5.0), friction=0.1), contact(5e3, "steel", ("normal", 5.0), 0.1)],
        base=base(0.4), belts={"table": belt(0.2)}, rails={"stop": segment((RADIUS, -0.2), (RADIUS, 0.2))},
        bottles=places, outputs={"bottles": 50},
    )  # fmt: skip
    watch = PeakWatch(sim)
    for _ in range(500):
        sim.advance()
        watch.after_tick()
    drag = 0.4 * MASS * 9.81
    assert watch.load == pytest.approx(4.5 * drag, rel=0.01)
    found = pressed(sim.model, watch.load)
    assert found is not None and found.as_expected
    facts = ["1 s", f"{watch.load:.3g} N", "within", f"{15 * drag:.3g} N", "friction", "stable", "all 5 bottles"]
    assert missing(found.sentence, facts) == []
    harder = pressed(sim.model, 16 * drag)
    assert harder is not None
    facts = ["all 5 bottles", "friction", "chatter", "friction_solver: implicit", "more steps a tick"]
    assert missing(harder.sentence, facts) == []


def test_where_no_bound_rests_on_it_no_load_is_told() -> None:
    assert pressed(build_model(scene(**TWO)), 1.0) is None


@pytest.mark.parametrize(("share", "warned"), [(0.5, False), (1.0, False), (1.01, True), (10.0, True)])
def test_an_overlap_beyond_the_studied_limit_is_warned_of(share: float, warned: bool) -> None:
    force = share * DEEP * 2.0 * RADIUS * K
    check = reached(force * (1.0 - 1e-9))
    assert check.overlap == pytest.approx(share * DEEP)
    assert bool(check.deep_warning) == warned
    if warned:
        facts = [f"{force:.3g} N", percent(check.overlap), percent(DEEP), "throughput", "docs/accuracy.md"]
        assert missing(check.deep_warning, facts) == []


@pytest.mark.parametrize("stiffness", [K, 1e7])
def test_run_and_check_warn_of_deep_overlaps(stiffness: float, tmp_path: Path) -> None:
    """At 1 m/s two bottles of 0.2 kg overlap by 3.4 % of their diameter at 5 kN/m, by 0.08 % at 10 MN/m."""
    near = [bottle(0.0, 0.0, 1.0), bottle(2.0 * RADIUS + 0.01, 0.0)]
    fields = {**TWO, **PEAKS, "contacts": [contact(stiffness)], "bottles": near, "duration": 0.1}
    file = tmp_path / "two.yaml"
    file.write_text(scene(**fields, outputs={"bottles": 100}).source_text)
    arguments = (
        ["check", "--out", tmp_path],
        ["run", "--no-record"],
        ["run", "--no-pictures", "--out", tmp_path / "bag"],
    )
    for command, *options in arguments:
        result = CliRunner().invoke(main, [str(command), str(file), *map(str, options)])
        assert result.exit_code == 0, result.output
        warnings = [line for line in result.output.splitlines() if line.startswith("warning") and "overlap" in line]
        assert [missing(line, ["3.4 %", percent(DEEP)]) for line in warnings] == ([[]] if stiffness == K else [])
