# SPDX-License-Identifier: Apache-2.0
"""Gauges: observers that compute one metric each, from the end of a run's warm-up to its end."""

from __future__ import annotations

import math
from array import array
from collections.abc import Callable
from typing import Any, Protocol, runtime_checkable

import numpy as np

from conveyor_sim.columns.counters import LINE, CounterColumns
from conveyor_sim.errors import StudyError
from conveyor_sim.scene.words import shown
from conveyor_sim.simulation import Simulation
from conveyor_sim.statistics.batch_means import batch_means

COUNTING_INTERVAL = 1.0
"""s, at which bottles are counted: too few come in less for means of them to say more."""

SCUFFING_INTERVAL = 0.1
"""s, at which bottles are looked at: of one that leaves, so much at most is missed."""


class Gauge(Protocol):
    """Metric of one run."""

    def after_tick(self) -> None:
        """Observe the tick that has just ended."""

    def value(self) -> float:
        """At the end; NaN: there is none."""


@runtime_checkable
class Averaged(Gauge, Protocol):
    """One whose number is a mean over time, so that a long run alone says how well it is known."""

    @property
    def series(self) -> np.ndarray:
        """Return the series (n,), at even times, whose mean is the value."""


def half_width(gauge: Averaged) -> float | None:
    """Return the half-width of the value's 95 % interval by batch means; None if the run is too short."""
    found = batch_means(gauge.series)
    return None if found is None else found.interval.half_width


class Counted:
    """A column of the counters, which began anew as the warm-up ended."""

    def __init__(self, simulation: Simulation, device: str, column: str) -> None:
        """device: that counts bottles, or "line"."""
        self._simulation, self._column = simulation, column
        self._row = _row_of(simulation, device)

    def after_tick(self) -> None:
        """Counters need no looking at."""

    def value(self) -> float:
        """Return the present value."""
        return float(getattr(_counters(self._simulation), self._column)[self._row])


class Throughput:
    """Bottles a minute."""

    def __init__(self, simulation: Simulation, device: str) -> None:
        """device: "" for the line."""
        self._simulation, self._began = simulation, simulation.time
        self._made = Counted(simulation, device or LINE, "processed")
        self._first, self._every = simulation.tick, max(1, round(COUNTING_INTERVAL / simulation.scene.tick))
        self._counts = array("d", [0.0])

    def after_tick(self) -> None:
        """Count now and then."""
        if (self._simulation.tick - self._first) % self._every == 0:
            self._counts.append(self._made.value())

    @property
    def series(self) -> np.ndarray:
        """Bottles a minute (n,), in one COUNTING_INTERVAL after the other."""
        return np.diff(np.array(self._counts)) * (60.0 / (self._every * self._simulation.scene.tick))

    def value(self) -> float:
        """Since the warm-up."""
        return 60.0 * self._made.value() / (self._simulation.time - self._began)


class Stops:
    """Changes from running to anything else."""

    def __init__(self, simulation: Simulation, machine: str) -> None:
        """machine: "" for all."""
        counters = _counters(simulation)
        now = dict(zip(counters.name, counters.category, strict=True))
        self._running = {name: category == "running" for name, category in now.items() if category and name != LINE}
        if machine and machine not in self._running:
            wanted = ", ".join(self._running) or "one of a line with machines"
            raise StudyError(f"{shown(machine)} given as a machine, expected {wanted}")
        self._simulation, self._machines, self._stops = simulation, {machine} if machine else {*self._running}, 0

    def after_tick(self) -> None:
        """Observe the events of the tick."""
        for event in self._simulation.line.happened:
            machine, _, which = event.name.rpartition("/")
            if event.kind == "machine_state" and which == "category" and machine in self._machines:
                self._stops += self._running[machine] and event.text != "running"
                self._running[machine] = event.text == "running"

    def value(self) -> float:
        """Return the count so far."""
        return float(self._stops)


class PeakForce:
    """Largest normal contact force over every step; from the first output of bottles on, as peaks begin anew there."""

    def __init__(self, simulation: Simulation) -> None:
        self._simulation, self._began = simulation, simulation.due("bottles")
        self._force = 0.0

    def after_tick(self) -> None:
        """Look."""
        if self._began:
            self._force = max(self._force, self._simulation.peak_force or 0.0)
        self._began = self._began or self._simulation.due("bottles")

    def value(self) -> float:
        """Return the largest force, N."""
        return self._force


