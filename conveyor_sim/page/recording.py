# SPDX-License-Identifier: Apache-2.0
"""A recording as the page shows it: head, blocks of some seconds, and story, each read by the bag's index."""

from __future__ import annotations

import json
import math
from collections.abc import Collection, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from typing import Any

import numpy as np

from conveyor_sim.bag.messages.encode import to_image
from conveyor_sim.bag.messages.topics import TOPICS
from conveyor_sim.bag.reader import Bag
from conveyor_sim.columns.bottles import BottleColumns
from conveyor_sim.columns.variables import VariableColumns
from conveyor_sim.errors import BagError
from conveyor_sim.page.block import SECONDS, BlockContent, block_ticks, pack
from conveyor_sim.page.head import head
from conveyor_sim.page.story import TOPICS_READ, Story
from conveyor_sim.scene import parse_again, parse_overrides

_SLACK_NS = 2_000_000_000
"""Greatest distance of a message's log time from that of others of its tick, ns."""


class Stamps:
    """Finds messages by tick. If log times are not simulated times, the recording is read once at the start."""

    def __init__(self, bag: Bag, topics: Collection[str]) -> None:
        """topics: those that carry ticks, and are requested later."""
        self._bag = bag
        self._tick_ns = int(bag.line.tick_ns)
        first = next(((bag.tick(topic, data), stamp) for topic, stamp, data in bag.raw(topics)), None)
        self._simulated = first is None or abs(first[0] * self._tick_ns - first[1]) <= 1
        stamped = [] if self._simulated else [(bag.tick(topic, data), stamp) for topic, stamp, data in bag.raw(topics)]
        ticks = np.array([tick for tick, _ in stamped], dtype=np.int64)
        # Decreasing ticks belong to another run, after a reset.
        back = np.flatnonzero(np.diff(ticks) < -_SLACK_NS // self._tick_ns)
        self._ticks = np.maximum.accumulate(ticks[: back[0] + 1] if len(back) else ticks)
        self._stamps = [stamp for _, stamp in stamped]

    @property
    def last(self) -> int:
        """The last tick."""
        return self._bag.span_ns[1] // self._tick_ns if self._simulated else int(self._ticks[-1])

    def messages(
        self, topics: Collection[str], start: int | None = None, stop: int | None = None
    ) -> Iterator[tuple[str, int, bytes]]:
        """Yield topic, tick and bytes of the messages of some topics in time order, from a tick on, before a tick."""
        if self._simulated:
            # The stamp of tick 0 is 1 ns.
            first, last = (None if tick is None else tick * self._tick_ns for tick in (start, stop))
        else:
            first = None if start is None else self._stamp(start) - _SLACK_NS
            last = self._stamp(self.last if stop is None else stop) + _SLACK_NS
        for topic, _, data in self._bag.raw(topics, first, last):
            tick = self._bag.tick(topic, data)
            if (start is None or tick >= start) and (stop is None or tick < stop):
                yield topic, tick, data

    def _stamp(self, tick: int) -> int:
        return self._stamps[min(int(np.searchsorted(self._ticks, tick)), len(self._ticks) - 1)]


DRAWN = ("bottles", "contacts", "belts", "signals")
"""Topics that blocks contain."""
_LOOKS = 24
"""Moments among which the fullest one is searched, at most."""
_LOOK_EVERY = 1.0
"""Least simulated time between two of them, s; more of them would read the same chunks again."""
VARIABLES = "variables"
"""Topic of a controller's variables, which are further columns of the signals."""


class Collector:
    """Collects the content of a block from messages."""

    def __init__(self, bag: Bag, start: int, gaps: Mapping[str, int], variables: Sequence[str] = ()) -> None:
        """Begin an empty block.

        start: the block's first tick. gaps: least number of ticks between two selected messages, by topic. variables:
        names of the controller's variables that are shown.
        """
        self.content = BlockContent()
        self._bag = bag
        self._start = start
        self._gaps = gaps
        self._taken = dict.fromkeys(DRAWN, -1)
        self._left_out: list[BottleColumns] = []
        self._names = variables
        self._variables = np.full(len(variables), np.nan)

    def add(self, topic: str, tick: int, raw: bytes) -> None:
        """Add a message if it is due. All topics count the ticks from the block's first one."""
        if topic == VARIABLES:
            self._add_variables(tick, raw)
            return
        slot = (tick - self._start) // self._gaps[topic]
        is_due = slot != self._taken[topic]
        self._taken[topic] = slot
        if topic == "bottles":
            self._add_bottles(tick, raw, is_due)
        elif is_due and topic == "contacts":
            self.content.contacts.append((tick, TOPICS[topic].unpack(self._bag.decode(topic, raw))))
        elif is_due and topic == "belts":
            self.content.belts.append((tick, self._bag.decode(topic, raw).actual))
        elif is_due:
            values = to_image(self._bag.decode(topic, raw)).values
            self.content.signals.append((tick, np.concatenate([values, self._variables])))

    def _add_variables(self, tick: int, raw: bytes) -> None:
        """Add the variables of a scan to the signals of its tick, which the scan has read, and to those that follow."""
        columns: VariableColumns = TOPICS[VARIABLES].unpack(self._bag.decode(VARIABLES, raw))
        now = dict(zip(columns.name, columns.value.tolist(), strict=True))
        self._variables = np.array([now.get(name, np.nan) for name in self._names])
        if self.content.signals and self.content.signals[-1][0] == tick:
            row = self.content.signals[-1][1]
            row[len(row) - len(self._variables) :] = self._variables

    def _add_bottles(self, tick: int, raw: bytes, is_due: bool) -> None:
        """Add bottles if they are due. Peak forces of skipped messages go into the next one that is due."""
        bottles: BottleColumns = TOPICS["bottles"].unpack(self._bag.decode("bottles", raw))
        if not is_due:
            self._left_out.append(bottles)
            return
        force = bottles.peak_force.copy()
        for earlier in self._left_out if len(force) else ():
            # Ids ascend; bottles that have left are not drawn.
            place = np.searchsorted(bottles.id, earlier.id).clip(max=len(force) - 1)
            there = bottles.id[place] == earlier.id
            force[place[there]] = np.fmax(force[place[there]], earlier.peak_force[there])
        self.content.bottles.append((tick, BottleColumns(**{**vars(bottles), "peak_force": force})))
        self._left_out = []


@dataclass(frozen=True)
class Detail:
    """Greatest detail in which a recording is shown: rates in Hz of simulated time."""

    bottles: float = 25.0
    contacts: float = 12.5
    belts: float = 25.0
    signals: float = 25.0
    counters: float = 0.5
    block: float = SECONDS
    """Length of a block, s."""
    story: float = math.inf
    """Length of a stretch of the story, s."""


class PageRecording:
    """Data of the page from an open bag. Raise SceneError if its scene can't be read by this version."""

    def __init__(self, bag: Bag, detail: Detail) -> None:
        self._bag = bag
        self._detail = detail
        self._tick_ns = int(bag.line.tick_ns)
        self._scene = parse_again(
            bag.line.scene_text, f"{bag.path} (recorded scene)", parse_overrides(bag.line.overrides)
        )
        self._stamps = Stamps(bag, (*DRAWN, *TOPICS_READ))
        is_ours = bag.types.get(VARIABLES) == TOPICS[VARIABLES].type
        self._variables: list[str] = next((list(one.data.name) for one in bag.read(VARIABLES)), []) if is_ours else []
        self._began = self.first = int(bag.line.tick)
        self.last = max(self.first, self._stamps.last)
        self._block_ticks = block_ticks(self._tick_ns, detail.block)

    def begin_before(self, tick: int, seconds: float) -> None:
        """Draw only the part from `seconds` before a tick on. Events are still listed from the beginning."""
        self.first = min(self.last, max(self.first, tick - round(seconds * 1e9 / self._tick_ns)))

    @property
    def name(self) -> str:
        """Name of the scene."""
        return self._scene.name

    @property
    def blocks(self) -> int:
        """Number of blocks; the first one begins at the first tick."""
        return 1 + (self.last - self.first) // self._block_ticks

    @property
    def stories(self) -> int:
        """Number of stretches of the story."""
        return 1 + math.floor((self.last - self._began) * self._tick_ns * 1e-9 / self._detail.story)

    def fullest(self) -> int:
        """Return the tick of the displayed part with the most bottles, among ticks that are evenly spaced.

        It is the first one of equals, and the first tick if no bottles were recorded. Unreadable ticks are skipped.
        """
        if not self._bag.counts.get("bottles"):
            return self.first
        count = min(_LOOKS, 1 + round((self.last - self.first) * self._tick_ns * 1e-9 / _LOOK_EVERY))
        looks = np.linspace(self.first, self.last, count).astype(np.int64).tolist()
        # The size of a message grows with the number of its bottles, so it needs no decoding.
        sizes = {}
        for look, stop in zip(looks, [*looks[1:], self.last + 1], strict=True):
            with suppress(BagError):
                _, tick, raw = next(self._stamps.messages(("bottles",), look, stop), ("", look, b""))
                sizes[tick] = len(raw)
        return max(sizes, key=lambda tick: sizes[tick], default=self.first)

    def head(self) -> dict[str, Any]:
        """Return the data of `head.head`, with the times and the numbers of blocks and stretches."""
        times = {
            "began": self._began,
            "first": self.first,
            "last": self.last,
            "block": self._block_ticks,
            "blocks": self.blocks,
            "stories": self.stories,
        }
        forced: list[int] = next((to_image(frame.data).forced.tolist() for frame in self._bag.messages("signals")), [])
        shown = head(self._bag.line, self._scene)
        shown["signals"] += self._variables
        return {**shown, "times": times, "forced": forced}

    def block(self, number: int) -> bytes:
        """Return a block, counted from 0, as `block.pack` writes it."""
        start = self.first + number * self._block_ticks
        gaps = {name: max(1, round(1e9 / getattr(self._detail, name) / self._tick_ns)) for name in DRAWN}
        collector = Collector(self._bag, start, gaps, self._variables)
        topics = (*DRAWN, VARIABLES) if self._variables else DRAWN
        for topic, tick, raw in self._stamps.messages(topics, start, min(start + self._block_ticks, self.last + 1)):
            collector.add(topic, tick, raw)
        return pack(collector.content, start)

    def story(self, number: int = 0) -> bytes:
        """Return the story of a stretch of the recording, counted from 0, as JSON (`Story`)."""
        story = Story(self._bag.time, 1.0 / self._detail.counters)
        start = stop = None
        if self.stories > 1:
            length = round(self._detail.story * 1e9 / self._tick_ns)
            start = self._began + number * length
            stop = start + length
        for topic, tick, raw in self._stamps.messages(TOPICS_READ, start, stop):
            story.add(topic, self._bag.decode(topic, raw), tick)
        return text(story.data)


def text(value: Any) -> bytes:
    """Return a value as JSON, with null for NaN and infinities."""
    return json.dumps(_clean(value), separators=(",", ":")).encode()


def _clean(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _clean(entry) for key, entry in value.items()}
    if isinstance(value, (list, tuple)):
        return [_clean(entry) for entry in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value
