# SPDX-License-Identifier: Apache-2.0
"""Operator panel: buttons, selector switches, emergency stops, lamps, horns, stack lights and numeric fields."""

from collections.abc import Sequence

from conveyor_sim.line.alarms.declaration import Declared, error
from conveyor_sim.line.device import Device, ScanContext
from conveyor_sim.line.devices.power import PowerSupply
from conveyor_sim.line.devices.setup import BOUNCE, DeviceSetup
from conveyor_sim.line.tag import PANEL, Tag, choice, number, switch
from conveyor_sim.scene.parts.panel import Button, EmergencyStop, Horn, Lamp, NumberField, Selector, StackLight

HELD = "/press"
"""Ending of the names of tags that press something: a momentary button for as long as it is 1, or an emergency stop."""

MAINTAINED = "/pressed"
"""Ending of the names of tags that press maintained buttons."""


class ButtonDevice(Device):
    """Push-button. A press lasts for at least one scan, even if the release arrives within the same tick."""

    def __init__(self, name: str, button: Button, setup: DeviceSetup) -> None:
        """Build the tags."""
        self._closed = button.contact == "NC"
        action = (
            switch(f"{name}{HELD}", PANEL, "Pressed while on.")
            if button.action == "momentary"
            else switch(f"{name}{MAINTAINED}", PANEL, "Pressed from on to off.")
        )
        text = "closed until it is pressed" if self._closed else "closed while it is pressed"
        super().__init__(
            name, [switch(f"{name}/contact", "status", f"Its contact, {text}.", float(self._closed)), action]
        )
        self._bounce_ticks = setup.ticks(button.bounce)
        self.random = setup.random(name, BOUNCE) if self._bounce_ticks > 1 else None
        self.down = False
        self.touched = False
        """True if it was pressed since the last tick."""
        self.pressed = False
        """Its state in this tick, without bounce."""
        self.bouncing = 0
        """Ticks for which the contact still bounces."""
        self.contact = self._closed

    def command(self, name: str, value: float, now: ScanContext) -> None:
        """Press or release."""
        self.down = value != 0.0
        self.touched = self.touched or self.down

    def begin(self, now: ScanContext) -> None:
        """Set the contact for this tick."""
        pressed, self.touched = self.down or self.touched, False
        if pressed is not self.pressed:
            self.pressed, self.bouncing = pressed, self._bounce_ticks
        self.contact = self.pressed is not self._closed
        if self.bouncing:
            # The first scan reads the new state, so that a press is never lost.
            if self.random is not None and self.bouncing < self._bounce_ticks:
                self.contact = bool(self.random.integers(2))
            self.bouncing -= 1

    def values(self, now: ScanContext) -> Sequence[float]:
        """Return the contact."""
        return (self.contact,)


class SelectorDevice(Device):
    """Selector switch."""

    def __init__(self, name: str, selector: Selector, setup: DeviceSetup) -> None:
        """Build the tags."""
        texts = dict(enumerate(selector.positions))
        super().__init__(
            name,
            [
                choice(f"{name}/position", "status", "Its position.", texts, selector.first),
                choice(f"{name}/turn", PANEL, "Turns it to a position.", texts, selector.first),
            ],
        )
        self.position = selector.first

    def command(self, name: str, value: float, now: ScanContext) -> None:
        """Turn to a position."""
        self.position = int(value)

    def values(self, now: ScanContext) -> Sequence[float]:
        """Return the position."""
        return (self.position,)


class EmergencyStopDevice(Device):
    """Emergency stop. A press lasts for at least one scan, even if the reset arrives within the same tick."""

    def __init__(self, name: str, stop: EmergencyStop, setup: DeviceSetup) -> None:
        """Build the tags, and join the power supply if it takes power."""
        super().__init__(
            name,
            [
                switch(f"{name}/contact", "status", "Its contact, open while it is latched.", 1.0, "state"),
                switch(f"{name}{HELD}", PANEL, "Latches it when on is written."),
                switch(f"{name}/reset", PANEL, "Unlatches it when on is written."),
            ],
        )
        self._power = setup.shared(PowerSupply, PowerSupply) if stop.cuts else None
        if self._power is not None:
            self._power.add_stop(name, stop.cuts, stop.deceleration, stop.cell)
        self._loads = " and ".join(stop.cuts)
        self._alarm = f"{name}/pressed"
        self.latched = False
        self.touched = False
        """True if it was pressed since the last tick."""
        self.open = False
        """True if the contact is open in this tick."""

    @property
    def alarms(self) -> Sequence[Declared]:
        """Alarm of an emergency stop that takes power."""
        if self._power is None:
            return ()
        return (error(self._alarm, f"{self.name} was pressed: {self._loads} have no power", f"{self.name}/contact"),)

    def command(self, name: str, value: float, now: ScanContext) -> None:
        """Latch or unlatch it."""
        if value == 0.0:
            return
        self.latched = name.endswith(HELD)
        self.touched = self.touched or self.latched

    def begin(self, now: ScanContext) -> None:
        """Set the contact, and take or give back power."""
        before, self.open, self.touched = self.open, self.latched or self.touched, False
        if self.open is before or self._power is None:
            return
        if self.open:
            self._power.cut(self.name, now)
        else:
            self._power.restore(self.name)
        now.alarm(self._alarm, self.open)

    def values(self, now: ScanContext) -> Sequence[float]:
        """Return the contact."""
        return (not self.open,)


class LightsDevice(Device):
    """Lamp, horn or stack light. It only displays commands, whose values are in the read-back."""

    def __init__(self, name: str, part: Lamp | Horn | StackLight, setup: DeviceSetup) -> None:
        """Build the tags: one command per light."""
        if isinstance(part, StackLight):
            texts: dict[str, str] = {light: f"Lights the {light} light." for light in part.lights}
        else:
            texts = {"on": "Lights it." if isinstance(part, Lamp) else "Sounds it."}
        super().__init__(name, [switch(f"{name}/{light}", "command", text) for light, text in texts.items()])

    @property
    def takes_repeats(self) -> bool:
        """Return False."""
        return False

    def command(self, name: str, value: float, now: ScanContext) -> None:
        """Take a command."""


class NumberFieldDevice(Device):
    """Numeric field that an operator, a controller or both write."""

    def __init__(self, name: str, field: NumberField, setup: DeviceSetup) -> None:
        """Build the tags."""
        low, high = field.limits
        self._written = f"{name}/write"
        tags: list[Tag] = [
            number(f"{name}/value", "actual", "Value in the field.", field.unit, low, high, field.first),
        ]
        if field.written_by != "controller":
            tags.append(number(f"{name}/set", PANEL, "Value to enter.", field.unit, low, high, field.first))
        if field.written_by != "operator":
            text = "Value to display; acts when it changes."
            tags.append(number(self._written, "setpoint", text, field.unit, low, high, field.first))
        super().__init__(name, tags)
        self.value = self.written = field.first

    def command(self, name: str, value: float, now: ScanContext) -> None:
        """Take a value of an operator, or a changed value of a controller."""
        if name != self._written:
            self.value = value
        elif value != self.written:
            self.value = self.written = value

    def values(self, now: ScanContext) -> Sequence[float]:
        """Return the value."""
        return (self.value,)
