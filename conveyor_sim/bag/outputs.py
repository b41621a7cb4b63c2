# SPDX-License-Identifier: Apache-2.0
"""Messages of a simulation: each topic at its ticks, serialized once for all sinks that want it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from conveyor_sim.bag.messages.encode import Header
from conveyor_sim.bag.messages.topics import OUTPUTS, TOPICS, Snapshot, Topic
from conveyor_sim.columns.variables import VariableColumns

if TYPE_CHECKING:
    from conveyor_sim.columns.events import GuardEvent
    from conveyor_sim.line.commands.inputs import CommandOutcome
    from conveyor_sim.line.run_state import RunState
    from conveyor_sim.simulation import Simulation


_EVENTS = [(name, topic, topic.events) for name, topic in OUTPUTS.items() if topic.events is not None]
_STATES = [(topic, topic.state) for topic in OUTPUTS.values() if topic.state is not None and not topic.once]


class MessageSink(Protocol):
    """Receiver of serialized messages: the recorder, a node's publishers."""

    def wants(self, topic: str) -> bool:
        """Return True if a message of this topic would be used now. Messages that no sink wants are not computed."""

    def write(self, topic: str, data: bytes, stamp_ns: int) -> None:
        """Take one message, with its simulated time in ns."""


class OutputWriter:
    """Writer of a simulation's messages to sinks: call `start` once, then `after_tick` after every single tick."""

    def __init__(self, sim: Simulation, sinks: Sequence[MessageSink], *, run_id: str, frame_id: str = "world") -> None:
        self._sim = sim
        self._sinks = sinks
        self._run_id = run_id
        self._frame_id = frame_id
        self._noticed: list[GuardEvent] = []
        self._eyes: dict[str, bool] = {}
        self._run: RunState | None = None

    def start(self) -> None:
        """Write the latched topics (line, plant) and the state at the present tick."""
        header, now = self._header(self._sim.tick), Snapshot(self._sim, self._run_id)
        for topic in OUTPUTS.values():
            if topic.state is not None and topic.once:
                self._hand_out(topic.name, topic, header, topic.state, now)
        self._write_state()

    def after_tick(self) -> list[CommandOutcome]:
        """Write the results of the tick's commands, then every topic that is due. Return the command results."""
        outcomes = self.after_failure()
        self._write_state()
        return outcomes

    def after_failure(self) -> list[CommandOutcome]:
        """Write the events of a tick, also of one that failed: command results, guard reports, exceeded limits."""
        events = self._sim.take_events()
        for name, topic, view in _EVENTS:
            for event in view(events) if self._sinks else ():
                self._hand_out(name, topic, self._header(event.tick), _itself, event)
        self._noticed += events.guard
        return events.outcomes

    def take_noticed(self) -> list[GuardEvent]:
        """Return the reports of the guard since the last call, which have been written."""
        noticed, self._noticed = self._noticed, []
        return noticed

    def tell(self, outcome: CommandOutcome) -> None:
        """Write a command result that belongs to no tick."""
        self._hand_out("outcomes", OUTPUTS["outcomes"], self._header(outcome.tick), _itself, outcome)

    def show_run(self, run: RunState) -> None:
        """Write the state of the run if it has changed."""
        if run != self._run:
            self._run = run
            self._hand_out("run_state", OUTPUTS["run_state"], self._header(self._sim.tick), _itself, run)

    def show_variables(self, names: Sequence[str], values: Sequence[float]) -> None:
        """Write a controller's variables after its scan at the present tick, if any are recorded."""
        if names:
            columns = VariableColumns(names, np.asarray(values, np.float64))
            self._hand_out("variables", OUTPUTS["variables"], self._header(self._sim.tick), _itself, columns)

    def _write_eyes(self) -> None:
        eyes, row = self._sim.line.photo_eyes(), TOPICS["photo_eyes/<eye>"]
        for name, blocked in eyes.items():
            if self._eyes.get(name) is not blocked:
                self._hand_out(name, row, self._header(self._sim.tick), _itself, blocked)
        self._eyes = eyes

    def _write_state(self) -> None:
        if not self._sinks:
            return
        self._write_eyes()
        header, now = self._header(self._sim.tick), Snapshot(self._sim, self._run_id)
        for topic, state in _STATES:
            if topic.rate is None or self._sim.due(topic.rate):
                self._hand_out(topic.name, topic, header, state, now)

    def _hand_out(self, name: str, topic: Topic, header: Header, observe: Callable[[Any], Any], source: Any) -> None:
        """Write the observation of a source, if any sink wants the topic and there is an observation."""
        receivers = [sink for sink in self._sinks if sink.wants(name)]
        if receivers and (observation := observe(source)) is not None:
            data = topic.pack(observation, header)
            for sink in receivers:
                sink.write(name, data, header.stamp_ns)

    def _header(self, tick: int) -> Header:
        # ROS reads a stamp of 0 as "not set", so tick 0 is stamped 1 ns, as Simulation.stamp_ns does.
        return Header(tick, max(1, tick * self._sim.model.tick_ns), self._frame_id)


def _itself(source: Any) -> Any:
    return source
