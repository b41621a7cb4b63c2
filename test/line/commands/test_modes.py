# SPDX-License-Identifier: Apache-2.0
"""Control mode of devices and ownership of the line: which commands are accepted."""

from pathlib import Path

import pytest
from facts import missing
from scenes import base, belt, bottle, simulation

from conveyor_sim.line.commands.authority import AUTOMATIC, IN_CONTROL, MAINTENANCE, MANUAL, MAY
from conveyor_sim.line.commands.inputs import DISOWN, INJECT, MODE, OWN, SET, WRITER_KINDS, CommandOutcome, Input
from conveyor_sim.line.commands.modes import Modes
from conveyor_sim.simulation import Simulation

ONE, TWO = "belts/one/cmd_speed", "belts/two/cmd_speed"


def two_belts(watchdog: float | None = None) -> Simulation:
    return simulation(
        accuracy={"per_tick": 10},
        base=base(0.4),
        where="hall/line_1",
        belts={
            "one": belt(0.2, (0.0, 0.0), 1.0, 1.0, watchdog=watchdog),
            "two": belt(0.3, (2.0, 0.0), 1.0, 1.0),
        },
        zones={"z": {"region": [[0, 0], [1, 0], [1, 1]]}},
        bottles=[bottle(0.5, 0.5)],
    )


def act(kind: str, operation: str, *given: tuple[str, float], writer: str = "Jo", texts: tuple[str, ...] = ()) -> Input:
    names, values = zip(*given, strict=True) if given else ((), ())
    return Input("here", writer, kind, operation, names, values, texts)


def plc(*given: tuple[str, float], writer: str = "plc") -> Input:
    return act("controller", SET, *given, writer=writer)


def mode(kind: str, number: float, device: str = "belts/one") -> Input:
    return act(kind, MODE, (device, number))


def after(sim: Simulation, *given: Input) -> list[CommandOutcome]:
    """Return the results of inputs in the next tick."""
    for one in given:
        sim.give(one)
    sim.advance()
    return sim.take_outcomes()


def shown(sim: Simulation, name: str) -> float:
    return float(sim.signals()[sim.process_image.signal_names.index(name)])


def commanded(sim: Simulation) -> list[float]:
    return sim.belts().commanded.tolist()


def test_only_devices_that_take_commands_have_a_mode() -> None:
    sim = two_belts()
    (one, two) = [tag for tag in sim.process_image.signals if tag.name.endswith("/mode")]
    assert (one.name, two.name, one.device, one.device_class) == (
        "belts/one/mode",
        "belts/two/mode",
        "belts/one",
        "belt",
    )
    assert (one.role, one.initial, dict(one.texts)) == (
        "status",
        AUTOMATIC,
        {1: "Automatic", 2: "Maintenance", 3: "Manual"},
    )
    assert (shown(sim, one.name), shown(sim, two.name)) == (AUTOMATIC, AUTOMATIC)


@pytest.mark.parametrize("number", IN_CONTROL)
@pytest.mark.parametrize("kind", ["controller", "operator", "engineer", "test"])
def test_commands_are_taken_of_those_in_control(kind: str, number: int) -> None:
    """The setpoint stays when the control mode changes."""
    sim = two_belts()
    outcomes = after(sim, mode("test", number), act(kind, SET, (ONE, 0.7)))
    allowed = kind in IN_CONTROL[number]
    assert [outcome.accepted for outcome in outcomes] == [True, allowed]
    assert outcomes[1].without_control is not allowed
    assert commanded(sim)[0] == (0.7 if allowed else 0.2)
    assert shown(sim, "belts/one/mode") == number
    for back in IN_CONTROL:
        after(sim, mode("test", back))
        assert commanded(sim)[0] == (0.7 if allowed else 0.2)


def test_what_a_controller_has_no_control_of_is_taken_out_of_its_scan() -> None:
    """The rest is applied. A record of both parts gives the same results again."""
    sim = two_belts()
    after(sim, mode("operator", MANUAL))
    outcomes = after(sim, plc((ONE, 0.5), (TWO, 0.6), ("alarms/x", 1.0)))
    assert [(o.names, o.values, o.accepted, o.part) for o in outcomes] == [
        ((ONE,), (0.5,), False, True),
        ((TWO, "alarms/x"), (0.6, 1.0), True, False),
    ]
    assert missing(outcomes[0].reason, "belts/one", "Manual", "operator Jo", "Automatic") == []
    assert commanded(sim) == [0.2, 0.6]
    again = after(sim, *(outcome.input for outcome in outcomes))
    assert [(o.input, o.accepted, o.reason) for o in again] == [(o.input, o.accepted, o.reason) for o in outcomes]
    (wrong,) = after(sim, plc(("belts/one/speeed", 0.5), (TWO, 0.1)))
    assert wrong.reason.startswith("belts/one/speeed: no such command") and not wrong.without_control


