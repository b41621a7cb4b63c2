# SPDX-License-Identifier: Apache-2.0
"""MCAP files of recordings, read back by the `mcap` library."""

from __future__ import annotations

from collections import Counter
from io import BytesIO

import numpy as np
import pytest
from mcap.reader import NonSeekingReader, make_reader

from conveyor_sim.bag.mcap.index import is_complete
from conveyor_sim.bag.mcap.writer import McapFileWriter, Schema

TOPICS = ("/bottles", "/signals", "/never")
SCHEMA = Schema("std_msgs/msg/String", "ros2msg", b"string data")
CHUNK_SIZE = 1 << 20


def messages(count: int) -> list[tuple[int, int, bytes, int]]:
    """Return channel, log time, content and sequence; times go back now and then, contents are large and small."""
    random = np.random.default_rng(11)
    return [
        (int(random.integers(1, 3)), int(random.integers(0, 10**12)), random.bytes(int(random.integers(0, 40_000))), n)
        for n in range(count)
    ]


def written(count: int, flush_every: int) -> bytes:
    stream = BytesIO()
    file = McapFileWriter(stream, "bag_0.mcap", "jazzy")
    assert [file.add_topic(topic, SCHEMA, "cdr", {"hash": topic}) for topic in TOPICS] == [1, 2, 3]
    for number, (channel, time, data, sequence) in enumerate(messages(count)):
        file.add_message(channel, data, time, time + 1, sequence)
        if number % flush_every == flush_every - 1:
            file.flush()
    file.add_attachment("start.npz", "application/octet-stream", b"1234", log_time=6, create_time=5)
    file.finish()
    return stream.getvalue()


@pytest.mark.parametrize(("count", "flush_every"), [(0, 1), (1, 1), (7, 2), (300, 1000), (300, 7)])
def test_mcap_reads_it_back(count: int, flush_every: int) -> None:
    data = written(count, flush_every)
    reader = make_reader(BytesIO(data), validate_crcs=True)
    read = sorted(
        (message.sequence, message.channel_id, message.log_time, message.publish_time, message.data)
        for _, _, message in reader.iter_messages()
    )
    assert read == [(sequence, channel, time, time + 1, data) for channel, time, data, sequence in messages(count)]
    assert [(one.name, one.data, one.log_time, one.create_time) for one in reader.iter_attachments()] == [
        ("start.npz", b"1234", 6, 5)
    ]
    summary = reader.get_summary()
    assert summary is not None and summary.statistics is not None
    assert [channel.topic for channel in summary.channels.values()] == list(TOPICS)
    assert [schema.name for schema in summary.schemas.values()] == [SCHEMA.name]
    assert summary.statistics.chunk_count == len(summary.chunk_indexes)
    assert all(chunk.uncompressed_size < CHUNK_SIZE + 50_000 for chunk in summary.chunk_indexes)
    if flush_every == 1000:
        assert len(summary.chunk_indexes) > 2


@pytest.mark.parametrize("count", [0, 300])
def test_checksums_cover_every_byte(count: int) -> None:
    data = written(count, 7)
    assert is_complete(data)
    stream = BytesIO(data)
    assert sum(1 for _ in NonSeekingReader(stream, validate_crcs=True).iter_messages()) == count


def test_a_flushed_file_is_readable_without_its_end() -> None:
    stream = BytesIO()
    file = McapFileWriter(stream, "bag_0.mcap", "jazzy")
    channel = file.add_topic("/a", SCHEMA, "cdr", {})
    for time in range(5):
        file.add_message(channel, b"x", time, time)
        file.flush()
        read = NonSeekingReader(BytesIO(stream.getvalue())).iter_messages(log_time_order=False)
        assert [next(read)[2].log_time for _ in range(time + 1)] == list(range(time + 1))


def test_times_and_counts_are_those_of_all_ros_messages_so_far() -> None:
    file = McapFileWriter(BytesIO(), "bag_0.mcap", "jazzy")
    channel, foreign = file.add_topic("/a", SCHEMA, "cdr", {}), file.add_foreign("/b", None, "json", {})

    def state() -> tuple[int, int, int, dict[str, int]]:
        counts = Counter({topic.name: topic.message_count for topic in file.topics})
        return file.info.start_ns, file.info.end_ns, file.info.message_count, dict(counts)

    assert state() == (0, 0, 0, {"/a": 0})
    file.add_message(foreign, b"{}", 10, 10)
    file.add_message(channel, b"x", 50, 50)
    assert state() == (50, 50, 1, {"/a": 1})
    file.flush()
    file.add_message(channel, b"x", 20, 20, 1)
    assert state() == (20, 50, 2, {"/a": 2})
