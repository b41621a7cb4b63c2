# SPDX-License-Identifier: Apache-2.0
"""Observables of a long run for a line engineer: throughput, forces in queues, impacts, time to fill, spacing."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from conveyor_sim.columns.bottles import BottleColumns, ContactColumns
from conveyor_sim.columns.itinerary import Itinerary
from conveyor_sim.scene import Scene
from conveyor_sim.simulation import Simulation

OUTPUT_RATE = 50.0
"""Hz, about, at which bottles are looked at."""

STOP_FORCE, OVERLAP = "stop force", "largest overlap"
"""Observables that are reported beside the flow of impulses."""

LOOP = 3
"""Belts at least, for a bottle to come round (`Itinerary`)."""

_ROWS = 256
"""Bottles at a time whose distances to all others are held in memory."""


def measuring(scene: Scene) -> dict[str, Any]:
    """Fields to lay over a scene so that `observe` can look: peaks on, bottles output at about OUTPUT_RATE."""
    every = max(1, round(1e9 / (OUTPUT_RATE * scene.tick_ns)))
    return {"outputs": {"bottles": 1e9 / (scene.tick_ns * every)}, "effects": {"peaks": "on"}}


class Record:
    """Record of a run from which observables are computed."""

    def __init__(self, simulation: Simulation) -> None:
        """Look at the state before the first tick. ValueError if the scene has no peaks."""
        scene = simulation.scene
        if not simulation.model.has("peaks") or not scene.every("bottles"):
            raise ValueError("expected a scene with peaks and an output of bottles: lay measuring(scene) over it")
        self.scene = scene
        self.interval = scene.every("bottles") * scene.tick
        """s, between outputs of bottles."""
        self.itinerary = Itinerary(len(scene.belts), len(simulation.model.plant.bottles))
        self.queue_forces: list[NDArray[np.float64]] = []
        """N, by output: time-mean, since the output before, of each touched bottle's summed normal forces."""
        self.peak_forces: list[NDArray[np.float64]] = []
        """N, by output: each touched bottle's largest normal force of any one contact since the output before."""
        self.rail_forces: list[NDArray[np.float64]] = []
        """N, by output of the second half: sum of the normal forces on each rail, (rails,)."""
        self.overlap = 0.0
        """Largest at an output, over the smaller diameter."""
        self.filled: float | None = None
        """s, when every infeed that counts had fed its last bottle, or the first was blocked."""
        self.removed = self.removed_by_half = 0
        self.bottles = simulation.bottles()
        self._simulation = simulation
        self.take()

    def take(self) -> None:
        """Look at the state after a tick."""
        simulation = self._simulation
        if any(self.scene.exits()):
            self.removed = simulation.counts.removed
            if simulation.tick <= self.scene.duration_ticks // 2:
                self.removed_by_half = self.removed
        if self.filled is None and self.scene.infeeds and self._is_filled():
            self.filled = simulation.time
        last = simulation.tick == self.scene.duration_ticks
        if simulation.due("bottles") or last:
            self.bottles = simulation.bottles()
        if simulation.due("bottles"):
            self.itinerary.take(simulation.time, self.bottles)
            touched = self.bottles.peak_force > 0.0
            self.queue_forces.append(self.bottles.impulse[touched] / self.interval)
            self.peak_forces.append(self.bottles.peak_force[touched])
            contacts = simulation.contacts()
            self.overlap = max(self.overlap, _largest_overlap(simulation, self.bottles, contacts))
            if simulation.tick > self.scene.duration_ticks // 2:
                self.rail_forces.append(_rail_forces(simulation, contacts))

    def _is_filled(self) -> bool:
        signals = dict(zip(self._simulation.process_image.signal_names, self._simulation.signals(), strict=True))
        infeeds = self.scene.infeeds.items()
        counted = [signals[f"infeeds/{name}/fed"] == infeed.count for name, infeed in infeeds if infeed.count]
        return (bool(counted) and all(counted)) or any(signals[f"infeeds/{name}/blocked"] for name, _ in infeeds)


@dataclass(frozen=True)
class Observable:
    """A number that a run amounts to."""

    name: str
    unit: str
    description: str
    of: Callable[[Record], float | None]
    """None where the scene can have none."""
    judged: bool = True
    """True if a setting must reproduce the observable to be eligible."""
    flow: bool = False
    """True if it is a count, a rate or a position, by which impulses are judged."""


