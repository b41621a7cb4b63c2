"""Parts of a valid MCAP file that this package does not read: channels of other programs, records of unknown kinds."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping

from mcap.records import Channel, Schema

CDR = "cdr"
IDL = ("ros2idl", "omgidl")
ROS_SCHEMAS = ("ros2msg", *IDL, "")
"""Schema encodings of ROS 2 messages; "": the definition was not available to the recorder."""
NAMED = 5
"""Channels or opcodes that are listed, at most."""


def is_ros(channel: Channel, schemas: Mapping[int, Schema]) -> bool:
    """Return True if the messages of a channel are ROS 2 messages."""
    schema = schemas.get(channel.schema_id) if channel.schema_id else None
    return schema is not None and channel.message_encoding == CDR and schema.encoding in ROS_SCHEMAS


def skipped_parts(
    channels: Mapping[int, Channel],
    schemas: Mapping[int, Schema],
    counts: Mapping[int, int],
    unknown: Iterable[int],
    compressions: Iterable[str],
) -> str:
    """Return one phrase that counts the foreign messages, records and chunks of a file; "" if it has none.

    counts: messages by channel. unknown: the opcode of each record that is not read. compressions: of each chunk that
    can't be read.
    """
    foreign = [number for number, channel in channels.items() if not is_ros(channel, schemas)]
    parts = []
    if foreign:
        messages = sum(counts.get(number, 0) for number in foreign)
        names = [f"{channels[n].topic} ({channels[n].message_encoding or 'no encoding'})" for n in foreign]
        parts.append(f"{messages} messages of {len(foreign)} channels without ROS 2 type: {_listed(names)}")
    opcodes = Counter(unknown)
    if opcodes:
        names = [f"0x{opcode:02x}" for opcode in sorted(opcodes)]
        parts.append(f"{opcodes.total()} records that are not read, of kinds {_listed(names)}")
    if unread := Counter(compressions):
        parts.append(f"{unread.total()} chunks of unknown compression: {_listed(sorted(unread))}")
    return "; ".join(parts)


def _listed(names: list[str]) -> str:
    more = f" and {len(names) - NAMED} more" if len(names) > NAMED else ""
    return ", ".join(names[:NAMED]) + more
