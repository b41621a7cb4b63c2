"""`Person`: an operator or an engineer at the line of a scenario, who does between two ticks what a panel allows."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from conveyor_sim.errors import CommandError
from conveyor_sim.line.commands.authority import MODES
from conveyor_sim.line.commands.inputs import FORCE, MODE, SET, UNFORCE, Input, WriterKind

NUMBERS = {text.lower(): number for number, text in MODES.items()}
"""Of modes, by their names."""


class Person:
    """What one does takes effect at the next tick. Each method raises CommandError if it would be refused then."""

    def __init__(self, source: str, kind: WriterKind, give: Callable[[Input], None]) -> None:
        """source: of the inputs. kind: of writer, and the name. give: takes an input, raises CommandError."""
        self._source = source
        self._kind = kind
        self._give = give

    def set(self, name: str, value: float) -> None:
        """Give a command, of a device that is in the person's hands."""
        self.operate(SET, [name], [value])

    def mode(self, device: str, mode: int | str) -> None:
        """Put a device ("belts/table") into a mode, by its number or as "automatic", "maintenance" or "manual"."""
        if isinstance(mode, str):
            if mode not in NUMBERS:
                raise CommandError(f"{device}: mode {mode!r} given, expected one of {', '.join(NUMBERS)}")
            mode = NUMBERS[mode]
        self.operate(MODE, [device], [mode])

    def force(self, signal: str, value: float) -> None:
        """Have controllers read this value of a signal, whatever the line has, until it is unforced."""
        self.operate(FORCE, [signal], [value])

    def unforce(self, *signals: str) -> None:
        """Have them read what the line has again; without names: of all signals."""
        self.operate(UNFORCE, signals)

    def acknowledge(self, *alarms: str) -> None:
        """Acknowledge alarms, by their ids; without: all that wait to be."""
        self.operate("acknowledge", alarms)

    def reset(self, *alarms: str) -> None:
        """Clear alarms that have latched and whose condition is gone, by their ids; without: all of them."""
        self.operate("reset", alarms)

    def shelve(self, alarm: str, seconds: float = 0.0) -> None:
        """Shelve an alarm for so long; 0: until its condition ends next."""
        self.operate("shelve", [alarm], [seconds])

    def unshelve(self, *alarms: str) -> None:
        """Take alarms off the shelf; without: all."""
        self.operate("unshelve", alarms)

    def reset_counters(self, *devices: str) -> None:
        """Have the counters and times of devices begin anew; without: of all."""
        self.operate("reset_counters", devices)

    def operate(
        self, operation: str, names: Sequence[str] = (), values: Sequence[float] = (), texts: Sequence[str] = ()
    ) -> None:
        """Use any operation of the line, as the service `operate` does."""
        self._give(Input(self._source, self._kind, self._kind, operation, tuple(names), tuple(values), tuple(texts)))
