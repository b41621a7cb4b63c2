# SPDX-License-Identifier: Apache-2.0
"""Recorded bags, damaged: cut, flipped, rearranged. What is read of them was recorded, else a sentence says why."""

from __future__ import annotations

import atexit
import io
import resource
import shutil
import tempfile
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from itertools import pairwise
from pathlib import Path

import numpy as np
from bag.small_line import SMALL_LINE, record
from fuzz.invariants import Violation
from mcap.exceptions import EndOfFile
from mcap.reader import NonSeekingReader, make_reader
from mcap.writer import CompressionType, Writer
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin
from rosbags.rosbag2 import Writer as StockWriter

from conveyor_sim.bag.messages.typestore import typestore
from conveyor_sim.bag.reader import Bag, open_bag
from conveyor_sim.bag.recover import RecoverReport, recover
from conveyor_sim.bag.replay import replay
from conveyor_sim.errors import BagError, ConveyorError, SceneError
from conveyor_sim.report.figures.recording import Recording
from conveyor_sim.run.playback import Playback
from conveyor_sim.scene import load_scene

TICKS = 100
MEMORY = 700
"""MB by which one case may raise the peak of the process."""
METADATA = "metadata.yaml"
Rng = np.random.Generator
Message = tuple[str, int, bytes]


@dataclass(frozen=True)
class Base:
    """A sound bag: its file's bytes, its records (start, stop) by kind, its messages, in and outside of chunks."""

    name: str
    content: bytes
    metadata: bytes
    records: tuple[tuple[int, int, int], ...]
    """Opcode, first byte, byte after."""
    messages: tuple[Message, ...]
    checked: bool
    """Its chunks carry checksums."""
    sealed: bool
    """Every byte lies under a checksum."""

    @property
    def chunks(self) -> list[tuple[int, int]]:
        return [(start, stop) for opcode, start, stop in self.records if opcode == 6]


@cache
def folder() -> Path:
    """Where the sound bags are, until this process ends."""
    made = Path(tempfile.mkdtemp(prefix="bags"))
    atexit.register(shutil.rmtree, made, ignore_errors=True)
    return made


@cache
def bases() -> tuple[Base, ...]:
    """Our own recording, one that was killed, and what stock recorders make: with few checksums, and with none."""
    own = folder() / "own"
    record(load_scene(SMALL_LINE), own, TICKS, ticks_a_chunk=10)
    bag = _base("own", own, checked=True, sealed=True)
    end = max(stop for opcode, _, stop in bag.records if opcode == 7)
    killed = Base("killed", bag.content[:end], b"", _records(bag.content[:end]), bag.messages, True, True)
    bare = (_bare(own, compressed=True), _bare(own, compressed=False))
    return (bag, killed, _stock(own, "stock"), *bare, _stock(own, "flat"))


def attack(seed: int, place: Path) -> str:
    """Damages a bag, then reads, replays, draws and repairs it."""
    rng = np.random.default_rng(seed)
    known = bases()
    base = known[int(rng.choice(len(known), p=[0.4, 0.15, 0.2, 0.1, 0.05, 0.1]))]
    content = base.content
    for _ in range(int(rng.choice([1, 2, 3], p=[0.7, 0.2, 0.1]))):
        content = EDITS[int(rng.integers(len(EDITS)))](base, content, rng)
    bag = place / "bag"
    bag.mkdir()
    (bag / "bag_0.mcap").write_bytes(content)
    metadata = _metadata(base, rng)
    if metadata is not None:
        (bag / METADATA).write_bytes(metadata)
    before = _peak()
    outcome = _judge(base, bag, content)
    if _peak() - before > MEMORY:
        raise Violation("memory", f"a case of {len(content)} bytes took {_peak() - before:.0f} MB")
    return outcome


# What must hold


