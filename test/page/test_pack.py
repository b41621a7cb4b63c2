# SPDX-License-Identifier: Apache-2.0
"""Packed data of a page: complete, and no larger than its limit."""

from __future__ import annotations

import zlib
from pathlib import Path

import numpy as np
import pytest
from page.line import record
from rosbags.rosbag2 import StoragePlugin, Writer

from conveyor_sim.bag.messages.typestore import typestore
from conveyor_sim.bag.reader import open_bag
from conveyor_sim.columns.bottles import BottleColumns, ContactColumns
from conveyor_sim.errors import ConveyorError
from conveyor_sim.page.block import BlockContent, levels, pack, varints
from conveyor_sim.page.one_file import write_page
from conveyor_sim.page.recording import Detail, PageRecording

BOTTLES, SECONDS, RATE = 300, 60.0, 25.0
ALLOWED = 1_000_000
"""Bytes of a page for a minute of 300 bottles at 25 Hz, base64 included."""


def read_varints(data: bytes) -> list[int]:
    found, value, shift = [], 0, 0
    for byte in data:
        value |= (byte & 0x7F) << shift
        shift += 7
        if not byte & 0x80:
            found.append((value >> 1) ^ -(value & 1))
            value, shift = 0, 0
    return found


def test_varints_come_back() -> None:
    values = [0, -1, 1, 63, 64, -64, -65, 2**31, -(2**40), 2**62, -(2**63)]
    assert read_varints(varints(values)) == values
    assert varints(np.zeros(0, np.int64)) == b""


def test_forces_are_kept_within_a_twentieth() -> None:
    force = np.geomspace(0.5, 1e5, 1000)
    back = 0.05 * (2.0 ** (levels(force) / 8.0) - 1.0)
    assert np.abs(back / force - 1.0).max() < 0.05


def test_a_minute_of_a_crowd_that_is_pushed_about_stays_below_a_megabyte() -> None:
    """300 bottles in a dense crowd, each shaken by some mm/s and carried on at 0.3 m/s, with contacts and forces."""
    rng = np.random.default_rng(3)
    ids = np.arange(BOTTLES, dtype=np.uint64)
    rows = np.stack([np.arange(BOTTLES) % 20 * 0.08, np.arange(BOTTLES) // 20 * 0.07], axis=1)
    velocity, shaken = np.zeros((BOTTLES, 2)), rows.copy()
    size, content = 0, BlockContent()
    for frame in range(int(SECONDS * RATE)):
        velocity = 0.8 * velocity + rng.normal(0.0, 0.004, velocity.shape)
        shaken += velocity / RATE
        x, y = shaken[:, 0] + 0.3 * frame / RATE, shaken[:, 1]
        zeros, force = np.zeros(BOTTLES), rng.exponential(5.0, BOTTLES)
        kinds = np.zeros(BOTTLES, np.uint16)
        bottles = BottleColumns(ids, kinds, x, y, zeros, zeros, zeros, zeros, kinds.astype(np.int32), force, zeros)
        content.bottles.append((4 * frame, bottles))
        if frame % 2 == 0:
            pairs = np.flatnonzero(rng.random(BOTTLES - 20) < 0.9)
            a, b, none = ids[pairs], ids[pairs + 20], np.zeros(len(pairs))
            kind, normal = np.zeros(len(pairs), np.uint8), rng.exponential(5.0, len(pairs))
            content.contacts.append((4 * frame, ContactColumns(kind, a, b, none, none, none, none, none, normal, none)))
        if frame % 100 == 99:
            size += len(zlib.compress(pack(content, 4 * (frame - 99)), 9))
            content = BlockContent()
    assert size * 4 / 3 < ALLOWED


def test_a_bottle_whose_type_changes_has_a_track_of_each_type() -> None:
    """Three frames of one bottle that is filled on its way; the page draws the type of the track."""
    content, one = BlockContent(), np.ones(1)
    for frame, kind in enumerate((0, 0, 1)):
        columns = BottleColumns(
            np.array([7], np.uint64), np.array([kind], np.uint16), frame * one, one, one, one, one, one,
            np.array([0], np.int32), one, one,
        )  # fmt: skip
        content.bottles.append((4 * frame, columns))
    numbers = iter(read_varints(pack(content, 0)))
    ticks, ids, types, first, count, x, *_ = ([next(numbers) for _ in range(next(numbers))] for _ in range(6))
    assert (ticks, ids, types) == ([0, 4, 4], [7, 0], [0, 1])
    assert (first, count, x) == ([0, 2], [2, 1], [0, 1000, 2000])


def test_the_end_alone_is_drawn_and_all_that_happened_is_listed(bag: Path, tmp_path: Path) -> None:
    whole, end = write_page(bag, tmp_path / "whole.html"), write_page(bag, tmp_path / "end.html", last=6.0)
    assert end.stat().st_size < whole.stat().st_size
    blocks = [page.read_text().count('data-part="block/') for page in (whole, end)]
    assert blocks == [7, 2]


def test_the_same_recording_gives_the_same_bytes(bag: Path, tmp_path: Path) -> None:
    pages = [write_page(bag, tmp_path / f"{number}.html").read_bytes() for number in (1, 2)]
    assert pages[0] == pages[1]


def test_a_page_that_cannot_be_written_is_said_in_one_sentence(bag: Path, tmp_path: Path) -> None:
    with pytest.raises(ConveyorError, match=r"is a folder, expected a file to write$"):
        write_page(bag, tmp_path)


def test_a_recording_of_a_moment_opens(tmp_path: Path) -> None:
    assert write_page(record(tmp_path / "bag", 0.02), tmp_path / "page.html").stat().st_size > 0


def test_what_stock_rosbag2_recorded_gives_the_same_blocks(bag: Path, tmp_path: Path) -> None:
    """Another storage, and log times of the wall clock."""
    store = typestore()
    folder = tmp_path / "stock"
    with open_bag(bag) as opened, Writer(folder, version=9, storage_plugin=StoragePlugin.SQLITE3) as writer:
        connections = {
            topic: writer.add_connection(f"/hall/{topic}", kind, typestore=store)
            for topic, kind in opened.types.items()
        }
        for topic, stamp, data in opened.raw():
            writer.write(connections[topic], 1_700_000_000_000_000_000 + stamp // 2, data)
    with open_bag(bag) as opened, open_bag(folder) as other:
        ours, theirs = PageRecording(opened, Detail()), PageRecording(other, Detail())
        for recording in (ours, theirs):
            recording.begin_before(recording.last, 15.0)
        assert (ours.first, ours.last, ours.story()) == (theirs.first, theirs.last, theirs.story())
        assert all(ours.block(number) == theirs.block(number) for number in range(ours.blocks))
