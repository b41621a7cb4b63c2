# SPDX-License-Identifier: Apache-2.0
"""What holds of the devices of a line at every tick: the process image against bottles, commands and the scene."""

from __future__ import annotations

import math

import numpy as np
from fuzz.axis_invariants import AxisWatch
from fuzz.crossing import crossed
from fuzz.panel_invariants import ExpectedPanel
from fuzz.violation import Violation
from fuzz.wheel_invariants import WheelWatch
from numpy.typing import NDArray

from conveyor_sim.columns.bottles import BottleColumns
from conveyor_sim.line.commands.inputs import INJECT, CommandOutcome
from conveyor_sim.line.machines.packml import PackMLState
from conveyor_sim.scene.bodies import AxisShape, BodyShape
from conveyor_sim.scene.geometry import SegmentPiece
from conveyor_sim.scene.moving import mover_shape, movers_of
from conveyor_sim.scene.parts.inspection import Inspection
from conveyor_sim.scene.parts.machine import PackmlPart
from conveyor_sim.scene.parts.reject import Reject
from conveyor_sim.scene.parts.sink import Sink
from conveyor_sim.scene.parts.source import Source
from conveyor_sim.scene.parts.station import Station
from conveyor_sim.simulation import Simulation

F8 = NDArray[np.float64]

NEAR = 1e-7
"""Of a length: what rounding may make of a place at which something begins or ends."""

RUNNING = (PackMLState.EXECUTE, PackMLState.SUSPENDED, PackMLState.COMPLETING)
"""States in which a machine may give or take a bottle."""

RISING = {
    "fed", "removed", "produced", "taken", "taken_bad", "count", "bad", "rejected", "rejected_bad", "rejected_good",
    "processed", "good", "defective", "false_accepts", "false_rejects", "failures", "missed", "dropped", "edges",
    "forward", "backward", "starved_time", "blocked_time", "time", "bad_time", "missing", "skipped", "lost",
}  # fmt: skip
"""Signals that never fall."""


