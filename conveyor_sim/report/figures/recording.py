# SPDX-License-Identifier: Apache-2.0
"""Data of the figures of a bag, read in a few passes that retain only the drawn data."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields
from functools import cached_property
from typing import Final

import numpy as np
from numpy.typing import NDArray

from conveyor_sim.bag.forced import forced_signals
from conveyor_sim.bag.messages.encode import to_image
from conveyor_sim.bag.reader import Bag
from conveyor_sim.columns.bottles import BottleColumns, ContactColumns
from conveyor_sim.columns.damage import DamageColumns, RailWearColumns
from conveyor_sim.columns.itinerary import Itinerary
from conveyor_sim.columns.ledger import Ledger
from conveyor_sim.errors import BagError, ConveyorError
from conveyor_sim.report.bottle_counts import BottleCounter, BottleCounts
from conveyor_sim.report.figures.data import (
    Contacts,
    Damage,
    EnergySeries,
    Floats,
    Flow,
    PeakForceSeries,
    PlantFrame,
    StaticGeometry,
    Velocity,
)
from conveyor_sim.scene import Scene, parse_again, parse_overrides
from conveyor_sim.scene.geometry import RailShape, initial_bottles
from conveyor_sim.scene.moving import bodies_by_signals, place_signals

Integers = NDArray[np.int64]

_DEFAULT_PARTS: Final = (0.25, 0.5, 0.75, 1.0)
_DEFAULT_FED: Final = (1, 50)  # the paper's Figs. 8 and 9
_BOTTLE_BOTTLE: Final = 0


@dataclass(frozen=True)
class _Summary:
    """One pass over all Bottles: `ticks` (n,), and `ids` of all bottles ever seen, ascending."""

    ticks: Integers
    ids: Integers
    flow: Flow
    peak_force: PeakForceSeries


class Recording:
    """A bag as the pictures see it.

    Raises BagError if it holds no Bottles, and SceneError if its scene can't be read by this version.
    """

    def __init__(self, bag: Bag) -> None:
        self._bag = bag
        if not bag.counts.get("bottles"):
            raise BagError(f"{bag.path}: no message of topic bottles, expected at least one to draw")
        self.scene = _scene(bag)
        self.plant = StaticGeometry.of(self.scene)
        self.belts: tuple[str, ...] = tuple(bag.line.belts)
        self._initial = len(list(initial_bottles(self.scene)))

    @property
    def flow(self) -> Flow:
        """Bottles fed, on each belt and removed, at every recorded Bottles."""
        return self._summary.flow

    @property
    def peak_force(self) -> PeakForceSeries:
        """Peak contact force over the bottles, at every recorded Bottles."""
        return self._summary.peak_force

    @cached_property
    def forced(self) -> tuple[str, ...]:
        """Names of the signals that were forced at any time, in the order in which they were."""
        return forced_signals(self._bag)

    @property
    def energy(self) -> EnergySeries | None:
        """The energy ledger, at every recorded one; None if there is none."""
        frames = list(self._bag.read("ledger"))
        if not frames:
            return None
        values = {
            field.name: np.array([getattr(frame.data, field.name) for frame in frames], dtype=np.float64)
            for field in fields(Ledger)
        }
        # The last entry is the floor's.
        belts = values.pop("belt_work")[:, :-1]
        rails = values.pop("rail_work").sum(axis=1)
        time = np.array([frame.time for frame in frames], dtype=np.float64)
        return EnergySeries(time=time, belts=belts, rails=rails, **values)

    @property
    def damage(self) -> Damage | None:
        """Return the damage up to the last recorded Damage message; None without one."""
        known = [field.name for field in fields(DamageColumns) if field.name not in ("id", "type", "x", "y")]
        worst: dict[str, dict[int, float]] = {name: {} for name in known}
        ids: set[int] = set()
        time = None
        for frame in self._bag.read("damage"):
            time = frame.time
            ids.update(frame.data.id.tolist())
            for name, by_bottle in worst.items():
                values = getattr(frame.data, name)
                there = np.isfinite(values)
                for bottle, value in zip(frame.data.id[there].tolist(), values[there].tolist(), strict=True):
                    by_bottle[bottle] = max(value, by_bottle.get(bottle, 0.0))
        if time is None:
            return None
        wear: RailWearColumns | None = None
        for last in self._bag.read("rail_wear"):
            wear = last.data
        none = np.zeros(0)
        limits = {name: limit for name in known if (limit := getattr(self.scene.limits, name)) is not None}
        return Damage(
            time=time,
            wear=wear or RailWearColumns(np.zeros(0, np.uint32), none, none, none, none, none),
            bottles=len(ids),
            worst={name: np.array(list(by_bottle.values())) for name, by_bottle in worst.items()},
            limits=limits,
        )

    def frames(self, times: Sequence[float] | None) -> list[PlantFrame]:
        """Return the recorded frames nearest to `times` (s), in ascending order, without repetition.

        Default: a quarter, half, three quarters and the end of the recording.
        Raise ConveyorError if a time is outside it.
        """
        ticks = self._drawable_ticks
        seconds = self._seconds(ticks)
        if times is None:
            times = [float(seconds[0] + part * (seconds[-1] - seconds[0])) for part in _DEFAULT_PARTS]
        for time in times:
            if not seconds[0] - self._tick <= time <= seconds[-1] + self._tick:
                raise ConveyorError(
                    f"{self._bag.path}: time {time:g} s given, "
                    f"expected one within the recording, {seconds[0]:g} to {seconds[-1]:g} s"
                )
        chosen = np.unique([ticks[int(np.argmin(np.abs(seconds - time)))] for time in times])
        wanted = set(chosen.tolist())
        contacts = {f.tick: f.data for f in self._bag.read("contacts", wanted)} if self._has_contacts else {}
        return [self._frame(f.tick, f.data, contacts.get(f.tick)) for f in self._bag.read("bottles", wanted)]

    def velocities(self, bottles: Sequence[int] | None) -> list[Velocity]:
        """Velocities of some bottles by id; default: the 1st and the 50th fed, or the last if there are fewer.

        Raises ConveyorError if a bottle was never recorded.
        """
        ids = self._summary.ids
        if bottles is None:
            fed = ids[ids >= self._initial] if (ids >= self._initial).any() else ids
            bottles = list(dict.fromkeys(int(fed[min(place, len(fed)) - 1]) for place in _DEFAULT_FED if len(fed)))
        for bottle in bottles:
            if bottle not in ids:
                known = f"{ids[0]} to {ids[-1]}" if len(ids) else "none"
                raise ConveyorError(
                    f"{self._bag.path}: bottle {bottle} given, expected the id of a recorded one: {known}"
                )
        series = self._bag.bottle_series(bottles)
        return [
            Velocity(
                bottle=bottle,
                born=max(0, bottle - self._initial + 1),
                time=series[bottle].time,
                vx=series[bottle].vx,
                vy=series[bottle].vy,
                belt=series[bottle].belt.astype(np.int64),
            )
            for bottle in bottles
        ]

    def _frame(self, tick: int, bottles: BottleColumns, contacts: ContactColumns | None) -> PlantFrame:
        return PlantFrame(
            time=self._bag.time(tick),
            x=bottles.x,
            y=bottles.y,
            theta=bottles.theta,
            radius=np.asarray(self._bag.line.type_radius)[bottles.type],
            speed=np.hypot(bottles.vx, bottles.vy),
            belt_speeds=self._belt_speeds(tick),
            contacts=None if contacts is None else contact_lines(bottles, contacts),
            moving=self._moving(tick),
        )

    @cached_property
    def _tick(self) -> float:
        return float(self._bag.line.tick_ns * 1e-9)

    def _seconds(self, ticks: Integers) -> Floats:
        return np.asarray(ticks * self._tick, dtype=np.float64)

    @cached_property
    def _has_contacts(self) -> bool:
        return bool(self._bag.counts.get("contacts"))

    @cached_property
    def _drawable_ticks(self) -> Integers:
        """Ticks at which there are bottles and, if contacts were recorded, contacts too."""
        ticks = self._summary.ticks
        if not self._has_contacts:
            return ticks
        both = np.intersect1d(ticks, self._bag.ticks("contacts"))
        return both if len(both) else ticks

    @cached_property
    def _belt_records(self) -> tuple[Integers, Floats]:
        frames = [(frame.tick, frame.data.actual) for frame in self._bag.belts()]
        speeds = np.array([speeds for _, speeds in frames], dtype=np.float64).reshape(len(frames), len(self.belts))
        return np.array([tick for tick, _ in frames], dtype=np.int64), speeds

    def _belt_speeds(self, tick: int) -> Floats:
        """Actual speeds (belts,) m/s as last recorded up to `tick`; those of the scene before."""
        ticks, speeds = self._belt_records
        last = int(np.searchsorted(ticks, tick, side="right")) - 1
        return self.plant.speeds if last < 0 else speeds[last]

    @cached_property
    def _place_records(self) -> tuple[Integers, Floats]:
        """Ticks (n,) and values (n, signals) of `place_signals` in the recorded process images."""
        signals, names = place_signals(self.scene), list(self._bag.line.signal_names)
        columns = [names.index(signal) for signal in signals]
        frames = list(self._bag.messages("signals")) if signals else []
        ticks = np.array([frame.tick for frame in frames], dtype=np.int64)
        values = [to_image(frame.data).truth[columns] for frame in frames]
        return ticks, np.array(values, dtype=np.float64).reshape(len(frames), len(signals))

    def _moving(self, tick: int) -> tuple[RailShape, ...]:
        """Bodies where they were last recorded up to `tick`; none before, when they are as at first."""
        ticks, values = self._place_records
        last = int(np.searchsorted(ticks, tick, side="right")) - 1
        if last < 0:
            return ()
        places = dict(zip(place_signals(self.scene), values[last].tolist(), strict=True))
        return bodies_by_signals(self.scene, places.__getitem__)

    @cached_property
    def _summary(self) -> _Summary:
        ticks: list[int] = []
        on_belt: list[Integers] = []
        entered: list[list[int]] = []
        forces: list[tuple[float, float, int]] = []
        before = np.empty(0, dtype=np.int64)
        new: list[Integers] = []
        itinerary = Itinerary(len(self.belts), self._initial)
        present: list[int] = []
        counter = BottleCounter("events" in self._bag.counts)
        for events in self._bag.read("events"):
            counter.take_events(events.data)
        for frame in self._bag.bottles():
            ids, belt = frame.data.id.astype(np.int64), frame.data.belt.astype(np.int64)
            new.append(np.setdiff1d(ids, before, assume_unique=True))
            before = ids
            ticks.append(frame.tick)
            present.append(len(ids))
            counter.take_bottles(frame.data.id)
            on_belt.append(np.bincount(belt[belt >= 0], minlength=len(self.belts)))
            itinerary.take(frame.time, frame.data)
            entered.append([len(times) for times in itinerary.entries])
            forces.append(_peak(ids, frame.data.peak_force))
        tick_array = np.array(ticks, dtype=np.int64)
        time = self._seconds(tick_array)
        flow = Flow(
            time=time,
            **_columns([counter.at(*now) for now in zip(ticks, present, strict=True)]),
            present=np.array(present, dtype=np.int64),
            on_belt=np.array(on_belt, dtype=np.int64),
            entered=np.array(entered, dtype=np.int64).reshape(len(ticks), len(self.belts)),
        )
        force = np.array(forces, dtype=np.float64)
        peak = PeakForceSeries(time, force[:, 0], force[:, 1], force[:, 2].astype(np.int64))
        return _Summary(tick_array, np.unique(np.concatenate(new)), flow, peak)


def _columns(counts: Sequence[BottleCounts]) -> dict[str, Integers | None]:
    """Return fed, removed and held (n,); None without recorded events."""
    columns = {name: [getattr(row, name) for row in counts] for name in ("fed", "removed", "held")}
    return {name: None if None in column else np.array(column, dtype=np.int64) for name, column in columns.items()}


def contact_lines(bottles: BottleColumns, contacts: ContactColumns) -> Contacts:
    """Lines (n, 2, 2) from axis to axis, or from axis to the point on the rail, with their normal forces.

    A bottle that is not among `bottles` counts as lying at the point of contact.
    """
    point = np.stack([contacts.x, contacts.y], axis=1)
    lines = np.stack([_axes(bottles, contacts.a, point), point], axis=1)
    between_bottles = contacts.kind == _BOTTLE_BOTTLE
    lines[between_bottles, 1] = _axes(bottles, contacts.b[between_bottles], point[between_bottles])
    return Contacts(lines, np.asarray(contacts.normal_force, dtype=np.float64))


def _axes(bottles: BottleColumns, ids: NDArray[np.uint64], otherwise: Floats) -> Floats:
    if not len(bottles.id):
        return otherwise
    at = np.searchsorted(bottles.id, ids).clip(max=len(bottles.id) - 1)
    axis = np.stack([bottles.x[at], bottles.y[at]], axis=1)
    return np.where((bottles.id[at] == ids)[:, None], axis, otherwise)


def _peak(ids: Integers, peak_force: Floats) -> tuple[float, float, int]:
    if not len(ids):
        return 0.0, 0.0, -1
    return float(peak_force.max()), float(np.percentile(peak_force, 99.0)), int(ids[np.argmax(peak_force)])


def _scene(bag: Bag) -> Scene:
    """Return the scene of the run, from the recorded text and the overrides at loading."""
    return parse_again(bag.line.scene_text, f"{bag.path} (recorded scene)", parse_overrides(bag.line.overrides))
