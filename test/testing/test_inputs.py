# SPDX-License-Identifier: Apache-2.0
"""The inputs of a scenario: the bag that is made of them is the one that would have been recorded, bit for bit."""

import json
from collections.abc import Callable, Mapping
from pathlib import Path

import pytest
from click.testing import CliRunner
from facts import missing, stating
from physics.stepping.guard.test_recording import bouncing
from scenes import MASS, RADIUS
from testing.conftest import FEEDER, ON_TABLE, STOP, TABLE
from testing.test_scenario import Hold

from conveyor_sim.bag.input_log import FILE_NAME, InputLog
from conveyor_sim.bag.reader import open_bag
from conveyor_sim.bag.replay import replay
from conveyor_sim.bag.rerun import rerun
from conveyor_sim.cli import main
from conveyor_sim.control import Constant, Inputs
from conveyor_sim.errors import BagError, CheckpointError, CommandError, SimulationError
from conveyor_sim.testing import Scenario

SPEED = "belts/table/cmd_speed"


def messages(bag: Path) -> list[tuple[str, int, bytes]]:
    """All of a bag, byte for byte, but for `line`, which has the id of its run."""
    with open_bag(bag) as opened:
        return [message for message in opened.raw() if message[0] != "line"]


class Signed:
    """Stops the table by a speed of 0 that is now -0: equal, but not the same bits."""

    def scan(self, inputs: Inputs) -> Mapping[str, float]:
        return {SPEED: -0.0 if inputs.tick % 2 else 0.0}


def play(table: Scenario) -> None:
    """Controllers with alarms, commands and faults by hand, and a controller in place of another."""
    table.attach(Hold(2))
    table.run_until(lambda s: s["alarms/full"], within=20)
    table.inject(STOP)
    table.command(SPEED, 0.2)
    table.run_for(1.5)
    table.attach(Signed())
    table.run_for(0.3)
    table.attach(Constant({}))
    table.inject(STOP, 0)
    table.run_for(0.255)


def recorded(folder: Path, play: Callable[[Scenario], None], start: Path | None = None) -> Scenario:
    """A scenario that was played, recorded to `bag` as it ran, with its inputs in `inputs`."""
    with Scenario(TABLE, {"seed": 3}, start=start, bag=folder / "bag", inputs=folder / "inputs") as table:
        play(table)
    return table


def test_the_bag_is_the_one_that_would_have_been_recorded(tmp_path: Path) -> None:
    table = recorded(tmp_path, play)
    made = rerun(tmp_path / "inputs", tmp_path / "made")
    assert (made.departure, made.end) == ("", table.time)
    assert messages(tmp_path / "made") == messages(tmp_path / "bag")
    report = replay(tmp_path / "made")
    assert report.exact and report.difference is None
    assert report.last_tick == table.simulation.tick


def test_who_records_does_not_change_the_bits(tmp_path: Path) -> None:
    with Scenario(TABLE, {"seed": 3}) as alone:
        play(alone)
    assert recorded(tmp_path, play).simulation.state_hash() == alone.simulation.state_hash()


def test_from_a_checkpoint_too(tmp_path: Path) -> None:
    warm = tmp_path / "warm.npz"
    with Scenario(TABLE, {"seed": 3}) as table:
        table.attach(Hold(1))
        table.run_until(lambda s: s["alarms/full"], within=20)
        table.run_for(0.05)
        table.command(SPEED, 0.3)  # waits for the next tick, and is in the checkpoint
        table.simulation.save(warm)
    table = recorded(tmp_path, play, warm)
    warm.unlink()  # a copy was kept
    made = rerun(tmp_path / "inputs", tmp_path / "made")
    assert made.departure == ""
    assert messages(tmp_path / "made") == messages(tmp_path / "bag")
    for bag in ("bag", "made"):
        report = replay(tmp_path / bag)
        assert report.exact and report.difference is None, bag
    assert (report.first_tick, report.last_tick) == (int(table.history.time[0] / 0.01 + 0.5), table.simulation.tick)

    (tmp_path / "made" / "start.npz").unlink()
    with pytest.raises(BagError, match=stating("tick 0", "checkpoint", "start.npz")):
        replay(tmp_path / "made")
    with Scenario(TABLE, {"seed": 3}) as other:
        other.simulation.save(tmp_path / "made" / "start.npz")
    with pytest.raises(BagError, match=r"start\.npz: .*tick 0\b.* tick \d+"):
        replay(tmp_path / "made")
    with Scenario(TABLE, {"seed": 4}) as other:
        other.simulation.save(tmp_path / "made" / "start.npz")
    with pytest.raises(CheckpointError, match=stating("scene", "seed: 4", "3")):
        replay(tmp_path / "made")


def test_a_run_that_the_guard_stops(tmp_path: Path) -> None:
    scene = bouncing(1.1 * RADIUS * (1e3 / MASS) ** 0.5, 1e3)
    with (
        Scenario(scene, bag=tmp_path / "bag", inputs=tmp_path / "inputs") as plant,
        pytest.raises(SimulationError),
    ):
        plant.run_for(1.0)
    assert rerun(tmp_path / "inputs", tmp_path / "made").departure == ""
    made = messages(tmp_path / "made")
    assert made == messages(tmp_path / "bag")
    assert [topic for topic, _, _ in made[-2:]] == ["guard", "run_state"]


