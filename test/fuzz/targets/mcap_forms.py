# SPDX-License-Identifier: Apache-2.0
"""A recording's messages in random forms that the MCAP specification allows: read as the mcap library reads them,
called intact, and replayed; then a flipped bit is found, or lies where no checksum is.
"""

from __future__ import annotations

import atexit
import shutil
import tempfile
from collections.abc import Callable, Sequence
from contextlib import closing
from dataclasses import dataclass, replace
from functools import cache
from io import BytesIO
from itertools import groupby
from pathlib import Path

import numpy as np
from bag.mcap_forms import FEATURES, Form, Item, Layout, build
from bag.small_line import SMALL_LINE, record
from fuzz.invariants import Violation
from mcap.reader import NonSeekingReader, make_reader
from mcap.records import Attachment, Channel, Message, Metadata, Schema

from conveyor_sim.bag.mcap.chunk import Chunk, chunk_at, read_content
from conveyor_sim.bag.mcap_reader import McapFilesReader
from conveyor_sim.bag.recover import recover
from conveyor_sim.bag.replay import replay
from conveyor_sim.errors import BagError
from conveyor_sim.scene import load_scene

TICKS = 60
REPLAYED = 0.3
"""Share of the cases that are replayed, which takes most of the time."""
Rng = np.random.Generator
Raw = tuple[str, int, bytes]


@dataclass(frozen=True)
class Recorded:
    """Content of a recording."""

    schemas: tuple[Schema, ...]
    channels: tuple[Channel, ...]
    messages: tuple[Message, ...]
    compared: dict[str, int]
    """Messages that its replay compares, by topic."""


@cache
def recorded() -> Recorded:
    """Our own recording of the small line."""
    folder = Path(tempfile.mkdtemp(prefix="forms"))
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    record(load_scene(SMALL_LINE), folder / "own", TICKS)
    with next((folder / "own").glob("*.mcap")).open("rb") as stream:
        reader = make_reader(stream)
        summary = reader.get_summary()
        assert summary is not None
        messages = tuple(message for _, _, message in reader.iter_messages(log_time_order=False))
    used = {message.channel_id for message in messages}
    channels = tuple(channel for number, channel in summary.channels.items() if number in used)
    return Recorded(tuple(summary.schemas.values()), channels, messages, replay(folder / "own").compared)


def attack(seed: int, place: Path) -> str:
    """Write one form, read, verify and replay it; then flip one bit."""
    rng = np.random.default_rng(seed)
    items, foreign = _items(rng)
    form = _form(rng)
    extended = bool(rng.random() < 0.2)  # inside chunks, where the library does not skip appended fields
    outside = form.appended
    if extended:
        form.appended = lambda opcode, inside: outside(opcode, False)
    made = build(items, form)
    file = place / "form.mcap"
    file.write_bytes(made.content)
    _verified(file, made.content, items, foreign)
    _read(file, _expected(made.content, items, extended, "ch" in form.features), foreign)
    if rng.random() < REPLAYED and (report := replay(file)).compared != recorded().compared:
        raise Violation("not replayed", f"{report.difference}: {report.compared}")
    found = _flipped(place / "flipped.mcap", made, form, rng)
    return f"{'sealed' if form.data_crc and form.summary_crc else 'open'}, {found}"


# What must hold


def _verified(file: Path, content: bytes, items: Sequence[Item], foreign: set[int]) -> None:
    report = recover(file)
    if not report.healthy or report.unusable or file.read_bytes() != content:
        raise Violation("called damaged", f"{report}")
    ours = sum(isinstance(item, Message) and item.channel_id not in foreign for item in items)
    if report.message_count != ours:
        raise Violation("count", f"{report.message_count} messages are reported, {ours} were written")
    if bool(foreign) and "without ROS 2 type" not in " ".join(report.skipped):
        raise Violation("silent skip", f"{foreign} are foreign channels: {report}")


