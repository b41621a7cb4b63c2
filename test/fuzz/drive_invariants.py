# SPDX-License-Identifier: Apache-2.0
"""What holds of belts at every tick: the speeds that they must have, and what is told of every command and fault."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from fuzz.inputs import accepted, commands_of, faults_of, speed_parts
from fuzz.panel_invariants import ExpectedPanel
from fuzz.violation import Violation

from conveyor_sim.line.commands.inputs import CommandOutcome
from conveyor_sim.line.commands.refusal import shown
from conveyor_sim.scene.drives import NamedDrive
from conveyor_sim.simulation import Simulation


class ExpectedBelts:
    """The speeds that the belts must have, from the inputs and the scene alone."""

    def __init__(self, simulation: Simulation) -> None:
        self._sim = simulation
        self._commands, self._faults = commands_of(simulation.scene), faults_of(simulation.scene)
        scene = simulation.scene
        self.panel = ExpectedPanel(simulation)
        self._movers = [_Mover(place, part, scene.tick, self.panel) for place, part in speed_parts(scene)]
        moves = {mover.place: mover for mover in self._movers}
        self._moved = [
            (f"belts/{name}", moves[f"drives/{belt.drive}" if belt.drive_name else f"belts/{name}"], belt.ratio)
            for name, belt in scene.belts.items()
            if belt.axis is None
        ]
        """Place, mover and ratio of each belt."""

    def check(self, sent: list[tuple[Any, ...]], outcomes: list[CommandOutcome]) -> None:
        """After a tick; sent: names, values, and whether they are faults; outcomes: what was told of them."""
        tick = self._sim.tick - 1
        told = []
        for names, values, fault in sent:
            good = accepted(self._faults if fault else self._commands, names, values)
            told.append((tick, "fault" if fault else "commands", names if good else shown(names), good))
            for name, value in zip(names, values, strict=False) if good else ():
                for mover in self._movers:
                    mover.take(name, value, tick)
                self.panel.take(name, value)
        told += [
            (tick, "watchdog", (f"{mover.place}/cmd_speed",), True)
            for mover in self._movers
            if mover.falls_silent(tick)
        ]
        found = [(outcome.tick, outcome.source, outcome.names, outcome.accepted) for outcome in outcomes]
        if found != told:
            raise Violation("outcomes", f"{found} told, expected {told}")
        if any(outcome.accepted == bool(outcome.reason) for outcome in outcomes):
            raise Violation("outcomes", "a refusal without a reason, or a reason without a refusal")
        speeds = self._sim.belts()
        image = dict(zip(self._sim.process_image.signal_names, self._sim.signals().tolist(), strict=True))
        if self.panel.begin():
            for mover in self._movers:
                mover.locked = True
        self.panel.check(image)
        for mover in self._movers:
            mover.check(image, self._sim.tick)
        numbers = {f"belts/{name}": n for n, name in enumerate(self._sim.scene.belts)}
        for place, mover, ratio in self._moved:
            n = numbers[place]
            commanded, actual = float(speeds.commanded[n]), float(speeds.actual[n])
            if commanded != ratio * mover.setpoint or not actual == image[f"{place}/speed"] == ratio * mover.speed:
                found = f"{commanded} and {actual} for {ratio} x {mover.setpoint} and {mover.speed} m/s"
                raise Violation("belts", f"{place}: {found} at tick {self._sim.tick}")


class _Mover:
    """A belt without a named drive, or a named drive."""

    def __init__(self, place: str, part: Any, tick: float, panel: ExpectedPanel) -> None:
        self.place, self._panel = place, panel
        self.locked = False
        """True without power, and until the start command after that."""
        self._drive, self._tick = part if isinstance(part, NamedDrive) else part.drive, tick
        self.setpoint = self.speed = part.speed
        self._patience = math.inf if part.watchdog is None else max(1, math.ceil(part.watchdog / tick - 1e-9))
        self._heard, self._silent = 0, False
        self._run, self._reverse, self._reset, self._trip, self._tripped = True, False, False, False, False

    def take(self, name: str, value: float, tick: int) -> None:
        """An input that was accepted, whomever it is for."""
        place, _, what = name.rpartition("/")
        if place != self.place:
            return
        before = self._run if what == "run" else self.setpoint
        starts = what == ("cmd_speed" if self._drive is None else "run") and value != 0.0 and before == 0.0
        self.locked = self.locked and not (starts and not self._panel.is_off("drives"))
        if what == "cmd_speed":
            self.setpoint, self._heard, self._silent = value, tick, False
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
        self.setpoint, self._silent = 0.0, True
        return True

    def check(self, image: dict[str, float], tick: int) -> None:
        """Speed, and the signals."""
        actual, before = image[f"{self.place}/speed"], self.speed
        self.speed = actual
        coast = math.copysign(max(0.0, abs(before) - self._panel.deceleration * self._tick), before)
        if self._drive is None:
            if actual != (coast if self.locked else self.setpoint):
                raise Violation("belts", f"{self.place} runs at {actual} for {self.setpoint} m/s at tick {tick}")
            return
        wanted = (
            0.0 if not self._run or self._tripped or self.locked else -self.setpoint if self._reverse else self.setpoint
        )
        most = math.inf if self._drive.acceleration is None else self._drive.acceleration * self._tick
        if self.locked:
            wrong = actual != coast
        elif self._drive.jerk is None:
            expected = before + float(np.clip(wanted - before, -most, most))
            wrong = abs(actual - expected) > 1e-9 * max(1.0, abs(wanted))
        else:
            wrong = abs(actual - before) > most * (1.0 + 1e-9) + 1e-12
        running, at_speed, fault = (image[f"{self.place}/{what}"] for what in ("running", "at_speed", "fault"))
        wrong |= (running, fault) != (self._run and not self._tripped and not self.locked, self._tripped)
        wrong |= at_speed != (abs(actual - wanted) <= 1e-9)
        if wrong:
            raise Violation("drives", f"{self.place} went from {before} to {actual} m/s, wanted {wanted}: {image}")
