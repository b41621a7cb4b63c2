# SPDX-License-Identifier: Apache-2.0
"""`HostCommands`: commands of Sparkplug hosts by NCMD and DCMD, checked at once and passed on as inputs.

Commands do not name their users, and Sparkplug has no answers. All clients that the broker lets publish can command, in
the role of the edge node. Metrics of the edge node report the results.
"""

from __future__ import annotations

import time
from collections.abc import Mapping
from typing import Any

from conveyor_sim.line.commands.inputs import MODE, SET, Input, WriterKind
from conveyor_sim.line.commands.receipt import Receipt
from conveyor_sim.line.tag import COMMANDS, Tag
from conveyor_sim.protocols.mqtt.line_metrics import decoded, number_of
from conveyor_sim.protocols.tags.control_mode import (
    TAKES_NO_INPUT,
    Holding,
    HoldingService,
    is_mode,
    objection,
    refused_for_good,
)
from conveyor_sim.protocols.tags.held_buttons import HeldButtons
from conveyor_sim.protocols.tags.tag_provider import MQTT, TagProvider
from conveyor_sim.support.printable import SENTENCE, printable

REBIRTH = "Node Control/Rebirth"
"""Metric of the edge node that requests all births again."""

MOST_METRICS = 1000
"""Largest number of metrics in a command."""

SILENCE = 30.0
"""Wall time without a command after which controllers release the line, s."""


class HostCommands:
    """Commands of all hosts for one tag provider, by one broker."""

    def __init__(
        self,
        source: TagProvider,
        role: WriterKind | None,
        broker: str,
        silence: float = SILENCE,
        holding: HoldingService | None = None,
    ) -> None:
        """Prepare the commands. role: role in which hosts command; None: they may not. broker: its address, for
        recorded inputs.
        holding: decides whether hosts hold the line; None: a new one.
        """
        self._source, self._role, self._silence = source, role, silence
        self._writer = f"{MQTT} {broker}"
        self._receipt = Receipt(source.info.tags, source.info.where)
        self._holding = holding or Holding(source, MQTT)
        self._held = HeldButtons(source)
        self._last = 0.0  # wall time of the latest accepted command, s
        self._commands: Mapping[str, Tag] = {tag.name: tag for tag in source.info.tags if tag.role in COMMANDS}
        self._modes: Mapping[str, Tag] = {tag.name: tag for tag in source.info.tags if is_mode(tag)}
        self.before = (0, 0)
        """Commands that were passed on, and commands that were refused, before the edge node was restarted."""
        self.writes = self.refused = 0
        """Commands that were passed on to the line so far, and commands that were refused."""
        self.refusal = ""
        """Reason of the latest refusal; empty: none was refused yet."""

    def refuse(self, reason: str, count: int = 1) -> None:
        """Count `count` commands as refused for a reason."""
        self.refused += count
        self.refusal = printable(reason, SENTENCE)

    def take_node(self, data: bytes) -> bool:
        """Take a command to the edge node. Return True if it requests all births again."""
        metrics = self._metrics(data)
        if isinstance(metrics, str):
            self.refuse(metrics)
            return False
        others = [metric.name for metric in metrics if metric.name != REBIRTH]
        if others or not all(metric.WhichOneof("value") == "boolean_value" for metric in metrics):
            what = printable(others[0]) if others else REBIRTH
            self.refuse(f"{what}: given to the edge node, expected {REBIRTH} as a Boolean; commands go to the device")
            return False
        return any(metric.boolean_value for metric in metrics)

    def take_line(self, data: bytes) -> None:
        """Take a command to the line. All metrics of it act together, or none."""
        metrics = self._metrics(data)
        if reason := metrics if isinstance(metrics, str) else self._give(metrics):
            self.refuse(reason)
        else:
            self.writes += 1

    def leave(self) -> None:
        """Release the line and all buttons that are held, because commands can't arrive any more."""
        self._holding.leave(self._writer)
        self._held.leave_all()

    def look(self) -> None:
        """Release the line and all held buttons after a silence. Call this regularly."""
        if time.monotonic() > self._last + self._silence:
            self.leave()
        self._holding.look()
        self._held.look()

    def _metrics(self, data: bytes) -> Any:
        """Return the metrics of a command, or the reason for its refusal."""
        try:
            metrics = decoded(data).metrics
            names = [metric.name for metric in metrics]
        except ValueError as error:
            return str(error)
        if not 1 <= len(names) <= MOST_METRICS:
            return f"{len(names)} metrics given, expected 1 to {MOST_METRICS}, each with its name"
        return metrics

    def _give(self, metrics: Any) -> str:
        """Pass a command to the line on. Return the reason for a refusal, "" if it was queued."""
        role, snapshot = self._role, self._source.snapshot
        if role is None:
            return "a command given, expected none: the line is served read-only"
        if snapshot.lost or snapshot.run.state in TAKES_NO_INPUT:
            return f"a command given, expected none: {snapshot.lost or f'the run is {snapshot.run.text}'}"
        known = {**self._commands, **self._modes}
        names: list[str] = []
        numbers: list[float] = []
        for metric in metrics:
            tag = known.get(metric.name)
            if tag is None:
                return f"{printable(metric.name)}: can't be commanded, expected a metric that is not readOnly"
            number = number_of(tag, metric)
            if number is None:
                return f"{tag.name}: no value of its data type given, expected {tag.kind}, as its birth has it"
            names.append(tag.name)
            numbers.append(number)
        modes = [name for name in names if name in self._modes]
        if modes and len(modes) < len(names):
            return f"{modes[0]}: given with commands, expected modes in a message of their own"
        return self._set_modes(role, names, numbers) if modes else self._set(role, names, numbers)

    def _set(self, role: WriterKind, names: list[str], numbers: list[float]) -> str:
        request = Input(MQTT, self._writer, role, SET, tuple(names), tuple(numbers))
        if refusal := refused_for_good(self._source, self._receipt, request):
            return refusal.reason
        for name, number in zip(names, numbers, strict=True):
            if reason := objection(self._source, self._commands[name], number, role, self._writer):
                return reason
        # In lockstep, the attached PLC owns the line.
        takes = role == "controller" and "target" not in self._source.controls
        if takes and (reason := self._holding.take(self._writer)):
            return reason
        self._last = time.monotonic()
        if reason := self._source.give(request):
            return reason
        self._held.note(self._writer, request)
        return ""

    def _set_modes(self, role: WriterKind, names: list[str], numbers: list[float]) -> str:
        devices = tuple(self._modes[name].device for name in names)
        request = Input(MQTT, self._writer, role, MODE, devices, tuple(numbers))
        if refusal := refused_for_good(self._source, self._receipt, request):
            return refusal.reason
        return self._source.give(request)
