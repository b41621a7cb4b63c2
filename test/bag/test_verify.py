# SPDX-License-Identifier: Apache-2.0
"""Damage is detected: no flipped bit is called intact or replayed; valid chunks are kept, losses are reported."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest
import zstandard
from bag.small_line import record
from click.testing import CliRunner
from facts import missing
from mcap.reader import NonSeekingReader, make_reader
from mcap.stream_reader import CRCValidationError
from mcap.summary import Summary
from mcap.writer import CompressionType, IndexType, Writer
from rosbags.rosbag2 import StoragePlugin
from rosbags.rosbag2 import Writer as StockWriter

from conveyor_sim.bag.mcap.writer import McapFileWriter, Schema
from conveyor_sim.bag.messages.topics import OUTPUTS
from conveyor_sim.bag.messages.typestore import definition, typestore
from conveyor_sim.bag.reader import open_bag
from conveyor_sim.bag.recover import recover
from conveyor_sim.bag.replay import replay
from conveyor_sim.cli import main
from conveyor_sim.errors import BagError
from conveyor_sim.report.figures.recording import Recording
from conveyor_sim.scene import Scene

Make = Callable[[str, int], Path]
EXAMPLE = Path(__file__).parents[2] / "examples" / "read_bag.py"
TICKS = 60
END = 8 + 29
"""Bytes of footer and end mark."""


@pytest.fixture
def folder(record_line: Make) -> Path:
    """A recording of seven chunks: the line, then ten ticks each."""
    return record_line("bag", TICKS)


def file_of(folder: Path) -> Path:
    return next(folder.glob("*.mcap"))


def summary_of(folder: Path) -> Summary:
    with file_of(folder).open("rb") as stream:
        summary = make_reader(stream).get_summary()
    assert summary is not None
    return summary


def change(folder: Path, at: int, new: bytes = b"", old: int | None = None) -> None:
    """Puts bytes in place of as many, or of `old`, at a byte of the file (negative: from its end)."""
    file = file_of(folder)
    content = file.read_bytes()
    at = at % len(content)
    file.write_bytes(content[:at] + new + content[at + (len(new) if old is None else old) :])


def flip(folder: Path, at: int) -> None:
    content = file_of(folder).read_bytes()
    change(folder, at, bytes([content[at] ^ 0x10]))


def damage_chunk(folder: Path, number: int) -> None:
    chunk = summary_of(folder).chunk_indexes[number]
    flip(folder, chunk.chunk_start_offset + chunk.chunk_length - 20)


def data_end(folder: Path) -> int:
    content = file_of(folder).read_bytes()
    return int.from_bytes(content[-END + 9 : -END + 17], "little") - 13


def messages(folder: Path) -> list[tuple[str, int, bytes]]:
    with open_bag(folder) as bag:
        return list(bag.raw())


def validated(file: Path) -> int:
    """Messages that the mcap library reads with all its checksums, without the index."""
    with file.open("rb") as stream:
        return sum(1 for _ in NonSeekingReader(stream, validate_crcs=True).iter_messages(log_time_order=False))


def test_what_is_recorded_carries_every_checksum(folder: Path) -> None:
    content = file_of(folder).read_bytes()
    end = data_end(folder)
    assert content[end] == 0x0F
    assert any(content[end + 9 : end + 13]), "the data section has a checksum"
    assert any(content[-12:-8]), "the index has a checksum"
    with open_bag(folder) as bag:
        assert validated(file_of(folder)) == sum(bag.counts.values())
    flip(folder, 22)  # in the header, outside of all chunks
    with pytest.raises(CRCValidationError):
        validated(file_of(folder))


def test_no_flipped_bit_goes_unnoticed(folder: Path) -> None:
    """One after the other, all over the file: opening refuses each, and so `replay` and `plot` do."""
    content = file_of(folder).read_bytes()
    for at in range(0, len(content), 997):
        flip(folder, at)
        with pytest.raises(BagError, match=r"damaged|begin"):
            open_bag(folder)
        file_of(folder).write_bytes(content)
    assert recover(folder).healthy


def test_a_damaged_chunk_is_left_out_and_its_seconds_and_messages_named(folder: Path) -> None:
    before = messages(folder)
    damage_chunk(folder, 4)
    lost = [message for message in before if 0.3e9 < message[1] <= 0.4e9]
    report = recover(folder)
    assert not report.healthy
    assert report.message_count == len(before) - len(lost)
    assert f"bag_0.mcap: lost: {len(lost)} messages from 0.31 s to 0.40 s" in report.damage
    assert messages(folder) == [message for message in before if message not in lost]
    assert validated(file_of(folder)) == report.message_count
    assert recover(folder).healthy


def test_chunks_that_are_lost_without_an_index_lie_between_their_neighbours(folder: Path) -> None:
    damage_chunk(folder, 4)
    os.truncate(file_of(folder), data_end(folder))
    report = recover(folder)
    (lost,) = [sentence for sentence in report.damage if "lost" in sentence]
    assert re.search(r"lost: \d+ messages from 0.30 s to 0.41 s", lost)


def test_a_chunk_that_is_gone_with_the_index_is_not_passed_over_in_silence(folder: Path) -> None:
    """No gap is left where it was, and nothing counts the messages any more."""
    whole = file_of(folder).read_bytes()
    chunk = summary_of(folder).chunk_indexes[4]
    start, length = chunk.chunk_start_offset, chunk.chunk_length + chunk.message_index_length
    damaged = bytearray(whole[:start] + whole[start + length :])
    damaged[-60] ^= 1  # in the index
    file_of(folder).write_bytes(damaged)
    report = recover(folder)
    assert any("whether messages are lost can't be known" in sentence for sentence in report.damage)
    assert recover(folder).healthy


def test_topics_that_a_lost_chunk_named_are_found_in_the_index(folder: Path) -> None:
    before = messages(folder)
    damage_chunk(folder, 0)  # the line is in it, and every topic's name
    flip(folder, file_of(folder).read_bytes().index(b"conveyor_sim.line") + 200)  # the copy of the line
    result = CliRunner().invoke(main, ["recover", str(folder)])
    assert result.exit_code == 1
    assert "no message of type conveyor_msgs/msg/Line" in result.output
    assert "other programs can read it, but it can't be replayed or drawn" in result.output
    with file_of(folder).open("rb") as stream:
        found = [
            (channel.topic[1:], message.log_time, message.data)
            for _, channel, message in make_reader(stream, validate_crcs=True).iter_messages()
        ]
    assert found == [message for message in before if message[0] != "line"]


def test_where_no_state_is_left_nothing_is_called_recovered(folder: Path) -> None:
    """The line alone could be read."""
    os.truncate(file_of(folder), summary_of(folder).chunk_indexes[1].chunk_start_offset)
    content = file_of(folder).read_bytes()
    result = CliRunner().invoke(main, ["recover", str(folder)])
    assert result.exit_code == 1
    assert "holds only 1 messages of /line and no state that can be read" in result.output
    assert "delete it to record there again" in result.output
    assert file_of(folder).read_bytes() == content
    assert sorted(file.name for file in folder.iterdir()) == ["bag_0.mcap", "metadata.yaml"]


@pytest.mark.parametrize(
    ("edit", "sentence"),
    [
        (lambda folder: flip(folder, 22), "the checksum over all data is wrong"),
        (lambda folder: flip(folder, data_end(folder) + 10), "the checksum over all data is wrong"),
        (lambda folder: flip(folder, data_end(folder) + 200), "the index at the end is damaged"),
        (lambda folder: change(folder, len(file_of(folder).read_bytes()) - 1, b"x" * 50, 1), "the end|index"),
        (lambda folder: change(folder, 8, bytes(30), 0), r"bytes 8 to \d+ hold nothing that can be read"),
    ],
    ids=["header", "checksum", "index", "appended", "inserted"],
)
def test_damage_outside_of_chunks_is_told_and_costs_no_message(
    folder: Path, edit: Callable[[Path], None], sentence: str
) -> None:
    before = messages(folder)
    edit(folder)
    report = recover(folder)
    assert re.search(sentence, " ".join(report.damage))
    assert messages(folder) == before
    assert replay(folder).difference is None


def test_bytes_lost_in_a_chunk_do_not_cost_the_next_one(folder: Path) -> None:
    before = messages(folder)
    chunk = summary_of(folder).chunk_indexes[4]
    change(folder, chunk.chunk_start_offset + 100, b"", old=500)
    report = recover(folder)
    kept = [message for message in before if not 0.3e9 < message[1] <= 0.4e9]
    assert messages(folder) == kept
    assert any("from 0.31 s to 0.40 s" in sentence for sentence in report.damage)


def test_chunks_twice_or_in_another_order_are_put_right(folder: Path) -> None:
    before = messages(folder)
    content = file_of(folder).read_bytes()
    second, fifth = (summary_of(folder).chunk_indexes[number] for number in (2, 5))
    a, b = ((c.chunk_start_offset, c.chunk_start_offset + c.chunk_length) for c in (second, fifth))
    swapped = content[: a[0]] + content[b[0] : b[1]] + content[a[1] : b[0]] + content[a[0] : a[1]] + content[b[1] :]
    twice = content[: b[1]] + content[a[0] : a[1]] + content[b[1] :]
    for damaged in (swapped, twice):
        file_of(folder).write_bytes(damaged)
        assert not recover(folder).healthy
        assert messages(folder) == before


def test_a_size_that_is_wrong_takes_no_memory(folder: Path) -> None:
    """A chunk that states an exabyte, and one whose content unpacks to a gigabyte."""
    first, second = summary_of(folder).chunk_indexes[2:4]
    change(folder, first.chunk_start_offset + 9 + 16, (1 << 60).to_bytes(8, "little"))
    frame = zstandard.compress(bytes(1 << 30))
    start = second.chunk_start_offset + 9 + 32 + 4 + 8
    change(folder, start, frame[: second.compressed_size])
    script = (
        "import resource, sys; from conveyor_sim.bag.recover import recover; "
        "before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss; recover(sys.argv[1]); "
        "print(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before)"
    )
    done = subprocess.run([sys.executable, "-c", script, str(folder)], capture_output=True, text=True, check=True)
    assert int(done.stdout) < 200_000, "kB"


def test_what_carries_no_checksum_is_never_called_whole(folder: Path, tmp_path: Path) -> None:
    """Stock recorders write files without a checksum over all data, or without any checksum."""
    partly = tmp_path / "partly.mcap"
    with file_of(folder).open("rb") as source, partly.open("wb") as stream:
        writer = Writer(stream, compression=CompressionType.LZ4, chunk_size=30_000, index_types=IndexType.ALL)
        writer.start("ros2", "stock")
        summary = summary_of(folder)
        schemas = {s.id: writer.register_schema(s.name, s.encoding, s.data) for s in summary.schemas.values()}
        channels = {
            c.id: writer.register_channel(c.topic, c.message_encoding, schemas[c.schema_id], c.metadata)
            for c in summary.channels.values()
        }
        for _, channel, message in make_reader(source).iter_messages():
            writer.add_message(channels[channel.id], message.log_time, message.data, message.publish_time)
        writer.finish()
    report = recover(partly)
    assert report.healthy
    assert missing(report.unverified[0], "partly.mcap", "chunks") == []
    result = CliRunner().invoke(main, ["recover", str(partly)])
    assert result.exit_code == 0
    assert "no damage was found" in result.output and "can't be verified" in result.output
    assert "whole" not in result.output
    assert replay(partly).difference is None

    bare = tmp_path / "bare"
    store = typestore()
    with open_bag(folder) as bag, StockWriter(bare, version=9, storage_plugin=StoragePlugin.MCAP) as out:
        topics = {topic: out.add_connection(f"/{topic}", kind, typestore=store) for topic, kind in bag.types.items()}
        for topic, time, data in bag.raw():
            out.write(topics[topic], time, data)
    report = recover(bare)
    assert report.healthy
    assert report.unverified == tuple(
        f"bare.mcap: {what}" for what in ("what is outside of chunks", "the index", "chunks")
    )
    assert replay(bare).difference is None


def test_damage_that_no_checksum_covers_is_refused_in_one_sentence(folder: Path, tmp_path: Path) -> None:
    """A stock bag without checksums, a message of it after the other cut to nonsense."""
    bare = tmp_path / "bare"
    store = typestore()
    with open_bag(folder) as bag, StockWriter(bare, version=9, storage_plugin=StoragePlugin.MCAP) as out:
        topics = {topic: out.add_connection(f"/{topic}", kind, typestore=store) for topic, kind in bag.types.items()}
        for number, (topic, time, data) in enumerate(bag.raw()):
            out.write(topics[topic], time, data if topic == "line" or number % 5 else data[: len(data) // 2])
    for reads in (replay, drawn):
        with pytest.raises(BagError) as caught:
            reads(bare)
        assert "\n" not in str(caught.value)
        assert "recover" in str(caught.value)


def test_a_length_in_the_index_that_no_checksum_covers_is_damage(folder: Path, tmp_path: Path) -> None:
    """Other readers would read beyond the record: mcap and rosbags can't open such a file."""
    bare = tmp_path / "bare"
    with open_bag(folder) as bag, StockWriter(bare, version=9, storage_plugin=StoragePlugin.MCAP) as out:
        topics = {t: out.add_connection(f"/{t}", kind, typestore=typestore()) for t, kind in bag.types.items()}
        for topic, time, data in bag.raw():
            out.write(topics[topic], time, data)
    content = bytearray(file_of(bare).read_bytes())
    length = content.rfind(b"ros2msg") + len(b"ros2msg")  # of the text of the last schema of the index
    content[length + 1] ^= 0x20
    file_of(bare).write_bytes(content)
    report = recover(bare)
    assert report.damage and not report.unusable
    assert validated(file_of(bare)) == len(messages(folder))


