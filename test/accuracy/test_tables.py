# SPDX-License-Identifier: Apache-2.0
"""Tables say what the rows say, in numbers for people, in the terminal and in Markdown alike."""

from __future__ import annotations

import io
import math
from dataclasses import replace

import pytest
from accuracy.studies import BLOWN, CHOSEN, OWN, REFERENCE, failed, study
from facts import missing
from rich.console import Console

from conveyor_sim.accuracy.report.lines import three_lines
from conveyor_sim.accuracy.report.tables import Block, Column, blocks, markdown, terminal
from conveyor_sim.accuracy.report.words import digits, duration, percent, setting_name, spread
from conveyor_sim.accuracy.results import AccuracyStudy
from conveyor_sim.accuracy.setting import Setting


def printed(of: AccuracyStudy, width: int = 80) -> str:
    file = io.StringIO()
    Console(file=file, width=width).print(terminal(of))
    return file.getvalue()


def block(of: AccuracyStudy, title: str) -> Block:
    (found,) = [block for block in blocks(of) if block.title.startswith(title)]
    return found


def column(of: Block, heading: str) -> list[str]:
    index = of.headings.index(heading)
    return [row[index] for _, rows in of.groups for row in rows]


def nothing() -> AccuracyStudy:
    return replace(
        study(),
        orders=(),
        horizons=(),
        points=(),
        samples=(),
        comparisons=(),
        ensemble_reference=None,
        stiffness=(),
        skipped=(),
        answer=None,
    )


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (0.8123, "0.812"),
        (40.0, "40"),
        (0.0, "0"),
        (1234.5, "1230"),
        (99.96, "100"),
        (0.9996, "1"),
        (-0.25, "-0.25"),
        (0.000123456, "0.000123"),
        (1.23e-9, "1.2e-9"),
        (3.4e8, "3.4e8"),
        (math.inf, "-"),
        (math.nan, "-"),
        (None, "-"),
    ],
)
def test_numbers_have_three_digits(value: float | None, text: str) -> None:
    assert digits(value) == text


def test_numbers_have_units_that_fit() -> None:
    assert percent(0.00812) == "0.812 %"
    assert percent(1.5) == "150 %"
    assert percent(7.6e-17) == percent(-7.6e-17) == "0 %"
    assert percent(1e-11) == "1e-9 %"
    assert percent(None) == "-"
    assert [duration(seconds) for seconds in (4e-5, 2.5e-3, 1.0)] == ["40 us", "2.5 ms", "1 s"]


@pytest.mark.parametrize(
    ("mean", "error", "text"),
    [
        (6.02134, 0.0127, "6.021 +- 0.013"),
        (252.6, 0.849, "252.60 +- 0.85"),
        (12345.6, 234.5, "12350 +- 230"),
        (10.0, 0.0996, "10.00 +- 0.10"),
        (0.12674, 0.000106, "0.12674 +- 0.00011"),
        (3.2e-6, 1.25e-7, "3.2e-6 +- 1.2e-7"),
        (5.5, 0.0, "5.5"),
        (5.5, math.inf, "5.5"),
    ],
)
def test_a_mean_ends_where_its_error_does(mean: float, error: float, text: str) -> None:
    assert spread(mean, error) == text


def test_settings_are_called_as_scenes_spell_them() -> None:
    assert setting_name(CHOSEN, 0.01) == "velocity_verlet, 100 us"
    assert setting_name(REFERENCE, 0.01) == "dormand_prince, 10 us, 1e-12 m/s a step"
    assert setting_name(Setting("rk4", 50, 0.25), 0.01) == "rk4, 200 us, stiffness x 0.25"


def test_80_columns_are_enough_for_every_word() -> None:
    text = printed(study())
    assert max(map(len, text.splitlines())) <= 80
    assert "…" not in text
    words = set(text.split())
    for of in blocks(study()):
        for cell in [*of.headings, *(cell for _, rows in of.groups for row in rows for cell in row)]:
            assert set(cell.split()) <= words