def test_of_others_the_whole_is_refused() -> None:
    sim = two_belts()
    after(sim, mode("operator", MANUAL))
    given = act("operator", SET, (ONE, 0.5), (TWO, 0.6))
    reason = "belts/two: is in Automatic, expected Manual for an operator's commands"
    assert sim.line.refusal(given) == reason
    (outcome,) = after(sim, given)
    assert (outcome.reason, outcome.names, commanded(sim)) == (reason, (ONE, TWO), [0.2, 0.3])


def test_what_waits_counts_when_a_refusal_is_asked_for() -> None:
    sim = two_belts()
    command = act("operator", SET, (ONE, 0.5))
    assert sim.line.refusal(command)
    sim.give(mode("controller", MANUAL))  # which will be refused
    assert sim.line.refusal(command)
    sim.give(mode("operator", MANUAL))
    assert sim.line.refusal(command) == ""
    assert sim.line.refusal(plc((ONE, 0.5))) and sim.line.refusal(plc((ONE, 0.5), (TWO, 0.5))) == ""
    assert missing(sim.line.refusal(mode("operator", MAINTENANCE)), "belts/one", "Maintenance", "engineer") == []
    sim.give(mode("engineer", MAINTENANCE))
    assert missing(sim.line.refusal(mode("operator", AUTOMATIC)), "belts/one", "Maintenance", "engineer") == []


@pytest.mark.parametrize(
    ("given", "reason"),
    [
        (mode("controller", 3), "mode: given by controller Jo, expected one of the kind operator or engineer or test"),
        (mode("operator", 4), "belts/one: 4 given, expected 1 to 3"),
        (mode("operator", 3, "zones/z"), "zones/z: no such device, expected one of belts/one, belts/two"),
        (act("operator", MODE), "no name and no value given, expected at least one device"),
        (act("test", OWN), "own: given by test Jo, expected one of the kind controller"),
        (act("controller", DISOWN), "the line has no owner, expected one"),
        (act("controller", OWN, writer=""), "no writer given, expected the name of a controller"),
        (act("controller", OWN, texts=("zones/*",)), "zones/*: fits no device that takes commands, expected such as"),
        (
            act("controller", OWN, (ONE, 1.0)),
            "1 names, 1 values, 0 texts given, expected texts alone, patterns of devices",
        ),
        (act("operator", INJECT, ("x", 1.0)), "inject: given by operator Jo, expected one of the kind test"),
    ],
)  # fmt: skip
def test_refusals(given: Input, reason: str) -> None:
    sim = two_belts()
    assert sim.line.refusal(given).startswith(reason)
    (outcome,) = after(sim, given)
    assert not outcome.accepted and outcome.reason.startswith(reason)
    assert shown(sim, "belts/one/mode") == AUTOMATIC and not sim.line.modes.owner


def test_an_owner_excludes_other_controllers_but_where_it_releases_groups() -> None:
    sim = two_belts()
    after(sim, act("controller", OWN, writer="plc", texts=("hall/line_1/belts/t*",)))
    other = after(sim, plc((ONE, 0.5), (TWO, 0.6), writer="forgotten"))
    assert [(o.names, o.accepted) for o in other] == [((ONE,), False), ((TWO,), True)]
    assert missing(other[0].reason, "belts/one", "controller plc", "release") == []
    assert all(o.accepted for o in after(sim, plc((ONE, 0.7), (TWO, 0.8))))
    assert missing(sim.line.refusal(act("controller", OWN, writer="forgotten")), "controller plc", "release") == []
    assert sim.line.refusal(act("controller", DISOWN, writer="forgotten"))
    after(sim, mode("operator", MANUAL))
    assert all(o.accepted for o in after(sim, act("operator", SET, (ONE, 0.1)), act("test", SET, (TWO, 0.1))))
    after(sim, mode("operator", AUTOMATIC), act("controller", OWN, writer="plc"))
    assert not after(sim, plc((TWO, 0.6), writer="forgotten"))[0].accepted
    after(sim, act("controller", DISOWN, writer="plc"))
    assert after(sim, plc((ONE, 0.5), (TWO, 0.6), writer="forgotten"))[0].accepted


