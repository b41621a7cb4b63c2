"""`Holding`: ownership of the line among clients that have no names.

Modbus has no sessions and no names. So the first write of a client takes the line. The line is released when the
connection ends or is idle for too long, so that absent clients do not block it. A restart of the protocol server ends
all connections, but not ownership: for GRACE seconds only clients on the holder's machine can take the line over.
"""

from __future__ import annotations

import time
from typing import Protocol

from conveyor_sim.line.commands.inputs import DISOWN, OWN, Input
from conveyor_sim.protocols.tags.tag_provider import LineSnapshot, TagProvider

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
    """Ownership of the line among the clients of one protocol server. Changes are recorded as inputs."""

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
