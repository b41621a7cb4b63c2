"""What a block is made of, taken from messages in the order of time, at most so many a second."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from conveyor_sim.bag.messages.encode import to_image
from conveyor_sim.bag.messages.topics import TOPICS
from conveyor_sim.bag.reader import Bag
from conveyor_sim.columns.bottles import BottleColumns
from conveyor_sim.columns.variables import VariableColumns
from conveyor_sim.page.block import BlockContent

DRAWN = ("bottles", "contacts", "belts", "signals")
"""Topics of which blocks are made."""
VARIABLES = "variables"
"""The topic of a controller's variables, which are further columns of the signals."""


class Collector:
    """Fills a BlockContent."""

    def __init__(self, bag: Bag, start: int, gaps: Mapping[str, int], variables: Sequence[str] = ()) -> None:
        """start: the block's first tick. gaps: by topic, ticks from one that is taken to the next, at least. variables:
        names of the controller's that are shown.
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
        """A message; whether it is taken depends on the ticks since the block's first, which all topics share."""
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
        """Those of a scan go with the signals of its tick, which it read, and hold until the next."""
        columns: VariableColumns = TOPICS[VARIABLES].unpack(self._bag.decode(VARIABLES, raw))
        now = dict(zip(columns.name, columns.value.tolist(), strict=True))
        self._variables = np.array([now.get(name, np.nan) for name in self._names])
        if self.content.signals and self.content.signals[-1][0] == tick:
            row = self.content.signals[-1][1]
            row[len(row) - len(self._variables) :] = self._variables

    def _add_bottles(self, tick: int, raw: bytes, is_due: bool) -> None:
        """Peak forces of those that are not taken go into the next that is."""
        bottles: BottleColumns = TOPICS["bottles"].unpack(self._bag.decode("bottles", raw))
        if not is_due:
            self._left_out.append(bottles)
            return
        force = bottles.peak_force.copy()
        for earlier in self._left_out if len(force) else ():
            # Ids ascend; those that are gone are drawn no more.
            place = np.searchsorted(bottles.id, earlier.id).clip(max=len(force) - 1)
            there = bottles.id[place] == earlier.id
            force[place[there]] = np.fmax(force[place[there]], earlier.peak_force[there])
        self.content.bottles.append((tick, BottleColumns(**{**vars(bottles), "peak_force": force})))
        self._left_out = []
