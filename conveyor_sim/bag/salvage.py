"""One walk over an MCAP file that may be damaged anywhere: what in it is sound, what is wrong, and what is lost."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path

from mcap.opcode import Opcode
from mcap.records import Attachment, Channel, Message, MessageIndex, Metadata, Schema

from conveyor_sim.bag.chunk import Chunk, Content, chunk_at, inside, next_chunk, read_content, read_cut, survey
from conveyor_sim.bag.index import CRC_SIZE, DATA_END, DATA_END_HEAD, Index, read_index
from conveyor_sim.bag.records import MAGIC, PRIVATE, RECORD_HEAD, Data, Malformed, checksum, head_at, parse
from conveyor_sim.errors import BagError

WRONG = "the checksum over all data is wrong"


@dataclass(frozen=True)
class Loss:
    """Messages that can't be had any more."""

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
    """A log time in words."""
    return f"{time_ns * 1e-9:.2f} s"


@dataclass(frozen=True)
class _Found:
    """A sound chunk, or one that the end of the file cuts."""

    chunk: Chunk
    counts: dict[int, int]
    """Messages by channel."""
    cut: bool = False

    @property
    def place(self) -> tuple[int, int, str]:
        return self.chunk.start, self.chunk.stop - self.chunk.start, self.chunk.compression

    @property
    def key(self) -> tuple[int, int, int]:
        return self.chunk.start_ns, self.chunk.end_ns, self.chunk.size


class NothingLeft(BagError):
    """A file in which there is nothing to recover; `why` is a phrase."""

    def __init__(self, path: Path, why: str) -> None:
        super().__init__(f"{path}: {why}; nothing in it can be recovered")
        self.why = why


