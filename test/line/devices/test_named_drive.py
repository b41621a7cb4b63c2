# SPDX-License-Identifier: Apache-2.0
"""Named drives: several belts at their ratios, commands and faults of the drive, refused commands to its belts."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import pytest
from scenes import base, belt, bottle, simulation

from conveyor_sim.control.scan import pulses_signal, speed_command, speed_signal
from conveyor_sim.line.commands.inputs import FORCE, INJECT, MODE, SET, Input
from conveyor_sim.line.commands.receipt import Receipt
from conveyor_sim.simulation import Simulation

RATIOS = {"slow": 0.5, "even": 1.0, "fast": 3.0}


def driven(**drive: Any) -> Simulation:
    """Return three belts of one drive at 0.4 m/s, a belt by itself between them, and a bottle on the fast one."""
    moved = {name: belt(0.0, (0.0, 20.0 * place), drive="m1", ratio=ratio)
             for place, (name, ratio) in enumerate(RATIOS.items())}  # fmt: skip
    for one in moved.values():
        del one["speed"], one["speed_limits"]
    parameters = {"speed": 0.4, "acceleration": 0.5, "pulses_per_metre": 1000.0, **drive}
    return simulation(
        accuracy={"per_tick": 10},
        base=base(0.4),
        drives={"m1": {name: value for name, value in parameters.items() if value is not None}},
        belts={"slow": moved["slow"], "own": belt(0.1, (0.0, -20.0)), "even": moved["even"], "fast": moved["fast"]},
        bottles=[bottle(1.0, 45.0, 1.2)],
    )


def signal(sim: Simulation, name: str) -> float:
    return float(sim.signals()[sim.process_image.signal_names.index(name)])


def states(sim: Simulation) -> dict[str, float]:
    return {name: signal(sim, f"drives/m1/{name}") for name in ("speed", "running", "at_speed", "fault")}


def commanded(sim: Simulation, **values: float) -> Simulation:
    """Send commands to the drive, and return the simulation."""
    sim.command([f"drives/m1/{name}" for name in values], list(values.values()))
    return sim


def refusals(sim: Simulation, operation: str, name: str) -> list[str]:
    """Return why line and receipt refuse an input."""
    request = Input("test", "test", "test", operation, (name,), (1.0,))
    early = Receipt(sim.process_image.tags, sim.scene.where).refusal(request)
    return [sim.line.refusal(request), early.reason if early is not None else ""]


def test_the_drive_has_the_tags_of_a_belt_with_a_drive_and_its_belts_keep_two() -> None:
    sim = driven(watchdog=1.0)
    alone = simulation(
        base=base(0.4), belts={"m1": belt(0.4, drive={"acceleration": 0.5, "pulses_per_metre": 1.0}, watchdog=1.0)}
    )
    of_belt = {tag.name.replace("belts/", "drives/") for tag in alone.process_image.tags if "belts/" in tag.name}
    of_drive = {tag.name for tag in sim.process_image.tags if "drives/" in tag.name}
    assert of_drive == of_belt - {"drives/m1/bottles"}
    for name in RATIOS:
        assert [tag.name for tag in sim.process_image.tags if tag.device == f"belts/{name}"] == [
            f"belts/{name}/speed",
            f"belts/{name}/bottles",
        ]
    assert set(sim.process_image.command_names) == {
        "belts/own/cmd_speed",
        *(f"drives/m1/{name}" for name in ("cmd_speed", "run", "reverse", "reset")),
    }


def test_all_belts_follow_the_ramp_at_their_ratios() -> None:
    sim = commanded(driven(), cmd_speed=1.0)
    assert sim.belts().actual.tolist() == [0.2, 0.1, 0.4, 3.0 * 0.4]
    for tick in range(1, 131):
        sim.advance()
        speed = min(1.0, 0.4 + 0.5 * 0.01 * tick)
        assert states(sim)["speed"] == pytest.approx(speed, rel=1e-12)
        assert sim.belts().actual == pytest.approx([0.5 * speed, 0.1, speed, 3.0 * speed], rel=1e-12)
        assert states(sim)["at_speed"] == (tick >= 120)
    assert sim.belts().commanded.tolist() == [0.5, 0.1, 1.0, 3.0]
    # The engine moves the bottle by 3 x 0.5 m/s^2, less than mu g, so that it creeps by less than v_lim.
    assert sim.bottles().vx[0] == pytest.approx(3.0, abs=0.01)
    assert signal(sim, "belts/fast/bottles") == 1.0
    assert signal(sim, "belts/fast/speed") == 3.0


def test_a_limit_of_jerk_makes_the_s_curve_of_the_closed_form() -> None:
    sim = commanded(driven(jerk=2.0), cmd_speed=1.4)
    ticks = 0
    while sim.belts().actual[0] != 0.7:
        sim.advance()
        ticks += 1
    # From rest to v in v / a + a / j.
    assert ticks * 0.01 == pytest.approx(1.0 / 0.5 + 0.5 / 2.0, abs=0.03)


def test_without_an_acceleration_it_follows_at_once_and_still_runs_reverses_and_trips() -> None:
    sim = commanded(driven(acceleration=None), cmd_speed=0.6)
    sim.advance()
    assert sim.belts().actual == pytest.approx([0.3, 0.1, 0.6, 1.8])
    assert states(sim) == {"speed": 0.6, "running": 1.0, "at_speed": 1.0, "fault": 0.0}
    commanded(sim, reverse=1.0).advance()
    assert sim.belts().actual == pytest.approx([-0.3, 0.1, -0.6, -1.8])
    sim.inject("drives/m1/trip", 1.0)
    sim.advance()
    assert sim.belts().actual.tolist() == [0.0, 0.1, 0.0, 0.0]


def test_run_and_reverse() -> None:
    sim = commanded(driven(), run=0.0)
    sim.advance(81)
    assert sim.belts().actual.tolist() == [0.0, 0.1, 0.0, 0.0]
    assert states(sim) == {"speed": 0.0, "running": 0.0, "at_speed": 1.0, "fault": 0.0}
    commanded(sim, run=1.0, reverse=1.0).advance(81)
    assert sim.belts().actual == pytest.approx([-0.2, 0.1, -0.4, -1.2])


def test_a_trip_stops_all_its_belts_until_it_is_reset() -> None:
    sim = driven()
    sim.inject("drives/m1/trip", 1.0)
    sim.advance(81)
    assert sim.belts().actual.tolist() == [0.0, 0.1, 0.0, 0.0]
    assert states(sim) == {"speed": 0.0, "running": 0.0, "at_speed": 1.0, "fault": 1.0}
    assert signal(sim, "alarms/drives/m1/tripped") == 1.0
    sim.inject("drives/m1/trip", 0.0)
    commanded(sim, reset=1.0).advance(81)
    assert sim.belts().actual == pytest.approx([0.2, 0.1, 0.4, 1.2])
    assert signal(sim, "alarms/drives/m1/tripped") == 0.0


def test_the_encoder_counts_the_metres_of_the_drive() -> None:
    sim = driven()
    sim.advance(100)
    assert signal(sim, "drives/m1/pulses") == 400.0
    commanded(sim, reverse=1.0).advance(400)
    # 160 ticks from 0.4 to -0.4 m/s take no travel but half a tick's; then 240 ticks at -0.4 m/s.
    assert signal(sim, "drives/m1/pulses") == pytest.approx(400.0 - 960.0, abs=5.0)


def test_its_watchdog_is_fed_by_speed_commands_only_and_stops_all_its_belts() -> None:
    sim = driven(watchdog=0.5)
    for _ in range(4):
        commanded(sim, run=1.0).advance(10)
    assert states(sim)["running"] == 1.0
    sim.advance(10)
    sim.advance()
    assert sim.belts().commanded.tolist() == [0.0, 0.1, 0.0, 0.0]
    assert signal(sim, "alarms/drives/m1/watchdog") == 1.0
    stop = [outcome for outcome in sim.take_outcomes() if outcome.source == "watchdog"]
    assert [(outcome.tick, outcome.names) for outcome in stop] == [(50, ("drives/m1/cmd_speed",))]
    commanded(sim, cmd_speed=0.4).advance(2)
    assert signal(sim, "alarms/drives/m1/watchdog") == 0.0
    assert sim.belts().commanded == pytest.approx([0.2, 0.1, 0.4, 1.2])


def test_its_watchdog_rests_outside_automatic_mode() -> None:
    sim = driven(watchdog=0.5)
    sim.line.queue(Input("test", "test", "test", MODE, ("drives/m1",), (3.0,)))
    sim.advance(100)
    assert sim.belts().commanded == pytest.approx([0.2, 0.1, 0.4, 1.2])


@pytest.mark.parametrize(
    ("operation", "name", "expected"),
    [
        (SET, "belts/fast/cmd_speed", "drives/m1/cmd_speed"),
        (SET, "belts/fast/run", "drives/m1/run"),
        (SET, "belts/fast/nothing", "drives/m1"),
        (SET, "belts/fast", "drives/m1"),
        (INJECT, "belts/slow/trip", "drives/m1/trip"),
        (MODE, "belts/even", "drives/m1"),
    ],
)
def test_a_command_to_its_belt_is_refused_with_its_name(operation: str, name: str, expected: str) -> None:
    for reason in refusals(driven(), operation, name):
        assert reason.startswith(f"{name}: no such ")
        assert reason.endswith(expected)
        assert "drives/m1 moves this belt" in reason
        assert "\n" not in reason


def test_other_unknown_names_are_refused_as_ever_and_signals_of_its_belts_can_be_forced() -> None:
    sim = driven()
    for name in ("belts/own/run", "belts/nothing/cmd_speed", "drives/m2/run"):
        assert "moves" not in "".join(refusals(sim, SET, name))
        assert all(refusals(sim, SET, name))
    assert refusals(sim, FORCE, "belts/fast/speed") == ["", ""]


def test_a_refused_set_of_commands_moves_no_belt() -> None:
    sim = driven()
    sim.command(["drives/m1/cmd_speed", "belts/fast/cmd_speed"], [1.0, 1.0])
    sim.advance(10)
    assert [outcome.accepted for outcome in sim.take_outcomes()] == [False]
    assert sim.belts().actual == pytest.approx([0.2, 0.1, 0.4, 1.2])


@pytest.mark.parametrize("value", [math.nan, math.inf, 3.5, -3.5])
def test_speeds_beyond_the_limits_of_the_drive_are_refused(value: float) -> None:
    sim = commanded(driven(), cmd_speed=value)
    sim.advance()
    (outcome,) = sim.take_outcomes()
    assert not outcome.accepted
    assert "-3 to 3 m/s" in outcome.reason


def test_signals_of_its_belts_span_its_limits_times_the_ratio() -> None:
    tags = {tag.name: tag for tag in driven(speed_limits=[-0.5, 1.0]).process_image.tags}
    low, high, start = (getattr(tags["belts/fast/speed"], name) for name in ("low", "high", "initial"))
    assert (low, high, start) == pytest.approx((-3.0, 3.0, 1.2))  # it can reverse
    assert "drives/m1" in tags["belts/fast/speed"].description


def test_a_loaded_checkpoint_goes_on_with_the_same_bits(tmp_path: Path) -> None:
    sim = commanded(driven(jerk=2.0, watchdog=2.0), cmd_speed=1.0, reverse=1.0)
    sim.advance(40)
    assert 0.0 < abs(states(sim)["speed"]) < 1.0  # on its ramp
    sim.save(tmp_path / "saved.npz")
    loaded = Simulation.load(tmp_path / "saved.npz")
    other = driven(jerk=2.0, watchdog=2.0)
    other.restore_from(sim)
    for one in (sim, loaded, other):
        one.advance(200)
    assert loaded.full_state_hash() == sim.full_state_hash()
    assert loaded.signals().tolist() == other.signals().tolist() == sim.signals().tolist()
    assert signal(sim, "alarms/drives/m1/watchdog") == 1.0


def test_a_drive_may_move_no_belt() -> None:
    sim = simulation(drives={"idle": {"speed": 0.5, "acceleration": 1.0, "pulses_per_metre": 10.0}})
    sim.advance(100)
    assert signal(sim, "drives/idle/pulses") == 5.0
    assert sim.belts().actual.size == 0


def test_one_name_may_stand_for_a_drive_and_a_belt() -> None:
    sim = simulation(base=base(0.4), drives={"one": {"speed": 0.5}}, belts={"one": _without_speed(drive="one")})
    sim.command(["drives/one/cmd_speed"], [0.25])
    sim.advance()
    assert sim.belts().actual.tolist() == [0.25]


def test_two_drives_move_their_own_belts() -> None:
    sim = simulation(
        base=base(0.4),
        drives={"b": {"speed": 0.5}, "a": {"speed": 0.25}},
        belts={"x": _without_speed(drive="a"), "y": _without_speed(drive="b", ratio=2)},
    )
    sim.command(["drives/a/cmd_speed"], [1.0])
    sim.advance()
    assert sim.belts().actual.tolist() == [1.0, 1.0]
    sim.command(["drives/b/cmd_speed"], [0.25])
    sim.advance()
    assert sim.belts().actual.tolist() == [1.0, 0.5]


def test_controllers_address_a_drive_by_its_path() -> None:
    assert speed_command("drives/m1") == "drives/m1/cmd_speed"
    assert speed_signal("drives/m1") == "drives/m1/speed"
    assert pulses_signal("drives/m1") == "drives/m1/pulses"
    assert speed_command("main") == "belts/main/cmd_speed"


def _without_speed(**fields: Any) -> dict[str, Any]:
    """Return a belt without the fields that belong to a drive."""
    return {name: value for name, value in belt(0.0, **fields).items() if name not in ("speed", "speed_limits")}
