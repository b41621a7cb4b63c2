"""Content of a block, selected from messages in the order of time at limited rates."""

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
"""Topics that blocks contain."""
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
