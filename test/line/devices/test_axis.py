# SPDX-License-Identifier: Apache-2.0
"""Axes: gears, phase shifts, jogging, faults, emergency stops, belts, and the same bits in every division of a run."""

from __future__ import annotations

import math
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scenes import base, belt, bottle, simulation

from conveyor_sim.errors import SceneError
from conveyor_sim.line.commands.inputs import INJECT, Input
from conveyor_sim.simulation import Simulation

TURN = 2.0 * math.pi
RATE = 24_000 / 3600
OMEGA = TURN * RATE
"""Speed of the master, rad/s."""
TICK = 0.01
LIMITS: dict[str, Any] = {"acceleration": 20.0, "jog_speed": 1.0}


def axes(**more: dict[str, Any]) -> Simulation:
    """Return a master `block`, a wheel `star` of 12 pockets in gear, and more axes."""
    star = {"master": "block", "ratio": "1/12", "phase": "10 deg", **LIMITS, **more.pop("star", {})}
    block = {"rate": "24 000 /h", **LIMITS, **more.pop("block", {})}
    return simulation(axes={"block": block, "star": star, **more})


def signal(sim: Simulation, name: str) -> float:
    return float(sim.signals()[sim.process_image.signal_names.index(f"axes/{name}")])


def commanded(sim: Simulation, **values: float) -> Simulation:
    """Send commands to `star`, or to `block` with the prefix block_."""
    names = [f"axes/block/{name[6:]}" if name.startswith("block_") else f"axes/star/{name}" for name in values]
    sim.command(names, list(values.values()))
    return sim


def deviation(sim: Simulation, phase: float = math.radians(10.0), ratio: float = 1 / 12) -> float:
    """Return the deviation of `star` from the phase, from the positions of both axes, rad; modulo one pitch."""
    wrong = signal(sim, "star/position") - ratio * signal(sim, "block/position") - phase
    return math.remainder(wrong, TURN / 12)


def in_gear(sim: Simulation) -> None:
    """Advance until `star` is in gear."""
    for _ in range(1000):
        if signal(sim, "star/in_gear"):
            return
        sim.advance()
    raise AssertionError("star did not gear in within 10 s")


def test_an_axis_turns_at_its_rate_and_a_geared_one_at_its_ratio() -> None:
    sim = axes()
    for tick in range(1, 300):
        sim.advance()
        places = OMEGA * TICK * tick, OMEGA / 12 * TICK * tick + math.radians(10.0)
        for name, place in zip(("block", "star"), places, strict=True):
            assert math.remainder(signal(sim, f"{name}/position") - place, TURN) == pytest.approx(0.0, abs=1e-10)
    assert signal(sim, "star/speed") == OMEGA / 12
    assert signal(sim, "star/in_gear") == 1.0 and signal(sim, "star/phase_error") == 0.0


def test_a_change_of_rate_is_a_ramp_that_the_gear_follows_in_phase() -> None:
    sim = axes()
    sim.advance(100)
    start, before = signal(sim, "block/position"), OMEGA
    commanded(sim, block_rate=0.5 * RATE)
    duration = 0.5 * OMEGA / 20.0
    for tick in range(1, 200):
        sim.advance()
        time = tick * TICK
        ramp = min(time, duration)
        place = start + before * ramp - 10.0 * ramp**2 + 0.5 * before * max(0.0, time - duration)
        # The last tick of the ramp is shared with the new speed, which it reaches at its end.
        assert math.remainder(signal(sim, "block/position") - place, TURN) == pytest.approx(0.0, abs=20.0 * TICK**2)
        assert deviation(sim) == pytest.approx(0.0, abs=1e-12)
        assert signal(sim, "star/in_gear") == 1.0
    assert signal(sim, "block/speed") == 0.5 * OMEGA


