# SPDX-License-Identifier: Apache-2.0
"""First difference of two recordings: at its tick, in words, within tolerances where bits need not agree."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import ExitStack
from pathlib import Path

import numpy as np
import pytest
from facts import missing
from page.line import LINE, record

from conveyor_sim.bag.messages.encode import Header
from conveyor_sim.bag.messages.topics import TOPICS
from conveyor_sim.bag.outputs import OutputWriter
from conveyor_sim.bag.reader import open_bag
from conveyor_sim.bag.recorder import Recorder
from conveyor_sim.columns.bottles import BottleColumns
from conveyor_sim.errors import ConveyorError
from conveyor_sim.page.difference import RecordingComparison
from conveyor_sim.scene import load_scene
from conveyor_sim.simulation import Simulation


def test_a_recording_equals_itself_up_to_its_end(bag: Path) -> None:
    with open_bag(bag) as a, open_bag(bag) as b:
        compared = RecordingComparison(a, b, 10.0)
        assert compared.stretches == 3 and compared.end == pytest.approx(24.0)
        assert [compared.find(number) for number in range(3)] == [[], [], []]


def test_the_first_of_each_kind_is_found_at_its_tick(bag: Path, other_bag: Path) -> None:
    with open_bag(bag) as a, open_bag(other_bag) as b:
        command, signal, bottle, seen = RecordingComparison(a, b, 60.0).find()
        frames = zip(a.bottles(), b.bottles(), strict=True)
        moved = next(then.tick for then, now in frames if not np.array_equal(then.data.x, now.data.x))
    assert (command.kind, command.tick) == ("commands", 600)
    assert missing(command.texts[0], "in A", "gates/hold/open", "0.0", "test") == []
    assert (signal.kind, signal.tick) == ("signals", 601)
    assert signal.signals == ("gates/hold/position", "gates/hold/is_open")
    assert signal.texts[1] == "gates/hold/is_open is 0 in A, 1 in B"
    assert (bottle.kind, bottle.tick) == ("bottles", moved)
    assert seen.kind == "seen" and seen.tick >= moved
    assert seen.texts[0].startswith(f"bottle {seen.bottle} is ") and " mm apart: at (" in seen.texts[0]


def test_stretches_find_what_the_whole_finds(bag: Path, other_bag: Path) -> None:
    with open_bag(bag, by_index=True) as a, open_bag(other_bag, by_index=True) as b:
        whole, parts = RecordingComparison(a, b, 60.0).find(), RecordingComparison(a, b, 4.0)
        first = {one.kind: one for number in reversed(range(parts.stretches)) for one in parts.find(number)}
    assert {one.kind: one for one in whole} == first


def test_what_is_compared_ends_where_the_shorter_recording_does(bag: Path, tmp_path: Path) -> None:
    short = record(tmp_path / "bag", 3.0)
    with open_bag(bag) as a, open_bag(short) as b:
        compared = RecordingComparison(a, b, 60.0)
        assert compared.find() == [] and compared.end == pytest.approx(3.0)


def placed(folder: Path, x: Callable[[int], float], tick_ns: int = 10_000_000) -> Path:
    """A recording of one bottle at x(tick), not simulated."""
    simulation = Simulation(load_scene(LINE, {"tick": tick_ns * 1e-9}))
    zero = np.zeros(1)
    with Recorder(folder) as recorder:
        OutputWriter(simulation, [recorder], run_id="run").start()
        for tick in range(1, 20):
            columns = BottleColumns(
                np.array([7], np.uint64), np.zeros(1, np.uint16), np.array([x(tick)]), zero, zero, zero, zero, zero,
                np.zeros(1, np.int32), zero, zero,
            )  # fmt: skip
            header = Header(tick, tick * tick_ns, "world")
            recorder.write("bottles", TOPICS["bottles"].pack(columns, header), header.stamp_ns)
    return folder


def test_a_last_bit_counts_on_one_machine_and_not_between_two(tmp_path: Path) -> None:
    a = placed(tmp_path / "a", lambda tick: 1.0)
    b = placed(tmp_path / "b", lambda tick: 1.0 if tick < 5 else 1.0 + 1e-9 if tick < 9 else 1.00002)
    found = []
    for machine in ("", "another"):
        with ExitStack() as stack:
            bags = [stack.enter_context(open_bag(path)) for path in (a, b)]
            bags[1].line.machine += machine
            found += [one for one in RecordingComparison(bags[0], bags[1], 60.0).find() if one.kind == "bottles"]
    assert [one.tick for one in found] == [5, 9]
    assert found[0].texts[0].startswith("bottle 7 is 1e-09 m apart") and found[1].texts[0].startswith(
        "bottle 7 is 0.02 mm"
    )


def test_ticks_of_other_lengths_are_refused_in_one_sentence(tmp_path: Path) -> None:
    a, b = placed(tmp_path / "a", lambda tick: 1.0), placed(tmp_path / "b", lambda tick: 1.0, 5_000_000)
    with (
        open_bag(a) as one,
        open_bag(b) as other,
        pytest.raises(ConveyorError, match=rf"^{b}: has ticks of 5 ms, expected those of {a}, 10 ms$"),
    ):
        RecordingComparison(one, other, 60.0)
