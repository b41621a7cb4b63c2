# SPDX-License-Identifier: Apache-2.0
"""Events of a line are recorded at their ticks, in order, once."""

from pathlib import Path

import pytest

from conveyor_sim.columns.events import Event
from conveyor_sim.control.scan import ALARMS as CONTROLLERS
from conveyor_sim.line.alarms.declaration import MOST_ALARMS
from conveyor_sim.line.commands.inputs import INJECT, SET, Input
from conveyor_sim.line.commands.refusal import ALARMS
from conveyor_sim.scene import Scene, load_scene
from conveyor_sim.simulation import Simulation
from conveyor_sim.support.resources import scene_path

REJECT = load_scene(scene_path("scenarios/reject_line"))
FUNNEL = load_scene(scene_path("scenarios/funnel_mouth"))
FIRE = "machines/rejecter/fire"


def setting(name: str, value: float) -> Input:
    return Input("test", "test", "test", SET, (name,), (value,))


def run(sim: Simulation, ticks: int) -> list[Event]:
    """Return all events within a number of ticks."""
    events = []
    for _ in range(ticks):
        sim.advance()
        events += sim.line.happened
    return events


def value(sim: Simulation, signal: str) -> float:
    return float(sim.signals()[sim.process_image.signal_names.index(signal)])


def of(events: list[Event], kind: str) -> list[tuple[int, str, int, float]]:
    return [(e.at, e.name, e.bottle, e.value) for e in events if e.kind == kind]


def test_bottles_fed_and_taken_are_those_that_come_and_go() -> None:
    sim = Simulation(FUNNEL)
    present = set(sim.bottles().id.tolist())
    assert not sim.line.happened  # what stands there at the start was not fed
    for _ in range(400):
        sim.advance()
        now = set(sim.bottles().id.tolist())
        come = {e.bottle for e in sim.line.happened if e.kind == "bottle_fed"}
        gone = {e.bottle for e in sim.line.happened if e.kind == "bottle_removed"}
        assert (come, gone) == (now - present, present - now)
        assert {e.at for e in sim.line.happened} <= {sim.tick}
        present = now
    assert sim.line.happened_so_far > 10


def test_the_value_counts_the_bottles_of_a_device() -> None:
    sim = Simulation(FUNNEL)
    taken = of(run(sim, 400), "bottle_removed")
    assert [value for _, _, _, value in taken] == list(range(1, len(taken) + 1))
    assert value(sim, "machines/packer/taken") == len(taken)


def test_a_bottle_thrown_out_is_rejected_not_removed() -> None:
    sim = Simulation(REJECT)
    for _ in range(4000):
        sim.command((FIRE,), (float(sim.tick % 20 < 10),))
        sim.advance()
        if value(sim, "machines/rejecter/rejected"):
            break
    assert [(e.kind, e.name, e.value) for e in sim.line.happened if e.bottle >= 0 and e.kind != "bottle_fed"] == [
        ("bottle_rejected", "machines/rejecter", 1.0)
    ]


def test_faults_states_and_refusals_are_noted_at_their_ticks() -> None:
    sim = Simulation(REJECT)
    run(sim, 5)
    sim.inject("belts/line/trip", 1.0)
    sim.command(("belts/nowhere/cmd_speed",), (1.0,))
    events = run(sim, 1)
    assert of(events, "fault_injected") == [(5, "belts/line/trip", -1, 1.0)]
    assert of(events, "command_refused") == [(5, "belts/nowhere/cmd_speed", -1, 1.0)]
    assert of(events, "machine_state") == [(6, "belts/line/running", -1, 0.0), (6, "belts/line/fault", -1, 1.0)]
    assert "no such command" in next(e.text for e in events if e.kind == "command_refused")
    sim.inject("belts/line/trip", 0.0)
    assert of(run(sim, 1), "fault_cleared") == [(6, "belts/line/trip", -1, 0.0)]


def test_an_alarm_is_noted_when_it_comes_and_when_it_goes() -> None:
    sim = Simulation(REJECT)
    seen = []
    for given in (0.0, 1.0, 1.0, None, 0.0, 0.0):
        if given is not None:
            sim.command(("alarms/full",), (given,))
        sim.advance()
        seen.append(([e.kind for e in sim.line.happened if e.name == "alarms/full"], set(sim.alarms)))
    assert seen == [
        ([], set()),
        (["alarm_raised"], {"full"}),
        ([], {"full"}),
        ([], {"full"}),
        (["alarm_cleared"], set()),
        ([], set()),
    ]
    assert all(outcome.accepted for outcome in sim.take_outcomes())