def _judge(base: Base, bag: Path, content: bytes) -> str:
    if _replays(bag):
        if base.sealed and content != base.content:
            raise Violation("damage replayed", f"{bag} replays as equal, but its file is not what was written")
        if base.checked and Counter(_messages(bag)) != Counter(base.messages):
            raise Violation("other messages", f"{bag} replays as equal with other messages than were recorded")
    _looks(bag)
    files = {file.name: file.read_bytes() for file in bag.iterdir()}
    try:
        report = recover(bag)
    except BagError as error:
        _sentence(error)
        if {file.name: file.read_bytes() for file in bag.iterdir()} != files:
            raise Violation("changed", f"a refused repair changed the files: {error}") from error
        if _states(_sound(base, content)):
            raise Violation("sound chunk lost", f"refused, though states lie in sound chunks: {error}") from error
        return "refused"
    _originals(bag, files, report)
    if any(file.suffix in (".recovering", ".tmp") for file in bag.iterdir()):
        raise Violation("left over", f"{[file.name for file in bag.iterdir()]}")
    _library_agrees(bag, report)
    found = _messages(bag) if not report.unusable else None
    if found is not None:
        _content(base, content, found, report)
    again = recover(bag)
    if not again.healthy:
        raise Violation("not repaired", f"a second repair finds {again.damage}")
    if report.healthy:
        if not report.unverified and content != base.content:
            raise Violation("called whole", "a file that is not what was written is called whole")
        return "whole" if not report.unverified else "unverified"
    if report.unusable:
        _sentence(BagError(report.unusable))
        return "repaired, without line"
    replays = _replays(bag)
    if not replays and base.checked and not _tells_loss(report):
        raise Violation("no replay", f"repaired, but it does not replay, and nothing says why: {report.damage}")
    return "repaired" if replays else "repaired, other"


def _replays(bag: Path) -> bool:
    try:
        return replay(bag).difference is None
    except (BagError, SceneError) as error:
        _sentence(error)
        return False


def _looks(bag: Path) -> None:
    """What draws, and what plays back, either does or says why not."""
    try:
        with open_bag(bag) as opened, opened.sense():
            _draw(opened)
            _play(opened)
    except ConveyorError as error:
        _sentence(error)


def _draw(bag: Bag) -> None:
    recording = Recording(bag)
    recording.frames(None)
    recording.velocities(None)
    assert recording.flow is not None


def _play(bag: Bag) -> None:
    playback = Playback(bag)
    playback.cue(playback.first_tick)
    for tick in range(playback.first_tick, min(playback.last_tick, playback.first_tick + TICKS) + 1):
        for _ in playback.take(tick):
            pass


def _sentence(error: Exception) -> None:
    text = str(error)
    if len(text) > 1500 or ("\n" in text and not isinstance(error, SceneError)) or "Traceback" in text:
        raise Violation("not one sentence", text[:2000])


def _originals(bag: Path, files: dict[str, bytes], report: RecoverReport) -> None:
    """Every byte that was there still is, under one name or another."""
    there = [file.read_bytes() for file in bag.iterdir()]
    for name, content in files.items():
        if content not in there:
            raise Violation("original lost", f"{name} is not kept: {report}")


def _library_agrees(bag: Path, report: RecoverReport) -> None:
    """The mcap library, with its own validation of checksums, reads what is called sound."""
    with (bag / "bag_0.mcap").open("rb") as stream:
        reader = NonSeekingReader(stream, validate_crcs=True)
        count = sum(1 for _ in reader.iter_messages(log_time_order=False))
    if count != report.message_count:
        raise Violation("library", f"reads {count} messages, the report tells of {report.message_count}")


def _content(base: Base, content: bytes, found: list[Message], report: RecoverReport) -> None:
    """Nothing is made up, what lay in sound chunks is there, and what is not is told as lost."""
    recorded, there = Counter(base.messages), Counter(found)
    verified = base.checked and not any("cut" in sentence for sentence in report.damage)
    if verified and there - recorded:
        raise Violation("made up", f"{(there - recorded).total()} messages that were never recorded: {report}")
    if lost := Counter(_sound(base, content)) - there:
        raise Violation("sound chunk lost", f"{lost.total()} messages of sound chunks are missing: {report}")
    if recorded - there and not _tells_loss(report) and base.checked:
        raise Violation("silent loss", f"{(recorded - there).total()} messages are missing: {report}")


def _tells_loss(report: RecoverReport) -> bool:
    words = ("lost", "left out", "cut", "end of the file is missing", "can be read")
    return any(word in sentence for sentence in report.damage for word in words)


