# SPDX-License-Identifier: Apache-2.0
"""`conveyor-sim alarms`: one row per alarm of a recording."""

import json
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from bag.editing import edited
from click.testing import CliRunner, Result
from facts import missing

from conveyor_sim.bag.outputs import OutputWriter
from conveyor_sim.bag.reader import open_bag
from conveyor_sim.bag.recorder import Recorder
from conveyor_sim.cli import main
from conveyor_sim.line.commands.inputs import FAULT, INJECT, Input
from conveyor_sim.report.alarms import AlarmRow, chosen_alarms
from conveyor_sim.scene import load_scene
from conveyor_sim.simulation import Simulation

Alarms = Callable[..., Result]
CLEARED, TRIPPED = "table full", "belts/line/tripped"


@pytest.fixture(scope="module")
def bag(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """An alarm of a controller that comes at 1, 2 and 3 s for half a second, and a trip at 2.5 s that stays; 4 s."""
    folder = tmp_path_factory.mktemp("alarms") / "bag"
    simulation = Simulation(load_scene("config/scenarios/watched_eyes.yaml"))
    with Recorder(folder) as recorder:
        outputs = OutputWriter(simulation, [recorder], run_id="run")
        outputs.start()
        while simulation.tick < 400:
            if simulation.tick in (100, 200, 300, 150, 250, 350):
                simulation.command((f"alarms/{CLEARED}",), (float(simulation.tick % 100 == 0),))
            if simulation.tick == 250:
                simulation.give(Input(FAULT, "test", "test", INJECT, ("belts/line/trip",), (1.0,)))
            simulation.advance()
            outputs.after_tick()
    return folder


@pytest.fixture
def alarms(bag: Path) -> Alarms:
    """The command for that bag."""
    return lambda *arguments: CliRunner().invoke(
        main, ["alarms", str(bag), *arguments], env={"COLUMNS": "200"}, catch_exceptions=False
    )


def test_occurrences_and_active_time_of_each_alarm(bag: Path) -> None:
    tripped, cleared = chosen_alarms(bag)
    assert tripped == AlarmRow(
        TRIPPED, "error", 800, 1, 2.5, 2.5, 1.5, "unacknowledged", "the drive of belts/line has tripped"
    )
    assert (cleared.id, cleared.raised, cleared.first, cleared.last, cleared.active) == (CLEARED, 3, 1.0, 3.0, 1.5)
    assert cleared.state == "returned"


def test_listing_and_json(alarms: Alarms, bag: Path) -> None:
    lines = alarms().stdout.splitlines()
    assert len(lines) == 3
    assert missing(lines[0], ["alarm", "raised", "active, s"]) == []
    assert re.split(r"\s{2,}", lines[1])[:7] == [TRIPPED, "error", "800", "1", "2.50", "2.50", "1.50"]
    rows = json.loads(alarms("--json").stdout)
    assert [AlarmRow(**row) for row in rows] == chosen_alarms(bag)


def test_they_are_chosen_by_class_and_name(alarms: Alarms) -> None:
    assert [row["id"] for row in json.loads(alarms("--json", "--kind", "error").stdout)] == [TRIPPED]
    assert [row["id"] for row in json.loads(alarms("--json", "--name", "table*").stdout)] == [CLEARED]
    assert json.loads(alarms("--json", "--name", "nothing").stdout) == []
    assert alarms("--name", "nothing").stdout == "no such alarm\n"
    refused = alarms("--kind", "warn")
    assert refused.exit_code == 1
    assert missing(refused.output, ["--kind", "warn", "error", "warning", "message"]) == []


def test_an_unknown_state_has_its_number(bag: Path, tmp_path: Path) -> None:
    def forge(topic: str, message: Any) -> None:
        if topic == "alarm_states":
            message.state = np.full(len(message.state), 99, dtype=np.uint8)

    rows = chosen_alarms(edited(bag, tmp_path / "forged", forge))
    assert {row.state for row in rows} == {"state 99"}


def test_a_recording_without_states_has_times_alone(bag: Path, tmp_path: Path) -> None:
    kept = ["line", "signals", "events"]
    with open_bag(bag) as opened, Recorder(tmp_path / "events", topics=kept) as recorder:
        for topic, log_time, data in opened.raw(kept):
            recorder.write(topic, data, log_time)
    rows = chosen_alarms(tmp_path / "events")
    assert {row.id: (row.alarm_class, row.priority, row.raised, row.state) for row in rows} == {
        CLEARED: ("", None, 3, ""),
        TRIPPED: ("", None, 1, ""),
    }