class DeviceWatch:
    """Looks at the process image after every tick. Raises Violation."""

    def __init__(self, simulation: Simulation, panel: ExpectedPanel) -> None:
        self._sim, self._panel = simulation, panel
        self._signals = simulation.process_image.signals
        self._scene = simulation.scene
        self._injected: dict[str, float] = {}
        """The last accepted value of each injected fault."""
        self._movers = [mover_shape(*mover) for mover in movers_of(simulation.scene)]
        self._now = self._before = self._values()
        self._axes, self._wheels = AxisWatch(simulation), WheelWatch(simulation)
        self._still = dict.fromkeys((axis.name for _, axis in self._movers), 0)
        """Ticks for which each moving rail has stood."""
        ledger = simulation.ledger()
        self._work = None if ledger is None else ledger.rail_work.copy()
        self._image()

    def check(self, before: BottleColumns, now: BottleColumns, outcomes: list[CommandOutcome]) -> None:
        """Check the devices between two ticks. outcomes: of the inputs of the second one."""
        for outcome in outcomes:
            if outcome.accepted and outcome.operation == INJECT:
                self._injected |= dict(zip(outcome.names, outcome.values, strict=True))
        self._before, self._now = self._now, self._values()
        self._image()
        self._rising()
        self._conservation()
        self._stopped()
        self._lines(before, now)
        self._zones(now)
        self._eyes(before, now)
        self._check_movers()
        self._axes.check(self._before, self._now, outcomes)
        self._wheels.check(self._before, self._now, outcomes)
        self._ledger()

    def in_frames(self, before: F8, after: F8) -> list[tuple[str, SegmentPiece, F8, F8]]:
        """Each moving rail at home, with the places before and after a tick, (n, 2), as seen from it."""
        return [
            (axis.name, piece, _seen(body, self._place(axis, self._before), before),
             _seen(body, self._place(axis, self._now), after))
            for bodies, axis in self._movers
            for body in bodies
            if body.cam is None  # a gate that lifts lets bottles pass
            for piece in body.at(0.0)
        ]  # fmt: skip

    def _values(self) -> dict[str, float]:
        return dict(zip(self._sim.process_image.signal_names, self._sim.signals().tolist(), strict=True))

    def _fault(self, name: str) -> float:
        """Return the value of an injected fault, 0 if it was never injected."""
        return self._injected.get(name, 0.0)

    def _place(self, axis: AxisShape, values: dict[str, float]) -> float:
        return axis.position(values[f"{axis.name}/position"])

    def _image(self) -> None:
        """Every signal is of its type."""
        for signal in self._signals:
            value = self._now[signal.name]
            good = math.isfinite(value)
            if signal.kind == "bool":
                good = value in (0.0, 1.0)
            elif signal.kind == "count":
                good = float(value).is_integer() and (value >= signal.low or signal.name.endswith("/pulses"))
            if not good:
                raise Violation("signal of another type", f"{signal.name} is {value} ({signal.kind})")

    def _rising(self) -> None:
        for name, value in self._now.items():
            device, _, signal = name.rpartition("/")
            # The state of an alarm has the alarm's own name, such as `alarms/lost`.
            if device != "alarms" and signal in RISING and value < self._before[name]:
                raise Violation("count that falls", f"{name} went from {self._before[name]} to {value}")

    def _conservation(self) -> None:
        """All bottles that come and go do so by a device."""
        scene, now, counts = self._scene, self._now, self._sim.counts
        fed = sum(now[f"infeeds/{name}/fed"] for name in scene.infeeds)
        fed += sum(now[f"spills/{name}/dropped"] for name in scene.spills)
        held = 0.0
        gone = sum(now[f"outfeeds/{name}/removed"] for name in scene.outfeeds)
        for name, machine in scene.machines.items():
            place = f"machines/{name}"
            if isinstance(machine, Source):
                fed += now[f"{place}/produced"]
            elif isinstance(machine, Sink):
                gone += now[f"{place}/taken"]
                _at_most(now, f"{place}/taken_bad", f"{place}/taken")
            elif isinstance(machine, Reject):
                gone += now[f"{place}/rejected"]
                if now[f"{place}/rejected_bad"] + now[f"{place}/rejected_good"] != now[f"{place}/rejected"]:
                    raise Violation("bad and good", f"{place}: not all rejected are one or the other")
            elif isinstance(machine, Station):
                inside = now[f"{place}/held"] if machine.carries else now[f"{place}/holds"]
                if inside > machine.capacity or (inside > 0.0) != now[f"{place}/holds"]:
                    raise Violation("too full", f"{place} holds {inside}, {machine.capacity} at most")
                held += inside
                if now[f"{place}/good"] + now[f"{place}/defective"] != now[f"{place}/processed"]:
                    raise Violation("bad and good", f"{place}: not all processed are good or defective")
            else:
                _at_most(now, f"{place}/bad", f"{place}/count")
            if isinstance(machine, PackmlPart):
                self._machine(place)
        if (fed, gone, held) != (counts.fed, counts.removed, counts.held):
            raise Violation("lost bottle", f"devices fed {fed}, removed {gone} and hold {held}, {counts} told")

    def _machine(self, place: str) -> None:
        """What a machine says of itself goes together."""
        now, before = self._now, self._before
        state = int(now[f"{place}/state"])
        if now[f"{place}/running"] and state not in RUNNING:
            raise Violation("machine", f"{place} runs in state {state} at tick {self._sim.tick}")
        if now[f"{place}/cur_rate"] > 0.0 and state not in (PackMLState.EXECUTE, PackMLState.COMPLETING):
            raise Violation("machine", f"{place} has a rate in state {state} at tick {self._sim.tick}")
        counters = [f"{place}/{what}" for what in ("produced", "taken", "processed") if f"{place}/{what}" in now]
        moved = any(now[name] > before[name] for name in counters)
        if moved and (state not in RUNNING or now[f"{place}/fault"]):
            raise Violation("machine", f"{place} works on a bottle in state {state} at tick {self._sim.tick}")

    def _stopped(self) -> None:
        """Check that an inspection or a reject runs unless it has the fault `stop`; a reject needs power."""
        for name, machine in self._scene.machines.items():
            place = f"machines/{name}"
            if isinstance(machine, (Inspection, Reject)):
                running, stop = self._now[f"{place}/running"], self._fault(f"{place}/stop")
                off = isinstance(machine, Reject) and self._panel.is_off("machines")
                if running == (stop or off):
                    raise Violation("machine", f"{place}/running is {running} with {place}/stop at {stop}")

    def _lines(self, before: BottleColumns, now: BottleColumns) -> None:
        """Check that counters and inspections count the bottles that passed; a stopped inspection counts none."""
        scene = self._scene
        lines = [(f"counters/{name}", line, ("forward", "backward")) for name, line in scene.counters.items()]
        lines += [
            (f"machines/{name}", machine, ("count", ""))
            for name, machine in scene.machines.items()
            if isinstance(machine, Inspection)
        ]
        gone = np.setdiff1d(before.id, now.id).size
        for place, line, words in lines:
            passed = _passed(np.array(line.from_), np.array(line.to), before, now)
            blind, taken = self._fault(f"{place}/stop") != 0.0, gone
            if blind:
                passed, taken = [(0, 0), (0, 0)], 0
            for word, (least, most) in zip(words, passed, strict=True):
                counted = 0.0 if not word else self._now[f"{place}/{word}"] - self._before[f"{place}/{word}"]
                # Those that were taken away after this tick's steps may have passed.
                if word and not least <= counted <= most + taken:
                    raise Violation("counted wrongly", f"{place}/{word}: {counted} in a tick, {least} to {most} passed")

    def _zones(self, now: BottleColumns) -> None:
        """Check that zones count the bottles inside, plus the injected offset, and never less than none."""
        for name, zone in self._scene.zones.items():
            offset = self._fault(f"zones/{name}/offset")
            corners, at = np.array(zone.region), np.column_stack([now.x, now.y])
            count = self._now[f"zones/{name}/bottles"]
            size = float(np.ptp(corners, axis=0).max())
            sides = zip(corners, np.roll(corners, -1, axis=0), strict=True)
            edge = np.min([SegmentPiece(tuple(a), tuple(b)).distance(at) for a, b in sides], axis=0, initial=math.inf)
            inside, unsure = _winds(corners, at), edge < NEAR * size
            least, most = np.count_nonzero(inside & ~unsure), np.count_nonzero(inside | unsure)
            if not max(0.0, least + offset) <= count <= max(0.0, most + offset):
                raise Violation(
                    "zone counted wrongly", f"zones/{name}: {count} with offset {offset}, {least} to {most} inside"
                )
            if zone.full_at is not None and self._now[f"zones/{name}/full"] != (count >= zone.full_at):
                raise Violation("zone counted wrongly", f"zones/{name}/full with {count} of {zone.full_at}")

    def _eyes(self, before: BottleColumns, now: BottleColumns) -> None:
        """An eye without delays and faults shows who is in its beam; later comers are seen at the next tick."""
        radius = self._sim.model.type_radius[now.type]
        at, there = np.column_stack([now.x, now.y]), np.isin(now.id, before.id)
        gone = np.setdiff1d(before.id, now.id).size
        for name, eye in self._scene.photo_eyes.items():
            if (
                any(fault.startswith(f"photo_eyes/{name}/") for fault in self._injected)
                or eye.debounce
                or eye.on_delay
                or eye.off_delay
            ):
                continue
            away = SegmentPiece(eye.from_, eye.to).distance(at)
            sure, perhaps = away < radius * (1.0 - 1e-4), away < radius * (1.0 + 1e-4)
            blocked = self._now[f"photo_eyes/{name}/blocked"]
            if blocked and not (perhaps & there).any() and not gone:
                raise Violation("eye", f"{name} is blocked at tick {self._sim.tick}, and no bottle is in its beam")
            if not blocked and (sure & there).any():
                raise Violation("eye", f"{name} is free at tick {self._sim.tick}, and a bottle is in its beam")
            rose, fell = (self._now[f"photo_eyes/{name}/{edge}"] for edge in ("rose", "fell"))
            if max(rose, fell) > self._sim.time + 1e-9:
                raise Violation("eye", f"{name}: an edge at {rose} or {fell} s, at {self._sim.time} s")

    def _check_movers(self) -> None:
        """No rail is off its course, or faster than it can, unless its drive is held up; none leaves its end stops."""
        for n, (_, axis) in enumerate(self._movers):
            before, now = self._place(axis, self._before), self._place(axis, self._now)
            position, held_up = self._now[f"{axis.name}/position"], self._held_up(n)
            if not 0.0 <= position <= 1.0:
                raise Violation("off its course", f"{axis.name} at {position} of its stroke")
            most = axis.max_speed * self._scene.tick * (1.0 + 1e-9) + 1e-12 * axis.stroke
            if abs(now - before) > most and not held_up:
                raise Violation("off its course", f"{axis.name} went {now - before} in a tick, {most} at most")
            if self._now[f"{axis.name}/blocked"] and not held_up:
                raise Violation("blocked by nothing", f"{axis.name} at tick {self._sim.tick}")
            if held_up and axis.limit is None:
                raise Violation("off its course", f"{axis.name} is held up, and has no limit")
            self._still[axis.name] = self._still[axis.name] + 1 if now == before and not held_up else 0

    def _held_up(self, n: int) -> bool:
        """Whether the drive of a moving rail was at its limit in the last tick."""
        moving = self._sim._state.world.moving
        return moving is not None and moving.actuators is not None and bool(moving.actuators.left[n])

    def _ledger(self) -> None:
        """A rail that stands does no work."""
        ledger = self._sim.ledger()
        if ledger is None or self._work is None:
            return
        if not np.isfinite([ledger.residual, ledger.turnover, *ledger.rail_work, *ledger.belt_work]).all():
            raise Violation("not finite", f"the ledger at tick {self._sim.tick}")
        for n, (_, axis) in enumerate(self._movers):
            if self._still[axis.name] > 1 and ledger.rail_work[n] != self._work[n]:
                raise Violation("work of a rail at rest", f"{axis.name} at tick {self._sim.tick}")
        self._work = ledger.rail_work.copy()


