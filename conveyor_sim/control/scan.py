# SPDX-License-Identifier: Apache-2.0
"""`Controller`: an object with `scan`, which returns commands and alarms for the signals of a tick."""

from __future__ import annotations

from collections import ChainMap
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Any, Protocol

from conveyor_sim.control.alarm import Alarm


@dataclass(frozen=True)
class LineTags:
    """Signals and commands of a line by name, with their kinds: "bool", "count", "number" or "enumeration"."""

    signals: Mapping[str, str]
    commands: Mapping[str, str]
    limits: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    """Accepted minimum and maximum by command; empty: not known."""


def bind(controller: object, tags: LineTags) -> None:
    """Pass the line's tags to a controller that has a method `bind`, before its first scan. Raise its exceptions."""
    method = getattr(controller, "bind", None)
    if callable(method):
        method(tags)


ALARMS = "alarms/"
"""Prefix of a key that is an alarm (0 or 1), not a command, in the answer of a scan."""

PROGRAM = "plc/"
"""Prefix of the variables of a program. Patterns may omit it."""

ON = 0.5
"""Lowest value at which a bool, sent as 0 or 1, is on."""


class ControlError(Exception):
    """Failure to build or run a controller. The text is a sentence for the user."""


class NoSuchSignal(ControlError, KeyError):
    """Access to a signal that the line does not have."""

    def __str__(self) -> str:
        return str(self.args[0])  # KeyError would put it in quotes


class Inputs(Mapping[str, float]):
    """Process image at the start of a scan: values of signals by name; a bool is 0 or 1.

    time: simulated time, s. tick: its number. length: time from this scan to the next, s.
    """

    __slots__ = ("_signals", "length", "tick", "time")

    def __init__(self, signals: Mapping[str, float], time: float, tick: int, length: float) -> None:
        self._signals = signals
        self.time = time
        self.tick = tick
        self.length = length

    def __getitem__(self, name: str) -> float:
        """Return the value of a signal. Raise NoSuchSignal, which is a KeyError."""
        try:
            return self._signals[name]
        except KeyError:
            raise NoSuchSignal(f"{name}: no such signal on this line, {_nearest(name, self._signals)}") from None

    def __iter__(self) -> Iterator[str]:
        return iter(self._signals)

    def __len__(self) -> int:
        return len(self._signals)

    def on(self, name: str) -> bool:
        """Return True if a signal of type bool is on. Raise NoSuchSignal."""
        return self[name] >= ON


class Controller(Protocol):
    r"""Object with a method `scan`.

    Optional attributes:

    - `declared_alarms`: a sequence of Alarm. Alarms without a declaration have defaults.
    - `bind`: a method that receives the line's tags (`LineTags`) before the first scan.
    - `alarm_tags`: tags (`alarms/<id>`) of alarms without a declaration, available after `bind`.
    - `signals_read`: names of the signals that it reads, available after `bind`. Others are then not in the inputs.
    - `variables`: numbers by name, available to conditions of tests.
    - `record`: patterns of the variables to record (`recorded.py`).
    - `left_over`: sentences about tags without use, available after `bind`.
    """

    def scan(self, inputs: Inputs) -> Mapping[str, float]:
        """Return commands by name, and alarms (keys that begin with ALARMS), for one scan."""


def declared_alarms(controller: object) -> tuple[Alarm, ...]:
    """Return a controller's declarations. Raise ControlError for invalid ones, or one that is given twice."""
    declared = getattr(controller, "declared_alarms", ())
    name = f"{type(controller).__name__}.declared_alarms"
    if not (isinstance(declared, (list, tuple)) and all(isinstance(one, Alarm) for one in declared)):
        raise ControlError(f"{name}: {declared!r:.200} given, expected a list or tuple of Alarm")
    ids = [one.id for one in declared]
    for id in ids:
        if ids.count(id) > 1:
            raise ControlError(f"{name}: {id} declared twice, expected once")
    return tuple(declared)


def known_alarms(controller: object) -> dict[str, str]:
    """Return the texts of the alarms that a bound controller announces, by tag. Raise ControlError for invalid ones."""
    texts = {f"{ALARMS}{alarm.id}": alarm.text or alarm.id for alarm in declared_alarms(controller)}
    return {tag: tag.removeprefix(ALARMS) for tag in getattr(controller, "alarm_tags", ())} | texts


def commands_of(answer: Mapping[str, float]) -> dict[str, float]:
    """Return the commands in a scan's answer. Raise ControlError if it is no mapping or a value is no number."""
    if not isinstance(answer, Mapping):
        raise ControlError(f"scan: {answer!r:.200} returned, expected a mapping of commands")
    try:
        return {name: float(answer[name]) for name in _command_names(tuple(answer))}
    except (AttributeError, OverflowError, TypeError, ValueError):
        for name, value in answer.items():
            if not isinstance(name, str):
                text = f"scan: {name!r:.200} returned as a name, expected that of a command or an alarm"
                raise ControlError(text) from None
            number(name, value)
        raise