def test_an_alarm_beside_a_refused_command_is_noted() -> None:
    sim = Simulation(REJECT)
    sim.command(("alarms/full", "belts/line/cmd_speed"), (1.0, 1e9))
    sim.advance()
    assert [o.accepted for o in sim.take_outcomes()] == [False]
    assert [e.kind for e in sim.line.happened] == ["command_refused", "alarm_raised"]


def test_an_alarm_that_somebody_injects_is_refused_and_not_raised() -> None:
    sim = Simulation(REJECT)
    sim.inject("alarms/full", 1.0)
    sim.advance()
    assert [e.kind for e in sim.line.happened] == ["command_refused"]
    assert not sim.alarms


@pytest.mark.parametrize("given", [0.5, float("nan"), -1.0, 2.0])
def test_an_alarm_is_zero_or_one(given: float) -> None:
    sim = Simulation(REJECT)
    assert sim.line.refusal(setting("alarms/full", given)) == f"alarms/full: {given:g} given, expected 0 or 1"
    assert sim.line.refusal(setting("alarms/full", 1.0)._replace(operation=INJECT))  # nobody injects one


@pytest.mark.parametrize(
    ("name", "shown"), [("alarms/a\nb", r"a\nb"), (f"alarms/{'a' * 300}", f"{'a' * 192}…"), ("alarms/voll ü", "voll ü")]
)
def test_an_alarm_is_kept_as_it_can_be_shown(name: str, shown: str) -> None:
    """So a recording, which holds that name, replays to the same one."""
    sim = Simulation(REJECT)
    for _ in range(2):
        sim.command((name,), (1.0,))
        sim.advance()
        (outcome,) = sim.take_outcomes()
        assert outcome.accepted
        (name,) = outcome.names
        assert sim.alarms == {shown}
    assert sim.line.happened_so_far == 2  # a bottle, and the alarm once


def test_an_alarm_has_a_name() -> None:
    expected = "alarms/: given, expected alarms/ and the name of an alarm"
    assert Simulation(REJECT).line.refusal(setting("alarms/", 1.0)) == expected


def test_the_alarms_that_stand_are_bounded() -> None:
    sim = Simulation(REJECT)
    many = tuple(f"alarms/{number}" for number in range(MOST_ALARMS))
    sim.command(many, (1.0,) * MOST_ALARMS)
    sim.command(("alarms/one more",), (1.0,))
    sim.command(many[:1], (1.0,))
    sim.advance()
    assert [o.accepted for o in sim.take_outcomes()] == [True, False, True]
    assert len(sim.alarms) == MOST_ALARMS
    sim.command((many[0], "alarms/in its place"), (0.0, 1.0))
    sim.advance()
    assert [o.accepted for o in sim.take_outcomes()] == [True]
    assert len(sim.alarms) == MOST_ALARMS
    assert "in its place" in sim.alarms


def test_controllers_and_lines_know_alarms_by_the_same_name() -> None:
    assert ALARMS == CONTROLLERS


@pytest.mark.parametrize("scene", [REJECT, FUNNEL], ids=lambda scene: scene.name)
def test_a_checkpoint_remembers_alarms_states_and_what_has_just_happened(scene: Scene, tmp_path: Path) -> None:
    sim = Simulation(scene)
    trip = sim.process_image.fault_names[0]
    sim.command(("alarms/full",), (1.0,))
    sim.inject(trip, 1.0)
    run(sim, 30)
    sim.command(("alarms/late",), (1.0,))
    sim.save(tmp_path / "there")
    loaded = Simulation.load(tmp_path / "there")
    assert (loaded.line.happened, loaded.line.happened_so_far, loaded.alarms) == (
        sim.line.happened,
        sim.line.happened_so_far,
        sim.alarms,
    )
    own = {alarm.id for alarm in sim.line.alarms if alarm.own}
    assert sim.alarms - own == {"full"}
    for each in (sim, loaded):
        each.inject(trip, 0.0)
    assert run(loaded, 100) == run(sim, 100)
    assert loaded.alarms == sim.alarms and loaded.alarms - own == {"full", "late"}
    assert loaded.line.happened_so_far == sim.line.happened_so_far