@pytest.mark.parametrize("ratio", ["1/12", "-1/12", "3/1", "-5/7"])
def test_gearing_in_takes_up_speed_then_phase(ratio: str) -> None:
    """The error in gear is rounding. Speed and acceleration of the slave are continuous within its limits."""
    sim = axes(star={"ratio": ratio, "in_gear": False})
    value = float(Fraction(ratio))
    sim.advance(123)
    assert signal(sim, "star/speed") == 0.0 and signal(sim, "star/in_gear") == 0.0
    commanded(sim, gear_in=1)
    before = 0.0
    for _ in range(1000):
        sim.advance()
        speed = signal(sim, "star/speed")
        assert abs(speed - before) <= 20.0 * TICK * (1 + 1e-9)
        assert abs(speed) <= abs(value) * OMEGA + 1.0 + 1e-9
        before = speed
        if signal(sim, "star/in_gear"):
            break
    teeth = Fraction(ratio).denominator
    for _ in range(100):
        sim.advance()
        wrong = signal(sim, "star/position") - value * signal(sim, "block/position") - math.radians(10.0)
        assert math.remainder(wrong, TURN / teeth) == pytest.approx(0.0, abs=1e-9)
        assert signal(sim, "star/phase_error") == 0.0
        assert signal(sim, "star/speed") == pytest.approx(value * OMEGA, rel=1e-14)


def test_the_phase_error_while_it_gears_in_is_that_of_the_positions() -> None:
    """It ends within half a pitch of the wheel, and its report is true to less than the travel of a tick."""
    sim = axes(star={"in_gear": False})
    sim.advance(77)
    commanded(sim, gear_in=1)
    errors = []
    for _ in range(300):
        sim.advance()
        reported = signal(sim, "star/phase_error")
        if signal(sim, "star/speed") >= OMEGA / 12 or reported:
            assert abs(math.remainder(deviation(sim) - reported, TURN / 12)) <= OMEGA / 12 * TICK
        errors.append(reported)
    assert max(map(abs, errors)) <= TURN / 24 and errors[-1] == 0.0


def test_gearing_out_goes_on_at_the_own_rate() -> None:
    sim = axes()
    sim.advance(10)
    commanded(sim, gear_out=1, rate=0.1)
    sim.advance(100)
    assert signal(sim, "star/in_gear") == 0.0
    assert signal(sim, "star/speed") == pytest.approx(TURN * 0.1)
    commanded(sim, rate=0.0)
    sim.advance(100)
    assert signal(sim, "star/speed") == 0.0
    commanded(sim, gear_out=0, gear_in=1)
    in_gear(sim)
    assert deviation(sim) == pytest.approx(0.0, abs=1e-12)


def test_an_axis_gears_in_with_a_master_at_rest() -> None:
    sim = axes(block={"rate": 0.0, "rate_limit": RATE}, star={"in_gear": False})
    commanded(sim, gear_in=1)
    in_gear(sim)
    commanded(sim, block_rate=RATE)
    sim.advance(300)
    assert signal(sim, "star/speed") == OMEGA / 12 and deviation(sim) == pytest.approx(0.0, abs=1e-12)


def test_a_phase_shift_moves_to_the_new_phase_and_back() -> None:
    sim = axes()
    sim.advance(10)
    commanded(sim, phase_shift=0.2)
    sim.advance()
    assert signal(sim, "star/in_gear") == 0.0 and signal(sim, "star/phase_error") < 0.0
    in_gear(sim)
    assert deviation(sim, math.radians(10.0) + 0.2) == pytest.approx(0.0, abs=1e-12)
    commanded(sim, phase_shift=0.0)
    sim.advance()
    in_gear(sim)
    assert deviation(sim) == pytest.approx(0.0, abs=1e-12)


def test_jogging_moves_out_of_gear_only() -> None:
    sim = axes(star={"in_gear": False})
    commanded(sim, jog_forward=1)
    sim.advance(50)
    assert signal(sim, "star/speed") == 1.0
    commanded(sim, jog_backward=1)
    sim.advance(50)
    assert signal(sim, "star/speed") == 0.0
    commanded(sim, jog_forward=0)
    sim.advance(50)
    assert signal(sim, "star/speed") == -1.0
    commanded(sim, jog_backward=0, gear_in=1)
    in_gear(sim)
    sim.command(["axes/star/jog_forward"], [1.0])
    sim.advance()
    (outcome,) = sim.take_outcomes()[-1:]
    assert not outcome.accepted and "expected axes/star/gear_out before" in outcome.reason


