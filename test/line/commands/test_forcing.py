# SPDX-License-Identifier: Apache-2.0
"""Forced signals: controllers read the forced value, and the line itself does not change."""

import math
from pathlib import Path

import numpy as np
import pytest
from scenes import base, belt, bottle, simulation

from conveyor_sim.line.commands.inputs import FORCE, UNFORCE, CommandOutcome, Input
from conveyor_sim.simulation import Simulation

SPEED, BLOCKED, REMOVED = "belts/one/speed", "photo_eyes/e/blocked", "outfeeds/out/removed"


def passing() -> Simulation:
    """Return a line with a bottle that passes a photo-eye and leaves by an outfeed 0.4 m further on."""
    return simulation(
        accuracy={"per_tick": 10},
        base=base(0.4),
        belts={"one": belt(0.5, (0.0, 0.0), 2.0, 1.0)},
        bottles=[bottle(0.5, 0.5)],
        photo_eyes={"e": {"from": [0.6, 0.0], "to": [0.6, 1.0]}},
        zones={"z": {"region": [[0, 0], [1, 0], [1, 1], [0, 1]]}},
        outfeeds={"out": {"region": [[0.9, 0], [2, 0], [2, 1], [0.9, 1]]}},
    )


def force(*given: tuple[str, float], kind: str = "engineer") -> Input:
    names, values = zip(*given, strict=True)
    return Input("here", "Jo", kind, FORCE, names, values)


def unforce(*names: str) -> Input:
    return Input("here", "Jo", "operator", UNFORCE, names, ())


def after(sim: Simulation, *given: Input) -> list[CommandOutcome]:
    for one in given:
        sim.give(one)
    sim.advance()
    return sim.take_outcomes()


def read(sim: Simulation, name: str) -> float:
    return float(sim.signals()[sim.process_image.signal_names.index(name)])


def test_it_changes_what_is_read_and_never_what_is() -> None:
    """State and counts have the same bits at every tick as without forced signals."""
    sim, free = passing(), passing()
    given = force((BLOCKED, 1.0), (SPEED, -9.0), (REMOVED, 700.0), ("zones/z/bottles", 5.0), ("belts/one/mode", 3.0))
    assert all(outcome.accepted for outcome in after(sim, given))
    free.advance()
    names = sim.process_image.signal_names
    for _ in range(120):
        image = sim.line.signals()
        assert image.truth.tolist() == free.signals().tolist()
        assert image.values.tolist() == sim.signals().tolist()
        forced = {names[place]: image.values[place] for place in image.forced}
        assert forced == dict(zip(given.names, given.values, strict=True))
        assert sim.line.photo_eyes() == {"photo_eyes/e": True}
        assert (sim.state_hash(), sim.counts) == (free.state_hash(), free.counts)
        sim.advance()
        free.advance()
    assert sim.counts.removed == 1 and sim.line.removed_by() == {"outfeeds/out": 1}
    after(sim, unforce(BLOCKED, SPEED))
    assert {names[place] for place in sim.line.signals().forced} == {"zones/z/bottles", REMOVED, "belts/one/mode"}
    after(sim, unforce())
    free.advance(2)
    assert not sim.line.signals().forced.size and sim.signals().tolist() == free.signals().tolist()


def test_commands_of_a_device_whose_mode_is_forced_are_taken_as_it_is() -> None:
    sim = passing()
    after(sim, force(("belts/one/mode", 3.0)))
    sim.command(["belts/one/cmd_speed"], [0.1])
    assert after(sim)[0].accepted


@pytest.mark.parametrize(
    ("given", "reason"),
    [
        (force((BLOCKED, 0.5)), "photo_eyes/e/blocked: 0.5 given, expected 0 or 1"),
        (force((REMOVED, 0.5)), "outfeeds/out/removed: 0.5 given, expected a whole number"),
        (force((REMOVED, math.inf)), "outfeeds/out/removed: inf given, expected a whole number"),
        (force((SPEED, math.nan)), "belts/one/speed: nan given, expected a finite number"),
        (force((SPEED, math.inf)), "belts/one/speed: inf given, expected a finite number"),
        (force(("belts/one/mode", 9.0)), "belts/one/mode: 9 given, expected 1 to 3"),
        (force(("belts/one/cmd_speed", 0.1)), "belts/one/cmd_speed: no such signal, expected one of"),
        (force((SPEED, 0.1), (SPEED, 0.2)), "belts/one/speed: given twice"),
        (force((SPEED, 0.1), kind="controller"), "force: given by controller Jo, expected one of the kind operator"),
        (unforce("belts/two/speed"), "belts/two/speed: no such signal"),
        (unforce(SPEED)._replace(values=(1.0,)), "1 values and 0 texts given, expected names of signals alone"),
    ],
)  # fmt: skip
def test_refusals(given: Input, reason: str) -> None:
    sim = passing()
    assert sim.line.refusal(given).startswith(reason)
    (outcome,) = after(sim, given)
    assert outcome.reason.startswith(reason) and not sim.line.signals().forced.size


def test_each_is_an_event() -> None:
    sim = passing()
    events = []
    for given in (force((SPEED, 0.1), (BLOCKED, 1.0)), force((SPEED, 0.2)), unforce(SPEED), unforce(), unforce(SPEED)):
        after(sim, given)
        events += [(event.at, event.kind, event.name, event.text) for event in sim.line.happened]
        if given.operation == FORCE:
            assert [event.value for event in sim.line.happened] == list(given.values)
    assert events == [
        (0, "signal_forced", SPEED, "by engineer Jo"),
        (0, "signal_forced", BLOCKED, "by engineer Jo"),
        (1, "signal_forced", SPEED, "by engineer Jo"),
        (2, "signal_unforced", SPEED, "by operator Jo"),
        (3, "signal_unforced", BLOCKED, "by operator Jo"),
    ]


def test_forces_are_in_a_checkpoint(tmp_path: Path) -> None:
    sim = passing()
    after(sim, force((SPEED, 0.1), (BLOCKED, 1.0)))
    sim.save(tmp_path / "kept")
    again, other = Simulation.load(tmp_path / "kept"), passing()
    other.restore_from(sim)
    for one in (again, other):
        assert one.line.forcing.forces == sim.line.forcing.forces
        assert np.array_equal(one.signals(), sim.signals()) and one.line.signals().forced.size == 2


@pytest.mark.parametrize(
    "forces",
    [[("x", 1.0, "Jo")], [(SPEED, 1.0, "Jo")] * 2, [(BLOCKED, 7.0, "Jo")], [(SPEED, 1.0, "\x1b")], [(SPEED, 1.0)]],
)
def test_what_no_line_can_have_is_refused(forces: list[object]) -> None:
    sim = passing()
    memory = sim.line.snapshot()
    memory["forcing"]["forces"] = forces
    with pytest.raises(ValueError, match=r"line\.forcing"):
        sim.line.restore(sim.tick, memory)


def test_some_signals_are_read_as_all_of_them_are() -> None:
    sim = passing()
    sim.advance(20)
    after(sim, force((SPEED, 0.3)))
    every = dict(zip(sim.process_image.signal_names, sim.signals().tolist(), strict=True))
    for names in (sim.process_image.signal_names[::-1], ("belts/one/mode", SPEED), (REMOVED,), ()):
        assert sim.values_of(names) == {name: every[name] for name in names}
    with pytest.raises(KeyError):
        sim.values_of(("belts/one/sped",))
