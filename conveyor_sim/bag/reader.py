# SPDX-License-Identifier: Apache-2.0
"""Reader of bags as columns: bags recorded by this package, or by stock rosbag2 from the same topics."""

from __future__ import annotations

import logging
import stat
from collections import Counter
from collections.abc import Collection, Iterator
from contextlib import AbstractContextManager, nullcontext, suppress
from dataclasses import dataclass, fields
from functools import cached_property, lru_cache
from pathlib import Path, PurePath
from typing import TYPE_CHECKING, Any, Generic, TypeVar

import numpy as np
from numpy.typing import NDArray

from conveyor_sim.bag.mcap.index import is_complete
from conveyor_sim.bag.mcap.metadata import FILE_NAME, file_names, is_stated_in, read_metadata
from conveyor_sim.bag.mcap.records import mapped
from conveyor_sim.bag.mcap.storage import other_storage, packed_message
from conveyor_sim.bag.mcap_reader import McapFilesReader
from conveyor_sim.bag.message_reader import MessageReader
from conveyor_sim.bag.messages.encode import FORMAT, LINE, Outcome
from conveyor_sim.bag.messages.older import CONVERTED, WITHOUT_NUMBER, upgraded
from conveyor_sim.bag.messages.qos import Qos
from conveyor_sim.bag.messages.topics import TOPICS
from conveyor_sim.bag.messages.typestore import type_hash
from conveyor_sim.bag.own_reader import own_reader
from conveyor_sim.bag.rosbags_reader import RosbagsReader
from conveyor_sim.bag.tables import frame_of
from conveyor_sim.columns.bottles import BeltColumns, BottleColumns, ContactColumns
from conveyor_sim.errors import BagError, ConveyorError
from conveyor_sim.support.printable import SENTENCE, printable

if TYPE_CHECKING:
    import pandas

T = TypeVar("T")

LOG = logging.getLogger("conveyor_sim")
SUFFIXES = (".mcap", ".db3")
"""Suffixes of files that are a bag by themselves."""


@dataclass(frozen=True)
class Frame(Generic[T]):
    """One recorded message, decoded."""

    tick: int
    time: float
    """s, simulated."""
    data: T


@dataclass(frozen=True)
class BottleSeries:
    """One bottle over its time on the line: 1-D arrays of equal length, with the fields of Bottles."""

    time: NDArray[np.float64]
    """s"""
    x: NDArray[np.float64]
    """m"""
    y: NDArray[np.float64]
    """m"""
    theta: NDArray[np.float64]
    """rad"""
    vx: NDArray[np.float64]
    """m/s"""
    vy: NDArray[np.float64]
    """m/s"""
    omega: NDArray[np.float64]
    """rad/s"""
    belt: NDArray[np.int32]
    peak_force: NDArray[np.float64]
    """N"""
    impulse: NDArray[np.float64]
    """N s"""


