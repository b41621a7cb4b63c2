# SPDX-License-Identifier: Apache-2.0
"""The operator panel: contacts, latching, power that an emergency stop takes, and who may use the inputs."""

from __future__ import annotations

from pathlib import Path
from typing import Any, get_args

import pytest
from facts import missing
from scenes import base, belt, bottle, contact, scene, simulation

from conveyor_sim.errors import SceneError
from conveyor_sim.line.commands.inputs import MODE, OWN, SET, CommandOutcome, Input
from conveyor_sim.line.machines.packml import Command, PackMLState
from conveyor_sim.line.tag import UNITS
from conveyor_sim.scene.parts.panel import PanelUnit
from conveyor_sim.simulation import Simulation

STOP = {"kind": "emergency_stop", "cuts": ["drives", "machines"], "deceleration": 1.0}
PARTS: dict[str, Any] = {
    "start": {"kind": "button"},
    "stop": {"kind": "button", "contact": "NC"},
    "pump": {"kind": "button", "action": "maintained"},
    "worn": {"kind": "button", "bounce": 0.1},
    "mode": {"kind": "selector", "positions": ["off", "hand", "auto"], "initial": "hand"},
    "estop": STOP,
    "ready": {"kind": "lamp"},
    "horn": {"kind": "horn"},
    "stack": {"kind": "stack_light", "lights": ["red", "green"]},
    "speed": {"kind": "numeric", "unit": "m/s", "limits": [0.1, 0.5], "initial": 0.3, "written_by": "both"},
}
SOURCE = {"kind": "source", "bottle": "bottle", "position": [0.5, 0.0], "direction": 0.0, "speed": 0.5, "rate": 1.0}


def lined(panel: dict[str, Any] | None = None, **fields: Any) -> Simulation:
    """Return a belt with a drive (1 m/s^2), a belt without, a source and a panel."""
    return simulation(
        accuracy={"per_tick": 10},
        base=base(0.4),
        contacts=[contact(5000.0)],
        panel=PARTS if panel is None else panel,
        belts={"driven": belt(0.5, drive={"acceleration": 1.0}), "plain": belt(0.5, (0.0, 4.0))},
        machines={"source": SOURCE},
        bottles=[bottle(0.0, 0.0, 0.5)],
        **fields,
    )


def test_an_emergency_stop_of_a_cell_cuts_its_drives_and_machines_only() -> None:
    drive = {"drive": {"acceleration": 1.0}}
    sim = simulation(
        accuracy={"per_tick": 10},
        base=base(0.4),
        contacts=[contact(5000.0)],
        panel={"estop": STOP, "a_estop": {**STOP, "cell": "a"}},
        belts={"a_lane": belt(0.5, **drive), "ab_lane": belt(0.5, (0.0, 4.0), **drive)},
        machines={"a_source": SOURCE, "ab_source": {**SOURCE, "position": [0.5, 4.0]}},
        bottles=[bottle(0.0, 0.0, 0.5)],
    )
    parts = ("belts/a_lane/running", "belts/ab_lane/running", "machines/a_source/running", "machines/ab_source/running")
    act(sim, a_estop__press=1.0)
    sim.advance(5)
    assert [read(sim, name) for name in parts] == [0.0, 1.0, 0.0, 1.0]
    act(sim, estop__press=1.0)
    sim.advance(5)
    assert [read(sim, name) for name in parts] == [0.0, 0.0, 0.0, 0.0]
    act(sim, estop__reset=1.0)
    clear = float(Command.CLEAR)
    sim.give(Input("test", "controller", "controller", SET, ("machines/a_source/cntrl_cmd",), (clear,)))
    sim.give(Input("test", "controller", "controller", SET, ("machines/ab_source/cntrl_cmd",), (clear,)))
    sim.advance()
    refused, accepted = sim.take_outcomes()[-2:]
    assert not refused.accepted and missing(refused.reason, "panel/a_estop") == []
    assert accepted.accepted


def test_an_emergency_stop_of_no_cell_is_refused() -> None:
    with pytest.raises(SceneError, match="cell") as refusal:
        lined({"estop": {**STOP, "cell": "elsewhere"}})
    assert missing(str(refusal.value), "panel.estop.cell", "elsewhere") == []


