# SPDX-License-Identifier: Apache-2.0
"""Guard events are in the bag and the summary, and a run that the guard stops keeps its recording."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from bag.ros_decode import assert_same, deserialize
from click.testing import CliRunner
from facts import missing
from rosbags.highlevel import AnyReader
from scenes import MASS, NO_FLOOR, RADIUS, bottle, contact, scene, segment, stiffness_for

from conveyor_sim.bag.messages.topics import TOPICS
from conveyor_sim.bag.messages.typestore import typestore
from conveyor_sim.bag.reader import open_bag
from conveyor_sim.bag.recover import recover
from conveyor_sim.bag.replay import replay
from conveyor_sim.errors import SimulationError
from conveyor_sim.report.report import render
from conveyor_sim.report.summarize import summarize
from conveyor_sim.run.runner import run_scene
from conveyor_sim.scene import Scene
from conveyor_sim.simulation import Simulation


def bouncing(speed: float, stiffness: float) -> Scene:
    """A bottle that reaches a rail after five ticks of 10 ms."""
    return scene(
        duration=0.12,
        accuracy={"per_tick": 10},
        contacts=[contact(stiffness, "steel")],
        rails={"stop": segment((0.6, -1.0), (0.6, 1.0))},
        bottles=[bottle(0.6 - RADIUS - 0.055 * speed, 0.0, speed)],
        outputs={"bottles": 100, "contacts": 0, "poses": 0, "belts": 0, "signals": 100},
        **NO_FLOOR,
    )


def decoded(bag: Path) -> list[Any]:
    """The guard's messages by two libraries, which agree."""
    with AnyReader([bag], default_typestore=typestore()) as reader:
        raw = [data for connection, _, data in reader.messages() if connection.topic == "/guard"]
        messages = [reader.deserialize(data, TOPICS["guard"].type) for data in raw]
    for data, message in zip(raw, messages, strict=True):
        assert_same(deserialize(TOPICS["guard"].type, data), message)
    return messages


def test_a_run_that_is_stopped_leaves_a_whole_bag_with_the_reason(tmp_path: Path) -> None:
    with pytest.raises(SimulationError) as stopped:
        run_scene(bouncing(1.1 * RADIUS * (1e3 / MASS) ** 0.5, 1e3), tmp_path / "run")
    assert recover(tmp_path / "run").healthy
    *_, event = decoded(tmp_path / "run")
    assert (event.kind, event.bottle, event.tick) == ("stopped", 0, 6)
    file = tmp_path / "run" / "stopped.npz"
    assert missing(str(stopped.value), event.text, str(file)) == []
    with open_bag(tmp_path / "run") as bag:
        assert [frame.tick for frame in bag.bottles()] == list(range(7))
    report = replay(tmp_path / "run")
    assert report.difference is None
    assert report.last_tick == 6
    assert summarize(tmp_path / "run").guard["stopped"] == 1
    kept = Simulation.load(file)
    assert (kept.tick, kept.bottles().x[0]) == (6, event.x)
    with pytest.raises(SimulationError) as again:
        kept.advance()
    assert str(again.value) == event.text


def test_a_tick_in_shorter_steps_is_told_and_replayed(tmp_path: Path) -> None:
    run = run_scene(bouncing(1.0, stiffness_for(1e-3, MASS)), tmp_path / "run")
    (event,) = decoded(tmp_path / "run")
    assert run.guard == (event.text,)
    assert (event.kind, event.tick) == ("shorter_steps", 6)
    assert replay(tmp_path / "run").difference is None
    summary = summarize(tmp_path / "run")
    assert summary.guard == {"shorter_steps": 1}
    assert any(event.text in row for row in _rows(render(summary)))


def _rows(group: Any) -> list[str]:
    return [cell for table in group.renderables for column in table.columns for cell in column.cells]


def test_the_command_line_ends_with_the_sentence(tmp_path: Path) -> None:
    from conveyor_sim.cli import main

    given = bouncing(1.1 * RADIUS * (1e3 / MASS) ** 0.5, 1e3)
    file = tmp_path / "soft.yaml"
    file.write_text(given.source_text)
    done = CliRunner().invoke(main, ["run", str(file), "--out", str(tmp_path / "run")])
    assert done.exit_code == 1
    assert "bottle 0 sinks" in done.output
    assert "a stiffness of about" in done.output
