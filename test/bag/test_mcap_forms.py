# SPDX-License-Identifier: Apache-2.0
"""Every form of MCAP that the specification allows is read as the mcap library reads it, and is called intact."""

from __future__ import annotations

from dataclasses import replace
from io import BytesIO
from pathlib import Path
from typing import Any

import pytest
from bag.mcap_forms import (
    ATTACHMENT,
    CHANNEL,
    FEATURES,
    MAGIC,
    SCHEMA,
    TEN,
    Form,
    Item,
    build,
    conformance_forms,
    padding,
)
from mcap.opcode import Opcode
from mcap.reader import NonSeekingReader, make_reader
from mcap.records import Channel, Message, Metadata, Schema

from conveyor_sim.bag.mcap.salvage import Salvage
from conveyor_sim.bag.mcap_reader import McapFilesReader
from conveyor_sim.bag.recover import RecoverReport, recover
from conveyor_sim.errors import BagError

ROS_SCHEMA = Schema(id=1, name="std_msgs/msg/Bool", encoding="ros2msg", data=b"bool data")
ROS_CHANNEL = Channel(id=1, topic="/on", schema_id=1, message_encoding="cdr", metadata={})
ROS_ITEMS: list[Item] = [ROS_SCHEMA, ROS_CHANNEL, *TEN]
LOG_CHANNEL = Channel(id=2, topic="/log", schema_id=0, message_encoding="json", metadata={})
LOG_MESSAGE = Message(channel_id=2, log_time=6, publish_time=6, data=b'{"a": 1}', sequence=0)
INDEXED = frozenset(FEATURES) - {"pad"}
UNREADABLE = ((0x10, b"reserved"), (0x7F, b""), (0x80, b"private"), (0xFF, MAGIC))


def in_library(content: bytes) -> tuple[list[Any], list[Any], list[Any]]:
    """Messages, attachments and metadata as the mcap library reads them, with its checksums."""
    readers = [NonSeekingReader(BytesIO(content), validate_crcs=True) for _ in range(3)]
    messages = [message for _, _, message in readers[0].iter_messages(log_time_order=False)]
    return messages, list(readers[1].iter_attachments()), list(readers[2].iter_metadata())


def recovered(place: Path, content: bytes) -> RecoverReport:
    file = place / "form.mcap"
    file.write_bytes(content)
    report = recover(file)
    assert [path.name for path in place.iterdir()] == [file.name]
    assert file.read_bytes() == content or not report.healthy
    return report


def read(place: Path, content: bytes) -> list[tuple[str, int, bytes]]:
    file = place / "form.mcap"
    file.write_bytes(content)
    source = McapFilesReader(file, [file])
    try:
        return list(source.messages({recorded.topic for recorded in source.topics}, None, None))
    finally:
        source.close()


def test_all_forms_of_the_conformance_suite_are_intact_and_read_as_by_the_library(tmp_path: Path) -> None:
    names = set()
    for name, items, features in conformance_forms():
        form = Form(features, appended=padding) if "pad" in features else Form(features)
        content = build(items, form).content
        salvage = Salvage(Path(name), content)
        assert (salvage.damage, salvage.chained) == ([], True), name
        assert (list(salvage.messages()), salvage.attachments, salvage.metadata) == in_library(content), name
        report = recovered(tmp_path, content)
        assert (report.healthy, report.damage) == (True, ()), name
        assert bool(report.skipped) == any(isinstance(item, Channel) for item in items), name
        assert bool(report.unverified) == bool(salvage.loose), name
        names.add(name)
    assert len(names) == 416


def test_ros_messages_are_read_in_the_order_of_the_library_in_every_form(tmp_path: Path) -> None:
    forms = [features for name, _, features in conformance_forms() if name.startswith("TenMessages")]
    assert len(forms) == 154
    for features in forms:
        form = Form(features, appended=padding) if "pad" in features else Form(features)
        content = build(ROS_ITEMS, form).content
        library = NonSeekingReader(BytesIO(content)).iter_messages()
        assert read(tmp_path, content) == [(c.topic, m.log_time, m.data) for _, c, m in library], features


@pytest.mark.parametrize("compression", ["", "lz4", "zstd"])
@pytest.mark.parametrize(
    "features",
    [INDEXED, {"ch"}, {"ch", "mx"}, {"ch", "chx"}, {"st"}, set()],
    ids=lambda features: " ".join(sorted(features)) or "none",
)
def test_unknown_records_appended_fields_and_foreign_channels_are_skipped(
    features: set[str], compression: str, tmp_path: Path
) -> None:
    """They lie in chunks and outside of chunks; each chunk holds one message."""
    form = Form(
        features, compression=lambda: compression, ends_chunk=lambda: True, between=lambda: UNREADABLE,
        appended=lambda opcode, inside: b"later fields",
    )  # fmt: skip
    items: list[Item] = [ROS_SCHEMA, ROS_CHANNEL, LOG_CHANNEL, *TEN[:7], LOG_MESSAGE, *TEN[7:], ATTACHMENT]
    content = build(items, form).content
    report = recovered(tmp_path, content)
    assert (report.healthy, report.message_count, report.end_ns) == (True, 10, 9)
    (skipped,) = report.skipped
    assert "1 messages of 1 channels without ROS 2 type: /log (json)" in skipped
    assert all(f"0x{opcode:02x}" in skipped for opcode, _ in UNREADABLE)
    # The library does not skip fields appended inside chunks, so it reads the file without these.
    form.appended = lambda opcode, inside: b"" if inside else b"later fields"
    library = NonSeekingReader(BytesIO(build(items, form).content)).iter_messages(["/on"])
    assert read(tmp_path, content) == [("/on", message.log_time, message.data) for _, _, message in library]


