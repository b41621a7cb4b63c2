"""`EventLog`: what happens on a line, from one tick to the next."""

import math
from collections.abc import Sequence

from conveyor_sim.columns.events import Event, Kind
from conveyor_sim.line.commands.inputs import INJECT, CommandOutcome
from conveyor_sim.line.device import Device, ScanContext
from conveyor_sim.scene.types import Unchecked
from conveyor_sim.support.printable import printable


class EventLog:
    """Keeps what happened since the last tick, in order. Public attributes are remembered in checkpoints."""

    events: list[tuple[int, str, str, int, Unchecked, str]]
    """Since the tick before, as Event has them."""
    bottles: dict[str, int]
    """By device, how many it has put onto the line or taken off it so far."""
    states: dict[str, list[Unchecked]]
    """Of machines, by device, at the end of the last tick."""

    def __init__(self, devices: Sequence[Device], now: ScanContext) -> None:
        """now: at the start, with the states that machines have at first."""
        # Each machine with its states.
        self._machines = [
            (device.name, device, states)
            for device in devices
            if (states := [signal for signal in device.signals if signal.adds_to == "state"])
        ]
        self.events = []
        self.total = 0
        """Events so far."""
        self.bottles = {device.name: 0 for device in devices}
        self.states = {name: [float(value) for value in device.states(now)] for name, device, _ in self._machines}

    def begin(self) -> None:
        """A tick begins."""
        self.events = []

    def note(self, at: int, kind: Kind, name: str, value: float, bottle: int = -1, text: str = "") -> None:
        """Something has happened."""
        self.events.append(Event(at, kind, name, bottle, value, text))
        self.total += 1

    def note_outcome(self, outcome: CommandOutcome) -> None:
        """An input was applied or refused as a tick began."""
        at, names, values = outcome.tick, outcome.names, outcome.values
        if outcome.repeated:
            return
        if not outcome.accepted:
            value = values[0] if len(names) == len(values) == 1 else math.nan
            self.note(at, "command_refused", printable(", ".join(names)), value, text=outcome.reason)
        elif outcome.operation == INJECT:
            self.note(at, "fault_injected" if values[0] else "fault_cleared", names[0], values[0])

    def note_alarm(self, at: int, kind: Kind, name: str, value: float, text: str) -> None:
        """Something has happened to an alarm."""
        self.note(at, kind, name, value, text=text)

    def note_removed(self, device: Device, bottles: Sequence[int], now: ScanContext) -> None:
        """A device has taken bottles, by their ids."""
        rejects = any(signal.adds_to == "rejected" for signal in device.signals)
        self._note_bottles("bottle_rejected" if rejects else "bottle_removed", device, sorted(bottles), now)

    def note_fed(self, device: Device, first: int, now: ScanContext) -> None:
        """A device may have given bottles. first: id of the next one before."""
        self._note_bottles("bottle_fed", device, range(first, now.state.next_id), now)

    def note_states(self, now: ScanContext) -> None:
        """A tick has ended."""
        kept = self.states
        for name, device, states in self._machines:
            before, present = kept[name], device.states(now)
            if before != present:
                kept[name] = [float(value) for value in present]
                for state, old, value in zip(states, before, present, strict=True):
                    if old != value:
                        text = state.texts.get(int(value), "")
                        self.note(now.tick, "machine_state", state.name, float(value), text=text)

    def _note_bottles(self, kind: Kind, device: Device, bottles: Sequence[int], now: ScanContext) -> None:
        for bottle in bottles:
            self.bottles[device.name] += 1
            self.note(now.tick, kind, device.name, float(self.bottles[device.name]), bottle)
