"""`Holding`: which of several clients that nobody knows by name is the controller of the line.

Modbus has no sessions and no names. So the first write of a client takes the line, and the end of its connection gives
it up, or its silence: a line that a client left behind must not be nobody's for ever.
"""

from __future__ import annotations

from conveyor_sim.line.inputs import DISOWN, OWN, Input
from conveyor_sim.scada.source import Shown, TagSource


class Holding:
    """Whose the line is, as far as the clients of one face are concerned. What changes is on record as inputs are."""

    def __init__(self, source: TagSource, face: str) -> None:
        """face: source of the inputs."""
        self._source, self._face = source, face
        self._holder = ""
        self._run_id = ""  # in which it took the line
        self._leaving = False

    @property
    def holder(self) -> str:
        """Who holds it; empty: nobody."""
        return self._holder if self._run_id == self._source.shown.run_id else ""  # another run is nobody's

    def take(self, writer: str) -> str:
        """Have the line be a writer's, from the next tick on. Why that can't be, "" if it is or will be."""
        holder, shown = self.holder, self._source.shown
        if holder == writer:
            self._leaving = False
            return ""
        if holder:
            return f"the line is owned by controller {holder}"
        if shown.owner == writer:
            return ""
        if reason := self._give(writer, OWN):
            return reason
        self._holder, self._run_id, self._leaving = writer, shown.run_id, False
        return ""

    def leave(self, writer: str) -> None:
        """Have a writer give it up, if it is its own."""
        if writer == self.holder:
            self._leaving = True
            self.look()

    def look(self) -> None:
        """Whoever is to give it up does so, as soon as there is room for that among the inputs."""
        if self._leaving and not (self.holder and self._is_owner(self._source.shown)):
            self._leaving, self._holder = False, ""
        if self._leaving and not self._give(self._holder, DISOWN):
            self._leaving, self._holder = False, ""

    def _is_owner(self, shown: Shown) -> bool:
        """Whether the line is its own, or will be once a tick passes; another may have been faster."""
        return shown.owner in ("", self._holder)

    def _give(self, writer: str, operation: str) -> str:
        return self._source.give(Input(self._face, writer, "controller", operation, (), ()))
