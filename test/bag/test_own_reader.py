# SPDX-License-Identifier: Apache-2.0
"""Recordings of this package read without rosbags: every byte and every number as rosbags has them."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from contextlib import closing
from dataclasses import fields, is_dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from conveyor_sim.bag.messages.cdr import tick_of
from conveyor_sim.bag.messages.encode import Header, commands_message
from conveyor_sim.bag.messages.topics import OUTPUTS
from conveyor_sim.bag.own_reader import OwnReader, own_reader
from conveyor_sim.bag.reader import open_bag
from conveyor_sim.bag.recorder import Recorder
from conveyor_sim.bag.rosbags_reader import RosbagsReader

SECOND = 1_000_000_000


def file_of(bag: Path) -> Path:
    (file,) = bag.glob("*.mcap")
    return file


@pytest.fixture
def sources(bag: Path) -> Iterator[tuple[OwnReader, RosbagsReader]]:
    own, other = own_reader(file_of(bag)), RosbagsReader([file_of(bag)])
    assert own is not None
    with closing(own), closing(other):
        yield own, other


def same(one: Any, other: Any) -> bool:
    """Equal to the bit, dtypes included."""
    if is_dataclass(one) and is_dataclass(other):
        names = [field.name for field in fields(one)]
        return names == [field.name for field in fields(other)] and all(
            same(getattr(one, name), getattr(other, name)) for name in names
        )
    if isinstance(one, np.ndarray):
        return bool(one.dtype == other.dtype) and one.tobytes() == other.tobytes()
    if isinstance(one, list):
        return len(one) == len(other) and all(map(same, one, other))
    return bool(one == other)


def test_topics_span_and_hashes_are_those_of_rosbags(sources: tuple[OwnReader, RosbagsReader]) -> None:
    own, other = sources
    assert own.topics == other.topics
    assert own.span_ns == other.span_ns
    for recorded in own.topics:
        assert own.type_hash(recorded.type) == other.type_hash(recorded.type)


@pytest.mark.parametrize(("start", "stop"), [(None, None), (SECOND // 5, None), (None, SECOND // 2), (1, SECOND // 3)])
def test_messages_are_those_of_rosbags_in_their_order(
    sources: tuple[OwnReader, RosbagsReader], start: int | None, stop: int | None
) -> None:
    own, other = sources
    topics = [recorded.topic for recorded in own.topics]
    messages = list(own.messages(topics, start, stop))
    assert messages == list(other.messages(topics, start, stop)) != []
    for topic in topics:
        assert list(own.messages([topic], start, stop)) == list(other.messages([topic], start, stop))


def test_decoded_messages_are_those_of_rosbags_to_the_bit(sources: tuple[OwnReader, RosbagsReader]) -> None:
    own, other = sources
    types = {recorded.topic: recorded.type for recorded in own.topics}
    with_tick = 0
    for topic, _, data in own.messages(types, None, None):
        message, expected = own.deserialize(data, types[topic]), other.deserialize(data, types[topic])
        assert same(message, expected), topic
        if hasattr(expected, "tick"):
            assert own.tick(data, types[topic]) == other.tick(data, types[topic]) == expected.tick
            with_tick += 1
    assert with_tick > 100


def test_what_belongs_to_an_earlier_time_comes_earlier(tmp_path: Path) -> None:
    with Recorder(tmp_path / "bag") as recorder:
        for number, stamp in enumerate((1, 50, 50, 20, 70, 20)):
            recorder.write("line" if number % 2 else "bottles", bytes([number]), stamp)
    own, other = own_reader(file_of(tmp_path / "bag")), RosbagsReader([file_of(tmp_path / "bag")])
    assert own is not None
    topics = ["/line", "/bottles"]
    messages = list(own.messages(topics, None, None))
    assert [data[0] for _, _, data in messages] == [0, 3, 5, 1, 2, 4]
    assert messages == list(other.messages(topics, None, None))


def test_a_recording_of_several_chunks_is_read_to_its_end(tmp_path: Path) -> None:
    with Recorder(tmp_path / "long") as recorder:
        for number in range(40):
            recorder.write("signals", bytes(100_000) + bytes([number]), 1 + number)
    own = own_reader(file_of(tmp_path / "long"))
    assert own is not None
    for _ in range(2):
        assert [data[-1] for _, _, data in own.messages(["/signals"], None, None)] == list(range(40))


def test_the_frame_may_have_any_name() -> None:
    for length in range(12):
        assert tick_of(commands_message([], np.zeros(0), Header(1 << 40, 1, "w" * length))) == 1 << 40


def test_what_another_recorder_wrote_is_left_to_rosbags(bag: Path, tmp_path: Path) -> None:
    file = shutil.copy(file_of(bag), tmp_path / "other.mcap")
    content = file.read_bytes()
    assert content.count(b"conveyor_sim ", 0, 64) == 1
    file.write_bytes(content.replace(b"conveyor_sim ", b"conveyor_xyz ", 1))
    assert own_reader(file) is None


def test_messages_of_another_definition_are_left_to_rosbags(bag: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(OUTPUTS, "bottles", OUTPUTS["contacts"])
    assert own_reader(file_of(bag)) is None


def test_chosen_ticks_are_read_as_in_a_reading_of_all(bag: Path) -> None:
    with open_bag(bag) as opened:
        everything = list(opened.bottles())
        assert opened.ticks("bottles").tolist() == [frame.tick for frame in everything]
        chosen = {everything[3].tick, everything[-1].tick}
        found = list(opened.read("bottles", chosen))
    assert [frame.tick for frame in found] == sorted(chosen)
    for frame in found:
        (expected,) = [one for one in everything if one.tick == frame.tick]
        assert frame.time == expected.time and same(frame.data, expected.data)
