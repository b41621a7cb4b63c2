# SPDX-License-Identifier: Apache-2.0
"""MCAP files of any writer, as the specification allows them: with or without chunks, index, schemas, in any order."""

from __future__ import annotations

import mmap
from collections.abc import Collection, Iterator, Mapping, Sequence
from contextlib import suppress
from functools import cached_property, lru_cache
from heapq import merge
from operator import itemgetter
from pathlib import Path
from typing import Any

from mcap.records import Channel
from rosbags.rosbag2.metadata import parse_qos
from rosbags.typesys import Stores, TypesysError, get_types_from_idl, get_types_from_msg, get_typestore
from rosbags.typesys.store import Typestore

from conveyor_sim.bag.mcap.chunk import MESSAGE, in_time_order
from conveyor_sim.bag.mcap.records import Data
from conveyor_sim.bag.mcap.salvage import IDL, Salvage
from conveyor_sim.bag.mcap.writer import QOS_KEY
from conveyor_sim.bag.message_reader import Raw, RecordedTopic
from conveyor_sim.bag.messages.qos import Qos
from conveyor_sim.bag.messages.typestore import SEPARATOR, typestore
from conveyor_sim.bag.rosbags_reader import offered
from conveyor_sim.errors import BagError


class McapFilesReader:
    """The ROS 2 messages of some MCAP files; channels of other programs are left out."""

    def __init__(self, path: Path, files: Sequence[Path]) -> None:
        """Open the files of the bag `path`. Raises BagError if one is damaged or holds chunks that can't be read."""
        self._maps: list[Data] = []
        self._files: list[Salvage] = []
        try:
            for file in files:
                self._files.append(self._opened(path, file))
        except BaseException:
            self.close()
            raise
        self.verified = not any(one.unverified for one in self._files)
        """Every byte lies under a checksum, and all are right."""

    def _opened(self, path: Path, file: Path) -> Salvage:
        with file.open("rb") as stream:
            empty = file.stat().st_size == 0
            data = b"" if empty else mmap.mmap(stream.fileno(), 0, access=mmap.ACCESS_READ)
        self._maps.append(data)
        salvage = Salvage(file, data)
        if salvage.damage:
            raise BagError(
                f"{file}: is damaged ({salvage.damage[0]}); `conveyor-sim recover {path}` saves what is valid"
            )
        if salvage.unread:
            raise BagError(f"{file}: has parts that can't be read here ({salvage.skipped}), expected none, lz4 or zstd")
        return salvage

    @property
    def skipped(self) -> tuple[str, ...]:
        """One sentence for each file with valid parts that are not read."""
        return tuple(f"{one.path}: skipped {one.skipped}" for one in self._files if one.skipped)

    @cached_property
    def topics(self) -> Sequence[RecordedTopic]:
        """The ROS 2 topics."""
        return [
            RecordedTopic(
                channel.topic,
                file.schemas[channel.schema_id].name,
                file.counts[number],
                _qos(channel.metadata.get(QOS_KEY, "")),
            )
            for file in self._files
            for number, channel in file.ros_channels.items()
        ]

    @property
    def span_ns(self) -> tuple[int, int]:
        """Log times of the first and the last message."""
        spans = [file.span for file in self._files if any(file.counts[number] for number in file.ros_channels)]
        return min((start for start, _ in spans), default=0), max((end for _, end in spans), default=0)

    def messages(self, topics: Collection[str], start_ns: int | None, stop_ns: int | None) -> Iterator[Raw]:
        """Yield the messages of some topics in time order.

        topics: absolute names. start_ns, stop_ns: interval of log times, without its end; None: no limit.
        """
        streams = [part for file in self._files for part in (_chunked(file, topics), _loose(file, topics))]
        for raw in merge(*streams, key=itemgetter(1)):
            if stop_ns is not None and raw[1] >= stop_ns:
                return
            if start_ns is None or raw[1] >= start_ns:
                yield raw

    def deserialize(self, data: bytes, type_name: str) -> Any:
        """Return a rosbags message object."""
        return self._types.deserialize_cdr(data, type_name)

    def tick(self, data: bytes, type_name: str) -> int:
        """Return the tick of a message that has one."""
        return int(self.deserialize(data, type_name).tick)

    def type_hash(self, type_name: str) -> str:
        """Return the RIHS01 hash of a type by the definition that the bag states."""
        return self._types.hash_rihs01(type_name)

    def close(self) -> None:
        """Close the files."""
        for data in self._maps:
            if isinstance(data, mmap.mmap):
                data.close()
        self._maps.clear()

    @cached_property
    def _types(self) -> Typestore:
        """The types as the files define them."""
        schemas = [file.schemas[channel.schema_id] for file in self._files for channel in file.ros_channels.values()]
        return _store(tuple(dict.fromkeys((schema.name, schema.encoding, schema.data) for schema in schemas)))


@lru_cache(maxsize=256)
def _qos(profiles: str) -> Qos:
    """Return the quality of service that a channel's metadata state, as YAML."""
    return offered(parse_qos(profiles))


@lru_cache(maxsize=8)  # a command may open a bag several times, and making a store takes most of the time
def _store(schemas: tuple[tuple[str, str, bytes], ...]) -> Typestore:
    """Return the types of some schemas; those without a definition are as in the default distribution."""
    types: dict[str, Any] = {}
    for schema in schemas:
        with suppress(TypesysError, UnicodeDecodeError):  # a topic of another program may be defined as it likes
            types.update(_defined(*schema))
    if any(name not in types for name, _, _ in schemas):
        types = {**typestore().fielddefs, **types}
    store = get_typestore(Stores.EMPTY)
    store.register(types)
    return store


def _defined(name: str, encoding: str, data: bytes) -> Mapping[str, Any]:
    """Return the types that a schema defines, by name."""
    text = data.decode()
    if encoding not in IDL:
        return get_types_from_msg(text, name) if encoding else {}
    if not text.startswith(f"{SEPARATOR}IDL: "):
        return get_types_from_idl(text)
    types: dict[str, Any] = {}
    for part in text.split(SEPARATOR)[1:]:
        types.update(get_types_from_idl(part.partition("\n")[2]))
    return types


def _named(file: Salvage, topics: Collection[str]) -> dict[int, str]:
    channels: dict[int, Channel] = file.ros_channels
    return {number: channel.topic for number, channel in channels.items() if channel.topic in topics}


def _chunked(file: Salvage, topics: Collection[str]) -> Iterator[Raw]:
    """Yield the messages in chunks in time order."""
    names = _named(file, topics)
    chunks = [one.chunk for one in file.chunks if one.counts.keys() & names.keys()]
    return in_time_order(file.data, sorted(chunks, key=lambda chunk: (chunk.start_ns, chunk.start)), names)


def _loose(file: Salvage, topics: Collection[str]) -> Iterator[Raw]:
    """Yield the messages outside of chunks in time order."""
    names = _named(file, topics)
    for message in sorted(file.loose, key=lambda message: message.log_time):
        if (topic := names.get(message.channel)) is not None:
            yield topic, message.log_time, bytes(file.data[message.start + MESSAGE.size : message.stop])
