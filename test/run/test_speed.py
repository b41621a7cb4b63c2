# SPDX-License-Identifier: Apache-2.0
"""The three lines on speed: how fast, what bounds it, what to change, for runs with different bounds."""

from __future__ import annotations

from pathlib import Path

import pytest
from bag.small_line import SMALL_LINE
from facts import missing
from pressing import hopper
from scenes import bottle, scene

from conveyor_sim.physics.model.remedies import step_limit
from conveyor_sim.run.runner import run_scene
from conveyor_sim.run.speed import Spent, TopicCount, expected, measured
from conveyor_sim.scene import load_scene
from conveyor_sim.support.resources import scene_path

TOPICS = {"bottles": TopicCount(100, 3_000_000), "contacts": TopicCount(100, 6_000_000), "belts": TopicCount(9, 900)}
BY_KERNELS = Spent(kernels=6.0, line=1.0, recording=2.0)


def test_a_step_that_contact_friction_rules_has_the_implicit_solver_for_a_remedy() -> None:
    limit = step_limit(hopper(1000))
    speed, bound, change = measured(20.0, 10.0, BY_KERNELS, 0.5, limit, TOPICS)
    assert speed.startswith("speed: ")
    assert missing(speed, ["20.00 s", "10.00 s", "2 x real time", "60 %", "kernels", "10 %", "devices", "guard"]) == []
    assert missing(speed, ["20 %", "recording", "0.50 s", "summary", "pictures"]) == []
    assert bound.startswith(f"bound: contact friction needs {limit.steps} steps a tick, ")
    assert change.startswith("change: fewer steps: friction_solver: implicit: ")
    assert expected(limit)[1:] == [bound, change]


def test_where_nothing_bounds_the_step_the_lines_say_so() -> None:
    limit = step_limit(scene(bottles=[bottle(0.0, 0.0)], floor="none"))
    _, bound, change = expected(limit)
    assert bound.startswith("bound: ") and change.startswith("change: ")
    assert missing(bound, ["nothing", "time step"]) == []
    assert missing(change, ["no single change", "fewer steps"]) == []


def test_a_recording_that_takes_longest_names_its_topics() -> None:
    spent = Spent(kernels=3.0, line=1.0, recording=5.0)
    _, bound, change = measured(20.0, 10.0, spent, 0.0, step_limit(load_scene(SMALL_LINE)), TOPICS)
    assert bound.startswith("bound: ") and change.startswith("change: ")
    assert missing(bound, ["recording", "9 MB", "contacts (67 %)", "bottles (33 %)"]) == []
    assert missing(change, ["lower rates", "contacts", "bottles", "`outputs`", "--no-record"]) == []


def test_devices_that_take_longest_are_named() -> None:
    spent = Spent(kernels=1.0, line=6.0, recording=2.0)
    _, bound, change = measured(20.0, 10.0, spent, 0.0, step_limit(load_scene(SMALL_LINE)), TOPICS)
    assert bound.startswith("bound: devices and the guard")
    assert missing(change, ["change", "longer tick", "scan cycle"]) == []


def test_pictures_that_take_longer_than_the_run_are_named() -> None:
    _, bound, change = measured(20.0, 10.0, BY_KERNELS, 10.5, step_limit(load_scene(SMALL_LINE)), TOPICS)
    assert missing(bound, ["bound", "summary", "pictures", "longer", "run"]) == []
    assert "--no-pictures" in change


def test_a_run_of_which_little_is_known_is_three_lines_too() -> None:
    assert len(measured(20.0, None, None, 3.0, None, TOPICS)) == 3


@pytest.mark.parametrize(
    ("name", "words"),
    [("turntable", "contact friction"), ("paper_plant", "250 steps a tick are given in the scene"),
     ("two_bottles", "impact of two bottles"), ("glass_line", "impact of two bottles")],
)  # fmt: skip
def test_shipped_scenes_are_bound_by_what_sets_their_steps(name: str, words: str) -> None:
    limit = step_limit(load_scene(scene_path(name)))
    speed, bound, change = expected(limit)
    assert "x real time on one core with" in speed
    assert bound == f"bound: {limit.bound}" and words in bound
    assert change == f"change: {limit.change}" if limit.remedies else "no single change" in change


def test_what_a_run_spent_is_part_of_its_wall_time(tmp_path: Path) -> None:
    done = run_scene(load_scene(SMALL_LINE), tmp_path / "bag")
    spent = done.spent
    assert spent.kernels > 0.0 and spent.line > 0.0 and spent.recording > 0.0
    assert spent.kernels + spent.line + spent.recording == pytest.approx(done.wall)
    assert run_scene(load_scene(SMALL_LINE), None).spent.recording == 0.0