class Scuffing:
    """Sliding work a bottle."""

    def __init__(self, simulation: Simulation) -> None:
        self._simulation = simulation
        self._every = max(1, round(SCUFFING_INTERVAL / simulation.scene.tick))
        self._present: dict[int, float] = {}
        self._left: dict[int, float] = {}
        self._look()
        self._at_first = self._present

    def after_tick(self) -> None:
        """Look now and then."""
        if self._simulation.tick % self._every == 0:
            self._look()

    def value(self) -> float:
        """Return the work, J."""
        self._look()
        if self._left:
            return math.fsum(self._left.values()) / len(self._left)
        works = [work - self._at_first.get(bottle, 0.0) for bottle, work in self._present.items()]
        return math.fsum(works) / len(works) if works else math.nan

    def _look(self) -> None:
        damage = self._simulation.damage()
        assert damage is not None  # the effect is forced on
        now = dict(zip(damage.id.tolist(), damage.scuffing_work.tolist(), strict=True))
        for bottle in self._present.keys() - now.keys():
            self._left[bottle] = self._present[bottle]
        for bottle in now.keys() & self._left.keys():  # a station has given it back
            del self._left[bottle]
        self._present = now


class OfTag:
    """A signal over all ticks since the warm-up."""

    def __init__(self, simulation: Simulation, tag: str, take: str) -> None:
        """take: "maximum", "minimum", "last" or "change"."""
        names = simulation.process_image.signal_names
        if tag not in names:
            raise StudyError(f"{shown(tag)} given as a tag, expected a signal as `conveyor-sim tags` lists them")
        self._simulation, self._index, self._take = simulation, names.index(tag), take
        self.unit = simulation.process_image.signals[self._index].unit
        self._first = self._now()
        self._values = array("d")

    def after_tick(self) -> None:
        """Keep it."""
        self._values.append(self._now())

    @property
    def values(self) -> np.ndarray:
        """(n,), one a tick."""
        return np.array(self._values)

    def value(self) -> float:
        """Return the statistic of the observed values."""
        if self._take in ("maximum", "minimum"):
            return max(self._values) if self._take == "maximum" else min(self._values)
        return self._values[-1] - (self._first if self._take == "change" else 0.0)

    def _now(self) -> float:
        return float(self._simulation.signals()[self._index])


class MeanOfTag(OfTag):
    """The mean of a signal over all ticks."""

    def __init__(self, simulation: Simulation, tag: str) -> None:
        super().__init__(simulation, tag, "mean")

    @property
    def series(self) -> np.ndarray:
        """(n,), one a tick."""
        return self.values

    def value(self) -> float:
        """In the unit of the tag."""
        return math.fsum(self._values) / len(self._values)


class Quantile:
    """A quantile of a signal over all ticks, linear between them."""

    def __init__(self, simulation: Simulation, of: str) -> None:
        """of: a share and a tag, "0.95 zones/table/bottles"."""
        self._share, tag = share_of(of)
        self._signal = MeanOfTag(simulation, tag)
        self.unit = self._signal.unit

    def after_tick(self) -> None:
        """Keep it."""
        self._signal.after_tick()

    def value(self) -> float:
        """In the unit of the tag."""
        return float(np.quantile(self._signal.values, self._share))


class OfFunction:
    """A function of the simulation at its end, or a class that is made with it as the warm-up ends."""

    def __init__(self, simulation: Simulation, made: Callable[[Simulation], Any]) -> None:
        self._simulation, self._made = simulation, made
        self._watch = made(simulation) if isinstance(made, type) else None
        self._look: Callable[[], object] = getattr(self._watch, "after_tick", lambda: None)

    def after_tick(self) -> None:
        """Hand it on."""
        self._look()

    def value(self) -> float:
        """Return the function's value. Raise StudyError if it isn't a number."""
        found = self._made(self._simulation) if self._watch is None else self._watch.value()
        try:
            return float(found)
        except (TypeError, ValueError):
            raise StudyError(f"{self._made.__name__} returned {shown(found)}, expected a number") from None


def share_of(text: str) -> tuple[float, str]:
    """Return a share from 0 to 1 and the tag that follows it. Raise StudyError for other text."""
    first, _, tag = text.partition(" ")
    try:
        share = float(first)
    except ValueError:
        share = math.nan
    if not (0.0 <= share <= 1.0 and tag):
        raise StudyError(f"{shown(f'quantile {text}')} given, expected such as quantile 0.95 zones/table/bottles")
    return share, tag.strip()


def _counters(simulation: Simulation) -> CounterColumns:
    counters = simulation.line.counters()
    if counters is None:
        raise StudyError("the line counts no bottles, expected one with machines, infeeds or outfeeds")
    return counters


def _row_of(simulation: Simulation, device: str) -> int:
    names = list(_counters(simulation).name)
    if device not in names:
        raise StudyError(f"{shown(device)} given as a device, expected one of {', '.join(names)}")
    return names.index(device)