def _sound(base: Base, content: bytes) -> list[Message]:
    """The messages of chunks that are there as they were written, if what names their topics is too."""
    if not base.checked:
        return []
    chunks = base.chunks
    ends = [start for opcode, start, _ in base.records if opcode == 15]
    index_there = bool(ends) and base.content[ends[0] :] in content
    if base.content[chunks[0][0] : chunks[0][1]] not in content and not index_there:
        return []
    sound: list[Message] = []
    for number, (start, stop) in enumerate(chunks):
        if base.content[start:stop] in content:
            sound += _chunk_messages(base.name)[number]
    return sound


@cache
def _chunk_messages(name: str) -> list[list[Message]]:
    """What each chunk holds: what the file up to its end holds, less what was before."""
    base = next(base for base in bases() if base.name == name)
    ends = [0, *(_count(base.content[:stop]) for _, stop in base.chunks)]
    return [list(base.messages[before:upto]) for before, upto in pairwise(ends)]


def _count(content: bytes) -> int:
    count = 0
    try:
        for _ in NonSeekingReader(io.BytesIO(content)).iter_messages(log_time_order=False):
            count += 1
    except EndOfFile:
        pass
    return count


def _states(messages: list[Message]) -> bool:
    return any(topic in ("bottles", "signals", "belts", "contacts") for topic, _, _ in messages)


def _messages(bag: Path) -> list[Message]:
    with open_bag(bag) as opened:
        return list(opened.raw())


def _peak() -> float:
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0


# Sound bags


def _base(name: str, bag: Path, *, checked: bool, sealed: bool) -> Base:
    content = next(bag.glob("*.mcap")).read_bytes()
    metadata = (bag / METADATA).read_bytes().replace(next(bag.glob("*.mcap")).name.encode(), b"bag_0.mcap")
    return Base(name, content, metadata, _records(content), tuple(_messages(bag)), checked, sealed)


def _records(content: bytes) -> tuple[tuple[int, int, int], ...]:
    found, position = [], 8
    while position + 9 <= len(content):
        stop = position + 9 + int.from_bytes(content[position + 1 : position + 9], "little")
        found.append((content[position], position, stop))
        position = stop
        if found[-1][0] == 2:
            break
    return tuple(found)


def _stock(own: Path, name: str) -> Base:
    """As rosbag2 writes: checksums of chunks and index, none over all; "flat": without chunks."""
    bag, chunked = folder() / name, name != "flat"
    bag.mkdir()
    (bag / METADATA).write_bytes((own / METADATA).read_bytes().replace(b"own_0.mcap", f"{name}_0.mcap".encode()))
    with (own / "own_0.mcap").open("rb") as source, (bag / f"{name}_0.mcap").open("wb") as stream:
        writer = Writer(stream, compression=CompressionType.ZSTD, chunk_size=40_000, use_chunking=chunked)
        writer.start("ros2", "stock")
        reader = make_reader(source)
        summary = reader.get_summary()
        assert summary is not None
        schemas = {
            schema.id: writer.register_schema(schema.name, schema.encoding, schema.data)
            for schema in summary.schemas.values()
        }
        channels = {
            channel.id: writer.register_channel(
                channel.topic, channel.message_encoding, schemas[channel.schema_id], channel.metadata
            )
            for channel in summary.channels.values()
        }
        for _, channel, message in reader.iter_messages(log_time_order=False):
            writer.add_message(channels[channel.id], message.log_time, message.data, message.publish_time)
        writer.finish()
    return _base(name, bag, checked=chunked, sealed=False)


def _bare(own: Path, *, compressed: bool) -> Base:
    """As the rosbags library writes: not one checksum."""
    name = "bare_zstd" if compressed else "bare"
    bag = folder() / name
    store = typestore()
    writer = StockWriter(bag, version=9, storage_plugin=StoragePlugin.MCAP)
    if compressed:
        writer.set_compression(CompressionMode.STORAGE, CompressionFormat.ZSTD)
    with open_bag(own) as opened, writer:
        connections = {
            topic: writer.add_connection(f"/{topic}", kind, typestore=store) for topic, kind in opened.types.items()
        }
        for topic, log_time, data in opened.raw():
            writer.write(connections[topic], log_time, data)
    return _base(name, bag, checked=False, sealed=False)


# Damage


