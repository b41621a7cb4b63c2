"""Makes a bag whole that was killed while it was written. The damaged file is kept beside the new one."""

from __future__ import annotations

import contextlib
import os
from collections import Counter
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from mcap.exceptions import McapError
from mcap.reader import make_reader
from mcap.records import Channel, Message, Metadata
from mcap.records import Schema as SchemaRecord

from conveyor_sim.bag.mcap_file import McapFile, Schema, topic_info
from conveyor_sim.bag.metadata import (
    RECORD_NAME,
    FileInfo,
    TopicInfo,
    bag_information,
    read_metadata,
    write_metadata,
)
from conveyor_sim.bag.salvage import MAGIC, Salvage
from conveyor_sim.bag.typestore import default_distro
from conveyor_sim.errors import BagError


@dataclass(frozen=True)
class RecoverReport:
    """What `recover` found and did."""

    path: Path
    healthy: bool
    """Nothing was wrong, and nothing was done."""
    message_count: int
    end_ns: int
    """Log time of the last message, ns."""
    damage: tuple[str, ...]
    """What was wrong, one sentence each."""
    kept: tuple[Path, ...]
    """The damaged originals; they may be deleted."""


@dataclass(frozen=True)
class _Content:
    """What one whole MCAP file holds."""

    file: FileInfo
    topics: tuple[TopicInfo, ...]


def recover(path: str | Path) -> RecoverReport:
    """Rewrites the cut MCAP files of a rosbag2 folder (or one .mcap file) and, for a folder, its metadata.yaml.

    The new file takes the old one's place only when it is complete; the old one stays as *.damaged.
    Raises BagError if there is nothing to recover or no room for the new file.
    """
    path = Path(path)
    files = [path] if path.is_file() else sorted(path.glob("*.mcap"), key=lambda file: (len(file.name), file.name))
    if not files:
        raise BagError(f"{path}: no MCAP file found, expected a rosbag2 folder or an .mcap file")
    damage: list[str] = []
    kept: list[Path] = []
    try:
        for file in files:
            if _read_content(file) is None:
                found = _rewrite(file) or ["the index at the end is missing"]
                damage += [f"{file.name}: {sentence}" for sentence in found]
                kept.append(_put_in_place(file))
        contents = [content for file in files if (content := _read_content(file)) is not None]
        if path.is_dir() and _refresh_metadata(path, contents):
            damage.append("metadata.yaml was missing or did not fit")
    except OSError as error:
        raise BagError(f"{path}: can't be recovered ({error.strerror}); the original was left as it was") from error
    return RecoverReport(
        path=path,
        healthy=not damage,
        message_count=sum(content.file.message_count for content in contents),
        end_ns=max(content.file.end_ns for content in contents),
        damage=tuple(damage),
        kept=tuple(kept),
    )


def _read_content(path: Path) -> _Content | None:
    """What a whole file's own index says; None if it has none."""
    try:
        with path.open("rb") as file:
            file.seek(-len(MAGIC), os.SEEK_END)
            if file.read() != MAGIC:
                return None
            file.seek(0)
            summary = make_reader(file).get_summary()
    except (McapError, OSError):
        return None
    if summary is None or summary.statistics is None:
        return None
    counts = summary.statistics.channel_message_counts
    topics = tuple(
        topic_info(channel.topic, summary.schemas[channel.schema_id].name, channel.metadata, counts.get(channel.id, 0))
        for channel in summary.channels.values()
        if channel.schema_id in summary.schemas
    )
    statistics = summary.statistics
    span = (statistics.message_start_time, statistics.message_end_time)
    return _Content(FileInfo(path.name, *span, statistics.message_count), topics)


def _temporary(file: Path) -> Path:
    return file.with_name(f"{file.name}.recovering")


def _rewrite(file: Path) -> list[str]:
    """Writes what can be had of a file beside it; returns what was wrong with it."""
    salvage, temporary = Salvage(file), _temporary(file)
    try:
        with temporary.open("wb") as stream:
            copy = McapFile(stream, file.name, default_distro())
            _copy(salvage, copy)
            if not copy.info.message_count:
                raise BagError(f"{file}: holds not one whole message; nothing can be recovered")
            copy.finish()
            stream.flush()
            os.fsync(stream.fileno())
        if _read_content(temporary) is None:
            raise BagError(f"{temporary}: the new file can't be read back; the original was left as it was")
    except BaseException:
        with contextlib.suppress(OSError):
            temporary.unlink()
        raise
    return salvage.damage


def _copy(salvage: Salvage, copy: McapFile) -> None:
    """Copies messages with their times, topics and types; rosbag2's own record is left to be written anew."""
    schemas: dict[int, Schema] = {}
    channels: dict[int, int] = {}
    nameless = 0
    for record in salvage.records():
        if isinstance(record, SchemaRecord):
            schemas[record.id] = Schema(record.name, record.encoding, record.data)
        elif isinstance(record, Channel):
            if record.id not in channels and record.schema_id in schemas:
                schema = schemas[record.schema_id]
                channels[record.id] = copy.add_topic(record.topic, schema, record.message_encoding, record.metadata)
        elif isinstance(record, Message):
            if record.channel_id in channels:
                channel = channels[record.channel_id]
                copy.add_message(channel, record.data, record.log_time, record.publish_time, record.sequence)
            else:
                nameless += 1
        elif isinstance(record, Metadata) and record.name != RECORD_NAME:
            copy.add_metadata(record.name, record.metadata)
    if nameless:
        salvage.damage.append(f"{nameless} messages were left out: the chunk that names their topics is damaged")


def _put_in_place(file: Path) -> Path:
    """Gives the new file the old one's name, the old one a name ending in .damaged; returns that name."""
    aside, number = file.with_name(f"{file.name}.damaged"), 2
    while aside.exists():
        aside = file.with_name(f"{file.name}.damaged-{number}")
        number += 1
    try:
        os.link(file, aside)  # then the next line swaps without a moment at which the bag has no file
    except OSError:
        file.rename(aside)
    _temporary(file).replace(file)
    return aside


def _refresh_metadata(folder: Path, contents: list[_Content]) -> bool:
    """Rewrites metadata.yaml if it does not fit the files; returns whether it did."""
    old = read_metadata(folder)
    files = [content.file for content in contents]
    if old is not None and _fits(old, files):
        return False
    counts: Counter[str] = Counter()
    topics: dict[str, TopicInfo] = {}
    for content in contents:
        for topic in content.topics:
            counts[topic.name] += topic.message_count
            topics[topic.name] = topic
    merged = [
        TopicInfo(topic.name, topic.type, topic.type_hash, topic.qos, counts[topic.name]) for topic in topics.values()
    ]
    distro = str(old["ros_distro"]) if old and old.get("ros_distro") else default_distro()
    write_metadata(folder, bag_information(merged, files, distro))
    return True


def _fits(information: dict[str, Any], files: list[FileInfo]) -> bool:
    names = information.get("relative_file_paths")
    return names == [file.path for file in files] and information.get("message_count") == sum(
        file.message_count for file in files
    )
