# SPDX-License-Identifier: Apache-2.0
"""`AlarmChanges`: alarms of a controller, given to the line with its commands when they change."""

from __future__ import annotations

from collections.abc import Mapping

from conveyor_sim.control.scan import ON, alarm_names, commands_of, number


class AlarmChanges:
    """Alarms of a controller to be sent to the line: all alarms of the first scan, then only changes."""

    def __init__(self) -> None:
        """Start without alarms."""
        self._raised: dict[str, float] = {}

    def of(self, answer: Mapping[str, float]) -> dict[str, float]:
        """Return alarms that a scan raises (1) or clears (0). Alarms missing in its answer are cleared.

        Raises ControlError for a value that is no number.
        """
        names = alarm_names(tuple(answer))
        if not (names or self._raised):
            return {}
        alarms = {name: float(number(name, answer[name]) >= ON) for name in names}
        now = {**dict.fromkeys(self._raised, 0.0), **alarms}
        changes = {name: value for name, value in now.items() if self._raised.get(name) != value}
        self._raised = now
        return changes

    def with_commands(self, answer: Mapping[str, float]) -> dict[str, float]:
        """Return the commands of the answer of a scan, then the alarms that change. Raise ControlError as `of`."""
        return commands_of(answer) | self.of(answer)

    def snapshot(self) -> dict[str, float]:
        """Return the alarms given so far."""
        return dict(self._raised)

    def restore(self, raised: Mapping[str, float]) -> None:
        """Continue from a snapshot."""
        self._raised = {str(name): float(value) for name, value in raised.items()}
