# SPDX-License-Identifier: Apache-2.0
"""A recording as a tag provider: it shows the recorded values of each time, forwards and back."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path

import pytest
from facts import missing
from protocols.waiting import until

from conveyor_sim.bag.outputs import OutputWriter
from conveyor_sim.bag.reader import open_bag
from conveyor_sim.bag.recorder import Recorder
from conveyor_sim.errors import BagError
from conveyor_sim.line.commands.inputs import FORCE, OPERATE, OWN, SET, Input
from conveyor_sim.line.line import image_of
from conveyor_sim.line.run_state import ENDED, PAUSED, REPLAYING
from conveyor_sim.protocols.tags import tag_history
from conveyor_sim.protocols.tags.bag_provider import BagTagProvider
from conveyor_sim.scene import load_scene
from conveyor_sim.simulation import Simulation

SPEED, SETPOINT = "belts/zone1/speed", "belts/zone1/cmd_speed"
TICKS, SET_AT = 1000, 500
GIVEN = Input("modbus", "me", "controller", SET, (SETPOINT,), (0.25,))


@pytest.fixture(scope="module")
def bag(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Record ten seconds of the zoned line; in the middle it gets an owner, a setpoint, and a forced signal."""
    folder = tmp_path_factory.mktemp("bags") / "zoned"
    simulation = Simulation(load_scene("config/scenarios/zoned_line.yaml"), threads=1)
    with Recorder(folder) as recorder:
        outputs = OutputWriter(simulation, [recorder], run_id="this run")
        outputs.start()
        for tick in range(TICKS):
            if tick == SET_AT:
                simulation.give(Input("modbus", "me", "controller", OWN, (), ()))
                simulation.give(GIVEN)
                simulation.give(Input(OPERATE, "Jo", "operator", FORCE, ("photo_eyes/full1/blocked",), (1.0,)))
            simulation.advance()
            outputs.after_tick()
    return folder


@pytest.fixture
def source(bag: Path) -> Iterator[BagTagProvider]:
    with BagTagProvider(bag, print, paused=True) as source:
        yield source


def seek(source: BagTagProvider, time: float) -> None:
    assert source.control("seek", time, "a test") == ""
    until(lambda: source.snapshot.tick == round(time * 100), f"{time:g} s")


def test_its_past_is_where_tags_changed_forwards_and_back(source: BagTagProvider, bag: Path) -> None:
    with open_bag(bag) as opened:
        place = list(opened.line.signal_names).index(SPEED)
        speeds = [(frame.tick, float(frame.data[place])) for frame in opened.signals()]
    changes = [speeds[0], *(now for was, now in pairwise(speeds) if was[1] != now[1])]
    assert len(changes) > 3  # the ramp
    assert source.history.read(SPEED, 0, TICKS, 1000) == (changes, None)
    assert source.history.read(SPEED, -100, 10**9, 1000, back=True) == (changes[::-1], None)
    assert source.history.read(SPEED, 0, TICKS, 2) == (changes[:2], changes[2][0])
    assert source.history.read(SPEED, changes[1][0], changes[-1][0] - 1, 1000) == (changes[1:-1], None)
    assert source.history.read(SETPOINT, 1, TICKS, 1000) == ([(SET_AT + 1, 0.25)], None)
    assert source.history.read(SETPOINT, 0, TICKS, 1, back=True) == ([(SET_AT + 1, 0.25)], 0)
    assert source.history.read("nothing", 0, TICKS, 1000) == ([], None)


def test_a_long_past_is_read_in_parts(source: BagTagProvider, monkeypatch: pytest.MonkeyPatch) -> None:
    whole, _ = source.history.read(SPEED, 0, TICKS, 1000)
    monkeypatch.setattr(tag_history, "MOST_READ", 10)
    monkeypatch.setattr(tag_history, "WINDOW", 100)
    for back in (False, True):
        first, last = 0, TICKS
        found: list[tag_history.TagSample] = []
        parts = 0
        rest: int | None = 0
        while rest is not None:
            samples, rest = source.history.read(SPEED, first, last, 1000, back)
            found += samples
            parts += 1
            if rest is not None:
                first, last = (first, rest) if back else (rest, last)
        assert parts > 3 and found == (whole[::-1] if back else whole)


