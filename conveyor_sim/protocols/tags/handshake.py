# SPDX-License-Identifier: Apache-2.0
"""Lockstep by two tags, for a PLC that is a client of a protocol server.

The client reads the inputs of tick `run/tick`, writes its outputs, and writes `run/target_tick` last. All writes since
the previous target then act as one set, and the line advances to the target. `run/tick` changes only at the target,
when all inputs of that tick are available. Writing the same target again has no effect. So runs are bit-identical
regardless of the speed of either side.
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
"""Tag: tick of the values of all other tags."""

TARGET = f"{RUN}/target_tick"
"""Tag: tick to which the line advances."""

MAY_GO_ON: tuple[WriterKind, ...] = ("controller", "test")
"""Roles that may write the target of a line in lockstep."""

HANDSHAKE = "by handshake"
"""Owner of the lockstep as the run state shows it."""

FURTHEST = 100_000
"""Largest number of ticks from the present tick to a target."""


def problem(what: Control, value: float, tick: int) -> str:
    """Return why a request can't be made of a line in lockstep at a tick; "" if it can."""
    if what != "target":
        return f"{what}: the line is in lockstep, expected only {TARGET}"
    if not float(value).is_integer() or not 0 <= value <= tick + FURTHEST:
        return f"{TARGET}: {value:g} given, expected a whole number from 0 to {tick + FURTHEST}"
    return ""


class HandshakeTagProvider(SteppedTagProvider):
    """Tag provider of a simulation that one thread steps up to the target of the clients."""

    controls: frozenset[Control] = frozenset({"target"})

    def __init__(self, simulation: Simulation) -> None:
        """Start at the present tick."""
        self._target = simulation.tick
        self._sets: deque[tuple[int, tuple[Input, ...]]] = deque()  # sets of inputs with their ticks
        self._written = threading.Condition()
        super().__init__(simulation)

    def control(self, what: Control, value: float, by: str) -> str:
        """Set the target. A target that was reached or set before has no effect."""
        if reason := problem(what, value, self._snapshot.tick):
            return reason
        with self._written:
            if value > self._target:
                self._sets.append((self._target, tuple(self._waiting)))
                self._waiting.clear()
                self._target = int(value)
                self._written.notify_all()
        return ""

    def take(self, patience: float) -> tuple[Input, ...] | None:
        """Wait for a target beyond the present tick; return the inputs for the present tick, None after `patience` s.

        Called by the stepping thread.
        """
        tick = self._simulation.tick
        with self._written:
            if not self._written.wait_for(lambda: self._target > tick, patience):
                return None
            return self._sets.popleft()[1] if self._sets and self._sets[0][0] <= tick else ()

    def before_tick(self) -> None:
        """Do nothing: `take` returns the waiting inputs."""

    def after_tick(self) -> None:
        """Take a snapshot at the target only; clients see no tick in between."""
        self._look()
        if self._simulation.tick >= self._target:
            self._show()
            self._listeners.tell()

    @property
    def _run(self) -> RunState:
        return RunState(LOCKSTEP, HANDSHAKE)
