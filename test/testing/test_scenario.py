# SPDX-License-Identifier: Apache-2.0
"""Scenarios: a controller's scans, what is asserted over simulated time, and what a failure tells."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

import pytest
from facts import missing, stating
from testing.conftest import FEEDER, ON_TABLE, STOP, TABLE, TAKEN

from conveyor_sim.bag.reader import open_bag
from conveyor_sim.bag.replay import replay
from conveyor_sim.control import Constant, Inputs
from conveyor_sim.errors import CommandError
from conveyor_sim.scene import load_scene
from conveyor_sim.simulation import Simulation
from conveyor_sim.testing import Scenario


@dataclass
class Hold:
    """Controller that holds the feeder while `high` bottles or more are on the table; stores its scans."""

    high: float
    ticks: list[int] = field(default_factory=list)

    def scan(self, inputs: Inputs) -> Mapping[str, float]:
        self.ticks.append(inputs.tick)
        assert inputs.time == pytest.approx(inputs.tick * inputs.length)
        full = inputs[ON_TABLE] >= self.high
        return {FEEDER: 0.0 if full else 0.4, "alarms/full": float(full)}


def test_a_controller_scans_once_a_tick(table: Scenario) -> None:
    hold = Hold(5)
    table.run_for(0.02)
    table.attach(hold)
    table.run_for(0.03)
    assert hold.ticks == [2, 3, 4, 5]


def test_the_same_bits_as_by_hand(table: Scenario) -> None:
    """A scan's answer to the signals of a tick acts from that tick on."""
    table.attach(Hold(3))
    table.run_for(8.0)

    simulation, hold = Simulation(load_scene(TABLE)), Hold(3)
    names = simulation.process_image.signal_names
    while simulation.tick < 800:
        signals = dict(zip(names, simulation.signals().tolist(), strict=True))
        answer = dict(hold.scan(Inputs(signals, simulation.time, simulation.tick, 0.01)))
        del answer["alarms/full"]
        simulation.command(tuple(answer), tuple(answer.values()))
        simulation.advance()
    assert table.simulation.state_hash() == simulation.state_hash()
    assert (table.history["belts/feeder/speed"] == 0.0).any()  # it did act


def test_time_passes_until_a_condition_is_true_and_no_further(table: Scenario) -> None:
    took = table.run_until(lambda s: s[ON_TABLE] >= 2, within=10)
    assert table.signals[ON_TABLE] == 2
    assert took == pytest.approx(table.time) == table.history.time[-1]
    assert (table.history[ON_TABLE][:-1] < 2).all()
    assert table.eventually(lambda s: s[ON_TABLE] >= 2, within=10) == 0.0


def test_seconds_are_rounded_up_to_ticks(table: Scenario) -> None:
    table.run_for(0.07)  # 0.07 / 0.01 is a little more than 7 in floating point
    assert table.simulation.tick == 7
    table.run_for(0.011)
    assert table.simulation.tick == 9
    with pytest.raises(ValueError, match="-1 s given, expected 0 s or more"):
        table.run_for(-1)


def test_what_does_not_come_true_in_time(table: Scenario) -> None:
    table.run_for(1.0)
    with pytest.raises(AssertionError) as failure:
        table.eventually(lambda s: s[ON_TABLE] > 90 and s[TAKEN] > 0, within=0.5)
    head, *signals = str(failure.value).splitlines()
    assert head.startswith("eventually(s[ON_TABLE] > 90 and s[TAKEN] > 0) did not come true")
    assert missing(head, ["within 0.5 s", "from 1.00 s to 1.50 s"]) == []
    assert signals == ["    belts/table/bottles = 0"]
    assert table.simulation.tick == 150


def test_always_tells_the_first_tick_at_which_it_is_not(table: Scenario) -> None:
    table.run_for(1.0)
    with pytest.raises(AssertionError) as failure:
        table.always(lambda s: s[ON_TABLE] < 2 or s["belts/table/speed"] > 1.0, for_=20)
    assert table.signals[ON_TABLE] == 2
    assert (table.history[ON_TABLE][:-1] < 2).all()
    text = str(failure.value)
    assert text.startswith('always(s[ON_TABLE] < 2 or s["belts/table/speed"] > 1.0) was false at ')
    assert f"at {table.time:.2f} s (tick {table.simulation.tick}), {table.time - 1.0:.2f} s after" in text
    assert text.endswith("    belts/table/bottles = 2\n    belts/table/speed = 0.4 m/s")