def test_markdown_has_the_same_cells() -> None:
    text = markdown(study())
    for of in blocks(study()):
        start = text.index(f"### {of.title}\n")
        part = text[start : text.find("\n### ", start) if text.find("\n### ", start) > 0 else None]
        lines = [line for line in part.splitlines() if line.startswith("|")]
        found = [tuple(cell.strip("* ") for cell in line.strip("|").split("|")) for line in lines[2:]]
        expected = []
        for caption, rows in of.groups:
            expected += [(caption, *[""] * (len(of.headings) - 1))] if caption else []
            expected += [tuple(cell.strip() for cell in row) for row in rows]
        assert found == expected
        assert all(note in part for note in of.notes)


def test_work_is_sorted_by_cost_and_holds_all_that_did_not_fail() -> None:
    of = study()
    work = block(of, "Work and precision")
    costs = [float(cell) for cell in column(work, "cost\nms/s")]
    assert costs == sorted(costs)
    assert len(costs) == sum(not point.failure for point in of.points)


def test_the_settings_that_matter_are_marked() -> None:
    of = study()
    work = block(of, "Work and precision")
    rows = work.groups[0][1]
    (own,) = [row for row in rows if "the scene's own" in row[-1]]
    (chosen,) = [row for row in rows if "recommended" in row[-1]]
    assert (own[0], own[2]) == (OWN.integrator, str(OWN.per_tick))
    assert (chosen[0], chosen[2]) == (CHOSEN.integrator, str(CHOSEN.per_tick))
    assert work.strong == {chosen}
    (point,) = [point for point in of.points if point.setting == CHOSEN]
    assert point.cost is not None and point.errors is not None
    assert column(work, "x real\ntime")[rows.index(chosen)] == digits(1.0 / point.cost.median)
    assert column(work, "impacts\n%")[rows.index(chosen)] == digits(100.0 * point.errors.peak_force)
    assert point.resting is not None
    assert column(work, "resting\nload, %")[rows.index(chosen)] == digits(100.0 * point.resting)


def test_both_errors_stand_beside_their_predictions() -> None:
    of = study()
    both = block(of, "Impacts and resting load")
    (chosen,) = both.strong
    (point,) = [point for point in of.points if point.setting == CHOSEN]
    assert point.errors is not None and point.resting is not None
    assert point.predicted is not None and point.predicted_resting is not None
    numbers = (point.predicted, point.errors.peak_force, point.predicted_resting, point.resting)
    assert chosen[2:] == (*(digits(100.0 * number) for number in numbers), digits(point.beyond))
    assert "settled at 22 s" in both.notes[0]
    assert missing(both.notes[0], ["twice the step", "9e-5 %"]) == []
    assert of.rest is not None
    moving = replace(of, rest=replace(of.rest, setting=None, reason="the forces that last were still changing at 9 s"))
    (note,) = block(moving, "Impacts and resting load").notes
    assert missing(note, ["Resting load", "the forces that last were still changing at 9 s"]) == []


def test_a_method_without_a_prediction_has_a_dash() -> None:
    work = block(study(), "Impacts and resting load")
    for integrator, predicted in zip(column(work, "integrator"), column(work, "impacts, %\npredicted"), strict=True):
        assert (predicted == "-") == integrator.startswith(("linearly_implicit", "dormand_prince"))


def test_settings_that_failed_are_listed_with_the_reason() -> None:
    of = study()
    failures = block(of, "Settings that failed")
    assert column(failures, "why") == [p.failure for p in sorted(of.points, key=lambda p: p.setting) if p.failure]


def test_orders_stand_in_groups_with_what_was_expected() -> None:
    orders = block(study(), "Closed forms")
    assert orders.groups[0][0] == "head on, clamped dashpot: speed of rebound"
    assert set(column(orders, "expected")) == {"1", "2", "2.5", "4", "5", "-"}
    assert set(column(orders, "steps")) == {"20 .. 640"}
    (note,) = orders.notes
    assert missing(note, ["errors", "RMS", "64 phases"]) == []


def test_horizons_tell_what_was_not_seen_and_the_references_doubt() -> None:
    horizons = block(study(), "How long")
    assert column(horizons, "a nudge\ndoubles in, s") == ["0.37", "0.18", "not seen"]
    assert missing(horizons.notes[0], ["0.0034 %", "peak force"]) == []