def _expected(content: bytes, items: Sequence[Item], extended: bool, chunked: bool) -> list[tuple[int, Raw]]:
    """Channel and message in the order of time, by the mcap library where it can read the file."""
    if extended and chunked:
        topics = {item.id: item.topic for item in items if isinstance(item, Channel)}
        written = [item for item in items if isinstance(item, Message)]
        found = [(m.channel_id, (topics[m.channel_id], m.log_time, m.data)) for m in written]
    else:
        reader = NonSeekingReader(BytesIO(content), validate_crcs=True)
        in_file = reader.iter_messages(log_time_order=False)
        found = [(c.id, (c.topic, m.log_time, m.data)) for _, c, m in in_file]
    return sorted(found, key=lambda one: one[1][1])


def _read(file: Path, expected: list[tuple[int, Raw]], foreign: set[int]) -> None:
    with closing(McapFilesReader(file, [file])) as source:
        read = list(source.messages({one.topic for one in source.topics}, None, None))
    if read != [raw for channel, raw in expected if channel not in foreign]:
        raise Violation("other messages", f"{len(read)} messages are read, the library reads {len(expected)}")


def _flipped(file: Path, made: Layout, form: Form, rng: Rng) -> str:
    content = bytearray(made.content)
    at = int(rng.integers(len(content)))
    content[at] ^= 1 << int(rng.integers(8))
    file.write_bytes(content)
    try:
        report = recover(file)
    except BagError:
        return "refused"
    if not report.healthy:
        if not recover(file).healthy:
            raise Violation("not repaired", f"a second repair finds damage: {report}")
        return "repaired"
    if any(start <= at < stop for start, stop in made.unknown) and not form.data_crc:
        return "in an unknown record"
    if form.data_crc and form.summary_crc:
        raise Violation("unnoticed", f"byte {at} lies under a checksum, and is called intact")
    if form.chunk_crc and (chunk := _chunk_around(made.content, at)) is not None:
        # Some bits of an LZ4 frame do not change the content, such as the offset of a match among equal bytes.
        if read_content(bytes(content), chunk) != read_content(made.content, chunk):
            raise Violation("unnoticed", f"byte {at} lies in a chunk with a checksum, and is called intact")
        return "without effect"
    if not report.unverified:
        raise Violation("called intact", f"byte {at} was flipped: {report}")
    return "unverified"


def _chunk_around(content: bytes, at: int) -> Chunk | None:
    """Return the chunk whose compressed content has a byte; None for all other bytes."""
    position = 8
    while position <= at:
        chunk = chunk_at(content, position)
        if chunk is not None and chunk.content <= at < chunk.content_stop:
            return chunk
        position += 9 + int.from_bytes(content[position + 1 : position + 9], "little")
    return None


# Random forms


def _form(rng: Rng) -> Form:
    features = {feature for feature in FEATURES if rng.random() < 0.6}
    if "ch" not in features or rng.random() < 0.3:
        features -= {"ch", "chx", "mx"} if rng.random() < 0.3 else set()
        features |= {"ch"} if features & {"chx", "mx"} else set()
    longest, ends, often = int(rng.integers(1, 20)), 2.0 ** -rng.uniform(0, 8), 2.0 ** -rng.uniform(2, 9)
    longer = {opcode for opcode in range(1, 16) if rng.random() < 0.3}

    def unknown() -> list[tuple[int, bytes]]:
        return [(int(rng.integers(0x10, 0x100)), rng.bytes(int(rng.integers(60))))] if rng.random() < often else []

    def appended(opcode: int, inside: bool) -> bytes:
        return rng.bytes(int(rng.integers(1, 1 + longest))) if opcode in longer and not inside else b""

    checks = rng.random(3) < (0.8, 0.6, 0.6)
    return Form(
        features, "ros2", compression=lambda: str(rng.choice(["", "lz4", "zstd"])),
        ends_chunk=lambda: bool(rng.random() < ends), appended=appended, between=unknown,
        chunk_crc=bool(checks[0]), data_crc=bool(checks[1]), summary_crc=bool(checks[2]),
    )  # fmt: skip