def drawn(path: Path) -> None:
    with open_bag(path) as bag, bag.sense():
        Recording(bag).frames(None)


@pytest.mark.parametrize("text", [b"", b"\xff\xfe\x00", b"[" * 5000, b"rosbag2_bagfile_information: 3", b"a: b: c"])
def test_a_damaged_metadata_file_is_told_and_written_anew(folder: Path, text: bytes) -> None:
    metadata = folder / "metadata.yaml"
    before = metadata.read_text()
    metadata.write_bytes(text)
    with pytest.raises(BagError, match=r"metadata\.yaml does not fit.*recover"):
        open_bag(folder)
    report = recover(folder)
    assert metadata.read_text() == before
    assert report.kept == (folder / "metadata.yaml.damaged",)
    assert (folder / "metadata.yaml.damaged").read_bytes() == text


def test_a_bag_of_several_files_is_read_and_repaired_as_one(folder: Path, tmp_path: Path) -> None:
    before = messages(folder)
    split = tmp_path / "split"
    split.mkdir()
    half = len(before) // 2
    for number, part in enumerate((before[:half], before[half:])):
        name = f"split_{number}.mcap"
        with (split / name).open("wb") as stream:
            file = McapFileWriter(stream, name, "jazzy")
            topics = {
                topic: file.add_topic(
                    f"/{topic}", Schema(output.type, "ros2msg", definition(output.type).encode()), "cdr", {}
                )
                for topic, output in OUTPUTS.items()
            }
            for topic, time, data in part:
                file.add_message(topics[topic], data, time, time)
            file.finish()
    assert missing(recover(split).damage[0], "metadata.yaml", "missing") == []
    assert sorted(messages(split)) == sorted(before)
    assert replay(split).difference is None
    os.truncate(split / "split_1.mcap", (split / "split_1.mcap").stat().st_size - 60)
    with pytest.raises(BagError, match=r"split_1\.mcap: is damaged"):
        open_bag(split)
    assert recover(split).message_count == len(before)
    assert sorted(messages(split)) == sorted(before)