class Bag(AbstractContextManager["Bag"]):
    """An open bag; use `open_bag`, as a context manager.

    `line` is the recorded conveyor_msgs/Line (its fields as attributes, arrays as NumPy, texts as lists of str).
    """

    def __init__(self, path: Path, source: MessageReader, verified: bool) -> None:
        self.path = path
        self.verified = verified
        """True if every byte is as it was written; False if some bytes carry no checksum."""
        self._source = source
        line_topics = [recorded.topic for recorded in source.topics if recorded.type == LINE and recorded.count]
        if not line_topics:
            raise BagError(f"{path}: no message of type {LINE}, expected the latched topic line")
        self.namespace = line_topics[0].rpartition("/")[0]
        _, _, data = next(iter(self.raw({"line"})))
        with in_one_sentence(path, "a message of topic line can't be decoded", data):
            line = source.deserialize(data, LINE)
            self.format = self._recorded_format(line)
            """Format of the recording, from 1 to encode.FORMAT."""
            self.line: Any = upgraded(LINE, line, self.format) if "line" in self.older_topics else line

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Close the files; iterating afterwards is an error."""
        self._source.close()

    @property
    def counts(self) -> dict[str, int]:
        """Recorded messages by topic, names as in OUTPUTS (without the namespace and its slash)."""
        counts: Counter[str] = Counter()
        for recorded in self._source.topics:
            counts[self._relative(recorded.topic)] += recorded.count
        return dict(counts)

    @cached_property
    def types(self) -> dict[str, str]:
        """Message type by topic, names as in OUTPUTS."""
        return {self._relative(recorded.topic): recorded.type for recorded in self._source.topics}

    def time(self, tick: int) -> float:
        """Return the simulated time of a tick, s."""
        return float(tick * self.line.tick_ns * 1e-9)

    @property
    def qos(self) -> dict[str, Qos]:
        """Quality of service offered by the recorded publishers, by topic, names as in OUTPUTS."""
        return {self._relative(recorded.topic): recorded.qos for recorded in self._source.topics}

    @property
    def span_ns(self) -> tuple[int, int]:
        """Log times of the first and the last message."""
        return self._source.span_ns

    @cached_property
    def next_run_ns(self) -> int | None:
        """Log time of a second line message, with which another run begins after a reset; None if there is none."""
        lines = [log_time for _, log_time, _ in self.raw({"line"})]
        return lines[1] if len(lines) > 1 else None

    def type_hash(self, topic: str) -> str:
        """Return the RIHS01 hash of a topic's type by the definition that the bag states."""
        return self._source.type_hash(self.types[topic])

    def raw(
        self, topics: Collection[str] | None = None, start_ns: int | None = None, stop_ns: int | None = None
    ) -> Iterator[tuple[str, int, bytes]]:
        """Yield topic, log time (ns) and serialized bytes of every message in time order.

        topics: names; None: all topics. start_ns, stop_ns: interval of log times, without its end; None: no limit.
        """
        chosen = [r for r in self._source.topics if topics is None or self._relative(r.topic) in topics]
        names = {recorded.topic: self._relative(recorded.topic) for recorded in chosen}
        count, stated = 0, sum(recorded.count for recorded in chosen)
        with in_one_sentence(self.path):
            for topic, log_time, data in self._source.messages(names.keys(), start_ns, stop_ns):
                count += 1
                yield names[topic], log_time, data
        if start_ns is None and stop_ns is None and count < stated:
            raise BagError(f"{self.path}: only {count} of {stated} messages can be read; damaged or cut short?")

    @cached_property
    def older_topics(self) -> frozenset[str]:
        """Topics of older definitions, whose messages `decode` converts to the present ones."""
        if self.format == FORMAT:
            return frozenset()
        return frozenset(
            topic
            for topic, kind in self.types.items()
            if kind in CONVERTED and self.type_hash(topic) != type_hash(kind)
        )

    def decode(self, topic: str, data: bytes) -> Any:
        """Return a rosbags message object. Raise BagError if the bytes are not a message of the topic's type.

        Messages of earlier formats have the fields of the present definition.
        """
        kind = self.types[topic]
        with in_one_sentence(self.path, f"a message of topic {topic} can't be decoded", data):
            message = self._source.deserialize(data, kind)
            return upgraded(kind, message, self.format) if topic in self.older_topics else message

    def sense(self) -> AbstractContextManager[None]:
        """Return a context for code that interprets messages. If the bag is not verified, errors become BagErrors."""
        return nullcontext() if self.verified else in_one_sentence(self.path, "its messages make no sense")

    def ticks(self, topic: str) -> NDArray[np.int64]:
        """Return the ticks (n,) of the messages of one topic."""
        return np.array([self.tick(topic, data) for _, _, data in self.raw({topic})], dtype=np.int64)

    def messages(self, topic: str, ticks: Collection[int] | None = None) -> Iterator[Frame[Any]]:
        """Yield the messages of one topic that carries a tick, as rosbags objects: all, or those of some ticks."""
        for _, _, data in self.raw({topic}):
            if ticks is not None and self.tick(topic, data) not in ticks:
                continue
            message = self.decode(topic, data)
            yield Frame(message.tick, message.tick * self._tick_ns(message) * 1e-9, message)

    def tick(self, topic: str, data: bytes) -> int:
        """Return the tick of a message of a topic that carries one, without decoding the rest."""
        with in_one_sentence(self.path, f"a message of topic {topic} can't be decoded", data):
            return self._source.tick(data, self.types[topic])

    def read(self, topic: str, ticks: Collection[int] | None = None) -> Iterator[Frame[Any]]:
        """Yield the messages of one topic in the form that its row of topics.TOPICS states, usually columns."""
        row = TOPICS[topic]
        for frame in self.messages(topic, ticks):
            yield Frame(frame.tick, frame.time, row.unpack(frame.data))

    def bottles(self) -> Iterator[Frame[BottleColumns]]:
        """Yield every recorded Bottles."""
        return self.read("bottles")

    def contacts(self) -> Iterator[Frame[ContactColumns]]:
        """Yield every recorded Contacts."""
        return self.read("contacts")

    def belts(self) -> Iterator[Frame[BeltColumns]]:
        """Yield every recorded Belts."""
        return self.read("belts")

    def signals(self) -> Iterator[Frame[NDArray[np.float64]]]:
        """Yield every recorded process image, in the order of line.signal_names."""
        return self.read("signals")

    def outcomes(self) -> Iterator[Frame[Outcome]]:
        """Yield the result of every command, in order. The tick is that at which it was applied or refused."""
        return self.read("outcomes")

    def frame(self, topic: str) -> pandas.DataFrame:
        """Return the table of a topic as a pandas DataFrame, with one row per bottle, contact, event or tick.

        topic: bottles, contacts, signals, events or belts. The first columns are `time` (s) and `tick`. Names of bottle
        types, belts and rails are categories. `attrs["units"]` holds the SI unit by column. Raise BagError for another
        topic, one that was not recorded, or if pandas is not installed.
        """
        return frame_of(self, topic)

    def bottle_series(self, ids: Collection[int]) -> dict[int, BottleSeries]:
        """Return the histories of some bottles, from one pass over the bag; ids that never occur are left out."""
        wanted = np.array(sorted(ids), dtype=np.uint64)
        names = [field.name for field in fields(BottleSeries)]
        rows: dict[int, dict[str, list[Any]]] = {}
        for frame in self.bottles():
            for index in np.flatnonzero(np.isin(frame.data.id, wanted)):
                row = rows.setdefault(int(frame.data.id[index]), {name: [] for name in names})
                row["time"].append(frame.time)
                for name in names[1:]:
                    row[name].append(getattr(frame.data, name)[index])
        return {bottle: BottleSeries(**{n: np.array(v) for n, v in row.items()}) for bottle, row in rows.items()}

    def _recorded_format(self, line: Any) -> int:
        """Return the format of the recording. Raise BagError for one that this version does not know."""
        if (number := WITHOUT_NUMBER.get(hash_ := self.type_hash("line"))) is not None:
            return number
        if not hasattr(line, "format"):
            raise BagError(f"{self.path}: has an unknown definition of Line ({hash_}), expected one of conveyor_sim")
        if not 1 <= line.format <= FORMAT:
            raise BagError(
                f"{self.path}: format {line.format} given, expected 1 to {FORMAT}; recorded by a newer conveyor_sim?"
            )
        return int(line.format)

    def _relative(self, topic: str) -> str:
        return topic.removeprefix(f"{self.namespace}/")

    def _tick_ns(self, message: Any) -> int:
        return int(message.tick_ns if message.__msgtype__ == LINE else self.line.tick_ns)