def test_what_holds_lets_its_time_pass(table: Scenario) -> None:
    table.always(lambda s: s["belts/table/speed"] == 0.4, for_=0.5)
    table.never(lambda s: s[ON_TABLE] > 90, for_=0.5)
    assert table.simulation.tick == 100
    table.command("belts/table/cmd_speed", 0.2)
    table.run_for(0.1)  # neither is asserted any longer
    assert table.signals["belts/table/speed"] == 0.2


def test_what_is_asserted_from_now_on_is_looked_at_in_every_run(table: Scenario) -> None:
    table.never(lambda s: s[ON_TABLE] >= 2)
    assert table.simulation.tick == 0
    with pytest.raises(AssertionError, match=r"^never\(s\[ON_TABLE\] >= 2\) was true at "):
        table.eventually(lambda s: s[TAKEN] > 0, within=30)
    assert table.signals[ON_TABLE] == 2


def test_what_is_false_already_fails_at_once(table: Scenario) -> None:
    with pytest.raises(AssertionError, match=stating("was false", "0.00 s", "tick 0")):
        table.always(lambda s: s[ON_TABLE] > 0, for_=1.0)
    assert table.simulation.tick == 0


def test_alarms(table: Scenario) -> None:
    table.attach(Hold(2))
    table.never(lambda s: s["alarms/full"], for_=0.5)
    table.eventually(lambda s: s["alarms/full"], within=20)
    assert table.alarms == {"full"}
    assert table.signals[ON_TABLE] == 2
    with pytest.raises(KeyError, match=stating("alarms/ful", "no such signal", "alarms/full")):
        table.never(lambda s: s["alarms/ful"], for_=0.5)


def test_alarms_reach_the_line_with_the_commands_and_are_recorded_and_replayed(tmp_path: Path) -> None:
    with Scenario(TABLE, bag=tmp_path / "bag") as table:
        table.attach(Hold(2))
        came = table.run_until(lambda s: s["alarms/full"], within=20)
        assert table.simulation.alarms == table.alarms == {"full"}
        table.attach(Constant({}))  # which has no such alarm: it goes
        table.run_for(0.05)
        assert not table.simulation.alarms and not table.alarms
    tick = round(came / 0.01) - 1  # its scan; the line is given it as the next tick begins
    with open_bag(tmp_path / "bag") as bag:
        rows = [
            row
            for frame in bag.read("events")
            for row in zip(frame.data.at, frame.data.kind, frame.data.name, strict=True)
            if row[1].startswith("alarm")
        ]
    assert rows == [(tick, "alarm_raised", "alarms/full"), (tick + 1, "alarm_cleared", "alarms/full")]
    assert replay(tmp_path / "bag").difference is None


def test_an_unknown_signal_is_an_error_not_a_condition_that_holds(table: Scenario) -> None:
    with pytest.raises(KeyError, match=stating("belts/tabel/bottles", "no such signal")):
        table.never(lambda s: s["belts/tabel/bottles"] > 3, for_=1.0)


def test_inputs_that_would_be_refused_are_so_at_once(table: Scenario) -> None:
    with pytest.raises(
        CommandError, match=stating("belts/tabel/cmd_speed", "no such command", "belts/table/cmd_speed")
    ):
        table.command("belts/tabel/cmd_speed", 0.1)
    with pytest.raises(CommandError, match=stating("belts/table/trip", "no such fault")):
        table.inject("belts/table/trip")


def test_a_refused_command_of_the_controller_is_an_error(table: Scenario) -> None:
    class TooFast:
        def scan(self, inputs: Inputs) -> Mapping[str, float]:
            return {FEEDER: 99.0}

    table.attach(TooFast())
    with pytest.raises(CommandError, match=stating("at 0.00 s", "refused", "belts/feeder/cmd_speed", "99")):
        table.run_for(1.0)


def test_overrides_are_for_files() -> None:
    assert Scenario(TABLE, {"conveyors": {"table": {"speed": 0.1}}}).signals["belts/table/speed"] == 0.1
    with pytest.raises(ValueError, match=stating("overrides", "loaded")):
        Scenario(load_scene(TABLE), {"duration": 1.0})


def test_a_test_gives_commands_and_injects_faults(table: Scenario) -> None:
    table.run_for(1.0)
    table.command("belts/table/cmd_speed", 0.1)
    table.inject(STOP)
    table.run_for(0.02)
    assert table.signals["belts/table/speed"] == 0.1
    assert not table.signals.on("machines/packer/running")
    table.inject(STOP, 0)
    table.run_for(0.02)
    assert table.signals.on("machines/packer/running")
