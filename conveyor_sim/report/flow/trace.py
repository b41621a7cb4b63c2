# SPDX-License-Identifier: Apache-2.0
"""Traces of lone bottles: each leg leads from an entry, or from a station's return, to where the bottle ends."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from conveyor_sim.errors import SimulationError
from conveyor_sim.line.devices.belt_surfaces import BeltSurfaces
from conveyor_sim.physics.model import build_model
from conveyor_sim.physics.state import State
from conveyor_sim.physics.stepping.tick import Integration
from conveyor_sim.report.flow.guides import Guides, left_of
from conveyor_sim.report.flow.surfaces import NONE, Indices, SurfaceMap, running_speeds
from conveyor_sim.report.flow.trace_scene import trace_scene
from conveyor_sim.report.flow.track import CHUNK, Track
from conveyor_sim.scene.geometry import Array, initial_bottles
from conveyor_sim.scene.parts.movers import Pusher
from conveyor_sim.scene.parts.outfeed import Outfeed
from conveyor_sim.scene.parts.sink import Sink
from conveyor_sim.scene.parts.spill import Spill
from conveyor_sim.scene.parts.station import Station
from conveyor_sim.scene.polygons import inside
from conveyor_sim.scene.problems import Path
from conveyor_sim.scene.schema import Grid, Scene, Single
from conveyor_sim.scene.types import XY

_STEP = 0.05
"""m"""

_ASIDE = 0.25 * _STEP
"""m, largest motion to the side in a step: without a limit, the path turns where a wide guide comes near."""

_MOST_STEPS = 4000
"""Steps of all estimates of a scene, 200 m."""

_LANE = 1.0
"""m, farthest guide that leads a bottle."""


class Takers:
    """Devices that take bottles, with their regions."""

    def __init__(self, regions: Sequence[tuple[Path, Sequence[XY]]]) -> None:
        """Store the path of each device and the corners of its region, m."""
        self._regions = regions
        corners = [np.asarray(region) for _, region in regions]
        self._low = np.array([polygon.min(axis=0) for polygon in corners]).reshape(-1, 2)
        self._high = np.array([polygon.max(axis=0) for polygon in corners]).reshape(-1, 2)

    def near(self, points: Array) -> Iterator[tuple[Path, Sequence[XY]]]:
        """Yield the devices whose boxes meet that of points (k, 2), m."""
        apart = (points.min(axis=0) > self._high).any(axis=1) | (points.max(axis=0) < self._low).any(axis=1)
        return (self._regions[index] for index in np.flatnonzero(~apart).tolist())


def drift(
    start: Array,
    along: Array,
    radius: float,
    surfaces: SurfaceMap,
    guides: Guides,
    takers: Takers,
    steps: int,
) -> tuple[Array, Array, Path | None]:
    """Return times (k,) s and places (k, 2) of a bottle that moves with the belts, and the device that takes it.

    start: place, m. along: unit vector of its motion. radius: of the bottle, m. takers: devices that take bottles. It
    follows the middle between near guides, or a guide that it touches. It ends after a number of steps or beside the
    belts, without a device (None).
    """
    place, time, speed = start.copy(), 0.0, 0.0
    times, places = [], []
    for _ in range(steps):
        carrier = int(surfaces.under(place[None])[0])
        if carrier != NONE and not surfaces[carrier].rests:
            along, speed = surfaces[carrier].heading(place[None])[0], abs(surfaces[carrier].running)
        if carrier == NONE or speed == 0.0:
            break
        left = left_of(along[None])
        to_left, to_right = float(guides.distance(place[None], left)[0]), float(guides.distance(place[None], -left)[0])
        if max(to_left, to_right) < _LANE:
            aside = min(max(0.5 * (to_left - to_right), -_ASIDE), _ASIDE)
        else:
            aside = max(0.0, radius - to_right) - max(0.0, radius - to_left)
        place = place + _STEP * along + aside * left[0]
        time += _STEP / speed
        times.append(time)
        places.append(place)
        for path, region in takers.near(place[None]):
            if inside(place[None], region)[0]:
                return np.array(times), np.array(places), path
    return np.array(times), np.array(places).reshape(-1, 2), None


MOST_WORK = 1e7
"""Largest work of all traces, steps of one bottle: below a second of one core of the 2020s."""

TICK_WORK = 1000
"""Work of a tick beside its steps, in steps of one bottle."""

MOST_LEGS = 64
"""Largest number of traced bottles."""

FARTHEST_PUSH = 0.5
"""m, longest way over which bottles push one that rests on a plate, beside the stroke of a pusher."""

End = Literal["exit", "station", "stopped", "off", "circulates", "cap", "failed"]
"""End of a leg. exit: outfeed or sink; off: beside all belts; cap: the work was used up; failed: the engine refused."""


@dataclass(frozen=True)
class Entrance:
    """Start of a leg: place, direction and speed of a bottle."""

    path: Path
    bottle: str
    position: XY
    direction: float
    """rad"""
    speed: float
    """m/s"""
    returned: bool = False
    """True for a bottle that a station returns."""


@dataclass(frozen=True, eq=False)
class Leg:
    """Path of a lone bottle from a start to its end."""

    start: Entrance
    radius: float
    times: Array
    """(k,), s since the start."""
    points: Array
    """(k, 2), m"""
    carriers: Indices
    """(k,), index of the surface under each point, or NONE."""
    end: End
    exit: Path | None = None
    """Path of the device that took the bottle."""
    reason: str = ""
    """Reason of a failure."""
    traced: float | None = None
    """m, way after which it is estimated by the speeds of the belts; None if all of it is traced."""

    @property
    def seconds(self) -> float:
        """Duration, s."""
        return float(self.times[-1])

    @property
    def length(self) -> float:
        """Way, m."""
        return float(np.hypot(*np.diff(self.points, axis=0).T).sum())

    @property
    def last(self) -> XY:
        """Last point, m."""
        return float(self.points[-1, 0]), float(self.points[-1, 1])

    @property
    def last_carrier(self) -> int:
        """Index of the last surface, or NONE."""
        on = self.carriers[self.carriers != NONE]
        return int(on[-1]) if on.size else NONE


def starts_of(scene: Scene) -> list[Entrance]:
    """Return all starts: infeeds, sources and stations, or else the first bottle of each entry of `bottles`."""
    starts = [
        Entrance(path, _bottle_of(scene, part), part.position, *part.heading, isinstance(part, Station))
        for path, part in scene.givers()
        if not isinstance(part, Spill)
    ]
    return (starts or _initial(scene))[:MOST_LEGS]


def traced_scene(scene: Scene, surfaces: SurfaceMap) -> Scene | None:
    """Return the scene that is simulated for the traces of a scene; None if there is nothing to trace."""
    starts = starts_of(scene)
    return _traced(scene, surfaces, starts) if starts and surfaces else None


def trace(scene: Scene, surfaces: SurfaceMap, guides: Guides) -> list[Leg]:
    """Trace a lone bottle from every start with the engine at draft accuracy.

    A bottle that stops on a plate is put behind it, as a pusher or the bottles after it would push it. The work is
    limited by MOST_WORK, so that the result does not depend on the machine.
    """
    starts = starts_of(scene)
    if not starts or not surfaces:
        return []
    return _Tracer(scene, surfaces, guides, starts).run()


@dataclass(frozen=True, eq=False)
class _Push:
    velocity: Array
    """m/s"""
    farthest: float
    """m, longest way."""


@dataclass(frozen=True, eq=False)
class _Sweep:
    """Area that a pusher sweeps."""

    region: Sequence[XY]
    velocity: Array
    """m/s"""
    stroke: float
    """m"""

    @classmethod
    def of(cls, pusher: Pusher) -> _Sweep:
        along = np.array([math.cos(pusher.direction), math.sin(pusher.direction)])
        near = np.array([pusher.from_, pusher.to])
        corners = np.vstack([near, near[::-1] + pusher.stroke * along])
        return cls([(float(x), float(y)) for x, y in corners], pusher.max_speed * along, pusher.stroke)


class _Tracer:
    def __init__(self, scene: Scene, surfaces: SurfaceMap, guides: Guides, starts: Sequence[Entrance]) -> None:
        self._surfaces, self._guides, self._starts = surfaces, guides, starts
        self._radius = [scene.bottle_types[start.bottle].radius for start in starts]
        model = build_model(_traced(scene, surfaces, starts))
        self._tick, self._steps = 1e-9 * model.tick_ns, model.steps_per_tick
        self._state = State(model, len(starts))
        for kind, x, y, theta, vx, vy, omega in model.plant.bottles:
            self._state.add(model.bottle_types.index(kind), x, y, theta, vx, vy, omega)
        self._state.make_lists()
        self._belts = BeltSurfaces(self._state)
        speeds = [*running_speeds(scene).values()]
        self._belts.move(np.array([*speeds, *([0.0] * (len(model.belts) - len(speeds)))]))
        self._integration = Integration(self._state, 1, True)
        self._ticks = 0
        self._pushers = [_Sweep.of(pusher) for pusher in scene.pushers.values()]
        takers = {path: part for path, part in scene.exits() if isinstance(part, (Outfeed, Sink, Station))}
        self._takers = Takers([(path, part.region) for path, part in takers.items()])
        self._stations = {path for path, part in takers.items() if isinstance(part, Station)}

    def run(self) -> list[Leg]:
        """Advance all bottles until each has ended."""
        count = len(self._starts)
        tracks = [
            Track(start.position, radius, self._surfaces)
            for start, radius in zip(self._starts, self._radius, strict=True)
        ]
        legs: dict[int, Leg] = {}
        work = 0.0
        while len(legs) < count:
            active = [index for index in range(count) if index not in legs]
            if work > MOST_WORK:
                steps = _MOST_STEPS // len(active)
                capped = {index: self._leg(index, tracks[index], None, "cap") for index in active}
                legs.update({index: self._estimated(leg, steps) for index, leg in capped.items()})
                break
            chunk, wrong = self._chunk(count)
            if wrong is not None:
                index, reason = wrong
                legs[index] = self._leg(index, tracks[index], None, "failed", reason=reason)
                self._state.remove(index)
            work += len(chunk) * self._steps * len(active) + CHUNK * TICK_WORK
            for index in active if len(chunk) else ():
                if index in legs:
                    continue
                tracks[index].add(chunk[:, index])
                leg = self._ended(index, tracks[index])
                if leg is not None and leg.end == "stopped" and self._pushed_on(index, leg):
                    tracks[index].cut(len(leg.points))
                elif leg is not None:
                    legs[index] = leg
                    self._state.remove(index)
            self._state.make_lists()
        return [legs[index] for index in range(count)]

    def _chunk(self, count: int) -> tuple[Array, tuple[int, str] | None]:
        """Advance by CHUNK ticks, fewer if the guard stops them.

        Return the places of all bottles after each tick, (ticks, count, 2), and the bottle at fault with the reason.
        """
        chunk = np.empty((CHUNK, count, 2))
        bottles = self._state.world.bottles
        for place in range(CHUNK):
            try:
                self._integration.take_tick(self._ticks, self._belts.fastest)
            except SimulationError as error:
                return chunk[:place], (self._integration.take_events()[-1].bottle, str(error))
            self._state.make_lists()
            self._ticks += 1
            chunk[place, :, 0], chunk[place, :, 1] = bottles.x[:count], bottles.y[:count]
        return chunk, None

    def _ended(self, index: int, track: Track) -> Leg | None:
        """Return the leg of a bottle that has ended within the last chunk, or None."""
        taken = [
            (track.before + int(np.argmax(within)) + 1, device)
            for device, region in self._takers.near(track.chunk)
            if (within := inside(track.chunk, region)).any()
        ]
        astray = track.astray
        if taken and (astray is None or min(count for count, *_ in taken) <= astray[1]):
            count, device = min(taken, key=lambda entry: entry[0])
            return self._leg(index, track, count, "station" if device in self._stations else "exit", device)
        if astray is not None:
            return self._leg(index, track, astray[0], "off")
        if (count_to := track.stopped()) is not None:
            return self._leg(index, track, count_to, "stopped" if track.carried else "off")
        if (count_to := track.closed()) is not None:
            return self._leg(index, track, count_to, "circulates")
        return None

    def _estimated(self, leg: Leg, steps: int) -> Leg:
        """Return a leg that ends at the cap with the rest of its way by the speeds of the belts."""
        step = leg.points[-1] - leg.points[-2]
        along = step / max(float(np.hypot(*step)), 1e-12)
        times, points, taker = drift(
            leg.points[-1], along, leg.radius, self._surfaces, self._guides, self._takers, steps
        )
        end: End = "cap" if taker is None else "station" if taker in self._stations else "exit"
        return replace(
            leg,
            times=np.concatenate([leg.times, leg.times[-1] + times]),
            points=np.vstack([leg.points, points]),
            carriers=np.concatenate([leg.carriers, self._surfaces.under(points)]),
            end=end,
            exit=taker,
            traced=leg.length,
        )

    def _pushed_on(self, index: int, leg: Leg) -> bool:
        """Put a bottle that has stopped on a plate behind it, at its last speed. Return False if it can't go on."""
        plate = int(leg.carriers[-1])
        push = self._push(leg, plate) if self._surfaces[plate].rests else None
        if push is None:
            return False
        speed = float(np.hypot(*push.velocity))
        along = push.velocity / max(speed, 1e-12)
        ways = np.arange(0.002, push.farthest, 0.002)[:, None]
        ahead = leg.points[-1] + ways * along
        carriers = self._surfaces.under(ahead)
        beyond = np.flatnonzero(carriers != plate)
        if not beyond.size or carriers[beyond[0]] == NONE:
            return False
        way = float(ways[beyond[0], 0])
        if float(self._guides.distance(leg.points[-1:], along[None])[0]) < way + leg.radius:
            return False
        bottles = self._state.world.bottles
        bottles.x[index], bottles.y[index] = ahead[beyond[0]]
        bottles.vx[index], bottles.vy[index] = push.velocity
        self._state.world.neighbourhood.stale[0] = 1
        self._integration.put_in()
        return True

    def _push(self, leg: Leg, plate: int) -> _Push | None:
        """Return the push on a bottle that has stopped on a plate: by a pusher, or by bottles that come as it came."""
        for pusher in self._pushers:
            if inside(leg.points[-1:], pusher.region)[0]:
                return _Push(pusher.velocity, pusher.stroke + FARTHEST_PUSH)
        before = np.flatnonzero(leg.carriers != plate)
        if not before.size:
            return None
        return _Push((leg.points[before[-1] + 1] - leg.points[before[-1]]) / self._tick, FARTHEST_PUSH)

    def _leg(
        self, index: int, track: Track, count: int | None, end: End, device: Path | None = None, reason: str = ""
    ) -> Leg:
        """Return the leg of the first `count` places of a track; None: all."""
        points, carriers = track.path(count)
        times = self._tick * np.arange(len(points), dtype=np.float64)
        return Leg(self._starts[index], self._radius[index], times, points, carriers, end, device, reason)