class in_one_sentence(AbstractContextManager[None]):
    """Context that turns the errors of libraries over an unreadable bag into a BagError of one sentence."""

    def __init__(self, path: Path, what: str = "can't be read as a bag", data: bytes = b"") -> None:
        """Describe the action that may fail. data: the message that is read; empty while no message is read."""
        self._path, self._what, self._data = path, what, data

    def __exit__(self, _kind: object, error: BaseException | None, _trace: object) -> None:
        if isinstance(error, Exception) and not isinstance(error, ConveyorError):
            if packed := packed_message(self._data):
                raise BagError(f"{self._path}: {self._what}: {packed}") from error
            reason = printable(" ".join(f"{type(error).__name__}: {error}".split()))
            hint = other_storage(self._path) or "`conveyor-sim recover` may help"
            raise BagError(f"{self._path}: {self._what} ({reason}); damaged? {hint}") from error


def mcap_files(path: Path) -> list[Path]:
    """Return the MCAP files of a rosbag2 folder in their order, or the file itself."""
    if path.is_file():
        return [path]
    files = [file for file in path.glob("*.mcap") if file.is_file()]
    return sorted(files, key=lambda file: (len(file.name), file.name))


def open_bag(path: str | Path, by_index: bool = False, *, report: bool = True) -> Bag:
    """Open a rosbag2 folder or a single .mcap file, once everything in it that carries a checksum has been verified.

    by_index: open an intact recording of this package by its index alone, however long it is. Its chunks are verified
    when they are read.
    report: log one line for each file with valid parts that are not read, such as channels without ROS 2 type.
    Raises BagError, in one sentence, if it is missing, cut short or damaged, or holds no `line`.
    """
    path = Path(path)
    with in_one_sentence(path):
        _require_bag(path)
        files = _checked_files(path)
        if by_index and len(files) == 1 and (own := own_reader(files[0])) is not None:
            return Bag(path, own, verified=False)
        source, verified = _source(path, files)
        if report and isinstance(source, McapFilesReader):
            for sentence in source.skipped:
                _report_skipped(sentence)
        try:
            return Bag(path, source, verified)
        except BaseException:
            with suppress(Exception):
                source.close()
            raise


