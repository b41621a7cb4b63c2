"""MCAP files as mcap's own writer writes them."""

from __future__ import annotations

from io import BytesIO
from pathlib import Path

import numpy as np
import pytest
from mcap.reader import make_reader
from mcap.writer import CompressionType, Writer

from conveyor_sim.bag.mcap import writer as mcap_writer
from conveyor_sim.bag.mcap.writer import CHUNK_SIZE, McapWriter

TOPICS = ("/bottles", "/signals", "/never")


def messages(count: int) -> list[tuple[int, int, bytes, int]]:
    """Channel, log time, content and sequence; times go back now and then, contents are large and small."""
    random = np.random.default_rng(11)
    return [
        (int(random.integers(1, 3)), int(random.integers(0, 10**12)), random.bytes(int(random.integers(0, 40_000))), n)
        for n in range(count)
    ]


def by_mcap(count: int, flush_every: int) -> bytes:
    stream = BytesIO()
    writer = Writer(stream, compression=CompressionType.ZSTD, enable_data_crcs=True)
    writer.start(profile="ros2", library="conveyor_sim test")
    schemas = [writer.register_schema(name, "ros2msg", b"text of " + name.encode()) for name in ("a", "b")]
    channels = [writer.register_channel(topic, "cdr", schemas[0], {"hash": topic}) for topic in TOPICS]
    assert channels == [1, 2, 3]
    for number, (channel, time, data, sequence) in enumerate(messages(count)):
        writer.add_message(channel, time, data, time + 1, sequence)
        if number % flush_every == flush_every - 1:
            writer.flush()
    writer.add_attachment(5, 6, "start.npz", "application/octet-stream", b"1234")
    writer.flush()
    writer.add_metadata("rosbag2", {"text": "one"})
    writer.finish()
    return stream.getvalue()


def by_us(count: int, flush_every: int) -> bytes:
    stream = BytesIO()
    writer = McapWriter(stream, "ros2", "conveyor_sim test")
    schemas = [writer.register_schema(name, "ros2msg", b"text of " + name.encode()) for name in ("a", "b")]
    channels = [writer.register_channel(topic, "cdr", schemas[0], {"hash": topic}) for topic in TOPICS]
    assert channels == [1, 2, 3]
    for number, (channel, time, data, sequence) in enumerate(messages(count)):
        writer.add_message(channel, time, data, time + 1, sequence)
        if number % flush_every == flush_every - 1:
            writer.flush()
    writer.add_attachment("start.npz", "application/octet-stream", b"1234", log_time=6, create_time=5)
    writer.flush()
    writer.add_metadata("rosbag2", {"text": "one"})
    writer.finish()
    return stream.getvalue()


@pytest.mark.parametrize(("count", "flush_every"), [(0, 1), (1, 1), (7, 2), (300, 1000), (300, 7)])
def test_at_the_same_level_the_file_is_that_of_mcap_to_the_byte(
    monkeypatch: pytest.MonkeyPatch, count: int, flush_every: int
) -> None:
    monkeypatch.setattr(mcap_writer, "LEVEL", 3)
    assert by_us(count, flush_every) == by_mcap(count, flush_every)


def test_mcap_reads_it_back(tmp_path: Path) -> None:
    reader = make_reader(BytesIO(by_us(300, 1000)), validate_crcs=True)
    read = sorted(
        (message.sequence, message.channel_id, message.log_time, message.data)
        for _, _, message in reader.iter_messages()
    )
    assert read == [(sequence, channel, time, data) for channel, time, data, sequence in messages(300)]
    summary = reader.get_summary()
    assert summary is not None and summary.statistics is not None
    assert summary.statistics.chunk_count == len(summary.chunk_indexes) > 2
    assert all(chunk.uncompressed_size < CHUNK_SIZE + 50_000 for chunk in summary.chunk_indexes)


def test_times_are_those_of_all_messages_so_far() -> None:
    writer = McapWriter(BytesIO(), "ros2", "conveyor_sim test")
    channel = writer.register_channel("/a", "cdr", writer.register_schema("a", "ros2msg", b""), {})
    assert writer.times == (0, 0)
    writer.add_message(channel, 50, b"x", 50, 0)
    assert writer.times == (50, 50)
    writer.flush()
    writer.add_message(channel, 20, b"x", 20, 1)
    assert (writer.times, writer.counts.total()) == ((20, 50), 2)
