"""What holds of belts at every tick: the speeds that they must have, and what is told of every command and fault."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from fuzz.inputs import accepted, commands_of, faults_of
from fuzz.violation import Violation

from conveyor_sim.line.commands.inputs import CommandOutcome
from conveyor_sim.line.commands.refusal import shown
from conveyor_sim.simulation import Simulation


class ExpectedBelts:
    """The speeds that the belts must have, from the inputs and the scene alone."""

    def __init__(self, simulation: Simulation) -> None:
        self._sim = simulation
        self._commands, self._faults = commands_of(simulation.scene), faults_of(simulation.scene)
        self._belts = [_Belt(name, belt, simulation.scene.tick) for name, belt in simulation.scene.belts.items()]

    def check(self, sent: list[tuple[Any, ...]], outcomes: list[CommandOutcome]) -> None:
        """After a tick; sent: names, values, and whether they are faults; outcomes: what was told of them."""
        tick = self._sim.tick - 1
        told = []
        for names, values, fault in sent:
            good = accepted(self._faults if fault else self._commands, names, values)
            told.append((tick, "fault" if fault else "commands", names if good else shown(names), good))
            for name, value in zip(names, values, strict=False) if good else ():
                for belt in self._belts:
                    belt.take(name, value, tick)
        told += [
            (tick, "watchdog", (f"{belt.place}/cmd_speed",), True) for belt in self._belts if belt.falls_silent(tick)
        ]
        found = [(outcome.tick, outcome.source, outcome.names, outcome.accepted) for outcome in outcomes]
        if found != told:
            raise Violation("outcomes", f"{found} told, expected {told}")
        if any(outcome.accepted == bool(outcome.reason) for outcome in outcomes):
            raise Violation("outcomes", "a refusal without a reason, or a reason without a refusal")
        speeds = self._sim.belts()
        image = dict(zip(self._sim.process_image.signal_names, self._sim.signals().tolist(), strict=True))
        for n, belt in enumerate(self._belts):
            belt.check(float(speeds.commanded[n]), float(speeds.actual[n]), image, self._sim.tick)


class _Belt:
    """One belt."""

    def __init__(self, name: str, belt: Any, tick: float) -> None:
        self.place = f"belts/{name}"
        self._drive, self._tick = belt.drive, tick
        self._setpoint = self._speed = belt.speed
        self._patience = math.inf if belt.watchdog is None else max(1, math.ceil(belt.watchdog / tick - 1e-9))
        self._heard, self._silent = 0, False
        self._run, self._reverse, self._reset, self._trip, self._tripped = True, False, False, False, False

    def take(self, name: str, value: float, tick: int) -> None:
        """An input that was accepted, whomever it is for."""
        place, _, what = name.rpartition("/")
        if place != self.place:
            return
        if what == "cmd_speed":
            self._setpoint, self._heard, self._silent = value, tick, False
        elif what == "run":
            self._run = value == 1.0
        elif what == "reverse":
            self._reverse = value == 1.0
        elif what == "reset":
            if value == 1.0 and not self._reset and not self._trip:
                self._tripped = False
            self._reset = value == 1.0
        else:
            self._trip = value == 1.0
            self._tripped = self._tripped or self._trip

    def falls_silent(self, tick: int) -> bool:
        """Whether its watchdog trips."""
        if self._silent or tick - self._heard < self._patience:
            return False
        self._setpoint, self._silent = 0.0, True
        return True

    def check(self, commanded: float, actual: float, image: dict[str, float], tick: int) -> None:
        """Setpoint and speed, and the signals."""
        if commanded != self._setpoint or image[f"{self.place}/speed"] != actual:
            raise Violation("belts", f"{self.place}: {commanded} for {self._setpoint} m/s at tick {tick}")
        if self._drive is None:
            if actual != self._setpoint:
                raise Violation("belts", f"{self.place} runs at {actual} for {self._setpoint} m/s at tick {tick}")
            return
        wanted = 0.0 if not self._run or self._tripped else -self._setpoint if self._reverse else self._setpoint
        most = self._drive.acceleration * self._tick
        if self._drive.jerk is None:
            expected = self._speed + float(np.clip(wanted - self._speed, -most, most))
            wrong = abs(actual - expected) > 1e-9 * max(1.0, abs(wanted))
        else:
            wrong = abs(actual - self._speed) > most * (1.0 + 1e-9) + 1e-12
        running, at_speed, fault = (image[f"{self.place}/{what}"] for what in ("running", "at_speed", "fault"))
        wrong |= (running, fault) != (self._run and not self._tripped, self._tripped)
        wrong |= at_speed != (abs(actual - wanted) <= 1e-9)
        if wrong:
            raise Violation("drives", f"{self.place} went from {self._speed} to {actual} m/s, wanted {wanted}: {image}")
        self._speed = actual