def test_chunks_that_are_empty_or_equal_or_beside_loose_messages_are_intact(tmp_path: Path) -> None:
    schema, channel, *messages = (build([item], Form({"ch"})).content for item in (ROS_SCHEMA, ROS_CHANNEL, TEN[0]))
    chunk = slice(len(build([], Form(set())).content) - 37 - 13, -37 - 13)
    empty = b"\x06" + (40).to_bytes(8, "little") + bytes(40)
    loose = build([TEN[1]], Form(set())).content[chunk]
    parts = [schema[chunk], channel[chunk], empty, messages[0][chunk], messages[0][chunk], empty, loose]
    bare = build([], Form(set(), data_crc=False)).content
    content = bare[: chunk.start] + b"".join(parts) + bare[chunk.start :]
    assert len(in_library(content)[0]) == 3
    assert recovered(tmp_path, content).damage == ()
    assert [time for _, time, _ in read(tmp_path, content)] == [0, 0, 2]


def test_a_private_record_that_holds_an_mcap_file_is_a_private_record(tmp_path: Path) -> None:
    inner = build(ROS_ITEMS, Form(INDEXED)).content
    for crc in (True, False):
        form = Form({"ch", "st"}, between=lambda: ((0x90, inner),), data_crc=crc)
        report = recovered(tmp_path, build(ROS_ITEMS, form).content)
        assert (report.damage, report.message_count) == ((), 10)


def test_an_unknown_compression_is_not_damage_but_can_not_be_read(tmp_path: Path) -> None:
    names = iter(["", "xz", *[""] * 8])
    content = build(ROS_ITEMS, Form(INDEXED, compression=lambda: next(names), ends_chunk=lambda: True)).content
    report = recovered(tmp_path, content)
    assert (report.damage, report.message_count) == ((), 9)
    assert "1 chunks of unknown compression: xz" in report.skipped[0]
    with pytest.raises(BagError, match="unknown compression: xz"):
        read(tmp_path, content)


@pytest.mark.parametrize("cut", [0, 1])
def test_contents_that_look_like_chunks_are_messages(cut: int, tmp_path: Path) -> None:
    """Zeros behind small numbers look like the head of an empty chunk, also where the end of the file is missing."""
    zeros = [Message(channel_id=1, log_time=t, publish_time=t, data=bytes(300), sequence=0) for t in range(20_000)]
    content = build([ROS_SCHEMA, ROS_CHANNEL, *zeros], Form({"st"}, data_crc=False)).content
    file = tmp_path / "form.mcap"
    file.write_bytes(content[: len(content) - cut])
    report = recover(file)
    assert (report.healthy, report.message_count) == (cut == 0, len(zeros))


def test_a_damaged_name_of_a_compression_is_damage(tmp_path: Path) -> None:
    """This holds without an index and checksums, too."""
    form = Form({"ch"}, compression=lambda: "zstd", ends_chunk=lambda: True, data_crc=False)
    content = build(ROS_ITEMS, form).content
    file = tmp_path / "form.mcap"
    last = content.rindex(b"zstd")
    file.write_bytes(content[:last] + b"zsud" + content[last + 4 :])
    assert not recover(file).healthy


def test_a_record_that_is_too_large_to_be_read_is_no_damage(tmp_path: Path) -> None:
    """300 MiB, all of it a hole in the file."""
    content = build(ROS_ITEMS, Form({"ch"}, data_crc=False)).content
    tail, length = len(content) - 37 - 13, 300 << 20
    file = tmp_path / "form.mcap"
    with file.open("wb") as stream:
        stream.write(content[:tail] + b"\x09" + length.to_bytes(8, "little"))
        stream.seek(tail + 9 + length)
        stream.write(content[tail:])
    report = recover(file)
    assert (report.damage, report.message_count) == ((), 10)
    assert "1 records that are not read, of kinds 0x09" in report.skipped[0]


