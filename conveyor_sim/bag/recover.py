# SPDX-License-Identifier: Apache-2.0
"""Repair of a bag that was interrupted or damaged: a copy of its valid parts. The damaged file stays beside it."""

from __future__ import annotations

import contextlib
import os
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path, PurePath

from mcap.records import Channel
from mcap.records import Schema as SchemaRecord

from conveyor_sim.bag.folder import alone
from conveyor_sim.bag.mcap.index import Index, is_complete, read_index
from conveyor_sim.bag.mcap.line_copy import NAME as LINE_COPY
from conveyor_sim.bag.mcap.metadata import (
    FILE_NAME,
    RECORD_NAME,
    FileInfo,
    TopicInfo,
    bag_information,
    file_names,
    fits,
    read_metadata,
    to_yaml,
    write_metadata,
)
from conveyor_sim.bag.mcap.records import mapped
from conveyor_sim.bag.mcap.salvage import Salvage, is_ros
from conveyor_sim.bag.mcap.storage import other_storage, packed_part
from conveyor_sim.bag.mcap.walk import NothingLeft
from conveyor_sim.bag.mcap.writer import McapFileWriter, Schema, topic_info
from conveyor_sim.bag.messages.encode import LINE
from conveyor_sim.bag.messages.topics import STATES
from conveyor_sim.bag.messages.typestore import default_distro
from conveyor_sim.bag.own_reader import is_of_this_package
from conveyor_sim.bag.reader import mcap_files, open_bag
from conveyor_sim.errors import BagError

WRITTEN_ANEW = (RECORD_NAME, LINE_COPY)
"""Names of metadata records that repeat other parts of the file."""
STATE_TYPES = {topic.type for topic in STATES.values()}


@dataclass(frozen=True)
class RecoverReport:
    """Result of `recover`."""

    path: Path
    healthy: bool
    """True if there was no damage, and no file was changed."""
    unverified: tuple[str, ...]
    """One phrase for each part without a checksum, whose damage can't be seen; empty: every byte was verified."""
    skipped: tuple[str, ...]
    """One sentence for each file with valid parts that are not read: channels without ROS 2 type, unknown records."""
    message_count: int
    """ROS 2 messages."""
    end_ns: int
    """Log time of the last of them, ns."""
    damage: tuple[str, ...]
    """One sentence for each fault and each loss."""
    kept: tuple[Path, ...]
    """The damaged originals."""
    unusable: str
    """Reason why the bag can't be replayed or drawn; empty: it can."""


@dataclass(frozen=True)
class _ValidPart:
    """Valid part of one MCAP file."""

    file: FileInfo
    topics: tuple[TopicInfo, ...]
    damage: tuple[str, ...] = ()
    unverified: tuple[str, ...] = ()
    skipped: str = ""
    """Phrase that counts the parts that are not read; "": there are none."""
    others: int = 0
    """Messages without ROS 2 type, attachments, and metadata of other programs."""
    chained: bool = False
    """Record lengths lead from the first record to a proper end."""
    nothing_left: bool = False


def recover(path: str | Path) -> RecoverReport:
    """Verify a rosbag2 folder (or one .mcap file). Replace a damaged file by a copy of its valid parts.

    The copy takes the old file's place only when it is complete and at least one recorded state is left. The old file
    stays as *.damaged, and so does a metadata.yaml that does not fit.
    Raise BagError if there is nothing to recover, no room for the new file, or if the bag is still being recorded; then
    no file has changed.
    """
    path = Path(path)
    damage: list[str] = []
    unverified: list[str] = []
    kept: list[Path] = []
    contents: list[_ValidPart] = []
    files: list[Path] = []
    with contextlib.ExitStack() as locks:
        try:
            files = mcap_files(path)
            storage = other_storage(path) if path.is_file() or not files else packed_part(path)
            if storage:
                raise BagError(f"{path}: can't be verified or repaired: {storage}")
            if not files:
                raise BagError(f"{path}: no MCAP file found, expected a rosbag2 folder or an .mcap file")
            for file in files:
                locks.enter_context(alone(file))
            contents = _repair_all(files)
            for content in contents:
                damage += [f"{content.file.path}: {sentence}" for sentence in content.damage]
                unverified += [f"{content.file.path}: {phrase}" for phrase in content.unverified]
            damage += _missing(path)
            if damage:
                _require_states(path, contents)
            for file, content in zip(files, contents, strict=True):
                if content.damage:
                    kept.append(_set_aside(file) if content.nothing_left else _put_in_place(file))
            contents = [content for content in contents if not content.nothing_left]
            if path.is_dir() and (aside := _refresh_metadata(path, contents)) is not None:
                damage.append(f"{FILE_NAME} was missing or does not fit any more; it was written anew")
                kept += aside
        except OSError as error:
            raise BagError(f"{path}: can't be recovered ({error.strerror}); no original was deleted") from error
        finally:
            for file in files:
                with contextlib.suppress(OSError):
                    _temporary(file).unlink()
    return RecoverReport(
        path=path,
        healthy=not damage,
        unverified=tuple(unverified),
        skipped=tuple(f"{content.file.path}: skipped {content.skipped}" for content in contents if content.skipped),
        message_count=sum(content.file.message_count for content in contents),
        end_ns=max(content.file.end_ns for content in contents),
        damage=tuple(damage),
        kept=tuple(kept),
        unusable=_unusable(path),
    )


