# SPDX-License-Identifier: Apache-2.0
"""Commands by which machines stay stopped after a failure or a planned stop is over, from the recorded read-back.

The signal `stop_reason` keeps a failure as the reason for a stop, also if the machine is commanded to stop meanwhile.
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Sequence

from conveyor_sim.bag.messages.topics import TOPICS
from conveyor_sim.bag.reader import Bag
from conveyor_sim.line.machines.packml import Command
from conveyor_sim.report.periods import Period

_STOP = {"run": (0.0, "command run"), "cntrl_cmd": (float(Command.STOP), "command Stop")}
"""By command: value that stops the machine, and its stop reason."""


class CommandedStops:
    """Times at which the commands of machines demand a stop."""

    def __init__(self, bag: Bag, machines: Sequence[str]) -> None:
        """Read the read-back of the machines' commands; a recording without it has none."""
        self._changes: dict[str, list[tuple[float, str]]] = {machine: [] for machine in machines}
        if bag.types.get("readback") != TOPICS["readback"].type:
            return
        places = {name: place for place, name in enumerate(bag.line.command_names)}
        for frame in bag.read("readback"):
            for machine, changes in self._changes.items():
                reason = ""
                for command, (value, text) in _STOP.items():
                    place = places.get(f"{machine}/{command}")
                    if not reason and place is not None and frame.data.value[place] == value:
                        reason = text
                if reason != (changes[-1][1] if changes else ""):
                    changes.append((frame.time, reason))

    def applied(self, period: Period) -> list[Period]:
        """Return the parts of a period, with the reason of each.

        A machine that is idle after a failure, and commanded to stop, stands for the command.
        """
        changes = self._changes.get(period.machine, [])
        if not changes or not period.is_after:
            return [period]
        first = bisect_right(changes, period.begin, key=lambda change: change[0])
        within = [change for change in changes[first:] if change[0] < period.end]
        at = [(period.begin, changes[first - 1][1] if first else ""), *within]
        ends = [*(begin for begin, _ in within), period.end]
        return [
            period._replace(begin=begin, end=end, reason=reason or period.reason)
            for (begin, reason), end in zip(at, ends, strict=True)
        ]