def act(sim: Simulation, kind: str = "operator", **values: float) -> CommandOutcome:
    """Give inputs of the panel ("start__press") by a kind of writer in one tick, and return the last result."""
    for name, value in values.items():
        sim.give(Input("test", kind, kind, SET, (f"panel/{name.replace('__', '/')}",), (value,)))
    sim.advance()
    return sim.take_outcomes()[-1]


def read(sim: Simulation, name: str) -> float:
    return float(sim.signals()[sim.process_image.signal_names.index(name)])


def speeds(sim: Simulation) -> tuple[float, float]:
    return read(sim, "belts/driven/speed"), read(sim, "belts/plain/speed")


def test_contacts_follow_buttons() -> None:
    sim = lined()
    closed = {name: read(sim, f"panel/{name}/contact") for name in ("start", "stop", "pump", "estop")}
    assert closed == {"start": 0.0, "stop": 1.0, "pump": 0.0, "estop": 1.0}
    act(sim, start__press=1.0, stop__press=1.0, pump__pressed=1.0)
    assert [read(sim, f"panel/{name}/contact") for name in ("start", "stop", "pump")] == [1.0, 0.0, 1.0]
    sim.advance(50)
    assert read(sim, "panel/start/contact") == 1.0
    act(sim, start__press=0.0, stop__press=0.0)
    assert [read(sim, f"panel/{name}/contact") for name in ("start", "stop", "pump")] == [0.0, 1.0, 1.0]


def test_a_press_within_one_tick_lasts_one_scan() -> None:
    sim = lined()
    for name, values in (("start", (1.0, 0.0)), ("start", (1.0, 0.0, 1.0, 0.0))):
        for value in values:
            sim.give(Input("test", "jo", "operator", SET, (f"panel/{name}/press",), (value,)))
        seen = []
        for _ in range(3):
            sim.advance()
            seen.append(read(sim, f"panel/{name}/contact"))
        assert seen == [1.0, 0.0, 0.0]


def test_bounce_is_drawn_from_the_seed_and_loses_no_press() -> None:
    def course(sim: Simulation) -> list[float]:
        act(sim, worn__press=1.0)
        seen = [read(sim, "panel/worn/contact")]
        for _ in range(14):
            sim.advance()
            seen.append(read(sim, "panel/worn/contact"))
        return seen

    first = course(lined(seed=1))
    assert first[0] == 1.0 and set(first[1:10]) == {0.0, 1.0} and first[10:] == [1.0] * 5
    assert course(lined(seed=1)) == first
    assert any(course(lined(seed=seed)) != first for seed in (2, 3))


def test_a_checkpoint_holds_a_bounce_of_any_length(tmp_path: Path) -> None:
    sim = lined({"worn": {"kind": "button", "bounce": 1e20}})
    act(sim, worn__press=1.0)
    sim.save(tmp_path / "checkpoint")
    again = Simulation.load(tmp_path / "checkpoint")
    for each in (sim, again):
        each.advance(5)
    assert again.state_hash() == sim.state_hash()


def test_selector_and_number() -> None:
    sim = lined()
    assert (read(sim, "panel/mode/position"), read(sim, "panel/speed/value")) == (1.0, 0.3)
    act(sim, mode__turn=2.0, speed__set=0.4)
    assert (read(sim, "panel/mode/position"), read(sim, "panel/speed/value")) == (2.0, 0.4)
    # A controller that repeats its value does not overwrite that of the operator.
    for value, shown in ((0.3, 0.4), (0.2, 0.2), (0.2, 0.2)):
        sim.command(["panel/speed/write"], [value])
        sim.advance()
        assert read(sim, "panel/speed/value") == shown
    act(sim, speed__set=0.5)
    sim.command(["panel/speed/write"], [0.2])
    sim.advance()
    assert read(sim, "panel/speed/value") == 0.5


def test_an_operator_uses_the_panel_in_every_mode_and_whoever_owns_the_line() -> None:
    sim = lined()
    modes = [name for name in sim.process_image.signal_names if name.startswith("panel/") and name.endswith("/mode")]
    assert modes == ["panel/ready/mode", "panel/horn/mode", "panel/stack/mode", "panel/speed/mode"]
    sim.give(Input("test", "plc", "controller", OWN, (), ()))
    assert act(sim, start__press=1.0).accepted
    sim.give(Input("test", "eve", "engineer", MODE, ("belts/plain", "panel/ready"), (2.0, 2.0)))
    assert act(sim, start__press=0.0).accepted
    for kind in ("operator", "engineer", "test"):
        assert act(sim, kind, start__press=1.0).accepted