def test_a_damaged_file_keeps_its_foreign_channels_attachments_and_metadata(tmp_path: Path) -> None:
    items: list[Item] = [
        ROS_SCHEMA, replace(SCHEMA, id=3), replace(CHANNEL, id=3, schema_id=3), ROS_CHANNEL, LOG_CHANNEL, LOG_MESSAGE,
        *TEN, replace(TEN[0], channel_id=3), ATTACHMENT, Metadata(name="note", metadata={"a": "b"}),
    ]  # fmt: skip
    content = build(items, Form(INDEXED, ends_chunk=lambda: True)).content
    file = tmp_path / "form.mcap"
    file.write_bytes(content[:-20])
    report = recover(file)
    assert (report.healthy, report.message_count, report.end_ns) == (False, 10, 9)
    messages, attachments, metadata = in_library(file.read_bytes())
    assert sorted(m.data for m in messages) == sorted(i.data for i in items if isinstance(i, Message))
    assert attachments == [ATTACHMENT]
    assert [record.name for record in metadata] == ["note", "rosbag2"]
    with file.open("rb") as stream:
        channels = {(s and s.encoding, c.topic, c.message_encoding) for s, c, _ in make_reader(stream).iter_messages()}
    assert channels == {("ros2msg", "/on", "cdr"), (None, "/log", "json"), ("c", "example", "a")}
    assert recover(file).healthy


def test_deletion_is_never_advised_where_records_lead_to_a_proper_end(tmp_path: Path) -> None:
    form = Form({"ch", "st"}, data_crc=False, summary_crc=False)
    content = bytearray(build(ROS_ITEMS, form).content)
    content[content.index(b"/on")] ^= 1  # in the only chunk
    file = tmp_path / "form.mcap"
    file.write_bytes(content)
    with pytest.raises(BagError) as caught:
        recover(file)
    assert "delete" not in str(caught.value)
    assert file.read_bytes() == content
    file.write_bytes(content[:-40])
    with pytest.raises(BagError, match="delete"):
        recover(file)


@pytest.mark.parametrize("opcode", [Opcode.CHUNK, Opcode.MESSAGE_INDEX, Opcode.ATTACHMENT, Opcode.METADATA])
@pytest.mark.parametrize("bit", [0x10, 0x80])
def test_a_record_that_a_flipped_bit_makes_unknown_is_damage(opcode: Opcode, bit: int, tmp_path: Path) -> None:
    """There is no checksum over all data, but the index states where the record is."""
    items: list[Item] = [ROS_SCHEMA, ROS_CHANNEL, *TEN, ATTACHMENT, Metadata(name="note", metadata={})]
    content = bytearray(build(items, Form(INDEXED, ends_chunk=lambda: True, data_crc=False)).content)
    position = 8
    while content[position] != opcode:
        position += 9 + int.from_bytes(content[position + 1 : position + 9], "little")
    content[position] ^= bit
    file = tmp_path / "form.mcap"
    file.write_bytes(content)
    assert not recover(file).healthy


def test_the_checksum_of_an_extended_attachment_is_compared(tmp_path: Path) -> None:
    form = Form({"ax"}, appended=lambda opcode, inside: b"later", data_crc=False)
    content = build([ATTACHMENT], form).content
    assert recovered(tmp_path, content).healthy
    with pytest.raises(BagError, match="nothing can be recovered"):
        recovered(tmp_path, content.replace(b"\1\2\3", b"\1\2\4"))


@pytest.fixture
def ten_chunks() -> bytes:
    """Ten chunks of one message, each with its message index, without checksum and index at the end."""
    form = Form({"ch", "mx"}, ends_chunk=lambda: True, data_crc=False)
    return build([ROS_SCHEMA, ROS_CHANNEL, *TEN], form).content


def test_an_index_that_lost_its_end_costs_no_chunk(ten_chunks: bytes, tmp_path: Path) -> None:
    """It would go on in the head of the chunk that follows."""
    _, stop = records_of(ten_chunks, Opcode.MESSAGE_INDEX)[4]
    file = tmp_path / "form.mcap"
    file.write_bytes(ten_chunks[: stop - 8] + ten_chunks[stop:])
    report = recover(file)
    assert (report.healthy, report.message_count) == (False, 10)


def test_a_chunk_of_which_only_its_index_is_left_is_reported(ten_chunks: bytes, tmp_path: Path) -> None:
    """Without an index at the end, its messages can't be counted."""
    start, stop = records_of(ten_chunks, Opcode.CHUNK)[6]
    file = tmp_path / "form.mcap"
    file.write_bytes(ten_chunks[:start] + ten_chunks[stop:])
    report = recover(file)
    assert (report.healthy, report.message_count) == (False, 9)
    assert any("lost" in phrase for phrase in report.damage), report.damage


def records_of(content: bytes, opcode: int) -> list[tuple[int, int]]:
    """Return first byte and end of all records of a kind."""
    ranges, position = [], len(MAGIC)
    while position + len(MAGIC) < len(content):
        stop = position + 9 + int.from_bytes(content[position + 1 : position + 9], "little")
        ranges += [(position, stop)] if content[position] == opcode else []
        position = stop
    return ranges
