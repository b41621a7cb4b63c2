# SPDX-License-Identifier: Apache-2.0
"""Rows with an exact symmetry: equal bits on any number of threads, and a warning where a scatter is missing."""

from __future__ import annotations

import json

import pytest
from facts import missing
from hard_cases.case import Case
from hard_cases.defaults import CASES, run_at_defaults, run_on_threads

from conveyor_sim.report.flow.flow import flow_of
from conveyor_sim.scene import parse_scene
from conveyor_sim.scene.layout.entries import LATERAL_SCATTER
from conveyor_sim.scene.places import Places

ROWS = {name: case for name, case in CASES.items() if case.family == "symmetry"}


@pytest.mark.parametrize("name", [name for name in ROWS if "exact" in name])
def test_the_bits_are_equal_on_two_threads(name: str) -> None:
    """A tick near the end of the run, when the columns have buckled; forces of many bottles are summed then."""
    first, second = run_at_defaults(name), run_on_threads(ROWS[name], 2)
    assert first.hash == second.hash != 0
    assert first.measures == second.measures


def findings(case: Case) -> list[str]:
    """Findings of `check` on the scene of a row as it is written, without the annex."""
    text = json.dumps({"name": case.name, "duration": case.duration, **case.given})
    scene = parse_scene(text, f"{case.name}.yaml")
    places = Places(scene)
    return [f"{finding.level} {finding.line(places)}" for finding in flow_of(scene).findings]


@pytest.mark.parametrize("name", ["exact_column", "scattered_column", "nearly_exact_column"])
def test_only_a_feed_without_scatter_is_warned_of(name: str) -> None:
    warnings = [text for text in findings(ROWS[name]) if "no scatter" in text]
    assert len(warnings) == (name == "exact_column")
    assert all(missing(text, ["infeeds.feed", "table", "lateral_jitter", "0.5 mm"]) == [] for text in warnings)


def test_the_scatter_of_the_row_is_the_default_along_conveyors() -> None:
    assert ROWS["scattered_column"].given["infeeds"]["feed"]["lateral_jitter"] == LATERAL_SCATTER