class Salvage:
    """Walks over a file's bytes when it is made; then says what was found.

    Raises NothingLeft if the file does not begin as an MCAP file does, and has no chunk either.
    """

    def __init__(self, path: Path, data: Data) -> None:
        begins = data[: len(MAGIC)] == MAGIC
        if not begins and next_chunk(data, 0, len(data)) is None:
            raise NothingLeft(path, "is empty" if len(data) == 0 else "does not begin as an MCAP file")
        self.path = path
        self.damage: list[str] = [] if begins else ["it does not begin as an MCAP file"]
        """What is wrong, a phrase each; nothing: what can be verified is as it was written."""
        self.unverified: list[str] = []
        """What carries no checksum, a phrase each."""
        self.metadata: list[Metadata] = []
        self.attachments: list[Attachment] = []
        self.schemas: dict[int, Schema] = {}
        self.channels: dict[int, Channel] = {}
        self.losses: list[Loss] = []
        self.counts: Counter[int] = Counter()
        """Messages by channel."""
        self._data = data
        self._index = read_index(data)
        self._found: list[_Found] = []
        self._digests: set[tuple[int, int]] = set()
        self._last: Content | None = None  # of the chunk before, if it is sound
        self._loose: list[tuple[int, int]] = []  # messages outside of chunks: where they begin and end
        self._loose_counts: Counter[int] = Counter()
        self._loose_names: list[object] = []
        self._holes: list[tuple[int, int | None]] = []  # after how many found chunks, how many messages
        self._ended = self._walk()
        self._names()
        self._judge()

    @property
    def span(self) -> tuple[int, int]:
        """Log times of the first and the last message, ns; zeros without any."""
        times = [time for found in self._found if found.counts for time in (found.chunk.start_ns, found.chunk.end_ns)]
        times += [message.log_time for message in self._loose_messages()]
        return (min(times), max(times)) if times else (0, 0)

    def messages(self) -> Iterator[Message]:
        """Every message that can be had and whose topic is known, in the order of the chunks' times."""
        for found in sorted(self._found, key=lambda found: found.chunk.start_ns):
            content = (read_cut if found.cut else read_content)(self._data, found.chunk)
            for record in inside(content):
                if isinstance(record, Message) and record.channel_id in self.channels:
                    yield record
        yield from self._loose_messages()

    def _loose_messages(self) -> Iterator[Message]:
        for start, stop in self._loose:
            record = parse(Opcode.MESSAGE, self._data[start:stop])
            if isinstance(record, Message) and record.channel_id in self.channels:
                yield record

    # The walk

    def _walk(self) -> int | None:
        """Goes over the data section; where it ends, None if its end is missing."""
        position, size = len(MAGIC), len(self._data)
        while position < size:
            chunk = chunk_at(self._data, position)
            if chunk is not None:
                position = self._take(chunk)
                continue
            head = head_at(self._data, position, size)
            if head is not None and head[0] == Opcode.DATA_END and head[1] == position + DATA_END.size:
                return position
            if head is not None and self._top_level(head[0], position, head[1]):
                position = head[1]
            else:
                position = self._resume(position)
        return None

    def _take(self, chunk: Chunk) -> int:
        """Takes a chunk in, if it is sound; returns where to go on."""
        self._last = None
        if chunk.stop > len(self._data) and self._chunk_in(chunk) is None:
            had = read_cut(self._data, chunk)
            share = f"{len(had)} of {chunk.size} bytes" if had else "nothing"
            self.damage.append(
                f"the last chunk was cut while it was written; {share} of its content could be read, and not verified"
            )
            records = list(inside(had))
            counts = Counter(record.channel_id for record in records if isinstance(record, Message))
            self._found.append(_Found(chunk, counts, cut=True))
            self._learn(records)
            return len(self._data)
        try:
            content = survey(read_content(self._data, chunk))
        except Malformed as error:
            self.damage.append(f"the chunk at byte {chunk.start} is damaged: {error}")
            self._holes.append((len(self._found), None))
            inner = self._chunk_in(chunk)
            return inner.start if inner else chunk.stop
        if (content.digest, chunk.size) in self._digests:
            self.damage.append(f"the chunk at byte {chunk.start} repeats another one")
            return chunk.stop
        self._digests.add((content.digest, chunk.size))
        if content.count and content.span != (chunk.start_ns, chunk.end_ns):
            self.damage.append(f"the chunk at byte {chunk.start} states other times than its messages")
            chunk = replace(chunk, start_ns=content.span[0], end_ns=content.span[1])
        self._last = content
        self._found.append(_Found(chunk, {channel: len(places) for channel, places in content.places.items()}))
        self._learn((*content.schemas, *content.channels))
        return chunk.stop

    def _chunk_in(self, chunk: Chunk) -> Chunk | None:
        """The next chunk, if it begins before a damaged one ends: where bytes of that were lost."""
        return next_chunk(self._data, chunk.start + 1, chunk.stop)

    def _learn(self, records: Iterable[object]) -> None:
        for record in records:
            if isinstance(record, Schema):
                self.schemas.setdefault(record.id, record)
            elif isinstance(record, Channel):
                self.channels.setdefault(record.id, record)

    def _top_level(self, opcode: int, start: int, stop: int) -> bool:
        """Takes a record outside of chunks in; whether it is one."""
        body = start + RECORD_HEAD.size
        if (opcode >= PRIVATE or opcode == Opcode.MESSAGE) and next_chunk(self._data, start + 1, stop) is not None:
            return False  # with a damaged length
        if opcode >= PRIVATE:
            return True
        if opcode not in (Opcode.HEADER, Opcode.SCHEMA, Opcode.CHANNEL, Opcode.MESSAGE, Opcode.MESSAGE_INDEX,
                          Opcode.ATTACHMENT, Opcode.METADATA):  # fmt: skip
            return False
        try:
            record = parse(opcode, self._data[body:stop])
        except Malformed:
            return False
        if isinstance(record, Message):
            self._loose.append((body, stop))
            self._loose_counts[record.channel_id] += 1
        elif isinstance(record, MessageIndex):
            self._match(record)
        elif isinstance(record, Metadata):
            self.metadata.append(record)
        elif isinstance(record, Attachment):
            self._attach(record, body, stop)
        else:
            self._loose_names.append(record)
        return True

    def _match(self, record: MessageIndex) -> None:
        """Compares what indexes the chunk before with what is in it, or counts what that held if it is damaged."""
        if self._holes and self._holes[-1][0] == len(self._found):
            at, count = self._holes[-1]
            self._holes[-1] = (at, (count or 0) + len(record.records))
        # Writers may put the entries in the order of time.
        elif self._last is not None and sorted(record.records) != sorted(self._last.places.get(record.channel_id, [])):
            self._once("the index of a chunk's messages is damaged")

    def _attach(self, record: Attachment, start: int, stop: int) -> None:
        crc = int.from_bytes(self._data[stop - CRC_SIZE : stop], "little")
        if crc and checksum(self._data, start, stop - CRC_SIZE) != crc:
            self.damage.append(f"the attachment {record.name} is damaged and was left out")
        else:
            self.attachments.append(record)

    def _resume(self, position: int) -> int:
        """Where the next record begins that can be trusted to be one: a chunk, or the end of the data."""
        chunk = next_chunk(self._data, position + 1, len(self._data))
        following = chunk.start if chunk else len(self._data)
        end = self._data.find(DATA_END_HEAD, position + 1, following)
        while end >= 0 and not self._is_end(end):
            end = self._data.find(DATA_END_HEAD, end + 1, following)
        following = end if end >= 0 else following
        self.damage.append(f"bytes {position} to {following} hold nothing that can be read")
        self._holes.append((len(self._found), None))
        return following

    def _is_end(self, position: int) -> bool:
        """Whether bytes that look like the end of the data are: the index begins right after."""
        after = position + DATA_END.size
        if self._index is not None:
            return after == self._index.start
        head = head_at(self._data, after, len(self._data))
        return head is not None and head[0] in (Opcode.SCHEMA, Opcode.CHANNEL, Opcode.STATISTICS, Opcode.CHUNK_INDEX)

    # The verdict

    def _names(self) -> None:
        """Topics and types that the data do not name any more are taken from the index."""
        self._learn(self._loose_names)
        self._named = {key for key, channel in self.channels.items() if channel.schema_id in self.schemas}
        if self._index is not None:
            self._learn((*self._index.schemas.values(), *self._index.channels.values()))
        self.channels = {key: value for key, value in self.channels.items() if value.schema_id in self.schemas}

    def _judge(self) -> None:
        if self._found and self._loose:  # nobody writes both, and a damaged record can look like a message
            self.damage.append(f"{len(self._loose)} messages outside of chunks were left out")
            self._loose.clear()
            self._loose_counts.clear()
        counts = self.counts
        counts.update(self._loose_counts)
        for found in self._found:
            counts.update(found.counts)
        if self._ended is None:
            self.damage.append("the end of the file is missing")
        else:
            self._judge_end(self._ended)
        nameless = sum(count for channel, count in counts.items() if channel not in self.channels)
        if nameless:
            self.damage.append(f"{nameless} messages were left out: what named their topics is damaged")
        by_index = sum(count for channel, count in counts.items() if channel in self.channels.keys() - self._named)
        if by_index and not self.damage:
            self.damage.append(f"only the index names the topics of {by_index} messages")
        if any(found.chunk.crc == 0 for found in self._found):
            self.unverified.append("chunks")
        if self._loose:
            self.unverified.append("messages outside of chunks")
            times = [message.log_time for message in self._loose_messages()]
            if times != sorted(times):  # without an index nobody can read them in order; the copy has one
                self.damage.append("messages outside of chunks are not in the order of their times")
        if self._index is not None:
            self._judge_index(self._index, counts)
        elif self._holes:
            self._lose_by_neighbours()
        elif WRONG in self.damage:
            self.damage.append("whether messages are lost can't be known: the index that counted them is damaged")

    def _judge_end(self, end: int) -> None:
        _, _, crc = DATA_END.unpack(self._data[end : end + DATA_END.size])
        if crc == 0:
            self.unverified.append("what is outside of chunks")
        elif checksum(self._data, 0, end) != crc:
            self._once(WRONG)
        index = self._index
        if index is None:
            self.damage.append("the index at the end is damaged or missing")
            return
        if not index.verified:
            self.unverified.append("the index")
        if index.start != end + DATA_END.size:
            self._once("the index is not where it should be")
        if index.stop != len(self._data):
            self.damage.append(f"{len(self._data) - index.stop} bytes follow the end")

    def _judge_index(self, index: Index, counts: Counter[int]) -> None:
        """What the index lists and was not found is lost; where it disagrees in other ways, it is damaged."""
        places = sorted((c.chunk_start_offset, c.chunk_length, c.compression) for c in index.chunks)
        known = {found.place for found in self._found} | {found.key for found in self._found}
        missing = [
            chunk
            for chunk in sorted(index.chunks, key=lambda chunk: chunk.message_start_time)
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
        found = sum(counts.values())
        statistics = index.statistics
        if statistics is not None and statistics.message_count != found and not missing:
            lost = statistics.message_count - found
            self._once(f"the index counts {statistics.message_count} messages, {found} were found")
            if self._holes and lost > 0:
                self._lose(Loss(lost, None, None))
        if self.damage:
            return
        keys = {(c.message_start_time, c.message_end_time, c.uncompressed_size) for c in index.chunks}
        fits = (
            (not places or places == [found.place for found in self._found])
            and (not keys or keys == {found.key for found in self._found})
            and all(self.schemas.get(key) == schema for key, schema in index.schemas.items())
            and all(self.channels.get(key) == channel for key, channel in index.channels.items())
            and (statistics is None or self._fits(statistics.message_start_time, statistics.message_end_time))
            and (statistics is None or Counter(statistics.channel_message_counts) == counts)
        )  # fmt: skip
        if not fits:
            self.damage.append("the index at the end does not fit the data")

    def _fits(self, start_ns: int, end_ns: int) -> bool:
        """Whether times are those of the messages, as far as these are in chunks."""
        filled = [found.chunk for found in self._found if found.counts]
        if self._loose or not filled:
            return True
        return (start_ns, end_ns) == (min(c.start_ns for c in filled), max(c.end_ns for c in filled))

    def _lose_by_neighbours(self) -> None:
        """Without an index, a loss lies between the sound chunks before and after it."""
        for at, messages in self._holes:
            before = self._found[at - 1].chunk.end_ns if at else None
            after = self._found[at].chunk.start_ns if at < len(self._found) else None
            self._lose(Loss(messages, before, after))

    def _lose(self, loss: Loss) -> None:
        """Adds a loss; one that follows right upon the last one is joined to it."""
        last = self.losses[-1] if self.losses else None
        if last is not None and None not in (last.end_ns, loss.start_ns) and self._adjoin(last, loss):
            known = last.messages is not None and loss.messages is not None
            count = (last.messages or 0) + (loss.messages or 0) if known else None
            self.losses[-1] = Loss(count, last.start_ns, loss.end_ns)
        elif last is None or (last.start_ns, last.end_ns) != (loss.start_ns, loss.end_ns):
            self.losses.append(loss)

    def _adjoin(self, first: Loss, second: Loss) -> bool:
        """Whether nothing was found between two losses."""
        assert first.end_ns is not None and second.start_ns is not None
        return not any(first.end_ns <= found.chunk.start_ns <= second.start_ns for found in self._found)

    def _once(self, phrase: str) -> None:
        if phrase not in self.damage:
            self.damage.append(phrase)
