# SPDX-License-Identifier: Apache-2.0
"""Jams: no passage for a time, although bottles wait and the belt runs. An alarm, and a sequence that clears jams.

A queue that moves nose to tail is no jam. Neither is a queue that stands because no bottles are taken downstream. An
eye at the height of the bottle axes sees no gap between touching bottles: let `passages` name a count that still
increases, of a counter or of bottles that the next machine has taken.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import Enum

from conveyor_sim.control.alarm import Alarm
from conveyor_sim.control.blocks import SR, TON
from conveyor_sim.control.scan import ALARMS, Inputs, require, speed_command, speed_signal

STANDS = 0.01
"""Speed below which a belt stands still, m/s."""


@dataclass
class JamAlarm:
    """Alarm of a jam at an exit. It stands until a bottle passes.

    name: of the exit, for the alarm "jam at <name>". belt: carries bottles through the exit. passages: counts, one of
    which increases with every passage (counters/<c>/forward, outfeeds/<o>/removed, photo_eyes/<e>/edges). waiting: a
    signal that is `waiting_from` or more while bottles wait before the exit (photo_eyes/<e>/blocked,
    zones/<z>/bottles). time: s without a passage. takes: a bool that is on while bottles are taken downstream
    (machines/<m>/running); empty: always.
    """

    name: str
    belt: str
    passages: tuple[str, ...]
    waiting: str
    time: float = 3.0
    waiting_from: float = 0.5
    takes: str = ""
    passed: bool = field(default=False, init=False)
    """True if a bottle passed since the last scan."""
    _counted: tuple[float, ...] | None = field(default=None, init=False, repr=False)
    _stuck: TON = field(init=False, repr=False)
    _jam: SR = field(default_factory=SR, init=False, repr=False)

    def __post_init__(self) -> None:
        require(bool(self.passages), "passages: none given, expected the name of a count or more")
        require(self.time > 0.0, f"time: {self.time:g} s given, expected more than 0")
        self._stuck = TON(self.time)

    @property
    def declared_alarms(self) -> tuple[Alarm, ...]:
        """Declaration of the alarm."""
        return (Alarm(f"jam at {self.name}", f"no bottle leaves {self.name}", "error", tag=self.waiting),)

    def jammed(self, inputs: Inputs) -> bool:
        """Return True during a jam. Call it once per scan."""
        counted = tuple(inputs[name] for name in self.passages)
        before, self._counted = self._counted or counted, counted
        self.passed = any(now > then for now, then in zip(counted, before, strict=True))
        runs = abs(inputs[speed_signal(self.belt)]) >= STANDS
        waits = inputs[self.waiting] >= self.waiting_from
        taken = not self.takes or inputs.on(self.takes)
        stuck = self._stuck(runs and waits and taken and not self.passed, inputs.time)
        return self._jam(stuck, self.passed)

    def scan(self, inputs: Inputs) -> Mapping[str, float]:
        """Return the alarm."""
        return {f"{ALARMS}jam at {self.name}": float(self.jammed(inputs))}


class _Phase(Enum):
    WATCH = 0
    STOP = 1
    BACK = 2
    JOG = 3
    GIVEN_UP = 4


@dataclass
class JamClearing:
    """Sequence that clears a jam: stop, run back, jog forward, until a bottle passes in a jog.

    Times in s, speeds in m/s; the belt's lowest speed must allow `back_speed`, which is negative. After `tries`
    attempts the belt stands, with the alarm "jam at <name> not cleared", until a person helps a bottle through. hold:
    commands sent during the sequence, such as a feeder's speed of 0. Commands are sent during the sequence only, so put
    it before the belt's controller in `priority`.
    """

    alarm: JamAlarm
    stop_time: float = 1.0
    back_speed: float = -0.1
    back_time: float = 1.0
    jog_speed: float = 0.1
    jog_time: float = 2.0
    tries: int = 3
    hold: Mapping[str, float] = field(default_factory=dict)
    tried: int = field(default=0, init=False)
    """Number of attempts since the last passage."""
    _phase: _Phase = field(default=_Phase.WATCH, init=False, repr=False)
    _timer: TON = field(default_factory=lambda: TON(0.0), init=False, repr=False)

    def __post_init__(self) -> None:
        speeds = f"{self.back_speed:g} and {self.jog_speed:g} given"
        signs = self.back_speed < 0.0 < self.jog_speed
        require(signs, f"back_speed, jog_speed: {speeds}, expected below 0 and above 0")
        require(self.tries >= 1, f"tries: {self.tries} given, expected 1 or more")

    @property
    def declared_alarms(self) -> tuple[Alarm, ...]:
        """Declarations of both alarms."""
        name = self.alarm.name
        text = f"{name} is jammed after {self.tries} tries to clear it, and waits for help"
        return (*self.alarm.declared_alarms, Alarm(f"jam at {name} not cleared", text, "error", priority=900))

    def scan(self, inputs: Inputs) -> Mapping[str, float]:
        """Return both alarms, and during the sequence also the belt's speed and the commands in `hold`."""
        jammed = self.alarm.jammed(inputs)
        self._go_on(jammed, inputs.time)
        # Bottles that pass a sensor while the belt runs back have not left. Only a passage in a jog ends the jam.
        acts = self._phase is not _Phase.WATCH
        answer = {
            f"{ALARMS}jam at {self.alarm.name}": float(jammed or acts),
            f"{ALARMS}jam at {self.alarm.name} not cleared": float(self._phase is _Phase.GIVEN_UP),
        }
        if acts:
            speed = {_Phase.BACK: self.back_speed, _Phase.JOG: self.jog_speed}.get(self._phase, 0.0)
            answer |= {**self.hold, speed_command(self.alarm.belt): speed}
        return answer

    def _go_on(self, jammed: bool, time: float) -> None:
        """Enter the phase of this scan."""
        if self._phase is _Phase.WATCH:
            if jammed:
                self.tried = 0
                self._enter(_Phase.STOP, self.stop_time, time)
        elif self._phase in (_Phase.JOG, _Phase.GIVEN_UP) and self.alarm.passed:
            self._phase = _Phase.WATCH
        elif self._phase is not _Phase.GIVEN_UP and self._timer(True, time):
            if self._phase is _Phase.STOP:
                self.tried += 1
                self._enter(_Phase.BACK, self.back_time, time)
            elif self._phase is _Phase.BACK:
                self._enter(_Phase.JOG, self.jog_time, time)
            elif self.tried < self.tries:
                self._enter(_Phase.STOP, self.stop_time, time)
            else:
                self._phase = _Phase.GIVEN_UP

    def _enter(self, phase: _Phase, seconds: float, time: float) -> None:
        self._phase, self._timer = phase, TON(seconds)
        self._timer(True, time)
