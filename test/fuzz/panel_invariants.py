# SPDX-License-Identifier: Apache-2.0
"""Invariants of an operator panel at every tick: contacts, values, lamps, alarms, and machines without power."""

from __future__ import annotations

import math
from typing import Any

from fuzz.violation import Violation

from conveyor_sim.line.machines.packml import CNTRL_CMD, Command, PackMLState
from conveyor_sim.scene.parts.machine import PackmlPart
from conveyor_sim.scene.parts.panel import Button, EmergencyStop, Load, NumberField, Selector
from conveyor_sim.scene.parts.reject import Reject
from conveyor_sim.simulation import Simulation

WITHOUT_POWER = (PackMLState.ABORTING, PackMLState.ABORTED)
COUNTS = ("produced", "taken", "processed", "rejected")


class ExpectedPanel:
    """Panel of a line, from the accepted inputs and the scene alone."""

    def __init__(self, simulation: Simulation) -> None:
        self._sim, self._scene = simulation, simulation.scene
        parts = self._scene.panel
        self._given = {tag.name: tag.initial for tag in simulation.process_image.commands if tag.name[:6] == "panel/"}
        """Last accepted value of each command, as the read-back has it."""
        self._buttons = {name: _Button(part, self._scene.tick) for name, part in parts.items() if type(part) is Button}
        self._stops = {name: _Stop(part) for name, part in parts.items() if isinstance(part, EmergencyStop)}
        self._values = {f"panel/{name}/value": part.first for name, part in parts.items() if type(part) is NumberField}
        self._before: dict[str, float] = {}
        """Signals at the tick before."""
        self._aborted: set[str] = set()
        """Machines that an emergency stop has aborted, without a Clear since then."""
        coasts = [stop.part.deceleration for stop in self._stops.values() if stop.part.deceleration is not None]
        self.deceleration = coasts[0] if coasts else math.inf
        """Deceleration of belts without power, m/s^2."""

    def take(self, name: str, value: float) -> None:
        """Apply an accepted input."""
        if name.endswith(CNTRL_CMD) and value == Command.CLEAR:
            self._aborted.discard(name.removesuffix(CNTRL_CMD))
        if name not in self._given:
            return
        before, self._given[name] = self._given[name], value
        part, _, what = name.removeprefix("panel/").partition("/")
        if part in self._buttons:
            self._buttons[part].press(value != 0.0)
        elif part in self._stops and value:
            self._stops[part].press(what == "press")
        elif what == "set" or (what == "write" and value != before):
            self._values[f"panel/{part}/value"] = value

    def is_off(self, load: Load) -> bool:
        """Return True if an emergency stop took the power of these consumers at the last tick."""
        return any(stop.is_open and load in stop.part.cuts for stop in self._stops.values())

    def begin(self) -> bool:
        """Begin a tick. Return True if an emergency stop takes the power of drives in it."""
        for button in self._buttons.values():
            button.begin()
        latching = [stop for stop in self._stops.values() if stop.begin()]
        if any("machines" in stop.part.cuts for stop in latching):
            self._aborted = {f"machines/{name}" for name in self._scene.machines}
        return any("drives" in stop.part.cuts for stop in latching)

    def check(self, image: dict[str, float]) -> None:
        """Check the signals at the end of a tick."""
        wrong = [name for name, value in self._values.items() if image[name] != value]
        wrong += [
            f"panel/{name}" for name, button in self._buttons.items() if button.differs(image[f"panel/{name}/contact"])
        ]
        for name, stop in self._stops.items():
            alarm, alarms = f"panel/{name}/pressed", self._sim.line.alarms
            active = alarm in alarms and alarms[alarm].active
            if image[f"panel/{name}/contact"] == stop.is_open or active != (stop.is_open and bool(stop.part.cuts)):
                wrong.append(f"panel/{name}")
        for name, part in self._scene.panel.items():
            if isinstance(part, Selector) and image[f"panel/{name}/position"] != self._given[f"panel/{name}/turn"]:
                wrong.append(f"panel/{name}")
        line = self._sim.line
        values = dict(zip(self._sim.process_image.command_names, line.read_back.values, strict=True))
        wrong += [f"read-back of {name}" for name, value in self._given.items() if values[name] != value]
        if wrong:
            raise Violation("panel", f"{', '.join(wrong)} at tick {self._sim.tick}: {self._given}")
        self._machines(image)
        self._before = image

    def _machines(self, now: dict[str, float]) -> None:
        """Machines without power work on nothing, and the return of power starts none."""
        for name, machine in self._scene.machines.items():
            place = f"machines/{name}"
            if isinstance(machine, PackmlPart) and place in self._aborted:
                still = now[f"{place}/state"] in WITHOUT_POWER and not now[f"{place}/running"]
            elif isinstance(machine, Reject) and self.is_off("machines"):
                still = not now[f"{place}/running"]
            else:
                continue
            counts = [f"{place}/{what}" for what in COUNTS if f"{place}/{what}" in now]
            counted = [name for name in counts if now[name] > self._before.get(name, 0.0)]
            if not still or counted:
                raise Violation("works without power", f"{place} at tick {self._sim.tick}: {counted}")


class _Button:
    def __init__(self, part: Button, tick: float) -> None:
        self._closed = part.contact == "NC"
        self._ticks = math.ceil(part.bounce / tick) + 1
        self._down = self._touched = self._pressed = False
        self._since = self._ticks
        """Ticks since the last change."""

    def press(self, down: bool) -> None:
        self._down, self._touched = down, self._touched or down

    def begin(self) -> None:
        pressed, self._touched = self._down or self._touched, False
        self._since = 0 if pressed != self._pressed else self._since + 1
        self._pressed = pressed

    def differs(self, contact: float) -> bool:
        """Return True if the contact is wrong. While it bounces, it may be open or closed, except in the first scan."""
        return (self._since == 0 or self._since >= self._ticks) and contact != (self._pressed != self._closed)


class _Stop:
    def __init__(self, part: EmergencyStop) -> None:
        self.part: Any = part
        self._latched = self._touched = self.is_open = False

    def press(self, latch: bool) -> None:
        self._latched, self._touched = latch, self._touched or latch

    def begin(self) -> bool:
        """Begin a tick. Return True if it latches in it."""
        before, self.is_open, self._touched = self.is_open, self._latched or self._touched, False
        return self.is_open and not before
