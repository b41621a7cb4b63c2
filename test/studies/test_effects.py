# SPDX-License-Identifier: Apache-2.0
"""Results from rows: means with intervals, effects, indistinguishable points, Sobol indices, pictures."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Mapping
from dataclasses import replace
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from facts import missing

from conveyor_sim.errors import StudyError
from conveyor_sim.studies.design import saltelli
from conveyor_sim.studies.effects import indices, interactions, main_effects, maps
from conveyor_sim.studies.results import Results
from conveyor_sim.studies.row import RunRow
from conveyor_sim.studies.verdict import verdicts, wider_than_wanted


def results_of(points: list[dict[str, Any]], seeds: int, made: Callable[[Mapping[str, Any], int], float]) -> Results:
    """A study of one metric, as if it had been run."""
    rows = [
        RunRow(number, seed, point, "finished", metrics={"y": made(point, seed)})
        for number, point in enumerate(points)
        for seed in range(seeds)
    ]
    text = json.dumps({"name": "made_up", "design": "grid"})
    return Results(text, "study.yaml", {"y": "N"}, {name: "m" if name == "x" else "" for name in points[0]}, {}, rows)


GRID = [{"x": x, "kind": kind} for x, kind in product((1.0, 2.0, 3.0), ("steel", "glass"))]


def noisy(point: Mapping[str, Any], seed: int) -> float:
    """2 x, 1 more with glass, and what a seed adds at every point: common random numbers."""
    return 2.0 * point["x"] + (point["kind"] == "glass") + [-1.0, 0.0, 1.0][seed]


def test_main_effects_are_means_over_all_else_with_intervals_over_seeds() -> None:
    ((x,), (kind,)) = main_effects(results_of(GRID, 3, noisy))[0]
    assert (x.parameter, x.metric, x.levels) == ("x (m)", "y (N)", [1.0, 2.0, 3.0])
    assert x.mean == pytest.approx([2.5, 4.5, 6.5])
    # Three seeds are three values, -1, 0 and 1 about the mean: t(2) = 4.303, and 1 / sqrt(3), however many points.
    assert x.half_width == pytest.approx([4.3027 / math.sqrt(3.0)] * 3, rel=1e-4)
    assert (kind.levels, kind.mean.tolist()) == (["steel", "glass"], [4.0, 5.0])


def test_a_seed_that_a_point_lacks_shifts_no_mean() -> None:
    """One point may have more runs than others; its additional seeds alone do not show the level."""
    found = results_of(GRID, 3, noisy)
    often = [RunRow(1, seed, GRID[1], "finished", metrics={"y": 3.0 + (-1.0) ** seed}) for seed in range(3, 23)]
    ((x,), _) = main_effects(replace(found, rows=[*found.rows, *often]))[0]
    assert x.mean == pytest.approx([2.5, 4.5, 6.5])
    assert x.half_width == pytest.approx([4.3027 / math.sqrt(3.0)] * 3, rel=1e-4)
    apart = [row for row in found.rows if row.point != 0 or row.seed == 0] + often
    ((x,), _) = main_effects(replace(found, rows=[row for row in apart if (row.point, row.seed) != (1, 0)]))[0]
    assert x.mean[0] == pytest.approx(0.5 * (1.0 + (3.0 + 4.0 + 20 * 3.0) / 22)) and math.isnan(x.half_width[0])


def test_interactions_and_maps() -> None:
    found = results_of(GRID, 3, noisy)
    ((across_x, across_kind),) = interactions(found, "y")
    assert [line.label for line in across_x] == ["kind steel", "kind glass"]
    assert across_x[1].mean - across_x[0].mean == pytest.approx([1.0] * 3)
    assert [line.label for line in across_kind] == ["x 1", "x 2", "x 3"]
    assert maps(found)["y"].mean == pytest.approx(np.array([[2.0, 3.0], [4.0, 5.0], [6.0, 7.0]]))


def test_what_cannot_be_told_is_said() -> None:
    """Seeds shift all points equally, so small differences are significant; independent noise hides them."""
    assert list(verdicts(results_of(GRID, 3, lambda p, s: noisy(p, s) + 1e-6 * math.sin(97.0 * s + p["x"])))) == [
        "y: lowest at x 1, kind steel",
        "y: highest at x 3, kind glass",
    ]
    draw = np.random.default_rng(3)
    noise = results_of(GRID, 5, lambda point, seed: float(draw.normal()))
    (verdict,) = verdicts(noise)
    assert verdict.startswith("y: ")
    assert missing(verdict, ["no two points", "5 seeds"]) == []
    # Two that are told apart, and a third, the highest on average, that scatters too much to be told from either.
    scatter = [-300.0, 500.0, -100.0, 400.0, 100.0]
    wild = results_of(GRID[:3], 5, lambda p, s: scatter[s] if p["x"] == 2.0 else noisy(p, s % 3))
    lowest, highest = verdicts(wild)
    best, others = lowest.split(";", 1)
    assert best == "y: lowest at x 1, kind steel"
    assert missing(others, ["no significant difference", "5 seeds", "x 2, kind steel"]) == []
    best, others = highest.split(";", 1)
    assert best == "y: highest at x 2, kind steel"
    assert missing(others, ["no significant difference", "5 seeds", "x 1, kind steel", "x 1, kind glass"]) == []


def test_what_is_not_compared_is_said() -> None:
    found = results_of(GRID, 3, noisy)
    lacks = [replace(row, metrics={"y": math.nan}) if row.key == (2, 1) else row for row in found.rows]
    (verdict,) = verdicts(replace(found, rows=lacks))
    assert missing(verdict, ["y", "not compared", "runs without", "x 2, kind steel"]) == []
    failed = [replace(row, status="failed", metrics={}) if row.point == 2 and row.seed else row for row in found.rows]
    (verdict,) = verdicts(replace(found, rows=failed))
    assert missing(verdict, ["points", "not compared", "two seeds", "finished run"]) == []
    many = results_of([{"x": float(x)} for x in range(101)], 2, lambda p, s: p["x"])
    (verdict,) = verdicts(many)
    assert missing(verdict, ["101 points", "not compared", "more than 100"]) == []


def test_an_interval_that_is_wider_than_wanted_is_named() -> None:
    """Standard deviation 1 of three values: +-2.5 at 95 %."""
    seeds = {"until": {"metric": "y", "half_width": 1.0}, "most": 10}
    found = replace(results_of(GRID[:2], 3, noisy), study=json.dumps({"name": "made_up", "seeds": seeds}))
    steel, glass = wider_than_wanted(found)
    assert missing(steel, ["y", "x 1, kind steel", "2.0 ± 2.5 N", "3 seeds", "wider", "± 1", "about 7"]) == []
    assert missing(glass, ["y", "x 1, kind glass", "3.0 ± 2.5 N", "3 seeds", "wider", "± 1", "about 7"]) == []
    seeds["until"] = {"metric": "y", "half_width": 1.0, "relative": True}
    relative = replace(found, study=json.dumps({"name": "made_up", "seeds": seeds}))
    assert [sentence.partition(",")[0] for sentence in wider_than_wanted(relative)] == ["y at x 1"]


def test_sobol_indices_of_a_function_whose_indices_are_known() -> None:
    """Ishigami and Homma 1990: y = sin a + 7 sin^2 b + 0.1 c^4 sin a, for angles from -pi to pi."""
    pytest.importorskip("SALib")
    names, base = ["a", "b", "c"], 1024
    angles = [dict(zip(names, row, strict=True)) for row in (math.pi * (2.0 * saltelli(names, base, 0) - 1.0)).tolist()]

    def made(point: Mapping[str, Any], seed: int) -> float:
        a, b, c = (point[name] for name in names)
        return math.sin(a) + 7.0 * math.sin(b) ** 2 + 0.1 * c**4 * math.sin(a)

    found = results_of(angles, 1, made)
    with pytest.raises(StudyError, match="expected design: saltelli"):
        indices(found)
    text = json.dumps({"name": "ishigami", "design": "saltelli", "points": base})
    few = [replace(row, parameters={**row.parameters, "c": 0.0}) for row in found.rows[:20]]
    sample = replace(found, study=text, rows=few)
    assert all(panel[0].scattered for panel in main_effects(sample)[0]) and not interactions(sample, "y")
    (shares,) = indices(Results(text, found.path, found.units, dict.fromkeys(names, ""), {}, found.rows))
    assert shares.first == pytest.approx([0.314, 0.442, 0.0], abs=0.1)
    assert shares.total == pytest.approx([0.558, 0.442, 0.244], abs=0.1)
    with pytest.raises(StudyError, match="1 of 5120 points have no y"):
        indices(Results(text, found.path, found.units, dict.fromkeys(names, ""), {}, found.rows[1:]))


def test_all_of_it_is_drawn(tmp_path: Path) -> None:
    pytest.importorskip("matplotlib")
    from conveyor_sim.studies.figures.draw import plot_study

    found = results_of(GRID, 3, noisy)
    gaps = Results(found.study, found.path, found.units, found.parameters, {}, found.rows[:-3])  # a point without runs
    for number, drawn in enumerate((found, gaps)):
        folder = tmp_path / str(number)
        pairs = {"y": interactions(drawn, "y")}
        files = plot_study("made_up", main_effects(drawn), pairs, maps(drawn), [], folder)
        names = ["response", "interactions_y", "map_y"]
        assert files == [folder / f"{name}{suffix}" for name in names for suffix in (".png", ".svg")]
        svg = (folder / "response.svg").read_text()
        assert 'id="band"' in svg and 'id="mean"' in svg