def _throughput(record: Record) -> float | None:
    if any(record.scene.exits()):
        ticks = record.scene.duration_ticks
        return (record.removed - record.removed_by_half) * 60.0 / ((ticks - ticks // 2) * record.scene.tick)
    if len(record.scene.belts) < LOOP:
        return None
    return record.itinerary.per_minute(max(record.itinerary.returns, key=len))[1]


def _mean_queue_force(record: Record) -> float | None:
    forces = np.concatenate(record.queue_forces)
    return None if not record.scene.contacts else float(forces.mean()) if forces.size else 0.0


def _high_queue_force(record: Record) -> float | None:
    return _percentile(record, record.queue_forces, 95.0)


def _high_peak_force(record: Record) -> float | None:
    return _percentile(record, record.peak_forces, 99.0)


def _time_to_fill(record: Record) -> float | None:
    if not record.scene.infeeds:
        return None
    return record.scene.duration if record.filled is None else record.filled


def _spacing(record: Record) -> float | None:
    x, y = record.bottles.x, record.bottles.y
    if len(x) < 2:
        return None
    nearest = np.zeros(len(x))
    for start in range(0, len(x), _ROWS):
        rows = np.arange(start, min(start + _ROWS, len(x)))
        apart = np.hypot(x[rows, None] - x, y[rows, None] - y)
        apart[rows - start, rows] = np.inf
        nearest[rows] = apart.min(axis=1)
    return float(nearest.mean())


def _stop_force(record: Record) -> float | None:
    if not record.scene.rails or not record.rail_forces:
        return None
    return float(np.mean(record.rail_forces, axis=0).max(initial=0.0))


def _overlap_percent(record: Record) -> float | None:
    return 100.0 * record.overlap if record.scene.contacts else None


OBSERVABLES = (
    Observable(
        "throughput",
        "1/min",
        "Bottles removed in the second half of the run, a minute; on a line where none is removed and with at "
        "least three belts, bottles that came back to the belt with the most returns.",
        _throughput,
        flow=True,
    ),
    Observable(
        "mean queue force",
        "N",
        "All normal forces on a bottle, summed, in the mean over 20 ms; mean over bottles that touch anything.",
        _mean_queue_force,
    ),
    Observable(
        "queue force, 95th percentile",
        "N",
        "The same, its 95th percentile over bottles and time.",
        _high_queue_force,
    ),
    Observable(
        "peak force, 99th percentile",
        "N",
        "Largest normal force of one contact of a bottle in 20 ms, impacts included; 99th percentile over bottles that "
        "touch anything and time.",
        _high_peak_force,
    ),
    Observable(
        "time to fill",
        "s",
        "Until every infeed that counts has fed its last bottle, or the first infeed is blocked; the duration, if "
        "neither happens.",
        _time_to_fill,
        flow=True,
    ),
    Observable(
        "spacing",
        "m",
        "Distance from a bottle's axis to the nearest other's at the end, mean over bottles.",
        _spacing,
        flow=True,
    ),
    Observable(
        STOP_FORCE,
        "N",
        "Sum of the normal forces on the rail that bears most, in the mean over the second half of the run. It is "
        "reported of impulses; no setting is judged by it.",
        _stop_force,
        judged=False,
    ),
    Observable(
        OVERLAP,
        "%",
        "Largest overlap of a contact over the smaller diameter, seen every 20 ms. What a stiffness amounts to, not "
        "what a line does: no setting is judged by it.",
        _overlap_percent,
        judged=False,
    ),
)


def observe(simulation: Simulation) -> dict[str, float]:
    """Run to the end of the scene's duration; the observables that it has, by name.

    The scene needs `measuring` laid over it, else ValueError. SimulationError if the state is no longer finite.
    """
    record = Record(simulation)
    while simulation.tick < simulation.scene.duration_ticks:
        simulation.advance()
        record.take()
    values = {observable.name: observable.of(record) for observable in OBSERVABLES}
    return {name: value for name, value in values.items() if value is not None}


def _percentile(record: Record, forces: list[NDArray[np.float64]], share: float) -> float | None:
    pooled = np.concatenate(forces)
    return None if not record.scene.contacts else float(np.percentile(pooled, share)) if pooled.size else 0.0


def _rail_forces(simulation: Simulation, contacts: ContactColumns) -> NDArray[np.float64]:
    on_rails = contacts.kind == 1
    rails = contacts.b[on_rails].astype(np.int64)
    sums = np.bincount(rails, contacts.normal_force[on_rails], minlength=len(simulation.model.rails))
    return np.asarray(sums, dtype=np.float64)


def _largest_overlap(simulation: Simulation, bottles: BottleColumns, contacts: ContactColumns) -> float:
    """Over the diameter of the bottle, in a pair of the smaller one."""
    diameter = 2.0 * simulation.model.type_radius[bottles.type]
    pairs = contacts.kind == 0
    least = diameter[np.searchsorted(bottles.id, contacts.a)]
    least[pairs] = np.minimum(least[pairs], diameter[np.searchsorted(bottles.id, contacts.b[pairs])])
    return float((contacts.overlap / least).max(initial=0.0))