def _flip(_: Base, content: bytes, rng: Rng) -> bytes:
    if not content:
        return content
    changed = bytearray(content)
    for _ in range(int(rng.choice([1, 1, 1, 3]))):
        changed[int(rng.integers(len(changed)))] ^= 1 << int(rng.integers(8))
    return bytes(changed)


def _cut(_: Base, content: bytes, rng: Rng) -> bytes:
    return content[: int(rng.integers(len(content) + 1))]


def _zeros(_: Base, content: bytes, rng: Rng) -> bytes:
    start = int(rng.integers(len(content) + 1))
    stop = min(len(content), start + int(2 ** rng.uniform(0, 15)))
    return content[:start] + bytes(stop - start) + content[stop:]


def _garbage(_: Base, content: bytes, rng: Rng) -> bytes:
    start = int(rng.integers(len(content) + 1))
    stop = min(len(content), start + int(2 ** rng.uniform(0, 12)))
    return content[:start] + rng.bytes(stop - start) + content[stop:]


def _append(_: Base, content: bytes, rng: Rng) -> bytes:
    return content + rng.bytes(int(2 ** rng.uniform(0, 14)))


def _insert(_: Base, content: bytes, rng: Rng) -> bytes:
    at = int(rng.integers(len(content) + 1))
    return content[:at] + rng.bytes(int(2 ** rng.uniform(0, 10))) + content[at:]


def _remove(_: Base, content: bytes, rng: Rng) -> bytes:
    at = int(rng.integers(len(content) + 1))
    return content[:at] + content[at + int(2 ** rng.uniform(0, 14)) :]


def _some_record(base: Base, rng: Rng) -> tuple[int, int]:
    _, start, stop = base.records[int(rng.integers(len(base.records)))]
    return start, stop


def _drop(base: Base, content: bytes, rng: Rng) -> bytes:
    start, stop = _some_record(base, rng)
    return content[:start] + content[stop:]


def _duplicate(base: Base, content: bytes, rng: Rng) -> bytes:
    start, stop = _some_record(base, rng)
    return content[:stop] + content[start:stop] + content[stop:]


def _swap(base: Base, content: bytes, rng: Rng) -> bytes:
    chunks = base.chunks
    if len(chunks) < 2:
        return content
    (a, b), (c, d) = sorted(chunks[int(i)] for i in rng.choice(len(chunks), 2, replace=False))
    return content[:a] + content[c:d] + content[b:c] + content[a:b] + content[d:]


def _length(base: Base, content: bytes, rng: Rng) -> bytes:
    """Another length of a record, or another size within a chunk's head, up to absurd ones."""
    start, _ = _some_record(base, rng)
    if rng.random() < 0.5 and base.chunks:
        start = base.chunks[int(rng.integers(len(base.chunks)))][0] + int(rng.choice([0, 16, 36]))
    value = int(2 ** rng.uniform(0, 63)).to_bytes(8, "little")
    return content[: start + 1] + value + content[start + 9 :]


def _frame(base: Base, content: bytes, rng: Rng) -> bytes:
    """A flip in the first bytes of a chunk's compressed content, where zstd states how much memory it wants."""
    if not base.chunks:
        return content
    start = base.chunks[int(rng.integers(len(base.chunks)))][0]
    at = start + 9 + 32 + 4 + 8 + int(rng.integers(14))
    if at >= len(content):
        return content
    return content[:at] + rng.bytes(1) + content[at + 1 :]


Edit = Callable[[Base, bytes, Rng], bytes]
EDITS: tuple[Edit, ...] = (
    _flip, _flip, _flip, _cut, _zeros, _garbage, _append, _insert, _remove, _drop, _duplicate, _swap, _length, _frame,
)  # fmt: skip


def _metadata(base: Base, rng: Rng) -> bytes | None:
    """metadata.yaml, mostly as it was."""
    kind = rng.random()
    if not base.metadata or kind < 0.08:
        return None
    if kind < 0.16:
        changed = bytearray(base.metadata)
        changed[int(rng.integers(len(changed)))] ^= 1 << int(rng.integers(8))
        return bytes(changed)
    if kind < 0.2:
        return base.metadata[: int(rng.integers(len(base.metadata)))]
    if kind < 0.22:
        return rng.bytes(200)
    if kind < 0.24:
        return b"rosbag2_bagfile_information: [" * 3000
    return base.metadata