def test_a_controller_presses_nothing() -> None:
    sim = lined()
    refused = act(sim, "controller", estop__press=1.0)
    assert not refused.accepted and missing(refused.reason, "panel/estop/press", "controller", "operator") == []
    assert read(sim, "panel/estop/contact") == 1.0
    sim.command(["panel/ready/on", "panel/stack/red"], [1.0, 1.0])
    sim.advance()
    assert sim.take_outcomes()[-1].accepted


@pytest.mark.parametrize(
    "values",
    [
        {"start__press": float("nan")},
        {"start__press": 0.5},
        {"mode__turn": 3.0},
        {"mode__turn": 0.5},
        {"speed__set": 0.6},
        {"speed__set": float("inf")},
        {"start__turn": 1.0},
        {"nobody__press": 1.0},
    ],
    ids=str,
)
def test_wrong_inputs_are_refused_and_change_nothing(values: dict[str, float]) -> None:
    sim = lined()
    before = {name: read(sim, name) for name in sim.process_image.signal_names if name.startswith("panel/")}
    assert not act(sim, **values).accepted
    assert {name: read(sim, name) for name in before} == before


def test_an_emergency_stop_takes_power_and_its_reset_starts_nothing() -> None:
    sim = lined()
    act(sim, estop__press=1.0)
    assert read(sim, "panel/estop/contact") == 0.0 and "panel/estop/pressed" in sim.alarms
    assert speeds(sim) == pytest.approx((0.49, 0.49))
    assert read(sim, "machines/source/state") == PackMLState.ABORTED
    sim.advance(24)
    assert speeds(sim) == pytest.approx((0.25, 0.25))
    act(sim, estop__press=0.0)
    assert read(sim, "panel/estop/contact") == 0.0
    sim.advance(40)
    assert speeds(sim) == (0.0, 0.0) and read(sim, "belts/driven/running") == 0.0
    # Without power, start commands act only after power has returned and they are given again.
    for value in (0.0, 1.0):
        sim.command(["belts/driven/run", "belts/plain/cmd_speed"], [value, 0.5 * value])
        sim.advance()
    sim.command(["machines/source/cntrl_cmd"], [Command.CLEAR])
    sim.advance()
    assert missing(sim.take_outcomes()[-1].reason, "Clear", "power", "panel/estop", "reset") == []
    act(sim, estop__reset=1.0)
    sim.advance(100)
    assert read(sim, "panel/estop/contact") == 1.0 and "panel/estop/pressed" not in sim.alarms
    assert speeds(sim) == (0.0, 0.0) and read(sim, "machines/source/state") == PackMLState.ABORTED
    for value in (0.0, 1.0):
        sim.command(["belts/driven/run", "belts/plain/cmd_speed"], [value, 0.5 * value])
        sim.advance()
    for command in (Command.CLEAR, Command.RESET, Command.START):
        sim.command(["machines/source/cntrl_cmd"], [command])
        sim.advance()
    sim.advance(60)
    assert speeds(sim) == (0.5, 0.5)
    assert (read(sim, "belts/driven/running"), read(sim, "machines/source/state")) == (1.0, PackMLState.EXECUTE)


def test_a_press_and_reset_within_one_tick_takes_power_for_a_scan() -> None:
    sim = lined()
    act(sim, estop__press=1.0, estop__reset=1.0)
    assert read(sim, "panel/estop/contact") == 0.0
    sim.advance()
    assert read(sim, "panel/estop/contact") == 1.0 and read(sim, "belts/driven/running") == 0.0


def test_power_returns_with_the_last_of_two_stops() -> None:
    sim = lined({"one": STOP, "two": STOP, "signal": {"kind": "emergency_stop"}})
    act(sim, one__press=1.0, two__press=1.0, signal__press=1.0)
    sim.advance(60)
    act(sim, one__reset=1.0)
    for value in (0.0, 1.0):
        sim.command(["belts/driven/run"], [value])
        sim.advance()
    sim.advance(60)
    assert speeds(sim)[0] == 0.0
    act(sim, two__reset=1.0)
    for value in (0.0, 1.0):
        sim.command(["belts/driven/run"], [value])
        sim.advance()
    sim.advance(60)
    assert speeds(sim)[0] == 0.5 and read(sim, "panel/signal/contact") == 0.0