def _temporary(file: Path) -> Path:
    return file.with_name(f"{file.name}.recovering")


def _repair_all(files: list[Path]) -> list[_ValidPart]:
    """Return the valid part of each file. Raise BagError if no file has one."""
    contents: list[_ValidPart] = []
    failures: list[NothingLeft] = []
    for file in files:
        try:
            contents.append(_repair(file))
        except NothingLeft as failure:
            failures.append(failure)
            contents.append(_ValidPart(FileInfo(file.name, 0, 0, 0), (), (failure.why,), nothing_left=True))
    if len(failures) == len(files):
        raise failures[0]
    return contents


def _missing(folder: Path) -> list[str]:
    """Return one sentence for each MCAP file that metadata.yaml names and that does not exist."""
    information = read_metadata(folder) or {}
    try:
        names = [name for name in file_names(information) if PurePath(name).suffix == ".mcap"]
        counts = {PurePath(file["path"]).name: file["message_count"] for file in information.get("files") or []}
    except (KeyError, TypeError):
        return []
    return [
        f"{name}: is missing, with {counts.get(name, 'an unknown number of')} messages"
        for name in names
        if not (folder / name).exists()
    ]


def _repair(file: Path) -> _ValidPart:
    """Verify a file. If it is damaged, write a copy of its valid parts beside it."""
    with mapped(file) as data:
        index = read_index(data) if is_complete(data) and is_of_this_package(data) else None
        if index is not None and index.statistics is not None and _is_ours(index):
            statistics = index.statistics
            span = (statistics.message_start_time, statistics.message_end_time)
            topics = _topics(index.schemas, index.channels, statistics.channel_message_counts)
            return _ValidPart(FileInfo(file.name, *span, statistics.message_count), topics)
        salvage = Salvage(file, data)
        if not salvage.damage:
            info = FileInfo(file.name, *salvage.span, sum(salvage.counts[number] for number in salvage.ros_channels))
            topics = _topics(salvage.schemas, salvage.ros_channels, salvage.counts)
            return _ValidPart(info, topics, unverified=tuple(salvage.unverified), skipped=salvage.skipped, chained=True)
        with _temporary(file).open("wb") as stream:
            copy = McapFileWriter(stream, file.name, default_distro())
            _copy(salvage, copy)
            copy.finish()
            stream.flush()
            os.fsync(stream.fileno())
    with mapped(_temporary(file)) as data:
        if not is_complete(data):
            raise BagError(f"{file}: the repaired copy can't be read back; the original was left as it was")
    damage = [*salvage.damage, *(str(loss) for loss in salvage.losses)]
    if salvage.unread or salvage.unknown:
        damage.append("records that are not read were left out of the copy")
    topics, kept = tuple(copy.topics), len([m for m in salvage.metadata if m.name not in WRITTEN_ANEW])
    foreign = sum(salvage.counts[number] for number in salvage.channels.keys() - salvage.ros_channels.keys())
    others = kept + len(salvage.attachments) + foreign
    return _ValidPart(copy.info, topics, tuple(damage), skipped=salvage.skipped, others=others, chained=salvage.chained)


def _is_ours(index: Index) -> bool:
    """Return True if an index shows nothing but ROS 2 channels and known records."""
    return not index.unknown and all(is_ros(channel, index.schemas) for channel in index.channels.values())


def _topics(
    schemas: Mapping[int, SchemaRecord], channels: Mapping[int, Channel], counts: Mapping[int, int]
) -> tuple[TopicInfo, ...]:
    return tuple(
        topic_info(channel.topic, schemas[channel.schema_id].name, channel.metadata, counts.get(number, 0))
        for number, channel in channels.items()
    )