def test_each_change_is_an_event_and_refusals_are_one_each_time_hands_change() -> None:
    sim = two_belts()
    events = []
    for given in (
        (mode("operator", MANUAL), plc((ONE, 0.5))),
        (plc((ONE, 0.5)),),
        (act("engineer", MODE, ("belts/one", 2.0), ("belts/two", 1.0)), plc((ONE, 0.5))),
        (mode("engineer", AUTOMATIC), act("controller", OWN, writer="plc", texts=("belts/two",)), plc((ONE, 0.5))),
        (plc((ONE, 0.6), writer="forgotten"),),
        (plc((ONE, 0.6), writer="forgotten"), act("controller", DISOWN, writer="plc")),
    ):
        after(sim, *given)
        events += [
            (event.at, event.kind, event.name, event.value, event.text.split(",")[0]) for event in sim.line.happened
        ]
    assert events == [
        (0, "mode_changed", "belts/one", 3.0, "by operator Jo"),
        (0, "command_refused", ONE, 0.5, "belts/one: is in Manual"),
        (2, "mode_changed", "belts/one", 2.0, "by engineer Jo"),
        (2, "command_refused", ONE, 0.5, "belts/one: is in Maintenance"),
        (3, "mode_changed", "belts/one", 1.0, "by engineer Jo"),
        (3, "owner_changed", "plc", 1.0, "released: belts/two"),
        (4, "command_refused", ONE, 0.6, "belts/one: the line is owned by controller plc"),
        (5, "owner_changed", "plc", 0.0, ""),
    ]


def test_a_watchdog_waits_for_a_controller_in_automatic_only() -> None:
    """Outside automatic mode it rests.

    Its full time, 0.05 s, starts when the belt is back in automatic mode.
    """
    sim = two_belts(watchdog=0.05)
    after(sim, mode("operator", MANUAL))
    sim.advance(20)
    assert commanded(sim)[0] == 0.2
    after(sim, mode("operator", AUTOMATIC))
    sim.advance(4)
    assert commanded(sim)[0] == 0.2
    sim.advance(1)
    assert commanded(sim)[0] == 0.0


def test_hands_are_in_a_checkpoint(tmp_path: Path) -> None:
    sim = two_belts()
    own = act("controller", OWN, writer="plc", texts=("belts/two",))
    after(sim, mode("operator", MANUAL), own, plc((ONE, 0.5), writer="forgotten"))
    sim.save(tmp_path / "kept")
    again = Simulation.load(tmp_path / "kept")
    other = two_belts()
    other.restore_from(sim)
    for one in (again, other):
        assert one.line.modes.signals and vars_of(one.line.modes) == vars_of(sim.line.modes)
        assert one.signals().tolist() == sim.signals().tolist()
    given = plc((ONE, 0.5), (TWO, 0.5), writer="forgotten")
    expected = after(sim, given)
    assert after(again, given) == expected and expected[0].repeated
    assert [(o.accepted, o.names) for o in expected] == [(False, (ONE,)), (True, (TWO,))]


def vars_of(modes: Modes) -> dict[str, object]:
    return {name: value for name, value in vars(modes).items() if not name.startswith("_")}


@pytest.mark.parametrize(
    "change",
    [
        {"modes": {"belts/one": 0, "belts/two": 1}},
        {"modes": {"belts/one": 1}},
        {"owner": "\x1b"},
        {"released": ["zones/*"]},
        {"reported": ["belts/three:controller"]},
        {"taken_by": {"belts/one": "\n", "belts/two": ""}},
    ],
)
def test_what_no_line_can_have_is_refused(change: dict[str, object]) -> None:
    sim = two_belts()
    memory = sim.line.snapshot()
    memory["modes"] |= change
    with pytest.raises(ValueError, match=r"line\.modes"):
        sim.line.restore(sim.tick, memory)


def test_every_operation_of_a_line_is_in_the_table() -> None:
    line = two_belts().line
    assert set(line.operations) == set(MAY)
    for operation, right in MAY.items():
        kinds = set(right.writers)
        assert kinds and kinds < set(WRITER_KINDS) and "line" not in kinds, operation
        assert right.what.endswith(".") and len(right.what) < 80, operation
