# SPDX-License-Identifier: Apache-2.0
"""Commands by which machines stay stopped after a failure or a planned stop is over, from the recorded read-back.

The signal `stop_reason` keeps a failure as the reason for a stop, also if the machine is commanded to stop meanwhile.
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Callable, Mapping, Sequence
from itertools import groupby
from operator import itemgetter

from conveyor_sim.line.machines.packml import Command
from conveyor_sim.report.command_changes import Change
from conveyor_sim.report.periods import Period

STOP = {"run": (0.0, "command run"), "cntrl_cmd": (float(Command.STOP), "command Stop")}
"""By command: value that stops the machine, and its stop reason."""


class CommandedStops:
    """Times at which the commands of machines demand a stop."""

    def __init__(
        self, machines: Sequence[str], changes: Mapping[str, Sequence[Change]], time: Callable[[int], float]
    ) -> None:
        """Derive them from the changes of the commands in STOP, by name. time: returns the time of a tick, s."""
        self._changes: dict[str, list[tuple[float, str]]] = {machine: [] for machine in machines}
        for machine, reasons in self._changes.items():
            own = [
                (tick, command, value) for command in STOP for tick, value in changes.get(f"{machine}/{command}", ())
            ]
            values: dict[str, float] = {}
            for tick, together in groupby(sorted(own, key=itemgetter(0)), key=itemgetter(0)):
                values |= {command: value for _, command, value in together}
                reason = next((text for command, (value, text) in STOP.items() if values.get(command) == value), "")
                if reason != (reasons[-1][1] if reasons else ""):
                    reasons.append((time(tick + 1), reason))  # states are reported at the end of a scan

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