def test_a_disabled_axis_brakes_and_those_in_gear_with_it_follow() -> None:
    sim = axes()
    commanded(sim, block_enable=0)
    sim.advance(300)
    assert signal(sim, "block/speed") == signal(sim, "star/speed") == 0.0
    assert signal(sim, "star/in_gear") == 1.0 and deviation(sim) == pytest.approx(0.0, abs=1e-12)
    commanded(sim, block_enable=1)
    sim.advance(300)
    assert signal(sim, "block/speed") == OMEGA and deviation(sim) == pytest.approx(0.0, abs=1e-12)
    commanded(sim, enable=0)
    sim.advance(100)
    assert signal(sim, "star/speed") == 0.0 and signal(sim, "star/in_gear") == 0.0
    assert signal(sim, "block/speed") == OMEGA


def jam(sim: Simulation, on: float) -> None:
    sim.inject("axes/star/jammed", on)


def test_a_jam_stops_all_axes_in_gear_at_the_limit_of_the_following_error() -> None:
    """The jammed wheel stands. Its error passes the limit after limit / speed, and then the master brakes."""
    sim = axes(star={"following_limit": 0.1}, third={"master": "block", "ratio": 0.5})
    sim.advance(100)
    jam(sim, 1.0)
    place = signal(sim, "star/position")
    ticks = 0
    while not signal(sim, "star/fault"):
        sim.advance()
        ticks += 1
        assert signal(sim, "star/position") == place
        assert signal(sim, "star/following_error") == pytest.approx(OMEGA / 12 * TICK * ticks, rel=1e-9)
    assert ticks == math.ceil(0.1 / (OMEGA / 12 * TICK))
    assert "axes/star/fault" in sim.alarms
    sim.advance(math.ceil(OMEGA / 20.0 / TICK) + 1)
    assert signal(sim, "block/speed") == signal(sim, "third/speed") == 0.0
    jam(sim, 0.0)
    commanded(sim, reset=1)
    sim.advance(1000)
    assert signal(sim, "star/fault") == 0.0 and signal(sim, "star/following_error") == 0.0
    assert signal(sim, "star/in_gear") == 1.0 and deviation(sim) == pytest.approx(0.0, abs=1e-11)
    assert signal(sim, "block/speed") == OMEGA


def test_a_short_jam_below_the_limit_is_caught_up_at_jog_speed() -> None:
    sim = axes(star={"following_limit": "none"})
    sim.advance(100)
    jam(sim, 1.0)
    sim.advance(5)
    jam(sim, 0.0)
    lost = 5 * OMEGA / 12 * TICK
    sim.advance()
    assert 0.0 < signal(sim, "star/following_error") < lost
    fastest = 0.0
    while signal(sim, "star/following_error"):
        sim.advance()
        fastest = max(fastest, signal(sim, "star/speed"))
    assert OMEGA / 12 < fastest <= OMEGA / 12 + 1.0
    assert deviation(sim) == pytest.approx(0.0, abs=1e-12)


def test_an_emergency_stop_brakes_the_train_in_gear() -> None:
    estop = {"stop": {"kind": "emergency_stop", "cuts": ["drives"], "deceleration": 1.0}}
    sim = simulation(
        panel=estop,
        axes={"block": {"rate": RATE, **LIMITS}, "star": {"master": "block", "ratio": "1/12", "phase": 0.0, **LIMITS}},
    )
    sim.advance(50)
    sim.command(["panel/stop/press"], [1.0], writer_kind="operator")
    sim.advance(300)
    assert signal(sim, "block/speed") == signal(sim, "star/speed") == 0.0
    assert signal(sim, "block/running") == signal(sim, "star/running") == 0.0
    assert deviation(sim, 0.0) == pytest.approx(0.0, abs=1e-12)
    # A start command of the master starts the axes in gear with it.
    sim.command(["panel/stop/press"], [0.0], writer_kind="operator")
    sim.command(["panel/stop/reset"], [1.0], writer_kind="operator")
    sim.advance()
    sim.command(["axes/block/enable"], [0.0])
    sim.advance()
    assert signal(sim, "star/running") == 0.0
    sim.command(["axes/block/enable"], [1.0])
    sim.advance(300)
    assert signal(sim, "block/running") == signal(sim, "star/running") == signal(sim, "star/in_gear") == 1.0
    assert signal(sim, "star/speed") == signal(sim, "block/speed") / 12.0 > 0.0