def _at_most(values: dict[str, float], one: str, other: str) -> None:
    if values[one] > values[other]:
        raise Violation("bad and good", f"{one} is more than {other}")


def _passed(start: F8, end: F8, before: BottleColumns, now: BottleColumns) -> list[tuple[int, int]]:
    """Least and most that passed from the left to the right of a line, and back."""
    was = np.column_stack([before.x, before.y])[np.isin(before.id, now.id)]
    at = np.column_stack([now.x, now.y])[np.isin(now.id, before.id)]
    along = end - start
    length = float(np.hypot(*along))
    left, right = (along[0] * (points - start)[:, 1] - along[1] * (points - start)[:, 0] for points in (was, at))
    crossing = crossed(SegmentPiece(tuple(start), tuple(end)), was, at)
    # What begins or ends on the line, or passes at one of its ends, may be counted or not.
    scale = length * max(1.0, float(np.abs([start, end]).max()))
    unsure = (np.abs(left) < NEAR * scale) | (np.abs(right) < NEAR * scale)
    with np.errstate(divide="ignore", invalid="ignore"):
        place = ((was + (left / (left - right))[:, None] * (at - was) - start) @ along) / length**2
    unsure |= (np.abs(place) < NEAR * scale) | (np.abs(place - 1.0) < NEAR * scale)
    ways = []
    for way in (left > right, left < right):
        ways.append((int(np.count_nonzero(crossing & way & ~unsure)), int(np.count_nonzero((crossing & way) | unsure))))
    return ways


def _winds(corners: F8, at: F8) -> NDArray[np.bool_]:
    """Whether a polygon winds about points."""
    turned = np.zeros(len(at))
    for one, other in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        a, b = one - at, other - at
        turned += np.arctan2(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0], (a * b).sum(axis=1))
    return np.asarray(np.abs(turned) > math.pi)


def _seen(body: BodyShape, position: float, points: F8) -> F8:
    """Points (n, 2) as seen from a mover at a position (m or rad): as if it were at home."""
    start = np.array(body.pivot)
    moved = points - start - np.array(body.along) * position
    cos, sin = math.cos(-body.turning * position), math.sin(-body.turning * position)
    return np.asarray(start + moved @ np.array([[cos, sin], [-sin, cos]]))
