# SPDX-License-Identifier: Apache-2.0
"""The copy of the line message after the header: damage of the chunk that holds the line costs no message."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest
from mcap.reader import make_reader
from mcap.records import Metadata
from rosbags.highlevel import AnyReader

from conveyor_sim.bag.mcap.line_copy import NAME, LineCopy, read_line_copy
from conveyor_sim.bag.reader import open_bag
from conveyor_sim.bag.recover import recover
from conveyor_sim.bag.replay import replay
from conveyor_sim.errors import BagError

Make = Callable[[str, int], Path]
TICKS = 60
HEAD = 9 + 32 + 4 + 8
"""Bytes of a chunk's head, with the name of its compression."""


@pytest.fixture
def folder(record_line: Make) -> Path:
    """Return a recording of seven chunks: the line, then ten ticks each."""
    return record_line("bag", TICKS)


def file_of(folder: Path) -> Path:
    return next(folder.glob("*.mcap"))


def messages(folder: Path) -> list[tuple[str, int, bytes]]:
    with open_bag(folder) as bag:
        return list(bag.raw())


def first_chunk(folder: Path) -> tuple[int, int]:
    """First byte and length of its record."""
    with file_of(folder).open("rb") as stream:
        summary = make_reader(stream).get_summary()
    assert summary is not None
    return summary.chunk_indexes[0].chunk_start_offset, summary.chunk_indexes[0].chunk_length


def records(folder: Path) -> list[Metadata]:
    with file_of(folder).open("rb") as stream:
        return list(make_reader(stream).iter_metadata())


def flip(folder: Path, *places: int) -> None:
    content = bytearray(file_of(folder).read_bytes())
    for place in places:
        content[place] ^= 0x04
    file_of(folder).write_bytes(content)


def test_the_copy_follows_directly_upon_the_header(folder: Path) -> None:
    content = file_of(folder).read_bytes()
    behind = 8 + 9 + int.from_bytes(content[9:17], "little")
    length = len(NAME).to_bytes(4, "little")
    assert content[behind] == 0x0C and content[behind + 9 :].startswith(length + NAME.encode())
    copy = read_line_copy(records(folder)[0])
    assert copy is not None
    assert (copy.topic, copy.type) == ("/line", "conveyor_msgs/msg/Line")
    assert ("line", copy.log_time, copy.data) == messages(folder)[0]


@pytest.mark.parametrize(
    "place", [0, 1, 3, 9, 17, 25, 33, 37, 41, 46, HEAD, HEAD + 10, HEAD + 900, -1], ids=lambda place: f"byte {place}"
)
def test_a_flipped_bit_anywhere_in_the_first_chunk_costs_no_message(folder: Path, place: int) -> None:
    before, compared = messages(folder), replay(folder).compared
    start, length = first_chunk(folder)
    flip(folder, start + place % length)
    with pytest.raises(BagError, match=r"damaged.*recover"):
        replay(folder)
    report = recover(folder)
    assert not report.healthy and not report.unusable
    assert report.message_count == len(before)
    assert not any("lost:" in sentence for sentence in report.damage)
    assert sorted(messages(folder)) == sorted(before)
    replayed = replay(folder)
    assert (replayed.difference, replayed.compared) == (None, compared)
    assert read_line_copy(records(folder)[0]) is not None
    with AnyReader([folder]) as reader:
        assert sum(1 for _ in reader.messages()) == len(before)
    assert recover(folder).healthy


def test_other_damage_beside_that_of_the_first_chunk_is_reported_with_its_messages(folder: Path) -> None:
    before = messages(folder)
    with file_of(folder).open("rb") as stream:
        summary = make_reader(stream).get_summary()
    assert summary is not None
    first, last = summary.chunk_indexes[0], summary.chunk_indexes[-1]
    flip(folder, first.chunk_start_offset + HEAD + 50, last.chunk_start_offset + HEAD + 50)
    lost = [message for message in before if message[1] > 0.5e9]
    report = recover(folder)
    assert [sentence for sentence in report.damage if "lost:" in sentence] == [
        f"bag_0.mcap: lost: {len(lost)} messages from 0.51 s to 0.60 s"
    ]
    assert sorted(messages(folder)) == sorted(message for message in before if message not in lost)
    replayed = replay(folder)
    assert (replayed.difference, replayed.last_tick) == (None, 50)


def test_a_damaged_copy_is_written_anew_from_the_line_message(folder: Path) -> None:
    before = messages(folder)
    flip(folder, file_of(folder).read_bytes().index(NAME.encode()) + 200)
    assert recover(folder).message_count == len(before)
    copy = read_line_copy(records(folder)[0])
    assert copy is not None and ("line", copy.log_time, copy.data) == before[0]


def test_the_line_is_lost_only_if_both_are_damaged(folder: Path) -> None:
    start, _ = first_chunk(folder)
    flip(folder, file_of(folder).read_bytes().index(NAME.encode()) + 200, start + HEAD + 50)
    report = recover(folder)
    assert "conveyor_msgs/msg/Line" in report.unusable
    assert any("lost: 1 messages" in sentence for sentence in report.damage)


@pytest.mark.parametrize("key", ["topic", "type", "log_time", "data", "crc32"])
@pytest.mark.parametrize("value", [None, "", "1", "/other", "eJwDAAAAAAE="])
def test_a_record_that_is_changed_is_no_copy(key: str, value: str | None) -> None:
    content = LineCopy("/line", "conveyor_msgs/msg/Line", 1, b"some data").to_record()
    assert read_line_copy(Metadata(name=NAME, metadata=content)) is not None
    changed = {name: text for name, text in content.items() if name != key}
    if value is not None:
        changed[key] = value
    if changed != content:
        assert read_line_copy(Metadata(name=NAME, metadata=changed)) is None
    assert read_line_copy(Metadata(name="other", metadata=content)) is None
