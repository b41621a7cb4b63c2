"""What is made of rows: means with honest intervals, effects, what can't be told apart, Sobol indices, pictures."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Mapping
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from conveyor_sim.errors import StudyError
from conveyor_sim.studies.design import saltelli
from conveyor_sim.studies.effects import indices, interactions, main_effects, maps
from conveyor_sim.studies.results import Results
from conveyor_sim.studies.row import Row
from conveyor_sim.studies.verdict import verdicts


def results_of(points: list[dict[str, Any]], seeds: int, made: Callable[[Mapping[str, Any], int], float]) -> Results:
    """A study of one metric, as if it had been run."""
    rows = [
        Row(number, seed, point, "finished", metrics={"y": made(point, seed)})
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


def test_interactions_and_maps() -> None:
    found = results_of(GRID, 3, noisy)
    ((across_x, across_kind),) = interactions(found, "y")
    assert [line.label for line in across_x] == ["kind steel", "kind glass"]
    assert across_x[1].mean - across_x[0].mean == pytest.approx([1.0] * 3)
    assert [line.label for line in across_kind] == ["x 1", "x 2", "x 3"]
    assert maps(found)["y"].mean == pytest.approx(np.array([[2.0, 3.0], [4.0, 5.0], [6.0, 7.0]]))


def test_what_cannot_be_told_is_said() -> None:
    """The seeds' part is the same at all points, so even small differences are told; noise of its own hides them."""
    assert list(verdicts(results_of(GRID, 3, lambda p, s: noisy(p, s) + 1e-6 * math.sin(97.0 * s + p["x"])))) == [
        "y: lowest at x 1, kind steel",
        "y: highest at x 3, kind glass",
    ]
    draw = np.random.default_rng(3)
    noise = results_of(GRID, 5, lambda point, seed: float(draw.normal()))
    assert list(verdicts(noise)) == ["y: no point can be told from another with 5 seeds"]


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
    (shares,) = indices(Results(text, found.path, found.units, dict.fromkeys(names, ""), {}, found.rows))
    assert shares.first == pytest.approx([0.314, 0.442, 0.0], abs=0.1)
    assert shares.total == pytest.approx([0.558, 0.442, 0.244], abs=0.1)
    with pytest.raises(StudyError, match="1 of 5120 points have no y"):
        indices(Results(text, found.path, found.units, dict.fromkeys(names, ""), {}, found.rows[1:]))


def test_all_of_it_is_drawn(tmp_path: Path) -> None:
    pytest.importorskip("matplotlib")
    from conveyor_sim.plot import plot_study

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
