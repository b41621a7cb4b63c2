# SPDX-License-Identifier: Apache-2.0
"""Recordings in earlier formats are read, played and served in the present definitions."""

from __future__ import annotations

import json
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from bag.editing import edited
from bag.small_line import record
from facts import stating
from protocols.waiting import until

from conveyor_sim.bag.messages.encode import ALARM_STATES, FORMAT
from conveyor_sim.bag.messages.older import upgraded
from conveyor_sim.bag.messages.topics import TOPICS
from conveyor_sim.bag.messages.typestore import typestore
from conveyor_sim.bag.reader import open_bag
from conveyor_sim.bag.recorded_scene import recorded_scene
from conveyor_sim.bag.replay import replay
from conveyor_sim.errors import BagError
from conveyor_sim.line.line import image_of
from conveyor_sim.page.head import head
from conveyor_sim.protocols.tags.bag_provider import BagTagProvider
from conveyor_sim.protocols.tags.line_mirror import LineMirrorError
from conveyor_sim.report.summarize import summarize
from conveyor_sim.run.playback import Playback
from conveyor_sim.scene import parse_scene
from conveyor_sim.simulation import Simulation

OLD = Path(__file__).parent / "old"
FIRST = OLD / "before_tags.mcap"
"""Format 1."""
SECOND = OLD / "before_tag_messages.mcap"
"""Format 2, recorded with commit 7fa2643: an infeed with random bottles, alarms of the scene and of a controller,
inputs of every operation.
"""
CYCLES = OLD / "before_cycles.mcap"
"""Format 2: a filler, a capper and two packers with failures, a reset, and rates above the nominal ones."""
FRICTION = OLD / "before_warm_friction.mcap"
"""Format 3, recorded with commit cab9d27: a zigzag queue of four bottles with implicit friction in few steps."""
VERLET = OLD / "before_warm_friction_verlet.mcap"
"""Likewise, with velocity Verlet."""
EXPLICIT = OLD / "before_sweeps.mcap"
"""Format 5, recorded with commit 04b1e30: six bottles that a belt pushes into a corner, with leapfrog."""
IMPULSES = OLD / "before_sweeps_impulses.mcap"
"""Likewise, with impulses and three sweeps per step."""
EYE = "photo_eyes/eye/blocked"


def test_the_second_format_replays_with_its_random_streams() -> None:
    report = replay(SECOND)
    assert report.difference is None and report.last_tick == 400
    assert report.compared["bottles"] == 9 and report.compared["outcomes"] == 10 and report.compared["signals"] == 41


def test_machines_of_the_second_format_count_as_recorded() -> None:
    """Signals and counters are simulated again bit for bit: effectiveness above 100 %, a bottle fed at the start."""
    report = replay(CYCLES)
    assert (report.difference, report.last_tick, report.compared["signals"]) == (None, 1600, 33)
    with open_bag(CYCLES) as bag:
        recorded = [*bag.read("counters")]
        given = [*bag.outcomes()]
        again = Simulation(recorded_scene(bag.line, "bag"))
    for frame in recorded:
        while again.tick < frame.tick:
            for outcome in given:
                if outcome.tick == again.tick:
                    again.give(outcome.data.input)
            again.advance()
        columns = again.line.counters()
        for field in vars(frame.data):
            np.testing.assert_array_equal(getattr(columns, field), getattr(frame.data, field), field)
    first, last = recorded[0].data, recorded[-1].data
    assert first.processed[0] == 1 and last.effectiveness.max() > 1.2 and last.since.max() == 417
    assert last.rate_limit.tolist() == last.rate.tolist() and np.isnan(last.set_effectiveness).all()


@pytest.mark.parametrize(("path", "ticks"), [(FRICTION, 30), (VERLET, 20)], ids=["leapfrog", "verlet"])
def test_implicit_friction_of_the_third_format_is_solved_as_recorded(path: Path, ticks: int) -> None:
    """Replayed bit for bit, with friction that is solved anew in each step; the present solver gives another run."""
    report = replay(path)
    assert (report.difference, report.last_tick) == (None, ticks)
    with open_bag(path) as bag:
        assert bag.format == 3
        line = bag.line
        recorded = list(bag.read("bottles"))[-1].data
        scene = recorded_scene(line, "bag")
    again, present = Simulation(scene), Simulation(parse_scene(line.scene_text))
    for sim in (again, present):
        sim.advance(ticks)
    assert scene.friction_anew and again.model.settings.warm is None and present.model.settings.warm is not None
    for name in ("x", "y", "vx", "vy", "omega"):
        assert np.array_equal(getattr(again.bottles(), name), getattr(recorded, name))
    assert not np.array_equal(present.bottles().x, recorded.x)


