"""What a controller is: an object with `scan`, from the signals of a tick to the commands and alarms it answers."""

from __future__ import annotations

from collections import ChainMap
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any, Protocol

from conveyor_sim.control.alarm import Alarm
from conveyor_sim.control.line_tags import LineTags, bind

ALARMS = "alarms/"
"""What a key of an answer begins with that is an alarm (0 or 1), not a command."""

ON = 0.5
"""A bool travels as 0 or 1: from here on it is on."""


class ControlError(Exception):
    """A controller that can't be made, or can't go on; the text is a sentence meant for the user."""


class NoSuchSignal(ControlError, KeyError):
    """A signal that the line does not have."""

    def __str__(self) -> str:
        return str(self.args[0])  # KeyError would put it in quotes


class Inputs(Mapping[str, float]):
    """The process image as it is read at the start of a scan: values of signals by name; a bool is 0 or 1.

    time: s, simulated. tick: its number. length: s from this scan to the next.
    """

    __slots__ = ("_signals", "length", "tick", "time")

    def __init__(self, signals: Mapping[str, float], time: float, tick: int, length: float) -> None:
        self._signals = signals
        self.time = time
        self.tick = tick
        self.length = length

    def __getitem__(self, name: str) -> float:
        """The value of a signal. Raises NoSuchSignal, which is a KeyError."""
        try:
            return self._signals[name]
        except KeyError:
            raise NoSuchSignal(f"{name}: no such signal on this line, {_nearest(name, self._signals)}") from None

    def __iter__(self) -> Iterator[str]:
        return iter(self._signals)

    def __len__(self) -> int:
        return len(self._signals)

    def on(self, name: str) -> bool:
        """Whether a signal of type bool is on. Raises NoSuchSignal."""
        return self[name] >= ON


class Controller(Protocol):
    """Anything with a scan. One with an attribute `declared_alarms` (a sequence of Alarm) says by it what its alarms
    are; the others are as by default. One with a method `bind` is given the line's tags (`line_tags.py`) before its
    first scan; one with an attribute `variables` (a mapping of numbers by name) shows these to a test's conditions, and
    by an attribute `record` (patterns) says which of them are recorded (`recorded.py`); one with an attribute
    `left_over` (sentences) says, once it has the tags, what of them it leaves out.
    """

    def scan(self, inputs: Inputs) -> Mapping[str, float]:
        """One scan: commands by name, and alarms (keys that begin with ALARMS)."""


def declared_alarms(controller: object) -> tuple[Alarm, ...]:
    """What a controller declares of its alarms. Raises ControlError for what is no declaration, or one given twice."""
    found = getattr(controller, "declared_alarms", ())
    name = f"{type(controller).__name__}.declared_alarms"
    if not (isinstance(found, (list, tuple)) and all(isinstance(one, Alarm) for one in found)):
        raise ControlError(f"{name}: {found!r:.200} given, expected a list or tuple of Alarm")
    ids = [one.id for one in found]
    for id in ids:
        if ids.count(id) > 1:
            raise ControlError(f"{name}: {id} declared twice, expected once")
    return tuple(found)


def commands_of(answer: Mapping[str, float]) -> dict[str, float]:
    """The commands of a scan's answer. Raises ControlError for what is no answer, and a value that is no number."""
    if not isinstance(answer, Mapping):
        raise ControlError(f"scan: {answer!r:.200} returned, expected a mapping of commands")
    try:
        return {name: float(value) for name, value in answer.items() if not name.startswith(ALARMS)}
    except (AttributeError, OverflowError, TypeError, ValueError):
        for name, value in answer.items():
            if not isinstance(name, str):
                text = f"scan: {name!r:.200} returned as a name, expected that of a command or an alarm"
                raise ControlError(text) from None
            number(name, value)
        raise


def number(name: str, value: object) -> float:
    """Return a value of an answer as a number. Raise ControlError if it is none."""
    try:
        return float(value)  # type: ignore[arg-type]
    except (OverflowError, TypeError, ValueError):
        raise ControlError(f"{name}: {value!r:.200} answered by the controller, expected a number") from None


