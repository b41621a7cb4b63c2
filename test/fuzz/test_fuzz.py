# SPDX-License-Identifier: Apache-2.0
"""A short run of what `make fuzz` does for as long as one likes, always of the same cases; and what once failed."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from fuzz.case import Case, cases, load_case
from fuzz.commands import Command
from fuzz.crossing import crossed
from fuzz.families import CI_FAMILIES, Family, random_family
from fuzz.invariants import Invariants, Sent
from fuzz.play import failure_kind, play, send
from fuzz.violation import Violation
from fuzz.wrong import judge, wrong_texts
from hypothesis import HealthCheck, Phase, assume, given, settings
from hypothesis import strategies as st
from scenes import bottle, contact, kind, scene, segment

from conveyor_sim.accuracy.trajectory import displace
from conveyor_sim.errors import SceneError
from conveyor_sim.scene import parse_scene
from conveyor_sim.scene.geometry import ArcPiece, SegmentPiece
from conveyor_sim.simulation import Simulation

KNOWN = sorted(path for path in (Path(__file__).parent / "known").glob("*.yaml") if ".script" not in path.name)

BEYOND_PHYSICS = {"too_fast_for_its_rail"}
"""Of them, what the guard must stop."""

short = settings(
    derandomize=True,
    database=None,
    deadline=None,  # the first case compiles
    suppress_health_check=list(HealthCheck),  # scenes are large and slow to draw by their nature
    phases=[Phase.generate],  # `make fuzz` makes failures small
)


@pytest.mark.parametrize("family", CI_FAMILIES, ids=str)
def test_whatever_the_scene(family: Family) -> None:
    ran = []
    # Most scenes compile another mixture of effects; `make fuzz` draws more of them.
    examples = 4 if family.integrator == "impulses" else 7

    @settings(short, max_examples=examples)
    @given(cases(family, beyond=False))
    def holds(case: Case) -> None:
        assume(_least_bottles(case.scene) > 1)  # a single bottle is another mixture of effects
        ran.append(play(case))

    holds()
    assert sum(played.how == "run" for played in ran) > len(ran) / 2
    assert sum(played.bottle_ticks for played in ran) > 500
    assert any(played.replayed for played in ran)


def _least_bottles(data: dict[str, Any]) -> float:
    """Return a lower bound of the number of bottles in a scene, infinite with an endless infeed."""
    feeds = data.get("infeeds", {}).values()
    return len(data["bottles"]) + sum(feed.get("count", math.inf) for feed in feeds)


def test_a_scene_is_read_or_refused_in_words() -> None:
    judged = []

    @settings(short, max_examples=80)
    @given(st.one_of(*(wrong_texts(random_family(number)) for number in range(10))))
    def refused(text: str) -> None:
        judged.append(judge(text))

    refused()
    assert any(one.refused for one in judged)
    assert any(not one.refused for one in judged)


@settings(short, max_examples=200)
@given(st.text() | st.text("[]{}:-,&*!'\"\n 1ae."))
def test_any_text_is_read_or_refused(text: str) -> None:
    with pytest.raises(SceneError):
        parse_scene(text)


@pytest.mark.parametrize("file", KNOWN, ids=lambda file: file.stem)
def test_what_once_failed(file: Path) -> None:
    assert play(load_case(file)).how == ("stopped" if file.stem in BEYOND_PHYSICS else "run")


def small(**fields: object) -> Case:
    """A case of one bottle that runs into a rail, with a command."""
    data = {
        "name": "small", "duration": 1.0, "bottle_types": {"bottle": kind(0.05)},
        "contacts": [{"between": ["glass", "steel"], "stiffness": 1e4}], "belts": {}, "floor": "none",
        "rails": {"wall": segment((0.1, -1.0), (0.1, 1.0))}, "bottles": [bottle(0.0, 0.0, 1.0)], **fields,
    }  # fmt: skip
    return Case(json.loads(json.dumps(data)), ticks=10, commands=[Command(3, ("belts/none/cmd_speed",), (math.nan,))])


def test_a_case_comes_back_from_its_files(tmp_path: Path) -> None:
    case = small()
    again = load_case(case.save(tmp_path, "case", "what was wrong"))
    assert (again.scene, again.ticks, again.calls) == (case.scene, case.ticks, case.calls)
    assert repr(again.commands) == repr(case.commands)
    assert play(again).how == "run"


class Passing(Simulation):
    """A line whose bottles are put a way farther at tick 3."""

    way = 0.2

    def advance(self, ticks: int = 1) -> None:
        super().advance(ticks)
        if self.tick == 3:
            displace(self, np.full(1, self.way), np.zeros(1))


def test_a_bottle_through_a_rail_is_noticed() -> None:
    simulation = Passing(parse_scene(small().scene_text))
    invariants = Invariants(simulation)
    with pytest.raises(Violation, match="through a rail"):
        for _ in range(5):
            simulation.advance()
            invariants.after_tick([], simulation.take_outcomes())
    assert simulation.tick == 3


DEVICES = {
    "counters": {"c": {"from": [0.02, -0.5], "to": [0.02, 0.5]}},
    "zones": {"z": {"region": [[-0.1, -0.1], [0.1, -0.1], [0.1, 0.1], [-0.1, 0.1]]}},
    "photo_eyes": {"e": {"from": [0.03, 0.5], "to": [0.03, -0.5]}},
    "machines": {"i": {"kind": "inspection", "from": [0.025, -0.5], "to": [0.025, 0.5]}},
}


class Misread(Simulation):
    """A line one signal of which is off by some at tick 5."""

    signal, by = "", 0.0

    def signals(self) -> np.ndarray:
        values = super().signals()
        if self.tick == 5:
            values[self.process_image.signal_names.index(self.signal)] += self.by
        return values


@pytest.mark.parametrize(
    ("signal", "by", "kind"),
    [
        ("counters/c/forward", 0.0, ""),
        ("counters/c/forward", 1.0, "counted wrongly"),
        ("counters/c/backward", -1.0, "signal of another type"),
        ("zones/z/bottles", 1.0, "zone counted wrongly"),
        ("zones/z/bottles", 0.5, "signal of another type"),
        ("photo_eyes/e/blocked", -1.0, "eye"),
        ("photo_eyes/e/rose", 1.0, "eye"),
        ("machines/i/count", 1.0, "counted wrongly"),
        ("machines/i/running", -1.0, "machine"),
    ],
)
def test_a_signal_that_is_wrong_is_noticed(signal: str, by: float, kind: str) -> None:
    simulation = Misread(parse_scene(small(**DEVICES).scene_text))
    simulation.signal, simulation.by = signal, by
    assert violation_of(simulation, []) == kind


@pytest.mark.parametrize(
    ("fault", "value", "signal", "by", "kind"),
    [
        ("machines/i/stop", 1.0, "machines/i/count", 0.0, ""),
        ("machines/i/stop", 1.0, "machines/i/count", 1.0, "counted wrongly"),
        ("machines/i/stop", 1.0, "machines/i/running", 1.0, "machine"),
        ("machines/i/stop", 0.5, "machines/i/count", 0.0, ""),
        ("zones/z/offset", 3.0, "zones/z/bottles", 0.0, ""),
        ("zones/z/offset", 3.0, "zones/z/bottles", -3.0, "zone counted wrongly"),
        ("zones/z/offset", -3.0, "zones/z/bottles", 0.0, ""),
        ("zones/z/offset", 1001.0, "zones/z/bottles", 0.0, ""),
    ],
)
def test_an_injected_fault_has_its_effect_and_no_other(
    fault: str, value: float, signal: str, by: float, kind: str
) -> None:
    simulation = Misread(parse_scene(small(**DEVICES).scene_text))
    simulation.signal, simulation.by = signal, by
    assert violation_of(simulation, [((fault,), (value,), True)]) == kind


PANEL = {
    "panel": {
        "e": {"kind": "emergency_stop", "cuts": ["drives", "machines"], "deceleration": 20.0},
        "b": {"kind": "button", "contact": "NC"},
        "s": {"kind": "selector", "positions": ["off", "on"]},
        "n": {"kind": "numeric", "limits": [0.0, 1.0]},
        "l": {"kind": "lamp"},
    },
    "base": [{"between": ["glass", "chain"], "friction": 0.1}],
    "belts": {
        "b": {"kind": "straight", "start": [0, 0], "angle": 0.0, "length": 1.0, "width": 1.0, "speed": 2.0,
              "material": "chain", "speed_limits": [0.0, 2.0], "drive": {"acceleration": 1.0}}
    },
    "machines": {"r": {"kind": "reject", "region": [[0, 0], [0.1, 0], [0, 0.1]], "delay": 0.0, "window": 0.1}},
}  # fmt: skip


@pytest.mark.parametrize(
    ("command", "value", "signal", "by", "kind"),
    [
        ("panel/e/press", 1.0, "panel/e/contact", 0.0, ""),
        ("panel/e/press", 1.0, "panel/e/contact", 1.0, "panel"),
        ("panel/e/reset", 1.0, "panel/e/contact", -1.0, "panel"),
        ("panel/e/press", 1.0, "belts/b/running", 1.0, "drives"),
        ("panel/e/press", 1.0, "machines/r/running", 1.0, "works without power"),
        ("panel/e/press", 1.0, "machines/r/rejected", 1.0, "works without power"),
        ("panel/b/press", 1.0, "panel/b/contact", 0.0, ""),
        ("panel/b/press", 1.0, "panel/b/contact", 1.0, "panel"),
        ("panel/s/turn", 1.0, "panel/s/position", -1.0, "panel"),
        ("panel/s/turn", 2.0, "panel/s/position", 0.0, ""),
        ("panel/n/set", 0.5, "panel/n/value", 0.1, "panel"),
        ("panel/n/set", math.nan, "panel/n/value", 0.0, ""),
        ("panel/l/on", 1.0, "panel/n/value", 0.0, ""),
    ],
)
def test_a_panel_that_does_not_follow_its_inputs_is_noticed(
    command: str, value: float, signal: str, by: float, kind: str
) -> None:
    simulation = Misread(parse_scene(small(**PANEL).scene_text))
    simulation.signal, simulation.by = signal, by
    assert violation_of(simulation, [((command,), (value,), False)]) == kind


def violation_of(simulation: Simulation, first: Sent) -> str:
    """Return the kind of the violation at tick 5, or "". first: inputs of the first tick."""
    invariants = Invariants(simulation)
    send(simulation, first)
    try:
        for tick in range(7):
            simulation.advance()
            invariants.after_tick([] if tick else first, simulation.take_outcomes())
    except Violation as violation:
        assert simulation.tick == 5
        return violation.kind
    return ""


def test_a_drive_that_does_not_ramp_is_noticed() -> None:
    belt = {"kind": "straight", "start": [0, 0], "angle": 0.0, "length": 1.0, "width": 1.0, "speed": 0.0,
            "material": "chain", "speed_limits": [-1.0, 1.0], "drive": {"acceleration": 1.0}}  # fmt: skip
    simulation = Simulation(
        parse_scene(small(belts={"b": belt}, base=[{"between": ["glass", "chain"], "friction": 0.1}]).scene_text)
    )
    invariants = Invariants(simulation)
    sent: Sent = [(("belts/b/cmd_speed",), (1.0,), False)]
    simulation.command(*sent[0][:2])
    simulation.advance()
    invariants.after_tick(sent, simulation.take_outcomes())
    simulation._line.now.speeds[0] = 0.5
    with pytest.raises(Violation, match="drives"):
        invariants.after_tick([], [])


def test_a_bottle_that_is_nowhere_is_noticed() -> None:
    simulation = Simulation(scene(contacts=[contact(1e4)], bottles=[bottle(0.0, 0.0), bottle(1.0, 0.0)]))
    invariants = Invariants(simulation)
    displace(simulation, np.array([0.0, math.nan]), np.zeros(2))
    with pytest.raises(Violation, match="not finite"):
        invariants.after_tick([], [])


def test_a_lost_bottle_is_noticed() -> None:
    simulation = Simulation(scene(contacts=[contact(1e4)], bottles=[bottle(0.0, 0.0), bottle(1.0, 0.0)]))
    invariants = Invariants(simulation)
    simulation._state.remove(0)
    simulation.advance()
    with pytest.raises(Violation, match="lost bottle"):
        invariants.after_tick([], [])


@pytest.mark.parametrize(
    ("piece", "way", "through"),
    [
        (SegmentPiece((0.0, 0.0), (1.0, 0.0)), ((0.5, -0.1), (0.6, 0.1)), True),
        (SegmentPiece((0.0, 0.0), (1.0, 0.0)), ((0.5, -0.1), (0.6, -0.01)), False),
        (SegmentPiece((0.0, 0.0), (1.0, 0.0)), ((1.2, -0.1), (1.1, 0.1)), False),
        (ArcPiece((0.0, 0.0), 1.0, 0.0, math.pi / 2), ((0.6, 0.6), (0.9, 0.9)), True),
        (ArcPiece((0.0, 0.0), 1.0, 0.0, math.pi / 2), ((-0.6, 0.6), (-0.9, 0.9)), False),
        (ArcPiece((0.0, 0.0), 1.0, 0.0, math.pi / 2), ((1.0, 0.1), (0.1, 1.0)), False),
        (ArcPiece((0.0, 0.0), 1.0, 0.0, 2 * math.pi), ((0.0, 0.0), (0.0, -3.0)), True),
    ],
)
def test_ways_through_pieces(piece: SegmentPiece | ArcPiece, way: object, through: bool) -> None:
    before, after = np.array(way)[:, None, :]
    assert crossed(piece, before, after).tolist() == [through]


def test_failures_are_told_apart_by_where_they_are_raised() -> None:
    try:
        parse_scene(None)  # type: ignore[arg-type]
    except Exception as error:
        assert " in " in failure_kind(error)
    assert failure_kind(Violation("lost bottle", "one")) == "lost bottle"
