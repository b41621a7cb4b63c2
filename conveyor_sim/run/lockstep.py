# SPDX-License-Identifier: Apache-2.0
"""Lockstep protocol: one owner advances the simulation to absolute ticks, and may repeat a request safely.

A request is complete: it holds its owner, target tick and commands. A repeated request therefore means that its answer
was lost, and gets the stored answer. A request that does not continue from the present tick is refused, with the
reason. No rule depends on wall time.
"""

from __future__ import annotations

import struct
from concurrent.futures import Future
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

from conveyor_sim.columns.image import Image
from conveyor_sim.errors import ConveyorError
from conveyor_sim.line.commands.inputs import DECLARE, DELETE, SET, SPAWN, CommandOutcome, Input
from conveyor_sim.support.printable import MOST, printable

if TYPE_CHECKING:
    from conveyor_sim.simulation import Simulation


LOCKSTEP = "lockstep"
"""Source of commands in lockstep."""


class SentInputs(NamedTuple):
    """Inputs that a controller sends together, as their fields."""

    alarm_ids: tuple[str, ...] = ()
    """Declared alarms."""
    alarms: tuple[str, ...] = ()
    """Their declarations, as JSON."""
    deleted: tuple[int, ...] = ()
    """Ids of the bottles to remove."""
    spawned: tuple[str, ...] = ()
    """Types of the bottles to put on the line."""
    spawn_values: tuple[float, ...] = ()
    """SPAWN_VALUES of each of these bottles."""
    names: tuple[str, ...] = ()
    """Commands and alarms."""
    values: tuple[float, ...] = ()

    def inputs(self, source: str, writer: str) -> list[Input]:
        """Return the inputs in the order in which they are applied, without empty ones."""
        rows = (
            (DECLARE, self.alarm_ids, (), self.alarms),
            (DELETE, (), self.deleted, ()),
            (SPAWN, self.spawned, self.spawn_values, ()),
            (SET, self.names, self.values, ()),
        )
        return [Input(source, writer, "controller", *row) for row in rows if any(row[1:])]

    def key(self) -> tuple[object, ...]:
        """Return a key that is equal for equal bits."""
        bits = [struct.pack(f"<{len(values)}d", *values) for values in (self.spawn_values, self.values)]
        return (*self._replace(spawn_values=(), values=()), *bits)


class Refused(ConveyorError):
    """A request that can't be carried out now. The text is the reason."""


@dataclass(frozen=True)
class LockstepRequest:
    """Request of a controller, as in Lockstep.srv."""

    run_id: str
    target_tick: int
    sent: SentInputs
    release: bool
    sim_run_id: str = ""
    released: tuple[str, ...] = ()

    def same_as(self, other: LockstepRequest | None) -> bool:
        """Return True if both are equal bit for bit, so that a request with a NaN equals its repetition."""
        # The ticks differ at every new scan, so the rest is seldom compared.
        return other is not None and self.target_tick == other.target_tick and self._key() == other._key()

    @property
    def inputs(self) -> list[Input]:
        """Inputs of the request, in the order in which they are applied."""
        return self.sent.inputs(LOCKSTEP, self.run_id)

    def _key(self) -> dict[str, object]:
        return {**vars(self), "sent": self.sent.key()}


@dataclass(frozen=True)
class LockstepAnswer:
    """State of the simulation at the target tick."""

    sim_run_id: str
    tick: int
    stamp_ns: int
    signals: Image
    state_hash: int
    outcomes: tuple[CommandOutcome, ...]
    """Command results since the last answer."""

    @staticmethod
    def of(simulation: Simulation, run: str, outcomes: tuple[CommandOutcome, ...] = ()) -> LockstepAnswer:
        """Return the present state of a simulation. run: ID of the run (Line.run_id)."""
        return LockstepAnswer(
            run, simulation.tick, simulation.stamp_ns, simulation.line.signals(), simulation.state_hash(), outcomes
        )


class Lockstep:
    """Owner of the simulation, and the answer to the last accepted request."""

    def __init__(self, max_ticks: int) -> None:
        """max_ticks: longest advance of one request."""
        self._max_ticks = max_ticks
        self._owner = ""
        self._last: LockstepRequest | None = None
        self._answer: Future[LockstepAnswer] | None = None

    @property
    def owner(self) -> str:
        """The run_id that owns the simulation; empty if there is no owner."""
        return self._owner

    def repeated(self, request: LockstepRequest) -> Future[LockstepAnswer] | None:
        """Return the answer, present or future, if a request repeats the last accepted one."""
        return self._answer if request.same_as(self._last) else None

    def accept(self, request: LockstepRequest, run: str, tick: int, last_tick: int) -> Future[LockstepAnswer]:
        """Accept a new request, and return the future of its answer.

        run: ID of the run (Line.run_id), which is at `tick` and ends at `last_tick`.

        Raises Refused.
        """
        reason = self._refusal(request, run, tick, last_tick)
        if reason:
            raise Refused(reason)
        self._owner = "" if request.release else request.run_id
        self._last = request
        self._answer = Future()
        return self._answer

    def clear(self) -> None:
        """Forget the owner and its last request after a reset."""
        self._owner, self._last, self._answer = "", None, None

    def _refusal(self, request: LockstepRequest, run: str, tick: int, last_tick: int) -> str:
        if not request.run_id:
            return "run_id is empty; expected the caller's name for its run"
        if len(request.run_id) > MOST:
            return f"run_id is {len(request.run_id)} characters long, expected at most {MOST}"
        if request.sim_run_id not in ("", run):
            return (
                f"sim_run_id {printable(request.sim_run_id)} given, but the simulation is in run {run}: it was reset, "
                "or a checkpoint was loaded"
            )
        if self._owner and request.run_id != self._owner:
            return f"the simulation is owned by run '{printable(self._owner)}'; expected its release, or a reset"
        if self._answer is not None and not self._answer.done():
            return f"the advance to tick {self._last.target_tick if self._last else tick} is still under way"
        if request.target_tick <= tick:
            return f"stale: target_tick {request.target_tick} given, expected more than the present tick {tick}"
        if request.target_tick > last_tick:
            return f"target_tick {request.target_tick} given, but the run ends at tick {last_tick}"
        if request.target_tick - tick > self._max_ticks:
            return (
                f"target_tick {request.target_tick} is {request.target_tick - tick} ticks away, "
                f"expected at most {self._max_ticks} (parameter lockstep_max_ticks)"
            )
        return ""
