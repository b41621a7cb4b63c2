# SPDX-License-Identifier: Apache-2.0
"""Control authority of clients: checks against the latest snapshot, and ownership by clients without user names.

The checks are for immediate answers; the line checks again at the tick.
"""

from __future__ import annotations

import time
from collections.abc import Mapping
from typing import Protocol

from conveyor_sim.line.commands.authority import AUTOMATIC, IN_CONTROL, MODES, PEOPLE, advice, covers
from conveyor_sim.line.commands.inputs import DISOWN, OWN, SET, Input, WriterKind
from conveyor_sim.line.commands.receipt import Receipt, Refusal
from conveyor_sim.line.machines.packml import stops
from conveyor_sim.line.run_state import ENDED, REPLAYING, STOPPED
from conveyor_sim.line.tag import PANEL, Tag
from conveyor_sim.protocols.tags.tag_provider import Control, LineSnapshot, TagProvider

GRACE = 30.0
"""Wall time after a server restart within which the holder of the line can reconnect, s."""


class HoldingService(Protocol):
    """Decides which client holds the line. Its members are documented in `Holding`."""

    @property
    def holder(self) -> str:
        """Writer that holds the line; empty: none."""

    def judged_as(self, writer: str) -> str:
        """Return the writer name to be compared with the owner of the line."""

    def take(self, writer: str) -> str:
        """Make a writer the owner of the line from the next tick on.

        Return the reason for a refusal, "" if there is none.
        """

    def leave(self, writer: str) -> None:
        """Release the line if a writer holds it."""

    def look(self) -> None:
        """Retry a release that failed because the input queue was full."""


class Holding:
    """Ownership of the line among the clients of one protocol server. Changes are recorded as inputs.

    Modbus has no sessions and no names. So the first write of a client takes the line. The line is released when the
    connection ends or is idle for too long, so that absent clients do not block it. A restart of the protocol server
    ends all connections, but not ownership: for GRACE seconds only clients on the holder's machine can take the line
    over.
    """

    def __init__(self, source: TagProvider, protocol: str) -> None:
        """Start without a holder. protocol: source of the inputs."""
        self._source, self._protocol = source, protocol
        self._holder = ""
        self._run_id = ""  # run in which the holder took the line
        self._leaving = False
        self._away_until = 0.0  # end of the wait for the holder after a restart, s of wall time; 0: no wait

    @property
    def holder(self) -> str:
        """Writer that holds the line; empty: none."""
        return self._holder if self._run_id == self._source.snapshot.run_id else ""  # another run has no holder

    def take(self, writer: str) -> str:
        """Make a writer the owner of the line from the next tick on.

        Return the reason for a refusal, "" if there is none.
        """
        holder, snapshot = self.holder, self._source.snapshot
        if holder == writer:
            self._leaving, self._away_until = False, 0.0
            return ""
        if holder and self.judged_as(writer) == holder:
            if self._is_owner(snapshot) and (reason := self._give(holder, DISOWN)):
                return reason
            self._holder, self._away_until = "", 0.0
        elif holder:
            return f"the line is owned by controller {holder}"
        if snapshot.owner == writer:
            return ""
        if reason := self._give(writer, OWN):
            return reason
        self._holder, self._run_id, self._leaving, self._away_until = writer, snapshot.run_id, False, 0.0
        return ""

    def judged_as(self, writer: str) -> str:
        """Return the writer name to be compared with the owner of the line.

        After a restart of the protocol server it is the holder's name for each client on the holder's machine.
        """
        holder = self.holder
        return holder if holder and self._away_until and _machine(writer) == _machine(holder) else writer

    def restart(self) -> None:
        """Keep the line for the holder, whose connection has ended because the protocol server restarts."""
        if self.holder and not self._leaving and not self._away_until:
            self._away_until = time.monotonic() + GRACE

    def end(self) -> None:
        """Release the line, because the protocol server ends for good."""
        self._away_until = 0.0
        self.leave(self.holder)

    def leave(self, writer: str) -> None:
        """Release the line if a writer holds it and is not expected back after a restart."""
        if writer == self.holder and not self._away_until:
            self._leaving = True
            self.look()

    def look(self) -> None:
        """Release the line of a holder that has left, as soon as the input queue has room."""
        if self._away_until and time.monotonic() > self._away_until:
            self._leaving, self._away_until = True, 0.0
        if self._leaving and not (self.holder and self._is_owner(self._source.snapshot)):
            self._leaving, self._holder = False, ""
        if self._leaving and not self._give(self._holder, DISOWN):
            self._leaving, self._holder = False, ""

    def _is_owner(self, snapshot: LineSnapshot) -> bool:
        """Return True if the holder owns the line, or will own it after a tick unless another client was faster."""
        return snapshot.owner in ("", self._holder)

    def _give(self, writer: str, operation: str) -> str:
        return self._source.give(Input(self._protocol, writer, "controller", operation, (), ()))


def _machine(writer: str) -> str:
    """Return a writer such as "modbus 10.0.0.7:49152" without its port."""
    return writer.rpartition(":")[0]


TAKES_NO_INPUT = (ENDED, STOPPED, REPLAYING)
"""States of a run in which inputs never take effect."""

MAY_CONTROL: tuple[WriterKind, ...] = ("operator", "engineer", "test")
"""Roles that may control a run: pause, resume and so on."""


CONTROL_RANGES: Mapping[Control, tuple[float, float]] = {"step": (1.0, 2.0**32 - 1.0), "speed": (0.0, 1e6)}
"""Valid values by request: number of ticks; factor of real time, 0 for as fast as possible."""


def is_mode(tag: Tag) -> bool:
    """Return True if a tag is the control mode of a device. An authorised client changes the mode by writing it."""
    return bool(tag.device) and tag.name == f"{tag.device}/mode"


def objection(source: TagProvider, command: Tag, value: float, kind: WriterKind, writer: str) -> str:
    """Return why a command of a writer would be refused in the latest state of the line; "" if it would not."""
    if command.role == PANEL:
        return ""
    snapshot, device = source.snapshot, command.device
    if kind in PEOPLE and stops(command.name, value):
        return ""
    mode = int(snapshot.values.get(f"{device}/mode", AUTOMATIC))
    if kind not in IN_CONTROL[mode]:
        return f"{device}: is in {MODES[mode]}, {advice(kind)}"
    if kind != "controller" or snapshot.owner in ("", writer):
        return ""
    if any(covers(pattern, device, source.info.where) for pattern in snapshot.released):
        return ""
    return f"{device}: the line is owned by controller {snapshot.owner}"


def refused_for_good(source: TagProvider, receipt: Receipt, request: Input) -> Refusal | None:
    """Return why the line would refuse an input in every state; None if it might accept it.

    A refused input is still passed on if its writer may use the operation, so that the line records the refusal.
    Commands (SET) are not passed on.
    """
    refusal = receipt.refusal(request)
    # An input with commands is not passed on, because the line might accept a part of it.
    if refusal is not None and refusal.cause != "operation" and request.operation != SET:
        source.give(request)
    return refusal