def test_an_axis_follows_a_named_drive_by_its_travel() -> None:
    belts = {"table": belt(0.0, drive="m")}
    for field in ("speed", "speed_limits"):
        del belts["table"][field]
    sim = simulation(
        base=base(0.4), drives={"m": {"speed": 0.5, "acceleration": 1.0}}, belts=belts,
        axes={"screw": {"drive": "m", "travel": "80 mm"}}, bottles=[bottle(0.0, 0.0)],
    )  # fmt: skip
    sim.advance(100)
    assert signal(sim, "screw/speed") == pytest.approx(TURN * 0.5 / 0.08)
    sim.command(["drives/m/cmd_speed"], [0.25])
    sim.advance(100)
    assert signal(sim, "screw/speed") == pytest.approx(TURN * 0.25 / 0.08)
    sim.command(["axes/screw/enable"], [0.0])
    sim.advance(1000)
    assert signal(sim, "screw/speed") == 0.0


def test_an_axis_follows_a_machine_and_stands_with_it() -> None:
    sink = {"kind": "sink", "region": [[9.0, 0.0], [9.4, 0.0], [9.4, 1.0]], "rate": 2.0}
    source = {"kind": "source", "bottle": "bottle", "position": [0.5, 0.2], "direction": 0.0, "speed": 0.5, "rate": 2.0}
    sim = simulation(
        base=base(0.4), belts={"b": belt(0.5)}, machines={"filler": source, "end": sink},
        contacts=[{"between": ["glass", "glass"], "stiffness": 5000}],
        axes={"wheel": {"machine": "filler"}},
    )  # fmt: skip
    sim.advance(300)
    assert signal(sim, "wheel/speed") == pytest.approx(TURN * 2.0)
    sim.command(["machines/filler/run"], [0.0])
    sim.advance(300)
    assert signal(sim, "wheel/speed") == 0.0


def table(**more: Any) -> dict[str, Any]:
    ring = {"kind": "curved", "centre": [0.0, 0.0], "start_angle": 0.0, "span": "360 deg", "inner_radius": 0.2,
            "width": 0.4, "material": "chain", "axis": "star"}  # fmt: skip
    return {"table": {**ring, **more}}


def test_a_turn_table_turns_with_its_axis() -> None:
    """A bottle that rides on it has its angular speed; the travel of a tick is that of the axis, also in a ramp."""
    sim = simulation(
        base=base(0.9), belts=table(), bottles=[bottle(0.4, 0.0, 0.0, 0.4 * OMEGA / 12 / 2)],
        axes={"block": {"rate": RATE / 2, "rate_limit": RATE, **LIMITS},
              "star": {"master": "block", "ratio": "1/12", "phase": 0.0, **LIMITS}},
    )  # fmt: skip
    place, before, turned = 0.0, signal(sim, "star/position"), 0.0
    for tick in range(200):
        if tick == 50:
            commanded(sim, block_rate=RATE)
        sim.advance()
        place += float(sim.belts().actual[0]) * TICK / 0.4
        after = signal(sim, "star/position")
        turned += (after - before) % TURN
        before = after
    assert place == pytest.approx(turned, rel=1e-12)
    (omega,) = np.hypot(sim.bottles().vx, sim.bottles().vy) / np.hypot(sim.bottles().x, sim.bottles().y)
    assert omega == pytest.approx(OMEGA / 12, rel=1e-3)
    assert sim.belts().commanded[0] == pytest.approx(0.4 * OMEGA / 12)