@lru_cache(maxsize=1024)  # a command may open a bag several times
def _report_skipped(sentence: str) -> None:
    LOG.warning("%s", printable(sentence, SENTENCE))


def _require_bag(path: Path) -> None:
    """Raise BagError for a path that can't be a bag."""
    try:
        kind = path.stat().st_mode
    except FileNotFoundError:
        raise BagError(f"{path}: no such bag; expected a rosbag2 folder or an .mcap file") from None
    except OSError as error:
        raise BagError(
            f"{path}: can't be read ({error.strerror}), expected a rosbag2 folder or an .mcap file"
        ) from error
    if not (stat.S_ISDIR(kind) or (stat.S_ISREG(kind) and path.suffix in SUFFIXES)):
        storage = other_storage(path)
        raise BagError(f"{path}: {storage or 'is no bag; expected a rosbag2 folder or an .mcap file'}")


def _checked_files(path: Path) -> list[Path]:
    """Return the MCAP files of a bag; none if rosbags must read it by its metadata.yaml."""
    if path.is_file():
        if path.suffix != ".mcap":
            return []
        if storage := other_storage(path):
            raise BagError(f"{path}: {storage}")
        return [path]
    files = mcap_files(path)
    if not (path / FILE_NAME).exists():
        hint = "`conveyor-sim recover` repairs it" if files else "expected a rosbag2 folder"
        if not files and (storage := other_storage(path)):
            hint = f"`ros2 bag reindex` writes it ({storage})"
        raise BagError(f"{path}: {FILE_NAME} is missing; {hint}")
    with suppress(OSError, UnicodeDecodeError):
        if len(files) == 1 and is_stated_in(files[0]):
            return files
    information = read_metadata(path)
    try:
        names = [] if information is None else file_names(information)
    except (KeyError, TypeError):
        names = []
    for name in names:
        if (path / name).exists() and not (path / name).is_file():  # a pipe would be waited for
            raise BagError(f"{path / name}: is no regular file, expected one that {FILE_NAME} names")
    if not files:
        return []
    compressed = information is not None and str(information.get("compression_mode") or "none").lower() != "none"
    if names and (compressed or all(PurePath(name).suffix != ".mcap" for name in names)):
        return []  # rosbags unpacks what was compressed message by message or file by file
    if sorted(names) != sorted(file.name for file in files):
        raise BagError(f"{path}: {FILE_NAME} does not fit the MCAP files beside it; `conveyor-sim recover` repairs it")
    return files


def _source(path: Path, files: list[Path]) -> tuple[MessageReader, bool]:
    """Open a bag, by its MCAP files if it has any: these repeat, under a checksum, what metadata.yaml says.

    Return also True if every byte is as it was written. Raises BagError for damage that can be seen.
    """
    if not files:
        return RosbagsReader([path]), False
    if len(files) == 1 and _is_sealed(files[0]) and (own := own_reader(files[0])) is not None:
        return own, True
    source = McapFilesReader(path, files)
    return source, source.verified


def _is_sealed(file: Path) -> bool:
    with mapped(file) as data:
        return is_complete(data)