def test_a_command_that_is_refused(tmp_path: Path) -> None:
    with pytest.raises(CommandError):
        recorded(tmp_path, lambda table: (table.attach(Constant({FEEDER: 99.0})), table.run_for(1.0)))
    assert rerun(tmp_path / "inputs", tmp_path / "made").departure == ""
    assert messages(tmp_path / "made") == messages(tmp_path / "bag")


def test_what_a_constant_controller_gives_is_written_once(tmp_path: Path) -> None:
    recorded(tmp_path, lambda table: (table.attach(Constant({FEEDER: 0.4})), table.run_for(5.0)))
    lines = [json.loads(line) for line in (tmp_path / "inputs" / FILE_NAME).read_text().splitlines()]
    assert [line["tick"] for line in lines if "inputs" in line] == [0]
    assert [line["tick"] for line in lines if "hash" in line] == [100, 200, 300, 400, 500, 500]


def test_a_file_that_was_cut_short_gives_the_run_up_to_there(tmp_path: Path) -> None:
    recorded(tmp_path, play)
    file = tmp_path / "inputs" / FILE_NAME
    text = file.read_text()
    file.write_text(text[: text.rindex('"hash"')])  # within the last line
    last = max(json.loads(line).get("tick", 0) for line in text.splitlines()[:-1])
    made = rerun(tmp_path / "inputs", tmp_path / "made")
    assert made.departure == "" and made.end == pytest.approx(last * 0.01)
    *there, end = messages(tmp_path / "made")
    assert end[0] == "run_state"
    assert there == messages(tmp_path / "bag")[: len(there)]


def test_a_line_that_was_changed_by_hand_is_not_the_same_run(tmp_path: Path) -> None:
    def pushed(table: Scenario) -> None:
        table.run_for(2.0)
        with table.simulation.editing() as (bottles, slots):
            bottles.x[slots] += 0.01
        table.run_for(1.5)

    recorded(tmp_path, pushed)
    made = rerun(tmp_path / "inputs", tmp_path / "made")
    # It is noticed at the next state that was noted.
    assert missing(made.departure, ["3.00 s", "tick 300", "commands", "faults", "only"]) == []
    done = CliRunner().invoke(main, ["recover", str(tmp_path / "inputs")])
    assert done.exit_code == 1
    assert missing(done.output, ["3.00 s", "tick 300"]) == []


def test_of_another_version_the_versions_are_named(tmp_path: Path) -> None:
    recorded(tmp_path, play)
    file = tmp_path / "inputs" / FILE_NAME
    header, *lines = file.read_text().splitlines()
    changed = {**json.loads(header), "environment": ["engine=older"]}
    lines[-1] = json.dumps({**json.loads(lines[-1]), "hash": 0})
    file.write_text("\n".join([json.dumps(changed), *lines, ""]))
    made = rerun(tmp_path / "inputs", tmp_path / "made")
    assert made.departure.endswith("expected the versions and the machine of the first run (engine=older)")


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        (lambda lines: [], "is damaged"),
        (lambda lines: ["{", *lines[1:]], "is damaged"),
        (lambda lines: [lines[0].replace('"format": 3', '"format": 1'), *lines[1:]], "format 1 of inputs, expected 3"),
        (lambda lines: [*lines, '{"tick": 50, "hash": 1}'], r"is damaged \(ticks out of order\)"),
        (
            lambda lines: [*lines, '{"tick": 1000, "inputs": [["watchdog", "watchdog", "line", "set", [], [], []]]}'],
            "of the line itself",
        ),
    ],
)
def test_inputs_that_make_no_sense(tmp_path: Path, change: Callable[[list[str]], list[str]], reason: str) -> None:
    recorded(tmp_path, lambda table: table.run_for(1.0))
    file = tmp_path / "inputs" / FILE_NAME
    file.write_text("".join(f"{line}\n" for line in change(file.read_text().splitlines())))
    with pytest.raises(BagError, match=reason) as error:
        rerun(tmp_path / "inputs", tmp_path / "made")
    assert str(error.value).startswith(f"{file}: ") and "\n" not in str(error.value)
    assert not (tmp_path / "made").exists()


def test_what_ends_it_early_leaves_no_bag(tmp_path: Path) -> None:
    recorded(tmp_path, lambda table: table.run_for(1.0))

    def interrupt(done: float, total: float) -> None:
        assert total == 1.0
        if done > 0.5:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        rerun(tmp_path / "inputs", tmp_path / "made", interrupt)
    assert not (tmp_path / "made").exists()
    assert rerun(tmp_path / "inputs", tmp_path / "made").end == 1.0


def test_inputs_that_are_not_there_or_are_there_already(tmp_path: Path, table: Scenario) -> None:
    with pytest.raises(BagError, match=stating("inputs.jsonl", "no such file", "inputs of a run")):
        rerun(tmp_path, tmp_path / "made")
    with InputLog(tmp_path, table.simulation):
        with pytest.raises(BagError, match=stating("recorded or repaired", "another process")):
            rerun(tmp_path, tmp_path / "made")
        with pytest.raises(BagError, match=stating("can't be written", "File exists")):
            InputLog(tmp_path, table.simulation)
    assert table.signals[ON_TABLE] == 0
