"""`Serving`: the faces of one source, in a thread of their own, and what is told of them."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import AbstractContextManager
from typing import Any

from conveyor_sim.scada.face import HERE, Face, Settings, Status
from conveyor_sim.scada.faces import Kind
from conveyor_sim.scada.server_thread import ServerThread
from conveyor_sim.scada.source import TagSource


class Serving(AbstractContextManager["Serving"]):
    """Serves from the start to close()."""

    def __init__(self, source: TagSource, chosen: Sequence[tuple[Kind, Any]], settings: Settings) -> None:
        """chosen: protocols and their ports, 0 for any that is free; of MQTT the URL of the broker.

        Raises ConveyorError, in one sentence, if one of them can't be served; then none is.
        """
        self._source, self._settings = source, settings
        self._kinds = [kind for kind, _ in chosen]
        self._faces: list[Face] = []
        self._thread = ServerThread()
        try:
            for kind, place in chosen:
                kind.require()
                face = kind.make(source, place, settings)
                self._thread.run(face.start())
                self._faces.append(face)
        except BaseException:
            self.close()
            raise

    @property
    def faces(self) -> Sequence[Face]:
        """All of them, in the order in which they were chosen."""
        return self._faces

    @property
    def greeting(self) -> list[str]:
        """A sentence for each: where clients find it, and what they can do there."""
        whoever = "clients" if self._settings.host == HERE else "whoever reaches this machine there"
        pairs = zip(self._kinds, self._faces, strict=True)
        return [f"{face.address}: {kind.whoever or whoever} can {kind.exposes(self._settings)}" for kind, face in pairs]

    def progress(self) -> str:
        """How the line and its faces are, in one line."""
        shown = self._source.shown
        state = f"lost: {shown.lost}" if shown.lost else shown.run.text
        return " | ".join([f"{self._time:.1f} s {state}", *(_told(*one) for one in self._statuses())])

    def summary(self) -> str:
        """What has been served, in one line."""
        counts = [f"{name} {_writes(status)}" for name, status in self._statuses()]
        return f"served up to {self._time:g} s; {', '.join(counts)}"

    def latencies(self) -> dict[str, float]:
        """s of wall time by protocol, the longest since somebody asked."""
        return {name: status.latency for name, status in self._statuses()}

    def close(self) -> None:
        """End all of them."""
        for face in self._faces:
            self._thread.run(face.stop())
        self._thread.close()

    def __exit__(self, *_: object) -> None:
        self.close()

    @property
    def _time(self) -> float:
        return self._source.shown.tick * self._source.about.tick

    def _statuses(self) -> list[tuple[str, Status]]:
        async def ask() -> list[Status]:
            return [face.status() for face in self._faces]

        return [(kind.name, status) for kind, status in zip(self._kinds, self._thread.run(ask()), strict=True)]


def _told(name: str, status: Status) -> str:
    subscriptions = f", {_many(status.subscriptions, 'subscription')}" if status.subscriptions else ""
    left_out = f", {_many(status.left_out, 'tick')} left out" if status.left_out else ""
    clients = status.state or f"{_many(status.clients, 'client')}{subscriptions}"
    return f"{name}: {clients}, {_writes(status)}, {status.latency * 1e3:.1f} ms{left_out}"


def _many(count: int, what: str) -> str:
    return f"{count} {what}" if count == 1 else f"{count} {what}s"


def _writes(status: Status) -> str:
    return f"{status.writes} written, {status.refused} refused"
