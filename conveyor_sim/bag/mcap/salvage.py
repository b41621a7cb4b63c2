# SPDX-License-Identifier: Apache-2.0
"""Verdict on an MCAP file that may be damaged anywhere: valid parts, damage, losses, and parts that are not read."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from mcap.opcode import Opcode
from mcap.records import Channel, Message, Schema

from conveyor_sim.bag.mcap.chunk import COMPRESSIONS, inside, read_content, read_cut
from conveyor_sim.bag.mcap.index import DATA_END, Index
from conveyor_sim.bag.mcap.line_copy import LineCopy, read_line_copy
from conveyor_sim.bag.mcap.records import MAGIC, RECORD_HEAD, Data, checksum, parse
from conveyor_sim.bag.mcap.walk import MISMATCH, Walk

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


@dataclass(frozen=True)
class Loss:
    """Messages that can't be read any more."""

    messages: int | None
    """None: not known."""
    start_ns: int | None
    """Log times between which they were; None: from the beginning, or to the end."""
    end_ns: int | None

    def __str__(self) -> str:
        count = "an unknown number of messages" if self.messages is None else f"{self.messages} messages"
        start = "the beginning" if self.start_ns is None else seconds(self.start_ns)
        end = "the end" if self.end_ns is None else seconds(self.end_ns)
        return f"lost: {count} from {start} to {end}"


def seconds(time_ns: int) -> str:
    """Return a log time in words."""
    return f"{time_ns * 1e-9:.2f} s"


def lose(losses: list[Loss], loss: Loss, starts: Sequence[int]) -> None:
    """Add a loss. Join it to the last one, unless a valid chunk starts between them (`starts`)."""
    last = losses[-1] if losses else None
    if last is not None and _adjoin(last, loss, starts):
        known = last.messages is not None and loss.messages is not None
        count = (last.messages or 0) + (loss.messages or 0) if known else None
        losses[-1] = Loss(count, last.start_ns, loss.end_ns)
    elif last is None or (last.start_ns, last.end_ns) != (loss.start_ns, loss.end_ns):
        losses.append(loss)


def without_one(losses: Sequence[Loss], time_ns: int) -> list[Loss]:
    """Return losses less one message of a log time, which was restored."""
    left = []
    restored = False
    for loss in losses:
        after = loss.start_ns is None or loss.start_ns <= time_ns
        before = loss.end_ns is None or time_ns <= loss.end_ns
        if not restored and after and before and loss.messages is not None:
            restored = True
            loss = Loss(loss.messages - 1, loss.start_ns, loss.end_ns)
        if loss.messages != 0:
            left.append(loss)
    return left


def _adjoin(first: Loss, second: Loss, starts: Sequence[int]) -> bool:
    if first.end_ns is None or second.start_ns is None:
        return False
    return not any(first.end_ns <= start <= second.start_ns for start in starts)


WRONG = "the checksum over all data is wrong"
LISTED = (Opcode.CHUNK, Opcode.MESSAGE_INDEX, Opcode.ATTACHMENT, Opcode.METADATA)
"""Records whose places an index states."""