def test_long_runs_tell_difference_verdict_and_resolution() -> None:
    of = study()
    runs = block(of, "Long runs: ")
    assert runs.groups[0][0] == "throughput, 1/min: reference 252.60 +- 0.85"
    assert column(runs, "verdict") == [row.verdict for row in of.comparisons]
    assert column(runs, "resolves\n%") == [digits(100.0 * row.resolution) for row in of.comparisons]
    for text, row in zip(column(runs, "difference\n%"), of.comparisons, strict=True):
        low, high = map(float, text.split(" .. "))
        # Two digits of the interval's length are shown: half a unit of the last is a twentieth of it at most.
        assert [low, high] == pytest.approx([100.0 * row.low, 100.0 * row.high], abs=5.0 * (row.high - row.low))
    assert "tunnelling: bottle 71" in block(of, "Long runs that ended early").groups[0][1][0][-1]


def test_an_interval_without_ends_is_a_dash() -> None:
    of = study()
    row = replace(of.comparisons[0], low=-math.inf, high=math.inf, runs=1, verdict="undecided")
    runs = block(replace(of, comparisons=(row,)), "Long runs: ")
    assert column(runs, "difference\n%") == column(runs, "resolves\n%") == ["-"]


def test_stiffness_tells_changes_and_marks_deep_overlaps() -> None:
    of = block(study(), "Softer contacts")
    rows = {row[0]: row[1:] for _, found in of.groups for row in found}
    assert of.headings == ("stiffness x", "1", "0.25", "0.0625", "0.0156")
    assert rows["overlap, % of diameter"] == ("0.31", "1.24 !", "4.96 !", "19.8 !")
    assert rows["peak force, 99th percentile, N"][:2] == ("148", "77.1")
    names = [row[0] for _, found in of.groups for row in found]
    peak = of.groups[0][1][names.index("peak force, 99th percentile, N") + 2]
    assert peak[:3] == ("  change, %", "", "-47.9")


def test_the_answer_is_last_with_its_doubts() -> None:
    of = study()
    assert of.answer is not None
    last = blocks(of)[-1]
    assert (last.title, last.notes[:4]) == ("Answer", (*three_lines(of), of.answer.sentence))
    assert last.notes[-len(of.answer.doubts) :] == of.answer.doubts
    assert "Long runs have not accepted it." in last.notes
    accepted = replace(of, answer=replace(of.answer, accepted=True))
    assert any(note.startswith("Long runs accept it") for note in blocks(accepted)[-1].notes)


def test_a_study_that_found_nothing_has_an_answer_alone() -> None:
    assert [block.title for block in blocks(nothing())] == ["Answer"]
    facts = ["No setting", "1 %", "impacts", "resting load", "bound of stability"]
    assert missing(blocks(nothing())[0].notes[-1], facts) == []
    assert "### Answer" in markdown(nothing())


def test_where_all_failed_the_failures_are_told() -> None:
    of = replace(
        nothing(), points=(failed("rk4", 20, BLOWN), failed("linearly_implicit", 20, BLOWN)), skipped=("More.",)
    )
    assert [block.title for block in blocks(of)] == ["Settings that failed", "Left out", "Answer"]


def test_texts_are_not_taken_for_markup() -> None:
    of = replace(nothing(), points=(failed("rk4", 20, "unstable: [bold]x|y[/bold]"),))
    assert "[bold]x|y[/bold]" in printed(of)
    assert "[bold]x\\|y[/bold]" in markdown(of)


def test_where_room_lacks_prose_is_broken_before_numbers() -> None:
    row = ("a long sentence that takes several lines", "1.5 +- 0.1")
    columns = [Column[tuple[str, str]]("why", lambda row: row[0], left=True), Column("mean", lambda row: row[1])]
    file = io.StringIO()
    Console(file=file, width=30).print(Block.of("Title", columns, {"": [row]}))
    assert "1.5 +- 0.1" in file.getvalue()
    assert max(map(len, file.getvalue().splitlines())) <= 30
