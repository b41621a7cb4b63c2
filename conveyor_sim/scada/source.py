"""`TagSource`: what a SCADA face knows of a line, wherever that runs; and the source that a stepped simulation is."""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol

from conveyor_sim.line.inputs import Input
from conveyor_sim.line.tag import Tag

if TYPE_CHECKING:
    from conveyor_sim.simulation import Simulation

MODBUS = "modbus"
"""Source of inputs that come by Modbus."""

FACES = (MODBUS,)
"""Sources of inputs that SCADA clients give."""

MOST_WAITING = 1000
"""Inputs that wait for a tick at once, from all clients of all faces."""


@dataclass(frozen=True)
class Shown:
    """A line at one tick. It never changes, so any thread may read it."""

    tick: int
    values: Mapping[str, float]
    """Of all signals, and of all commands as they are in force, by name."""


class TagSource(Protocol):
    """Tags with their values, and a way in for inputs. Its methods may be called from any thread."""

    @property
    def tags(self) -> Sequence[Tag]:
        """All tags of the line, in the order of its process image."""

    @property
    def shown(self) -> Shown:
        """The line as it was last."""

    def give(self, given: Input) -> str:
        """Have an input judged and applied as the next tick begins. Why it can't wait for that, "" if it does."""


class TickSource:
    """A simulation that one thread steps, as a source.

    That thread hands over the inputs before a tick, and takes a copy of the line after it.
    """

    def __init__(self, simulation: Simulation) -> None:
        """Shows it as it is."""
        self._simulation = simulation
        self._waiting: deque[Input] = deque()
        image = simulation.process_image
        self._names = (*image.signal_names, *image.command_names)
        self.after_tick()

    @property
    def tags(self) -> Sequence[Tag]:
        """All tags of the line, in the order of its process image."""
        return self._simulation.process_image.tags

    @property
    def shown(self) -> Shown:
        """The line as it was at the end of the last tick."""
        return self._shown

    def give(self, given: Input) -> str:
        """Have an input judged and applied as the next tick begins. Why it can't wait for that, "" if it does."""
        if len(self._waiting) >= MOST_WAITING:
            return f"{MOST_WAITING} inputs wait for the next tick already"
        self._waiting.append(given)
        return ""

    def before_tick(self) -> None:
        """Hand over what waits. By the thread that steps."""
        for _ in range(len(self._waiting)):
            self._simulation.give(self._waiting.popleft())

    def after_tick(self) -> None:
        """Show the line as it is now. By the thread that steps."""
        simulation = self._simulation
        values = [*simulation.signals().tolist(), *simulation.line.read_back.values]
        self._shown = Shown(simulation.tick, dict(zip(self._names, values, strict=True)))
