"""`EventLog`: events on a line between two ticks."""

import math
from collections.abc import Sequence

from conveyor_sim.columns.events import Event, Kind
from conveyor_sim.line.commands.inputs import INJECT, CommandOutcome
from conveyor_sim.line.device import Device, ScanContext
from conveyor_sim.scene.types import Unchecked
from conveyor_sim.support.printable import printable


class EventLog:
    """Collects events since the last tick, in order. Public attributes are stored in checkpoints."""

    events: list[tuple[int, str, str, int, Unchecked, str]]
    """Events since the last tick, as fields of Event."""
    bottles: dict[str, int]
    """Number of bottles that each device has put onto the line or taken off it so far."""
    states: dict[str, list[Unchecked]]
    """States of machines at the end of the last tick, by device."""

    def __init__(self, devices: Sequence[Device], now: ScanContext) -> None:
        """Start without events.

        now: at the start, with the initial states of machines.
        """
        self._machines = [
            (device.name, device, states)
            for device in devices
            if (states := [signal for signal in device.signals if signal.adds_to == "state"])
        ]
        self.events = []
        self.total = 0
        """Number of events so far."""
        self.bottles = {device.name: 0 for device in devices}
        self.states = {name: [float(value) for value in device.states(now)] for name, device, _ in self._machines}

    def begin(self) -> None:
        """Start a tick without events."""
        self.events = []

    def note(self, at: int, kind: Kind, name: str, value: float, bottle: int = -1, text: str = "") -> None:
        """Add an event."""
        self.events.append(Event(at, kind, name, bottle, value, text))
        self.total += 1

    def note_outcome(self, outcome: CommandOutcome) -> None:
        """Add the event of a refused input, or of a fault."""
        at, names, values = outcome.tick, outcome.names, outcome.values
        if outcome.repeated:
            return
        if not outcome.accepted:
            value = values[0] if len(names) == len(values) == 1 else math.nan
            self.note(at, "command_refused", printable(", ".join(names)), value, text=outcome.reason)
        elif outcome.operation == INJECT:
            self.note(at, "fault_injected" if values[0] else "fault_cleared", names[0], values[0])

    def note_alarm(self, at: int, kind: Kind, name: str, value: float, text: str) -> None:
        """Add an event of an alarm."""
        self.note(at, kind, name, value, text=text)

    def note_removed(self, device: Device, bottles: Sequence[int], now: ScanContext) -> None:
        """Add events of bottles that a device has taken, by their ids."""
        rejects = any(signal.adds_to == "rejected" for signal in device.signals)
        self._note_bottles("bottle_rejected" if rejects else "bottle_removed", device, sorted(bottles), now)

    def note_fed(self, device: Device, first: int, now: ScanContext) -> None:
        """Add events of bottles that a device has fed.

        first: ID of the first bottle that was fed.
        """
        self._note_bottles("bottle_fed", device, range(first, now.state.next_id), now)

    def note_states(self, now: ScanContext) -> None:
        """Add events of changed states at the end of a tick."""
        stored = self.states
        for name, device, states in self._machines:
            before, present = stored[name], device.states(now)
            if before != present:
                stored[name] = [float(value) for value in present]
                for state, old, value in zip(states, before, present, strict=True):
                    if old != value:
                        text = state.texts.get(int(value), "")
                        self.note(now.tick, "machine_state", state.name, float(value), text=text)

    def _note_bottles(self, kind: Kind, device: Device, bottles: Sequence[int], now: ScanContext) -> None:
        for bottle in bottles:
            self.bottles[device.name] += 1
            self.note(now.tick, kind, device.name, float(self.bottles[device.name]), bottle)
