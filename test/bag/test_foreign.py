# SPDX-License-Identifier: Apache-2.0
"""Bags as other recorders write them and as accidents leave them: without an index, in several files, still growing."""

from __future__ import annotations

import os
import shutil
import struct
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from facts import missing
from mcap.reader import NonSeekingReader
from mcap.writer import IndexType, Writer
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin
from rosbags.rosbag2 import Writer as StockWriter

from conveyor_sim.bag.mcap.metadata import FILE_NAME, read_metadata
from conveyor_sim.bag.messages.typestore import definition, typestore
from conveyor_sim.bag.reader import open_bag
from conveyor_sim.bag.recorder import Recorder
from conveyor_sim.bag.recover import recover
from conveyor_sim.bag.replay import replay
from conveyor_sim.errors import BagError
from conveyor_sim.scene import Scene

Make = Callable[[str, int], Path]
TICKS = 60


@pytest.fixture
def folder(record_line: Make) -> Path:
    """A recording of seven chunks: the line, then ten ticks each."""
    return record_line("bag", TICKS)


def written(bag: Path, folder: Path, files: int = 1, **options: Any) -> Path:
    """The messages of a bag as mcap's own writer writes them, in some files."""
    folder.mkdir()
    with open_bag(bag) as opened:
        messages, types = list(opened.raw()), opened.types
    for number in range(files):
        with (folder / f"{folder.name}_{number}.mcap").open("wb") as stream:
            writer = Writer(stream, **options)
            writer.start("ros2", "stock")
            channels: dict[str, int] = {}
            for topic, time, data in messages[len(messages) * number // files : len(messages) * (number + 1) // files]:
                if topic not in channels:
                    schema = writer.register_schema(types[topic], "ros2msg", definition(types[topic]).encode())
                    channels[topic] = writer.register_channel(f"/{topic}", "cdr", schema)
                writer.add_message(channels[topic], time, data, time)
            writer.finish()
    recover(folder)  # writes metadata.yaml
    return folder


@pytest.mark.parametrize("files", [1, 2])
def test_a_bag_without_chunks_is_compared_to_its_end(folder: Path, tmp_path: Path, files: int) -> None:
    """The profile "fastwrite" of rosbag2 writes such bags."""
    compared = replay(folder).compared
    assert replay(written(folder, tmp_path / "flat", files, use_chunking=False)).compared == compared


def test_messages_out_of_order_without_an_index_are_read_in_order(folder: Path, tmp_path: Path) -> None:
    """The specification asks for no order."""
    bag = written(folder, tmp_path / "flat", use_chunking=False)
    with open_bag(bag) as opened:
        times = [time for _, time, _ in opened.raw()]
    file, early = bag / "flat_0.mcap", struct.pack("<Q", times[len(times) // 2])
    late = struct.pack("<Q", times[-1])
    file.write_bytes(file.read_bytes().replace(2 * early, late + early, 1))
    assert recover(bag).healthy
    with open_bag(bag) as opened:
        found = [time for _, time, _ in opened.raw()]
    assert found == sorted(found)
    assert len(found) == len(times)


def test_a_bag_without_indexes_of_messages_is_read(folder: Path, tmp_path: Path) -> None:
    bag = written(folder, tmp_path / "bare", index_types=IndexType.CHUNK | IndexType.ATTACHMENT | IndexType.METADATA)
    assert replay(bag).compared == replay(folder).compared


def test_a_recording_that_grows_is_not_repaired(folder: Path, scene: Scene, tmp_path: Path) -> None:
    """The repaired copy would take its place, and all that comes later be lost."""
    growing = tmp_path / "growing"
    with open_bag(folder) as bag, Recorder(growing) as recorder:
        for topic, time, data in bag.raw():
            recorder.write(topic, data, time)
            if time == 300_000_000:
                recorder.flush()
                before = {file.name: file.read_bytes() for file in growing.iterdir()}
                with pytest.raises(BagError, match="is being recorded"):
                    recover(growing)
                assert {file.name: file.read_bytes() for file in growing.iterdir()} == before
    assert recover(growing).healthy
    assert replay(growing).last_tick == TICKS


def test_a_recording_whose_file_is_deleted_ends_at_once(folder: Path, tmp_path: Path) -> None:
    recorder = Recorder(tmp_path / "deleted")
    with open_bag(folder) as bag:
        for topic, time, data in bag.raw():
            recorder.write(topic, data, time)
    shutil.rmtree(tmp_path / "deleted")
    with pytest.raises(BagError, match=r"stopped at 0\.60 s.*moved or deleted"):
        recorder.flush()


def test_a_recording_whose_folder_is_moved_is_complete_but_for_its_metadata(folder: Path, tmp_path: Path) -> None:
    recorder = Recorder(tmp_path / "here")
    with open_bag(folder) as bag:
        for topic, time, data in bag.raw():
            recorder.write(topic, data, time)
    (tmp_path / "here").rename(tmp_path / "there")
    with pytest.raises(BagError, match="moved or deleted"):
        recorder.close()
    assert missing(recover(tmp_path / "there").damage[0], "metadata.yaml", "missing") == []
    assert replay(tmp_path / "there").last_tick == TICKS


def test_a_topic_that_only_the_index_names_is_damage(folder: Path, tmp_path: Path) -> None:
    """A reader that starts at the beginning of the file can't identify the messages."""
    bag = written(folder, tmp_path / "flat", use_chunking=False)
    file = bag / "flat_0.mcap"
    content = file.read_bytes()
    start = content.index(b"\x08\0\0\0/bottles\x03\0\0\0cdr") - 13  # opcode, length, number, schema
    stop = start + 9 + int.from_bytes(content[start + 1 : start + 9], "little")
    file.write_bytes(content[:start] + content[stop:])
    assert any(sentence.startswith("flat_0.mcap: only the index names") for sentence in recover(bag).damage)
    assert recover(bag).healthy
    with file.open("rb") as stream:
        topics = [channel.topic for _, channel, _ in NonSeekingReader(stream).iter_messages()]
    assert "/bottles" in topics


@pytest.mark.parametrize("count", [1, 8])
def test_a_damaged_begin_costs_no_message(folder: Path, count: int) -> None:
    with open_bag(folder) as bag:
        before = list(bag.raw())
    file = next(folder.glob("*.mcap"))
    file.write_bytes(bytes(count) + file.read_bytes()[count:])
    with pytest.raises(BagError, match=r"damaged.*recover"):
        open_bag(folder)
    assert "does not begin as an MCAP file" in recover(folder).damage[0]
    with open_bag(folder) as bag:
        assert list(bag.raw()) == before


def test_an_empty_file_does_not_cost_the_others(folder: Path, tmp_path: Path) -> None:
    """A loss of power can leave an empty last file of a split bag."""
    split = written(folder, tmp_path / "split", 3)
    (split / "split_2.mcap").write_bytes(b"")
    (split / "split_2.mcap.recovering").write_bytes(b"left by a repair that was killed")
    report = recover(split)
    assert "split_2.mcap: is empty" in report.damage
    assert split / "split_2.mcap.damaged" in report.kept
    assert not (split / "split_2.mcap").exists()
    assert recover(split).healthy
    assert replay(split).difference is None


def test_a_file_that_is_missing_is_told(folder: Path, tmp_path: Path) -> None:
    split = written(folder, tmp_path / "split", 3)
    before = recover(split).message_count
    (split / "split_1.mcap").unlink()
    report = recover(split)
    assert f"split_1.mcap: is missing, with {before - report.message_count} messages" in report.damage


def test_messages_that_are_compressed_one_by_one_can_be_read_after_a_repair(folder: Path, tmp_path: Path) -> None:
    bag = tmp_path / "small"
    writer = StockWriter(bag, version=9, storage_plugin=StoragePlugin.MCAP)
    writer.set_compression(CompressionMode.MESSAGE, CompressionFormat.ZSTD)
    store = typestore()
    with open_bag(folder) as opened, writer:
        topics = {
            topic: writer.add_connection(f"/{topic}", kind, typestore=store) for topic, kind in opened.types.items()
        }
        for topic, time, data in opened.raw():
            writer.write(topics[topic], time, data)
    file = next(bag.glob("*.mcap"))
    file.write_bytes(file.read_bytes()[:-500])
    report = recover(bag)
    assert not report.healthy and not report.unusable
    assert replay(bag).difference is None


def test_metadata_that_calls_its_files_compressed_is_put_right(folder: Path) -> None:
    metadata = folder / FILE_NAME
    metadata.write_text(metadata.read_text().replace("compression_mode: ''", "compression_mode: FILE"))
    assert not recover(folder).healthy
    assert (read_metadata(folder) or {})["compression_mode"] == ""
    assert replay(folder).last_tick == TICKS


def test_a_pipe_in_place_of_a_file_is_not_waited_for(folder: Path) -> None:
    metadata = folder / FILE_NAME
    metadata.write_text(
        metadata.read_text().replace("bag_0.mcap", "bag_0.db3").replace("identifier: mcap", "identifier: sqlite3")
    )
    next(folder.glob("*.mcap")).unlink()
    os.mkfifo(folder / "bag_0.db3")
    with pytest.raises(BagError, match=r"bag_0\.db3: is no regular file"):
        open_bag(folder)


@pytest.mark.parametrize("name", ["x" * 300, "no.yaml"])
def test_a_path_that_is_no_bag_is_refused(tmp_path: Path, name: str) -> None:
    (tmp_path / "no.yaml").write_text("name: no")
    for command in (open_bag, recover):
        with pytest.raises(BagError, match=r"is no bag|can't be read|can't be recovered|nothing in it"):
            command(tmp_path / name)