def test_its_tags_are_those_of_its_scene() -> None:
    with open_bag(SECOND) as bag:
        line = bag.line
        assert bag.format == line.format == 2
        expected = image_of(recorded_scene(line, "bag"))
    assert [tag.name for tag in line.tags] == [tag.name for tag in expected.tags]
    for recorded, tag in zip(line.tags, expected.tags, strict=True):
        assert (recorded.kind, recorded.role, recorded.unit, recorded.unit_code) == (
            tag.kind, tag.role, tag.unit, tag.unece.code,
        )  # fmt: skip
        assert (recorded.min, recorded.max, recorded.initial) == (tag.low, tag.high, tag.initial)
        assert dict(zip(recorded.state_values.tolist(), recorded.state_texts, strict=True)) == tag.texts
        assert (recorded.device, recorded.device_class) == (tag.device, tag.device_class)


def test_alarms_have_the_ids_of_those_that_suppress_them() -> None:
    with open_bag(SECOND) as bag:
        states = [frame.data for frame in bag.read("alarm_states")][-1]
        outcomes = [frame.data for frame in bag.outcomes()]
    causes = dict(zip(states.id, states.suppressed_by, strict=True))
    assert causes["crowded"] == ("full",) and causes["follows"] == ("declared", "full") and causes["full"] == ()
    assert [outcome.bottles for outcome in outcomes] == [()] * 10
    assert {outcome.operation for outcome in outcomes} >= {"declare", "set", "mode", "force", "inject", "shelve"}


@pytest.mark.parametrize("path", [FIRST, SECOND], ids=["1", "2"])
def test_they_are_played_as_the_present_definitions_have_it(path: Path) -> None:
    """So a node of today can publish them, and Foxglove and clients of today read them."""
    with open_bag(path) as bag:
        playback = Playback(bag)
        messages = [*playback.cue(playback.first_tick)]
        for tick in range(playback.first_tick, playback.last_tick + 1):
            messages += playback.take(tick)
        hashes = {topic.name: topic.type_hash for topic in playback.topics}
        recorded = {name: list(bag.messages(name)) for name in ("line", "outcomes", "signals")}
    assert hashes["line"] is None and hashes["outcomes"] is None
    for name, frames in recorded.items():
        played = [typestore().deserialize_cdr(data, TOPICS[name].type) for topic, data in messages if topic == name]
        assert [one.tick for one in played] == [frame.tick for frame in frames]
        assert str(TOPICS[name].unpack(played[-1])) == str(TOPICS[name].unpack(frames[-1].data))


def test_the_second_is_served_with_its_alarms() -> None:
    with BagTagProvider(SECOND, print, paused=True) as source:
        assert source.control("seek", 2.0, "a test") == ""
        until(lambda: source.snapshot.tick == 200, "2 s")
        assert source.snapshot.forced == {EYE} and source.info.where == "hall/line"
        tags = {tag.name: tag for tag in source.info.tags}
        assert tags["belts/line/mode"].texts == {1: "Automatic", 2: "Maintenance", 3: "Manual"}
        alarms = source.snapshot.alarms
        assert alarms is not None and ("full",) in alarms.suppressed_by
        line: Any = typestore().deserialize_cdr(source.newest["line"], TOPICS["line"].type)
        assert line.format == 2


def test_the_first_has_no_tags_to_serve() -> None:
    with pytest.raises(LineMirrorError, match=stating("small_line", "without tags")):
        BagTagProvider(FIRST, print)


def test_both_are_drawn_and_reported() -> None:
    for path, count in ((FIRST, 1), (SECOND, 2)):
        with open_bag(path) as bag:
            shown = head(bag.line, recorded_scene(bag.line, "bag"))
            assert bag.format == count
        assert set(shown["signals"]) <= {tag["name"] for tag in shown["tags"]}
        assert summarize(path).commands > 0


def test_a_recording_of_a_playback_keeps_the_format(tmp_path: Path) -> None:
    """Its messages have the present definitions, but its scene is still read as when it was recorded."""
    with open_bag(SECOND) as bag:
        runs = {topic: list(bag.messages(topic)) for topic in ("line", "bottles", "outcomes")}
    assert runs["line"][0].data.format == 2
    copy = edited(SECOND, tmp_path / "copy", lambda topic, message: None)
    with open_bag(copy) as bag:
        assert bag.format == 2 and not bag.older_topics
    assert replay(copy).difference is None