def test_a_stop_without_cuts_is_only_a_signal() -> None:
    sim = lined({"estop": {"kind": "emergency_stop"}})
    act(sim, estop__press=1.0)
    sim.advance(50)
    assert read(sim, "panel/estop/contact") == 0.0
    assert speeds(sim) == (0.5, 0.5) and sim.alarms == frozenset()


def test_named_drives_and_rejects_lose_power() -> None:
    one = {"drive": "m", "ratio": 2.0}
    sim = simulation(
        accuracy={"per_tick": 10},
        base=base(0.4),
        contacts=[contact(5000.0)],
        panel={"estop": STOP},
        drives={"m": {"speed": 0.5, "acceleration": 1.0}},
        belts={"one": {key: value for key, value in belt(0.5, **one).items() if "speed" not in key}},
        machines={"out": {"kind": "reject", "region": [[3.0, -1.0], [3.2, -1.0], [3.2, 1.0]]}},
        bottles=[bottle(0.0, 0.0, 0.5)],
    )
    act(sim, estop__press=1.0)
    assert read(sim, "belts/one/speed") == pytest.approx(0.98)
    assert read(sim, "machines/out/running") == 0.0
    sim.command(["machines/out/fire"], [1.0])
    sim.advance(100)
    assert read(sim, "machines/out/missed") == 0.0 and read(sim, "belts/one/speed") == 0.0


def test_a_checkpoint_continues_with_the_same_bits(tmp_path: Path) -> None:
    sim = lined()
    act(sim, estop__press=1.0, worn__press=1.0, start__press=1.0)
    sim.save(tmp_path / "half_way")
    again = Simulation.load(tmp_path / "half_way")
    for run in (sim, again):
        act(run, estop__reset=1.0, start__press=0.0)
        run.advance(30)
    assert sim.full_state_hash() == again.full_state_hash()


def test_a_panel_that_is_not_used_changes_no_bit_and_a_line_without_has_no_tags_of_it() -> None:
    plain, with_panel = lined({}), lined()
    for sim in (plain, with_panel):
        sim.advance(300)
    assert plain.state_hash() == with_panel.state_hash()
    assert not any(tag.name.startswith("panel/") or tag.role == "panel" for tag in plain.process_image.tags)
    others = [tag for tag in with_panel.process_image.tags if not tag.name.startswith(("panel/", "alarm"))]
    assert others == [tag for tag in plain.process_image.tags if not tag.name.startswith("alarm")]


@pytest.mark.parametrize(
    ("part", "facts"),
    [
        ({**STOP, "deceleration": None}, ["panel.x.deceleration", "left out", "drives"]),
        ({**STOP, "cuts": ["machines"]}, ["panel.x.deceleration", "expected none"]),
        ({**STOP, "cuts": ["drives", "drives"]}, ["panel.x.cuts", "once"]),
        ({**STOP, "cuts": ["lights"]}, ["panel.x.cuts", "drives", "machines"]),
        ({"kind": "selector", "positions": ["a", "b"], "initial": "c"}, ["panel.x.initial", '"c"', "a", "b"]),
        ({"kind": "selector", "positions": ["a", "a"]}, ["panel.x.positions", "once"]),
        ({"kind": "selector", "positions": ["a"]}, ["panel.x.positions", "2 to 20"]),
        ({"kind": "stack_light", "lights": ["red", "red"]}, ["panel.x.lights", "once"]),
        ({"kind": "numeric", "limits": [1, 0]}, ["panel.x.limits", "below"]),
        ({"kind": "numeric", "limits": [0, 1], "initial": 2}, ["panel.x.initial", "2", "0 to 1"]),
        ({"kind": "button", "bounce": -1}, ["panel.x.bounce", "-1", "0 or greater"]),
        ({"kind": "lever"}, ["panel.x.kind", "lever", "button", "numeric"]),
    ],
    ids=str,
)
def test_an_invalid_part_is_refused_with_its_field(part: dict[str, Any], facts: list[str]) -> None:
    with pytest.raises(SceneError) as refused:
        scene(panel={"x": part})
    assert missing(str(refused.value), *facts) == []


def test_stops_of_a_line_have_one_deceleration() -> None:
    with pytest.raises(SceneError) as refused:
        scene(panel={"x": STOP, "y": {**STOP, "deceleration": 2.0}})
    assert missing(str(refused.value), "panel.y.deceleration", "2 given", "expected 1") == []


def test_units_of_numbers_are_those_of_tags() -> None:
    assert set(get_args(PanelUnit)) == set(UNITS)
