# SPDX-License-Identifier: Apache-2.0
"""Operator panel of a scene file: buttons, selector switches, emergency stops, lamps, horns, stack lights, numbers."""

from collections.abc import Iterator
from typing import Annotated, ClassVar, Literal, get_args

from annotated_types import Len

from conveyor_sim.scene.parts.device_part import DevicePart, Others
from conveyor_sim.scene.problems import Path, Problem
from conveyor_sim.scene.types import Holds, Limits, Name, NotNegative, Number, Positive, Text, quantity
from conveyor_sim.scene.words import listed, shown

Colour = Literal["black", "white", "red", "yellow", "green", "blue"]
"""Colours of buttons and lights."""

Load = Literal["drives", "machines"]
"""Consumers whose power an emergency stop takes."""

PanelUnit = Literal["1", "m", "m/s", "s", "Hz", "1/s", "1/min", "1/h", "1/m^2", "N", "N m", "J", "rad", "rad/s", "%"]
"""Units of a number: those of tags."""

MOST_POSITIONS = 20


class PanelPart(DevicePart):
    """A part of the operator panel. It has no place on the plan."""

    label: Text = quantity("Text beside it on the page. Left out: its name.", default="")


class Button(PanelPart):
    """A push-button with one contact."""

    KIND: ClassVar[str] = "button"

    kind: Literal["button"] = quantity("The kind of panel part.")
    contact: Literal["NO", "NC"] = quantity(
        "NO: normally open, closed while pressed. NC: normally closed, open while pressed.", default="NO"
    )
    action: Literal["momentary", "maintained"] = quantity(
        "momentary: pressed while it is held. maintained: stays pressed until it is released.", default="momentary"
    )
    bounce: NotNegative = quantity(
        "Time after each change in which the contact bounces: the first scan reads the new state, later scans open or "
        "closed, drawn from the seed.",
        "s",
        default=0.0,
    )
    colour: Colour = quantity("Colour on the page.", default="black")


class Selector(PanelPart):
    """A selector switch with named positions."""

    KIND: ClassVar[str] = "selector"

    kind: Literal["selector"] = quantity("The kind of panel part.")
    positions: Annotated[
        tuple[Name, ...], Len(2, MOST_POSITIONS), Holds(f"a list of 2 to {MOST_POSITIONS} names of positions")
    ] = quantity("Its positions, numbered from 0.")
    initial: Name | None = quantity("Position at the start. Left out: the first one.", default=None)

    @property
    def first(self) -> int:
        """Number of the position at the start."""
        return 0 if self.initial is None else self.positions.index(self.initial)

    def problems(self, path: Path, others: Others) -> Iterator[Problem]:
        """Yield problems of a repeated position, and of an unknown one at the start."""
        if len(set(self.positions)) < len(self.positions):
            yield Problem((*path, "positions"), f"{shown(list(self.positions))} given, expected each position once")
        if self.initial is not None and self.initial not in self.positions:
            expected = f"expected one of {listed(list(self.positions))}"
            yield Problem((*path, "initial"), f"{shown(self.initial)} given, {expected}")


class EmergencyStop(PanelPart):
    """An emergency stop: it latches when pressed, its contact is normally closed, and a reset unlatches it.

    With `cuts` it takes the power of drives or machines, and raises an alarm. Without, it is only a signal.
    """

    KIND: ClassVar[str] = "emergency_stop"

    kind: Literal["emergency_stop"] = quantity("The kind of panel part.")
    cuts: Annotated[tuple[Load, ...], Holds(f"a list of {' and '.join(get_args(Load))}")] = quantity(
        "Consumers without power while it is latched. drives: all belts coast to a stop. machines: all abort.",
        default=(),
    )
    deceleration: Positive | None = quantity(
        "Deceleration of belts without power, the same at all emergency stops of a line. Needed if `cuts` has drives.",
        "m/s^2",
        default=None,
    )
    cell: Name | None = quantity(
        "Cell whose drives and machines it cuts. Left out: those of the scene, or in the file of a cell those of the "
        "cell.",
        default=None,
    )

    def problems(self, path: Path, others: Others) -> Iterator[Problem]:
        """Yield problems of repeated loads, a wrong cell, and a deceleration that is missing, unused or different."""
        if self.cell and not any(
            name.startswith(f"{self.cell}_") for field in ("belts", "drives", "machines") for name in others[field]
        ):
            text = f"{shown(self.cell)} given, expected a cell with belts, drives or machines"
            yield Problem((*path, "cell"), text)
        if len(set(self.cuts)) < len(self.cuts):
            yield Problem((*path, "cuts"), f"{shown(list(self.cuts))} given, expected each once")
        place = (*path, "deceleration")
        if self.deceleration is None:
            if "drives" in self.cuts:
                yield Problem(place, "left out, expected a deceleration, because `cuts` has drives")
        elif "drives" not in self.cuts:
            yield Problem(place, f"{self.deceleration:g} given, expected none, because `cuts` does not have drives")
        else:
            stops = [part for part in others["panel"].values() if isinstance(part, EmergencyStop)]
            first = next(stop.deceleration for stop in stops if stop.deceleration is not None)
            if self.deceleration != first:
                text = f"{self.deceleration:g} given, expected {first:g}, as another emergency stop of the line has"
                yield Problem(place, text)


class Lamp(PanelPart):
    """An indicator lamp."""

    KIND: ClassVar[str] = "lamp"

    kind: Literal["lamp"] = quantity("The kind of panel part.")
    colour: Colour = quantity("Colour on the page.", default="white")


class Horn(PanelPart):
    """A horn."""

    KIND: ClassVar[str] = "horn"

    kind: Literal["horn"] = quantity("The kind of panel part.")


class StackLight(PanelPart):
    """A stack light."""

    KIND: ClassVar[str] = "stack_light"

    kind: Literal["stack_light"] = quantity("The kind of panel part.")
    lights: Annotated[tuple[Colour, ...], Len(1), Holds(f"a list of colours: {', '.join(get_args(Colour))}")] = (
        quantity("Colours of its lights, from the top.", default=("red", "yellow", "green"))
    )

    def problems(self, path: Path, others: Others) -> Iterator[Problem]:
        """Yield a problem for a repeated colour."""
        if len(set(self.lights)) < len(self.lights):
            yield Problem((*path, "lights"), f"{shown(list(self.lights))} given, expected each colour once")


class NumberField(PanelPart):
    """A numeric field, such as a setpoint that an operator enters or a value that a controller displays."""

    KIND: ClassVar[str] = "numeric"

    kind: Literal["numeric"] = quantity("The kind of panel part.")
    limits: Limits = quantity("Least and greatest value, in the field's `unit`.", "1")
    unit: PanelUnit = quantity("Unit of the value.", default="1")
    initial: Number | None = quantity("Value at the start, in `unit`. Left out: the least one.", "1", default=None)
    written_by: Literal["operator", "controller", "both"] = quantity(
        "Writer of the value. both: the last change counts.", default="operator"
    )

    @property
    def first(self) -> float:
        """Value at the start."""
        return self.limits[0] if self.initial is None else self.initial

    def problems(self, path: Path, others: Others) -> Iterator[Problem]:
        """Yield problems of limits without a range, and of a start beyond them."""
        low, high = self.limits
        if low >= high:
            yield Problem((*path, "limits"), f"{shown(self.limits)} given, expected a least value below the greatest")
        elif not low <= self.first <= high:
            yield Problem((*path, "initial"), f"{self.first:g} given, expected a value from {low:g} to {high:g}")