def test_it_shows_what_was_recorded_at_any_time_forwards_and_back(source: BagTagProvider, bag: Path) -> None:
    with open_bag(bag) as opened:
        names = opened.line.signal_names
        recorded = {frame.tick: dict(zip(names, frame.data.tolist(), strict=True)) for frame in opened.signals()}
    tags = image_of(load_scene("config/scenarios/zoned_line.yaml")).tags
    assert [tag.name for tag in source.info.tags] == [tag.name for tag in tags]
    shown = source.snapshot
    assert (shown.tick, shown.run.state, shown.run_id, shown.lost) == (0, PAUSED, "this run", "")
    for time in (8.0, 2.0, 9.0, 0.0, 10.0):
        seek(source, time)
        shown = source.snapshot
        values = {name: shown.values[name] for name in names}
        assert values == recorded[round(time * 100)]
        after = time > SET_AT / 100
        assert shown.values[SETPOINT] == (0.25 if after else 0.5)
        assert shown.forced == ({"photo_eyes/full1/blocked"} if after else frozenset())


def test_it_plays_with_what_happens_and_ends_and_begins_anew(source: BagTagProvider) -> None:
    seek(source, 4.9)
    assert source.snapshot.owner == ""
    heard = source.events(0)[0]
    assert source.control("resume", 0, "a test") == ""
    until(lambda: source.snapshot.run.state == REPLAYING, "it plays")
    until(lambda: source.snapshot.owner == "me", "the owner")
    _, events = source.events(heard)
    assert {"owner_changed", "signal_forced"} <= {event.kind for event in events}
    assert source.control("speed", 0, "a test") == ""
    until(lambda: source.snapshot.run.state == ENDED, "the end")
    assert source.snapshot.tick == TICKS
    assert source.control("resume", 0, "a test") == ""
    assert source.control("speed", 1, "a test") == ""
    until(lambda: source.snapshot.run.state == REPLAYING and source.snapshot.tick < TICKS, "from the beginning")
    assert source.control("loop", 1, "a test") == ""
    assert source.control("speed", 0, "a test") == ""
    before = source.events(0)[0]
    until(lambda: source.events(0)[0] > before + 2 * 21, "rounds")
    assert source.control("pause", 0, "a test") == ""
    until(lambda: source.snapshot.run.state == PAUSED, "the pause")
    tick = source.snapshot.tick
    assert source.control("speed", 1, "a test") == ""
    assert source.snapshot.tick == tick


def test_it_can_not_be_commanded_nor_led_out_of_itself(source: BagTagProvider) -> None:
    assert source.give(GIVEN).endswith("a recording can't be commanded")
    assert missing(source.control("seek", 11.0, "a test"), "seek", "11 ", "0 to 10 (s)") == []
    assert source.control("speed", -1.0, "a test").startswith("speed: -1 given")
    assert source.control("step", 1.0, "a test").startswith("step: expected one of loop, pause")


def test_what_can_not_be_shown_is_said_at_the_start(bag: Path, tmp_path: Path) -> None:
    with pytest.raises(BagError, match="no such bag"):
        BagTagProvider(tmp_path / "none", print)
    broken = tmp_path / "broken"
    shutil.copytree(bag, broken)
    (file,) = broken.glob("*.mcap")
    data = bytearray(file.read_bytes())
    data[len(data) // 2] ^= 0xFF
    file.write_bytes(data)
    with pytest.raises(BagError, match="is damaged"):
        BagTagProvider(broken, print)
    folder = tmp_path / "silent"
    simulation = Simulation(load_scene("config/scenarios/zoned_line.yaml", {"outputs": {"signals": 0.0}}), threads=1)
    with Recorder(folder) as recorder:
        outputs = OutputWriter(simulation, [recorder], run_id="")
        outputs.start()
    with pytest.raises(BagError, match="no message of topic signals"):
        BagTagProvider(folder, print)
