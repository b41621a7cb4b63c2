"""`PanelUser`: an operator or an engineer at the line of a scenario, who uses its panel between two ticks."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from conveyor_sim.errors import CommandError
from conveyor_sim.line.commands.authority import MODES
from conveyor_sim.line.commands.inputs import FORCE, MODE, SET, UNFORCE, Input, WriterKind

NUMBERS = {text.lower(): number for number, text in MODES.items()}
"""Numbers of the modes, by name."""


class PanelUser:
    """An operator or engineer. Operations act at the next tick; CommandError is raised if it would refuse them."""

    def __init__(self, source: str, kind: WriterKind, give: Callable[[Input], None]) -> None:
        """source: of the inputs. kind: kind and name of the writer. give: takes an input, or raises CommandError."""
        self._source = source
        self._kind = kind
        self._give = give

    def set(self, name: str, value: float) -> None:
        """Give a command to a device that the person controls."""
        self.operate(SET, [name], [value])

    def mode(self, device: str, mode: int | str) -> None:
        """Set the mode of a device ("belts/table"), by number or as "automatic", "maintenance" or "manual"."""
        if isinstance(mode, str):
            if mode not in NUMBERS:
                raise CommandError(f"{device}: mode {mode!r} given, expected one of {', '.join(NUMBERS)}")
            mode = NUMBERS[mode]
        self.operate(MODE, [device], [mode])

    def force(self, signal: str, value: float) -> None:
        """Force a signal: controllers read this value until the signal is unforced."""
        self.operate(FORCE, [signal], [value])

    def unforce(self, *signals: str) -> None:
        """Unforce signals; without names: all signals."""
        self.operate(UNFORCE, signals)

    def acknowledge(self, *alarms: str) -> None:
        """Acknowledge alarms by ID; without IDs: all unacknowledged alarms."""
        self.operate("acknowledge", alarms)

    def reset(self, *alarms: str) -> None:
        """Reset latched alarms whose condition has ended, by ID; without IDs: all of them."""
        self.operate("reset", alarms)

    def shelve(self, alarm: str, seconds: float = 0.0) -> None:
        """Shelve an alarm for `seconds`; 0: until its condition ends next."""
        self.operate("shelve", [alarm], [seconds])

    def unshelve(self, *alarms: str) -> None:
        """Unshelve alarms by ID; without IDs: all."""
        self.operate("unshelve", alarms)

    def reset_counters(self, *devices: str) -> None:
        """Reset the counters and times of devices; without names: of all devices."""
        self.operate("reset_counters", devices)

    def operate(
        self, operation: str, names: Sequence[str] = (), values: Sequence[float] = (), texts: Sequence[str] = ()
    ) -> None:
        """Give any operation of the line, like the service `operate`."""
        self._give(Input(self._source, self._kind, self._kind, operation, tuple(names), tuple(values), tuple(texts)))