def _items(rng: Rng) -> tuple[list[Item], set[int]]:
    """Return the recording under other numbers and in another order, among foreign parts; and the foreign channels."""
    base = recorded()
    numbers = iter(rng.permutation(np.arange(1, 2**16))[:200].tolist())
    schemas = {schema.id: replace(schema, id=next(numbers)) for schema in base.schemas}
    channels = {
        channel.id: replace(channel, id=next(numbers), schema_id=schemas[channel.schema_id].id)
        for channel in base.channels
    }
    by_number = {schema.id: schema for schema in schemas.values()}
    messages = [replace(message, channel_id=channels[message.channel_id].id) for message in base.messages]
    known = {channel.id: channel for channel in channels.values()}
    foreign: set[int] = set()
    for _ in range(int(rng.choice([0, 1, 3]))):
        channel, schema = _foreign(rng, next(numbers), next(numbers))
        foreign.add(channel.id)
        known[channel.id] = channel
        if schema is not None:
            by_number[schema.id] = schema
        times = rng.choice([message.log_time for message in messages], int(rng.integers(0, 5)))
        messages += [Message(channel.id, int(time), rng.bytes(9), int(time), 0) for time in times]
    return _arranged(_shuffled(messages, rng), known, by_number, rng), foreign


def _foreign(rng: Rng, number: int, schema: int) -> tuple[Channel, Schema | None]:
    kinds: list[Callable[[], tuple[Channel, Schema | None]]] = [
        lambda: (Channel(number, "/log", "json", {}, 0), None),
        lambda: (Channel(number, "/line", "cdr", {}, 0), None),
        lambda: (Channel(number, "/log", "json", {}, schema), Schema(schema, b"{}", "jsonschema", "log")),
        lambda: (Channel(number, "/bottles", "protobuf", {}, schema), Schema(schema, b"\1", "protobuf", "Bottles")),
        lambda: (Channel(number, "/old", "ros1", {}, schema), Schema(schema, b"bool data", "ros1msg", "std_msgs/Bool")),
    ]
    return kinds[int(rng.integers(len(kinds)))]()


def _shuffled(messages: list[Message], rng: Rng) -> list[Message]:
    """Return messages of nearby times in another order; messages of one time keep theirs, which a replay needs."""
    ordered = sorted(messages, key=lambda message: message.log_time)
    groups = [list(group) for _, group in groupby(ordered, key=lambda message: message.log_time)]
    reach = float(rng.choice([0.0, 3.0, 100.0]))
    order = np.argsort(np.arange(len(groups)) + reach * rng.random(len(groups)), kind="stable")
    return [message for place in order for message in groups[place]]


def _arranged(
    messages: Sequence[Message], channels: dict[int, Channel], schemas: dict[int, Schema], rng: Rng
) -> list[Item]:
    """Return messages with schemas and channels somewhere before them, now and then repeated, and other records."""
    items: list[Item] = []
    told: set[int] = set()
    repeats = float(rng.choice([0.0, 0.02]))

    def tell(channel: Channel) -> None:
        told.add(channel.id)
        if channel.schema_id:
            items.append(schemas[channel.schema_id])
        items.append(channel)

    if rng.random() < 0.5:
        for channel in channels.values():
            tell(channel)
    for message in messages:
        if message.channel_id not in told or rng.random() < repeats:
            tell(channels[message.channel_id])
        if rng.random() < 0.01:
            items.append(Metadata(name="note", metadata={"a": "b"}))
        if rng.random() < 0.01:
            items.append(Attachment(0, 1, "x", "text/plain", rng.bytes(5)))
        items.append(message)
    for channel in channels.values():
        if channel.id not in told:
            tell(channel)
    return items