@pytest.mark.parametrize("integrator", ["leapfrog", "semi_implicit_euler", "velocity_verlet"])
def test_implicit_friction_of_the_fourth_format_is_refused_and_reported(integrator: str, tmp_path: Path) -> None:
    bag = _of_format_4(tmp_path, integrator, "implicit")
    with pytest.raises(BagError, match=stating("format 4", "implicit friction", integrator)):
        replay(bag)
    assert summarize(bag).simulated == pytest.approx(0.02)


@pytest.mark.parametrize(("integrator", "solver"), [("leapfrog", "explicit"), ("rk4", "implicit")])
def test_other_friction_of_the_fourth_format_replays(integrator: str, solver: str, tmp_path: Path) -> None:
    report = replay(_of_format_4(tmp_path, integrator, solver))
    assert (report.difference, report.last_tick) == (None, 2)


def _of_format_4(folder: Path, integrator: str, solver: str) -> Path:
    """Record a bottle on a belt, with the number of the fourth format, whose messages are those of the present one."""
    scene = {
        "name": "friction",
        "duration": 0.02,
        "friction_solver": solver,
        "accuracy": {"integrator": integrator, "per_tick": 20},
        "base": [{"between": ["glass", "chain"], "friction": 0.3}],
        "bottle_types": {"b": {"radius": 0.03, "mass": 0.3, "material": "glass"}},
        "belts": {"chain": {"kind": "straight", "start": [0, 0], "angle": 0, "length": 2, "width": 0.2, "speed": 0.3,
                            "material": "chain"}},
        "bottles": [{"type": "b", "position": [0.5, 0.1], "velocity": [0.0, 0.0]}],
    }  # fmt: skip

    def fourth(topic: str, message: Any) -> None:
        if topic == "line":
            message.format = 4

    record(parse_scene(json.dumps(scene)), folder / "bag", 2)
    return edited(folder / "bag", folder / "fourth", fourth)


def test_the_fifth_format_replays_with_integrators_of_forces() -> None:
    report = replay(EXPLICIT)
    assert (report.difference, report.last_tick, report.compared["bottles"]) == (None, 20, 11)
    with open_bag(EXPLICIT) as bag:
        assert (bag.format, bag.line.sweeps, bag.line.integrator) == (5, 0, "leapfrog")
        assert bag.line.tags


def test_impulses_of_the_fifth_format_are_refused_and_reported() -> None:
    with pytest.raises(BagError, match=stating("format 5", "integrator impulses", "expected format 8")):
        replay(IMPULSES)
    assert summarize(IMPULSES).simulated == pytest.approx(0.2)
    with open_bag(IMPULSES) as bag:
        assert recorded_scene(bag.line, "bag").accuracy.sweeps == 3


@pytest.mark.parametrize("number", [6, 7])
@pytest.mark.parametrize("recording", [EXPLICIT, IMPULSES])
def test_these_formats_are_refused_with_impulses_only(recording: Path, number: int, tmp_path: Path) -> None:
    def renumbered(topic: str, message: Any) -> None:
        if topic == "line":
            message.format = number

    bag = edited(recording, tmp_path / "renumbered", renumbered)
    if recording == EXPLICIT:
        assert replay(bag).difference is None
    else:
        with pytest.raises(BagError, match=stating(f"format {number}", "integrator impulses", "expected format 8")):
            replay(bag)


def test_a_format_of_the_future_is_refused(tmp_path: Path) -> None:
    def later(topic: str, message: Any) -> None:
        if topic == "line":
            message.format = FORMAT + 1

    with pytest.raises(BagError, match=stating(f"format {FORMAT + 1} given", f"expected 1 to {FORMAT}", "newer")):
        open_bag(edited(SECOND, tmp_path / "later", later))


@pytest.mark.parametrize("listed", ["", "{", '{"a": 1}', "[1]", '["a", null]'])
def test_a_damaged_list_of_causes_is_refused(listed: str) -> None:
    """Files without checksums are read, so a text may be anything. `Bag.decode` names the recording."""
    with pytest.raises(ValueError):
        upgraded(ALARM_STATES, SimpleNamespace(header=None, suppressed_by=[listed]), 2)