def test_a_straight_belt_travels_by_the_cycle_of_its_axis() -> None:
    straight = {name: value for name, value in belt(0.0).items() if name not in ("speed", "speed_limits")}
    sim = simulation(base=base(0.4), axes={"block": {"rate": 2.0}}, bottles=[bottle(0.0, 0.0)],
                     belts={"lane": {**straight, "axis": "block", "travel": "150 mm"}})  # fmt: skip
    sim.advance()
    assert sim.belts().actual[0] == pytest.approx(0.3)
    request = Input("test", "test", "test", "set", ("belts/lane/cmd_speed",), (1.0,))
    assert "as axes/block moves this belt" in sim.line.refusal(request)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"axis": "none_such"}, "expected a name from axes"),
        ({"speed": 0.5}, "axes.star has it"),
        ({"travel": 0.1, "ratio": 2.0}, "given with travel"),
        ({"drive": {"acceleration": 1.0}}, "given with drive"),
    ],
)
def test_fields_of_a_belt_that_contradict_its_axis_are_refused(changes: dict[str, Any], words: str) -> None:
    with pytest.raises(SceneError, match=words):
        simulation(base=base(0.9), belts=table(**changes), axes={"star": {"rate": 1.0}}, bottles=[bottle(0.4, 0.0)])


def test_a_belt_needs_an_axis_without_a_cam() -> None:
    star = {"master": "block", "cam": [[0.0, 0.0], [1.0, 1.0], [2.0, 0.0]]}
    with pytest.raises(
        SceneError, match=r"axes\.star\.cam: given, expected none: belts\.table needs an axis without a cam"
    ):
        simulation(base=base(0.9), belts=table(), axes={"block": {"rate": 1.0}, "star": star}, bottles=[bottle(0.4, 0)])


SCRIPT = {
    5: ("axes/star/gear_out", 1.0), 60: ("axes/star/jog_forward", 1.0), 90: ("axes/star/jog_forward", 0.0),
    120: ("axes/star/gear_in", 1.0), 190: ("axes/star/phase_shift", -0.15), 197: ("axes/block/rate", 0.3 * RATE),
    230: ("axes/star/jammed", 1.0), 234: ("axes/star/jammed", 0.0),
}  # fmt: skip


def played(sim: Simulation, first: int, last: int, portion: int = 1) -> list[list[float]]:
    """Advance from tick `first` to `last` in portions, with the commands of the script. Return all signals."""
    rows = []
    tick = first
    while tick < last:
        if tick in SCRIPT:
            name, value = SCRIPT[tick]
            sim.inject(name, value) if name.endswith("jammed") else sim.command([name], [value])
        stop = min([tick + portion, last, *(at for at in SCRIPT if at > tick)])
        sim.advance(stop - tick)
        tick = stop
        rows.append(sim.signals().tolist())
    return rows


def scene_with_table() -> dict[str, Any]:
    return {
        "base": base(0.9), "belts": table(), "bottles": [bottle(0.4, 0.0)],
        "axes": {"star": {"master": "block", "ratio": "1/12", "phase": 0.1, **LIMITS},
                 "block": {"rate": RATE, **LIMITS}},
    }  # fmt: skip


@pytest.mark.parametrize("cut", [30, 75, 130, 192, 232, 240])
def test_a_checkpoint_continues_with_the_same_bits(cut: int, tmp_path: Path) -> None:
    through, sim = simulation(**scene_with_table()), simulation(**scene_with_table())
    expected = played(through, 0, 300)
    played(sim, 0, cut)
    sim.save(tmp_path / "checkpoint")
    again = Simulation.load(tmp_path / "checkpoint")
    assert again.signals().tolist() == expected[cut - 1]
    assert played(again, cut, 300) == expected[cut:]
    assert again.state_hash() == through.state_hash()


def test_portions_and_threads_do_not_change_bits() -> None:
    from scenes import scene

    one = Simulation(scene(**scene_with_table()), threads=1)
    two = Simulation(scene(**scene_with_table()), threads=2)
    assert played(one, 0, 300)[-1] == played(two, 0, 300, portion=17)[-1]
    assert one.state_hash() == two.state_hash()


def test_jammed_is_a_fault_and_no_command() -> None:
    sim = axes()
    assert sim.line.refusal(Input("test", "test", "test", INJECT, ("axes/star/jammed",), (1.0,))) == ""
    assert "axes/star/jammed" not in sim.process_image.command_names