def test_a_wrong_count_in_the_metadata_file_is_put_right(folder: Path) -> None:
    metadata = folder / "metadata.yaml"
    before = metadata.read_text()
    metadata.write_text(before.replace("message_count: 61", "message_count: 16"))
    assert not recover(folder).healthy
    assert metadata.read_text() == before


def test_the_example_tells_of_a_damaged_bag_in_one_line(scene: Scene, tmp_path: Path) -> None:
    record(scene, tmp_path / "bag", 10)
    os.truncate(file_of(tmp_path / "bag"), 9000)
    done = subprocess.run([sys.executable, str(EXAMPLE), str(tmp_path / "bag")], capture_output=True, text=True)
    assert done.returncode == 1
    assert "can't be read" in done.stderr
    assert len(done.stderr.strip().splitlines()) == 1


def test_a_damaged_attachment_is_left_out_and_its_name_escaped(tmp_path: Path) -> None:
    file = tmp_path / "notes.mcap"
    with file.open("wb") as stream:
        writer = McapFileWriter(stream, file.name, "jazzy")
        channel = writer.add_topic("/on", Schema("std_msgs/msg/Bool", "ros2msg", b"bool data"), "cdr", {})
        writer.add_message(channel, b"\x00\x01\x00\x00\x01", log_time=1, publish_time=1)
        for name in ("good", "bad\x1b[2J\nforged"):
            writer.add_attachment(name, "text/plain", f"text of {name}".encode(), log_time=1, create_time=1)
        writer.finish()
    file.write_bytes(file.read_bytes().replace(b"text of bad", b"text of Bad"))
    done = CliRunner().invoke(main, ["recover", str(file)])
    assert "notes.mcap: the attachment bad\\x1b[2J\\nforged is damaged" in done.output
    assert "\x1b" not in done.output
    with file.open("rb") as stream:
        assert [attachment.name for attachment in make_reader(stream).iter_attachments()] == ["good"]
