"""Lockstep by two tags, for a PLC that is a client of a face: it scans, then says how far the line is to go.

The client reads the inputs of the tick `run/tick`, writes its outputs, and writes `run/target_tick` last: with it, all
that was written since the one before acts as one set, and the line goes on to that tick. `run/tick` changes only once
it is reached, and all inputs of it are in place by then. To write the same target again does nothing. So a run has the
same bits however fast either side is.
"""

from __future__ import annotations

import threading
from collections import deque
from typing import TYPE_CHECKING

from conveyor_sim.line.commands.inputs import Input, WriterKind
from conveyor_sim.line.run_state import LOCKSTEP, RUN, RunState
from conveyor_sim.protocols.tags.tag_provider import Control, SteppedTagProvider

if TYPE_CHECKING:
    from conveyor_sim.simulation import Simulation

TICK = f"{RUN}/tick"
"""Tag: the tick that all other tags are of."""

TARGET = f"{RUN}/target_tick"
"""Tag: to which a client has the line go on."""

MAY_GO_ON: tuple[WriterKind, ...] = ("controller", "test")
"""Who may say how far a line in lockstep goes."""

HANDSHAKE = "by handshake"
"""In whose lockstep such a run is, as it shows itself."""

FURTHEST = 100_000
"""Ticks that a target may be ahead."""


def problem(what: Control, value: float, tick: int) -> str:
    """Why something can't be asked of a line in lockstep that is at a tick; "" if it can."""
    if what != "target":
        return f"{what}: the line is in lockstep, expected {TARGET} alone"
    if not float(value).is_integer() or not 0 <= value <= tick + FURTHEST:
        return f"{TARGET}: {value:g} given, expected a whole number from 0 to {tick + FURTHEST}"
    return ""


class HandshakeTagProvider(SteppedTagProvider):
    """A simulation that one thread steps as far as clients have said."""

    controls: frozenset[Control] = frozenset({"target"})

    def __init__(self, simulation: Simulation) -> None:
        """From where it stands."""
        self._target = simulation.tick
        self._sets: deque[tuple[int, tuple[Input, ...]]] = deque()  # each with the tick at which it acts
        self._written = threading.Condition()
        super().__init__(simulation)

    def control(self, what: Control, value: float, by: str) -> str:
        """Take a target; one that is reached, or was given before, changes nothing."""
        if reason := problem(what, value, self._shown.tick):
            return reason
        with self._written:
            if value > self._target:
                self._sets.append((self._target, tuple(self._waiting)))
                self._waiting.clear()
                self._target = int(value)
                self._written.notify_all()
        return ""

    def take(self, patience: float) -> tuple[Input, ...] | None:
        """What acts at the present tick, once a later one is the target; None: nobody said so within so many seconds.

        By the thread that steps.
        """
        tick = self._simulation.tick
        with self._written:
            if not self._written.wait_for(lambda: self._target > tick, patience):
                return None
            return self._sets.popleft()[1] if self._sets and self._sets[0][0] <= tick else ()

    def before_tick(self) -> None:
        """Nothing: what waits is taken by `take`."""

    def after_tick(self) -> None:
        """Show the line if the target is reached; clients see no tick in between."""
        self._look()
        if self._simulation.tick >= self._target:
            self._show()
            self._listeners.tell()

    @property
    def _run(self) -> RunState:
        return RunState(LOCKSTEP, HANDSHAKE)