def loaded(**star: Any) -> Simulation:
    """Return a star wheel that drags a bottle of 2 kg over the floor, at 0.3 m from its centre, mu = 0.3."""
    wheel = {"centre": [0.0, 0.0], "turn": "left", "entry": 0.0, "carry": "180 deg", "pockets": 12, "pitch_radius": 0.3,
             "pocket_radius": 0.034, "axis": "star", "material": "steel",
             "guide": {"material": "steel", "to": "360 deg"}}  # fmt: skip
    damping = {"law": "normal", "restitution": 0.2}
    return simulation(
        bottle_types={"bottle": {"radius": 0.033, "mass": 2.0, "material": "glass"}},
        contacts=[{"between": ["glass", "steel"], "stiffness": 20000.0, "damping": damping}],
        floor={"friction": 0.3}, stars={"wheel": wheel}, bottles=[bottle(0.3, 0.0)],
        axes={"block": {"rate": 1.0, **LIMITS}, "star": {"master": "block", "ratio": "1/12", "inertia": 0.05, **star}},
    )  # fmt: skip


DRAG = 0.3 * 2.0 * 9.81 * 0.3
"""Torque of friction on the floor, N m."""


def test_the_torque_of_a_wheel_is_that_of_the_friction_of_its_bottle() -> None:
    sim = loaded()
    sim.advance(200)
    torques = []
    for _ in range(100):
        sim.advance()
        torques.append(signal(sim, "star/torque"))
    assert np.mean(torques) == pytest.approx(DRAG, rel=0.02)
    assert signal(sim, "star/in_gear") == 1.0 and signal(sim, "star/torque_limited") == 0.0


def test_an_overloaded_drive_pushes_with_its_limit_and_its_failure_stops_the_train() -> None:
    sim = loaded(torque_limit=0.5 * DRAG, following_limit=0.3)
    torques = []
    while not signal(sim, "star/fault"):
        sim.advance()
        torques.append(signal(sim, "star/torque"))
    assert np.mean(torques[-20:]) == pytest.approx(0.5 * DRAG, rel=0.02)
    assert signal(sim, "star/torque_limited") == 1.0 and signal(sim, "star/following_error") > 0.3
    assert {"axes/star/torque", "axes/star/fault"} <= sim.alarms
    sim.advance(100)
    assert signal(sim, "block/speed") == 0.0
    sim.delete(int(sim.bottles().id[0]))
    commanded(sim, reset=1)
    sim.advance(300)
    assert signal(sim, "star/in_gear") == 1.0 and signal(sim, "block/speed") == TURN
    assert not {"axes/star/torque", "axes/star/fault"} & sim.alarms


def test_signals_of_a_long_jam_stay_in_their_ranges() -> None:
    """A jam without following limit lasts for longer than a cycle; the bottle has come to rest, so its torque is 0."""
    sim = loaded(following_limit="none")
    sim.inject("axes/star/jammed", 1.0)
    sim.advance(1500)
    assert signal(sim, "star/following_error") == TURN
    assert math.copysign(1.0, signal(sim, "star/torque")) == 1.0 and signal(sim, "star/torque") == 0.0
    tags = sim.process_image.signals
    assert all(tag.low <= value <= tag.high for tag, value in zip(tags, sim.signals().tolist(), strict=True))


def test_failure_of_a_slave_suppresses_the_alarms_of_its_master() -> None:
    """Both have failed, and both statuses say so; only the alarm of the slave, the cause, stands."""
    sim = loaded(following_limit=0.05)
    sim.inject("axes/star/jammed", 1.0)
    sim.inject("axes/block/jammed", 1.0)
    sim.advance(100)
    assert signal(sim, "star/fault") == signal(sim, "block/fault") == 1.0
    assert "axes/star/fault" in sim.alarms and "axes/block/fault" not in sim.alarms
    sim.inject("axes/star/jammed", 0.0)
    sim.command(["axes/star/reset"], [1.0])
    sim.advance(50)
    assert "axes/star/fault" not in sim.alarms and "axes/block/fault" in sim.alarms