def _traced(scene: Scene, surfaces: SurfaceMap, starts: Sequence[Entrance]) -> Scene:
    fastest = max([0.1, *(abs(surface.running) for surface in surfaces), *(start.speed for start in starts)])
    smallest = min(scene.bottle_types[start.bottle].radius for start in starts)
    bottles = [
        Single.model_construct(type=start.bottle, position=start.position, velocity=_velocity(start))
        for start in starts
    ]
    # A bottle moves by less than its radius in a tick, so that none passes a region between two ticks.
    return trace_scene(scene, bottles, max(0.001, round(0.5 * smallest / fastest, 3)))


def _velocity(start: Entrance) -> XY:
    return start.speed * math.cos(start.direction), start.speed * math.sin(start.direction)


def _bottle_of(scene: Scene, part: object) -> str:
    """Return the type of bottles from a part; a station may return several types, so the first one stands for all."""
    types = (*part.changes.values(), *scene.bottle_types) if isinstance(part, Station) else scene.bottle_types
    return str(getattr(part, "bottle", None) or next(iter(types)))


def _initial(scene: Scene) -> list[Entrance]:
    """Return the first bottle of each entry of `bottles`."""
    starts, place = [], 0
    bottles = initial_bottles(scene)
    for index, entry in enumerate(scene.bottles):
        kind, x, y, _, vx, vy, _ = bottles[place]
        starts.append(Entrance(("bottles", index), kind, (x, y), math.atan2(vy, vx), math.hypot(vx, vy)))
        place += entry.grid.rows * entry.grid.columns if isinstance(entry, Grid) else 1
    return starts