@lru_cache(maxsize=16)
def _command_names(names: tuple[str, ...]) -> tuple[str, ...]:
    """Return the names that are no alarms. Cached, because a controller repeats its names in every scan."""
    return tuple(name for name in names if not name.startswith(ALARMS))


@lru_cache(maxsize=16)
def alarm_names(names: tuple[str, ...]) -> tuple[str, ...]:
    """Return the names that are alarms. Cached as `_command_names`."""
    return tuple(name for name in names if name.startswith(ALARMS))


def number(name: str, value: object) -> float:
    """Return a value of an answer as a number. Raise ControlError if it is none."""
    try:
        return float(value)  # type: ignore[arg-type]
    except (OverflowError, TypeError, ValueError):
        raise ControlError(f"{name}: {value!r:.200} answered by the controller, expected a number") from None


@dataclass(frozen=True)
class Constant:
    """Controller with the same commands in every scan: `Constant({"belts/feeder/cmd_speed": 0.5})`."""

    commands: Mapping[str, float]

    def scan(self, inputs: Inputs) -> Mapping[str, float]:
        """Return the commands."""
        return self.commands


@dataclass(frozen=True)
class _Several:
    controllers: tuple[Controller, ...]

    def bind(self, tags: LineTags) -> None:
        """Pass the line's tags on."""
        for controller in self.controllers:
            bind(controller, tags)

    @property
    def variables(self) -> Mapping[str, float]:
        """Variables of all controllers."""
        shown: Any = [getattr(controller, "variables", {}) for controller in self.controllers]
        return ChainMap(*shown)  # read-only view

    @property
    def alarm_tags(self) -> tuple[str, ...]:
        """Tags of the alarms of all controllers."""
        return tuple(tag for controller in self.controllers for tag in getattr(controller, "alarm_tags", ()))

    @property
    def record(self) -> tuple[str, ...]:
        """Patterns of all controllers."""
        return tuple(pattern for controller in self.controllers for pattern in getattr(controller, "record", ()))


class _Together(_Several):
    @property
    def declared_alarms(self) -> tuple[Alarm, ...]:
        return tuple(alarm for controller in self.controllers for alarm in declared_alarms(controller))

    def scan(self, inputs: Inputs) -> Mapping[str, float]:
        merged: dict[str, float] = {}
        sender: dict[str, Controller] = {}
        for controller in self.controllers:
            for name, value in controller.scan(inputs).items():
                if name in merged:
                    both = f"{type(sender[name]).__name__} and {type(controller).__name__}"
                    raise ControlError(f"{name}: sent by both {both} in one scan, expected one (or priority)")
                merged[name] = value
                sender[name] = controller
        return merged


class _Priority(_Several):
    @property
    def declared_alarms(self) -> tuple[Alarm, ...]:
        declared: dict[str, Alarm] = {}
        for controller in self.controllers:
            for alarm in declared_alarms(controller):
                declared.setdefault(alarm.id, alarm)
        return tuple(declared.values())

    def scan(self, inputs: Inputs) -> Mapping[str, float]:
        merged: dict[str, float] = {}
        for answer in [controller.scan(inputs) for controller in self.controllers]:
            for name, value in answer.items():
                merged.setdefault(name, value)
        return merged


def together(*controllers: Controller) -> Controller:
    """Return a controller that scans several ones in order, on the same inputs, and merges their answers.

    Its scan raises ControlError if two of them return the same command or alarm.
    """
    return _Together(controllers)


def priority(*controllers: Controller) -> Controller:
    """Return a controller that scans several ones; for a command of several, the earliest one wins.

    So an interlock goes first, and the controller that it interrupts after it.
    """
    return _Priority(controllers)


def require(condition: bool, text: str) -> None:
    """Raise ControlError with the text unless the condition holds."""
    if not condition:
        raise ControlError(text)


def speed_command(belt: str) -> str:
    """Return the command that sets a belt's speed, m/s. belt: a belt, or "drives/<name>" for a named drive."""
    return f"{_tags(belt)}/cmd_speed"


def speed_signal(belt: str) -> str:
    """Return the signal of a belt's actual speed, m/s. belt: as in `speed_command`."""
    return f"{_tags(belt)}/speed"


def pulses_signal(belt: str) -> str:
    """Return the signal of an encoder's count. belt: as in `speed_command`."""
    return f"{_tags(belt)}/pulses"


def eye_signal(eye: str, what: str = "blocked") -> str:
    """Return a signal of a photo-eye: blocked, rose, fell or edges."""
    return f"photo_eyes/{eye}/{what}"


def _tags(belt: str) -> str:
    """Return the prefix of a belt's or drive's tags."""
    return belt if belt.startswith("drives/") else f"belts/{belt}"


def _nearest(name: str, signals: Mapping[str, float]) -> str:
    """Return the existing signals of the same kind, in words."""
    kind = name.split("/")[0] + "/"
    alike = [signal for signal in signals if signal.startswith(kind)]
    if alike:
        return f"expected one of {', '.join(alike)}"
    return "which a controller must report in every scan" if kind == ALARMS else f"which has no {kind}"