def _copy(salvage: Salvage, copy: McapFileWriter) -> None:
    """Copy messages with their times, topics and types; the records that repeat others are written anew."""
    channels = {}
    for number, channel in sorted(salvage.channels.items()):
        stated = salvage.schemas.get(channel.schema_id) if channel.schema_id else None
        schema = None if stated is None else Schema(stated.name, stated.encoding, stated.data)
        if schema is not None and is_ros(channel, salvage.schemas):
            channels[number] = copy.add_topic(channel.topic, schema, channel.message_encoding, channel.metadata)
        else:
            channels[number] = copy.add_foreign(channel.topic, schema, channel.message_encoding, channel.metadata)
    if (line := salvage.line(LINE)) is not None:
        copy.add_metadata(LINE_COPY, line.to_record())
    for message in salvage.messages():
        copy.add_message(
            channels[message.channel_id], message.data, message.log_time, message.publish_time, message.sequence
        )
    for record in salvage.metadata:
        if record.name not in WRITTEN_ANEW:
            copy.add_metadata(record.name, record.metadata)
    for attachment in salvage.attachments:
        copy.add_attachment(
            attachment.name, attachment.media_type, attachment.data, attachment.log_time, attachment.create_time
        )


def _require_states(path: Path, contents: list[_ValidPart]) -> None:
    """Raise BagError if a damaged bag has nothing left, or the recording of a line not one state."""
    topics = [topic for content in contents for topic in content.topics]
    left = {topic.name: topic.message_count for topic in topics if topic.message_count}
    ours = any(topic.type in STATE_TYPES for topic in topics)
    states = any(topic.type in STATE_TYPES and topic.message_count for topic in topics)
    if not (states if ours else left or any(content.others for content in contents)):
        what = f"only {sum(left.values())} messages of {', '.join(left)} and no state" if left else "not one message"
        # Where record lengths lead to a proper end, other programs may read more.
        advice = "" if any(content.chained for content in contents) else ": delete it to record there again"
        raise BagError(
            f"{path}: holds {what} that can be read; nothing can be recovered, and nothing was changed{advice}"
        )


def _put_in_place(file: Path) -> Path:
    """Give the new file the old one's name, and the old one a name ending in .damaged. Return that name."""
    aside = _aside(file)
    try:
        os.link(file, aside)  # then the next line swaps the files without a moment at which the bag has none
    except OSError:
        file.rename(aside)
    _temporary(file).replace(file)
    return aside


def _set_aside(file: Path) -> Path:
    """Give a file without any valid part a name ending in .damaged. Return that name."""
    aside = _aside(file)
    file.rename(aside)
    return aside


def _aside(file: Path) -> Path:
    aside, number = file.with_name(f"{file.name}.damaged"), 2
    while aside.exists():
        aside = file.with_name(f"{file.name}.damaged-{number}")
        number += 1
    return aside


def _refresh_metadata(folder: Path, contents: list[_ValidPart]) -> list[Path] | None:
    """Rewrite metadata.yaml if it does not fit the files. Then return the new path of the old one, if there was one."""
    counts: Counter[str] = Counter()
    topics: dict[str, TopicInfo] = {}
    for content in contents:
        for topic in content.topics:
            counts[topic.name] += topic.message_count
            topics[topic.name] = topic
    merged = [
        TopicInfo(topic.name, topic.type, topic.type_hash, topic.qos, counts[topic.name]) for topic in topics.values()
    ]
    old = read_metadata(folder)
    distro = str(old["ros_distro"]) if old and old.get("ros_distro") else default_distro()
    expected = bag_information(merged, [content.file for content in contents], distro)
    if old is not None:  # fields that no MCAP file holds
        keys = ["custom_data"]
        if str(old.get("compression_mode")).lower() == "message":  # a compressed file would not be MCAP
            keys += ["compression_format", "compression_mode"]
        expected |= {key: old[key] for key in keys if key in old}
    if old is not None and fits(old, expected):
        return None
    kept = []
    file = folder / FILE_NAME
    if file.is_file():
        kept.append(_aside(file))
        file.rename(kept[0])
    write_metadata(folder, to_yaml(expected))
    return kept


def _unusable(path: Path) -> str:
    """Return the reason why a bag can't be replayed or drawn; empty if it can."""
    try:
        with open_bag(path, report=False) as bag:
            known = any(bag.counts.get(topic) for topic in STATES)
    except BagError as error:
        return str(error)
    return "" if known else f"{path}: holds no message of topics {', '.join(STATES)}"
