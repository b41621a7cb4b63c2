# SPDX-License-Identifier: Apache-2.0
"""Read-back: value, writer and time of each command."""

from pathlib import Path

import numpy as np
from scenes import base, belt, bottle, simulation

from conveyor_sim.columns.read_back import ReadBackColumns
from conveyor_sim.line.commands.inputs import FAULT, INJECT, SET, WATCHDOG, Input
from conveyor_sim.simulation import Simulation

ONE, TWO = "belts/one/cmd_speed", "belts/two/cmd_speed"


def line() -> Simulation:
    """Return a line with the commands cmd_speed of both belts, then run, reverse and reset of the second."""
    return simulation(
        accuracy={"per_tick": 10},
        base=base(0.4),
        belts={
            "one": belt(0.2, (0.0, 0.0), 1.0, 1.0, watchdog=0.05),
            "two": belt(0.3, (2.0, 0.0), 1.0, 1.0, drive={"acceleration": 1.0}),
        },
        bottles=[bottle(0.5, 0.5)],
    )


def given(writer: str, name: str, value: float, kind: str = "test") -> Input:
    return Input("commands", writer, kind, SET, (name,), (value,))


def told(columns: ReadBackColumns | None, sim: Simulation, name: str) -> tuple[float, str, str, int]:
    """Return value, writer, kind of writer, and tick of the last change."""
    assert columns is not None
    place = sim.process_image.command_names.index(name)
    writer = columns.writer[place]
    return columns.value[place], columns.writers[writer], columns.writer_kinds[writer], int(columns.since[place])


def test_before_anybody_commands_it_is_as_the_scene_has_it() -> None:
    sim = line()
    columns = sim.line.read_back.changes()
    assert columns is not None
    np.testing.assert_array_equal(columns.value, [tag.initial for tag in sim.process_image.commands])
    np.testing.assert_array_equal(columns.value, [0.2, 0.3, 1.0, 0.0, 0.0])
    assert (columns.writers, columns.writer_kinds) == (("scene",), ("line",))
    assert not columns.writer.any() and not columns.since.any()
    sim.advance()
    assert sim.line.read_back.changes() is None


def test_it_follows_what_is_accepted_and_only_a_change_is_told() -> None:
    sim = line()
    back = sim.line.read_back
    steps = [
        (given("anna", TWO, 0.5), (0.5, "anna", "test", 0), True),
        (given("anna", TWO, 0.5), (0.5, "anna", "test", 0), False),  # the same again
        (given("anna", TWO, 99.0), (0.5, "anna", "test", 0), False),  # refused
        (given("plc", TWO, 0.5, "controller"), (0.5, "plc", "controller", 3), True),  # the same value, another writer
        (given("plc", TWO, 0.6, "controller"), (0.6, "plc", "controller", 4), True),
        (Input(FAULT, "bob", "test", INJECT, ("belts/two/trip",), (1.0,)), (0.6, "plc", "controller", 4), False),
    ]
    for tick, (one, expected, changed) in enumerate(steps):
        sim.command([ONE], [0.2], "test", writer="beat")  # keeps its watchdog quiet
        sim.give(one)
        sim.advance()
        assert told(back.columns(), sim, TWO) == expected
        assert (back.changes() is not None) == (changed or tick == 0)
    assert told(back.columns(), sim, ONE) == (0.2, "beat", "controller", 0)


def test_what_the_line_sets_is_told_too() -> None:
    sim = line()
    sim.advance(5)
    sim.advance()
    assert told(sim.line.read_back.changes(), sim, ONE) == (0.0, WATCHDOG, "line", 5)


def test_it_goes_on_from_a_checkpoint_and_is_told_at_once(tmp_path: Path) -> None:
    sim = line()
    sim.give(given("anna", TWO, 0.5))
    sim.advance(3)
    sim.save(tmp_path / "kept")
    again = Simulation.load(tmp_path / "kept")
    assert told(again.line.read_back.changes(), again, TWO) == (0.5, "anna", "test", 0)
    for run in (sim, again):
        run.give(given("plc", TWO, 0.5))
        run.advance()
    assert told(sim.line.read_back.columns(), sim, TWO) == told(again.line.read_back.columns(), again, TWO)
    other = line()
    other.restore_from(sim)
    assert told(other.line.read_back.changes(), other, TWO) == (0.5, "plc", "test", 3)


def test_more_writers_than_commands() -> None:
    """Only writers of values in force are listed."""
    sim = line()
    for number in range(20):
        sim.give(given(f"writer {number}", TWO, 0.01 * number))
    sim.advance()
    columns = sim.line.read_back.columns()
    assert columns.writers == ("scene", "writer 19")


def test_a_controller_that_repeats_its_commands_gets_the_same_bits() -> None:
    """A drive, a machine and a lamp are commanded in every tick, or when a value changes."""
    hashes = []
    for every in (1, 7):
        sim = simulation(
            accuracy={"per_tick": 10},
            base=base(0.4),
            belts={"two": belt(0.3, (0.0, 0.0), 2.0, 1.0, drive={"acceleration": 1.0})},
            bottles=[bottle(0.5, 0.5)],
            machines={
                "packer": {"kind": "sink", "region": [[1, 0], [2, 0], [2, 1], [1, 1]], "rate": 2.0, "ramp_up": 0.05}
            },
            panel={"lamp": {"kind": "lamp", "colour": "red"}},
        )
        names = (TWO, "belts/two/run", "belts/two/reset", "machines/packer/run", "machines/packer/cntrl_cmd",
                 "panel/lamp/on")  # fmt: skip
        for tick in range(42):
            stage = tick // 7
            if tick % every == 0:
                values = (0.1 * stage, stage != 2, stage == 3, stage not in (1, 2), 3.0 * (stage == 4), stage % 2)
                sim.command(names, values, writer="plc")
            sim.advance()
        assert [outcome.reason for outcome in sim.take_outcomes()] == [""] * (42 // every)
        hashes.append(sim.full_state_hash())
    assert hashes[0] == hashes[1]