class Salvage(Walk):
    """A walk over a file with a verdict: its damage, and the parts that can still be read.

    Raises NothingLeft if the file does not begin as an MCAP file does, and has no chunk either.
    """

    def __init__(self, path: Path, data: Data) -> None:
        super().__init__(path, data)
        self.unverified: list[str] = []
        """One phrase for each part that carries no checksum."""
        self.losses: list[Loss] = []
        self.counts: Counter[int] = Counter()
        """Messages by channel."""
        self.line_copy = next((copy for record in self.metadata if (copy := read_line_copy(record)) is not None), None)
        """The copy of the line message after the header; None if there is none, or it is damaged."""
        self.restored: Message | None = None
        """The line message as its copy has it, if the chunk that held it is lost."""
        self._names()
        self._judge()
        self._restore_line()

    @property
    def ros_channels(self) -> dict[int, Channel]:
        """The channels of ROS 2 messages, by number."""
        return {number: channel for number, channel in self.channels.items() if is_ros(channel, self.schemas)}

    @property
    def skipped(self) -> str:
        """One phrase that counts the parts that are not read though they are valid; "" if there are none."""
        unknown = [*self.unknown, *(() if self.index is None else self.index.unknown)]
        return skipped_parts(self.channels, self.schemas, self.counts, unknown, self.unread)

    @property
    def span(self) -> tuple[int, int]:
        """Log times of the first and the last ROS 2 message, ns; zeros without any."""
        ours = self.ros_channels
        times = [time for one in self.chunks for number, span in one.spans.items() if number in ours for time in span]
        times += [message.log_time for message in self.loose if message.channel in ours]
        times += [] if self.restored is None else [self.restored.log_time]
        return (min(times), max(times)) if times else (0, 0)

    def line(self, type_name: str) -> LineCopy | None:
        """Return the first message of the line's type, for a copy of it; None if none is left."""
        if self.restored is not None:
            return self.line_copy
        lines = {number for number, channel in self.ros_channels.items() if self._type(channel) == type_name}
        if not any(self.counts[number] for number in lines):
            return None
        message = next((message for message in self.messages() if message.channel_id in lines), None)
        if message is None:
            return None
        channel = self.channels[message.channel_id]
        return LineCopy(channel.topic, self._type(channel), message.log_time, bytes(message.data))

    def _type(self, channel: Channel) -> str:
        return self.schemas[channel.schema_id].name

    def messages(self) -> Iterator[Message]:
        """Yield every message that can be read and whose topic is known, in the order of the chunks' times."""
        if self.restored is not None:
            yield self.restored
        for one in sorted(self.chunks, key=lambda one: one.chunk.start_ns):
            content = (read_cut if one.cut else read_content)(self.data, one.chunk)
            for record in inside(content):
                if isinstance(record, Message) and record.channel_id in self.channels:
                    yield record
        for loose in self.loose:
            message = parse(Opcode.MESSAGE, self.data[loose.start : loose.stop])
            if isinstance(message, Message) and message.channel_id in self.channels:
                yield message

    def _names(self) -> None:
        """Take topics and types that are missing in the data from the index."""
        self.learn(self._loose_names)
        self._named = {key for key, channel in self.channels.items() if self._has_schema(channel)}
        if self.index is not None:
            self.learn((*self.index.schemas.values(), *self.index.channels.values()))
        self.channels = {key: channel for key, channel in self.channels.items() if self._has_schema(channel)}

    def _has_schema(self, channel: Channel) -> bool:
        return channel.schema_id == 0 or channel.schema_id in self.schemas  # 0: the channel needs none

    def _judge(self) -> None:
        counts = self.counts
        for one in self.chunks:
            counts.update(one.counts)
        loose = Counter(message.channel for message in self.loose)
        # A damaged record can look like a message.
        if self.chunks and self.loose and not (self._trusted and self._is_count(counts.total() + loose.total())):
            self.damage.append(f"{len(self.loose)} messages outside of chunks were left out")
            self.loose.clear()
            loose.clear()
        counts.update(loose)
        nameless = sum(count for channel, count in counts.items() if channel not in self.channels)
        if nameless:
            self.damage.append(f"{nameless} messages were left out: what named their topics is damaged")
        by_index = sum(count for channel, count in counts.items() if channel in self.channels.keys() - self._named)
        if by_index and not self.damage:
            self.damage.append(f"only the index names the topics of {by_index} messages")
        if self._ended is None:
            self.damage.append("the end of the file is missing")
        else:
            self._judge_end(self._ended)
        if not self.damage and self.data[len(MAGIC)] != Opcode.HEADER:
            self.damage.append("the header is missing")
        if any(one.chunk.crc == 0 and one.chunk.size for one in self.chunks):
            self.unverified.append("chunks")
        if self.loose:
            self.unverified.append("messages outside of chunks")
        if self.index is not None and (self.index.counts_messages or not self._holes):
            self._judge_index(self.index, counts)
        elif self._holes:
            self._lose_by_neighbours()
        uncertain = WRONG in self.damage or MISMATCH in self.damage
        if uncertain and not self._holes and (self.index is None or not self.index.counts_messages):
            self.damage.append(
                "whether messages are lost can't be known: the index that counted them is damaged or missing"
            )

    def _restore_line(self) -> None:
        """Take the line message from its copy if no other one is left of its topic."""
        copy = self.line_copy
        if copy is None or not self.damage:
            return
        for number, channel in self.ros_channels.items():
            if (channel.topic, self._type(channel)) != (copy.topic, copy.type) or self.counts[number]:
                continue
            self.restored = Message(number, copy.log_time, copy.data, copy.log_time, 0)
            self.counts[number] = 1
            self.losses = without_one(self.losses, copy.log_time)
            self.damage.append("the line message was lost and was restored from its copy after the header")
            return

    def _is_count(self, messages: int) -> bool:
        """Return True unless the index counts another number of messages."""
        statistics = None if self.index is None else self.index.statistics
        return statistics is None or statistics.message_count == messages

    def _judge_end(self, end: int) -> None:
        _, _, crc = DATA_END.unpack(self.data[end : end + DATA_END.size])
        if crc == 0:
            self.unverified.append("what is outside of chunks")
        elif not self._trusted and checksum(self.data, 0, end) != crc:
            self._once(WRONG)
        index = self.index
        if index is None:
            self.damage.append("the index at the end is damaged or missing")
            return
        if not index.verified:
            self.unverified.append("the index")
        if index.start != end + DATA_END.size or (index.start != index.stated and not index.absent):
            self._once("the index is not where it should be")
        if index.stop != len(self.data):
            self.damage.append(f"{len(self.data) - index.stop} bytes follow the end")

    def _judge_index(self, index: Index, counts: Counter[int]) -> None:
        """Report chunks that only the index lists as lost. Report an index that differs in other ways as damaged."""
        # Chunks whose compression is unknown hold messages that nothing here counts.
        listed = [chunk for chunk in index.chunks if chunk.compression in COMPRESSIONS]
        statistics = None if self.unread else index.statistics
        places = sorted((c.chunk_start_offset, c.chunk_length, c.compression) for c in listed)
        known = {one.place for one in self.chunks} | {one.key for one in self.chunks}
        missing = [
            chunk
            for chunk in sorted(listed, key=lambda chunk: chunk.message_start_time)
            if (chunk.chunk_start_offset, chunk.chunk_length, chunk.compression) not in known
            and (chunk.message_start_time, chunk.message_end_time, chunk.uncompressed_size) not in known
        ]
        for chunk in missing:
            offsets = len(chunk.message_index_offsets)
            # A message index is its head, a channel, a length, and 16 bytes a message.
            messages = (chunk.message_index_length - offsets * (RECORD_HEAD.size + 6)) // 16 if offsets else None
            self._lose(Loss(messages, chunk.message_start_time, chunk.message_end_time))
        if missing and not self._holes and not self.damage:
            self.damage.append("chunks that the index lists are missing")
        present = counts.total()
        if statistics is not None and statistics.message_count != present and not missing:
            lost = statistics.message_count - present
            self._once(f"the index counts {statistics.message_count} messages, {present} were found")
            if self._holes and lost > 0:
                self._lose(Loss(lost, None, None))
        if self.damage:
            return
        keys = {(c.message_start_time, c.message_end_time, c.uncompressed_size) for c in listed}
        fits = (
            (not places or places == [one.place for one in self.chunks])
            and (not keys or keys == {one.key for one in self.chunks})
            and all(at < index.start and self.data[at] in LISTED for at in index.places)
            and all(self.schemas.get(key) == schema for key, schema in index.schemas.items())
            and all(self.channels.get(key) == channel for key, channel in index.channels.items())
            and (statistics is None or self._fits(statistics.message_start_time, statistics.message_end_time))
            and (statistics is None or Counter(statistics.channel_message_counts) == counts)
        )  # fmt: skip
        if not fits:
            self.damage.append("the index at the end does not fit the data")

    def _fits(self, start_ns: int, end_ns: int) -> bool:
        """Return True if the messages in chunks have these first and last times."""
        filled = [one.chunk for one in self.chunks if one.counts]
        if self.loose or not filled:
            return True
        return (start_ns, end_ns) == (min(c.start_ns for c in filled), max(c.end_ns for c in filled))

    def _lose_by_neighbours(self) -> None:
        """Report losses without an index: they lie between the valid chunks before and after."""
        for at, messages in self._holes:
            before = self.chunks[at - 1].chunk.end_ns if at else None
            after = self.chunks[at].chunk.start_ns if at < len(self.chunks) else None
            self._lose(Loss(messages, before, after))

    def _lose(self, loss: Loss) -> None:
        lose(self.losses, loss, [one.chunk.start_ns for one in self.chunks])