@dataclass(frozen=True)
class Constant:
    """Gives the same commands in every scan: `Constant({"belts/feeder/cmd_speed": 0.5})`."""

    commands: Mapping[str, float]

    def scan(self, inputs: Inputs) -> Mapping[str, float]:
        """The commands."""
        return self.commands


@dataclass(frozen=True)
class _Together:
    controllers: tuple[Controller, ...]

    @property
    def declared_alarms(self) -> tuple[Alarm, ...]:
        return tuple(alarm for controller in self.controllers for alarm in declared_alarms(controller))

    def bind(self, tags: LineTags) -> None:
        """Hand the line's tags on."""
        for controller in self.controllers:
            bind(controller, tags)

    @property
    def variables(self) -> Mapping[str, float]:
        """Those of all of them."""
        return _variables(self.controllers)

    @property
    def record(self) -> tuple[str, ...]:
        """The patterns of all of them."""
        return _record(self.controllers)

    def scan(self, inputs: Inputs) -> Mapping[str, float]:
        merged: dict[str, float] = {}
        given_by: dict[str, Controller] = {}
        for controller in self.controllers:
            for name, value in controller.scan(inputs).items():
                if name in merged:
                    both = f"{type(given_by[name]).__name__} and {type(controller).__name__}"
                    raise ControlError(f"{name}: given by both {both} in one scan, expected one (or priority)")
                merged[name] = value
                given_by[name] = controller
        return merged


@dataclass(frozen=True)
class _Priority:
    controllers: tuple[Controller, ...]

    @property
    def declared_alarms(self) -> tuple[Alarm, ...]:
        found: dict[str, Alarm] = {}
        for controller in self.controllers:
            for alarm in declared_alarms(controller):
                found.setdefault(alarm.id, alarm)
        return tuple(found.values())

    def bind(self, tags: LineTags) -> None:
        """Hand the line's tags on."""
        for controller in self.controllers:
            bind(controller, tags)

    @property
    def variables(self) -> Mapping[str, float]:
        """Those of all of them."""
        return _variables(self.controllers)

    @property
    def record(self) -> tuple[str, ...]:
        """The patterns of all of them."""
        return _record(self.controllers)

    def scan(self, inputs: Inputs) -> Mapping[str, float]:
        merged: dict[str, float] = {}
        for answer in [controller.scan(inputs) for controller in self.controllers]:
            for name, value in answer.items():
                merged.setdefault(name, value)
        return merged


def _variables(controllers: Iterable[Controller]) -> Mapping[str, float]:
    shown: Any = [getattr(controller, "variables", {}) for controller in controllers]
    return ChainMap(*shown)  # read only, and read when it is asked for


def _record(controllers: Iterable[Controller]) -> tuple[str, ...]:
    return tuple(pattern for controller in controllers for pattern in getattr(controller, "record", ()))


def together(*controllers: Controller) -> Controller:
    """One controller that scans each of these, in order, on the same inputs, and merges their answers.

    Its scan raises ControlError if two of them give the same command or alarm.
    """
    return _Together(controllers)


def priority(*controllers: Controller) -> Controller:
    """One controller that scans each of these; where several give the same command, that of the earliest holds.

    So an interlock goes first, and the controller that it interrupts after it.
    """
    return _Priority(controllers)


def require(condition: bool, text: str) -> None:
    """Raises ControlError with the text unless the condition holds."""
    if not condition:
        raise ControlError(text)


def speed_command(belt: str) -> str:
    """The command that sets a belt's speed, m/s."""
    return f"belts/{belt}/cmd_speed"


def speed_signal(belt: str) -> str:
    """The signal of a belt's actual speed, m/s."""
    return f"belts/{belt}/speed"


def eye_signal(eye: str, what: str = "blocked") -> str:
    """A signal of a photo-eye: blocked, rose, fell or edges."""
    return f"photo_eyes/{eye}/{what}"


def _nearest(name: str, signals: Mapping[str, float]) -> str:
    """What of the same kind there is, in words."""
    kind = name.split("/")[0] + "/"
    alike = [signal for signal in signals if signal.startswith(kind)]
    if alike:
        return f"expected one of {', '.join(alike)}"
    return "which a controller has to tell in every scan" if kind == ALARMS else f"which has no {kind}"
