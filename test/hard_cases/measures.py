# SPDX-License-Identifier: Apache-2.0
"""Runs a case and measures it: what every row of the table, and of the study, is held against."""

from __future__ import annotations

import math
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from hard_cases.case import Case
from numpy.typing import NDArray

from conveyor_sim.accuracy.measure.precision import STEPS
from conveyor_sim.accuracy.setting import Setting
from conveyor_sim.accuracy.trajectory import displace, variant
from conveyor_sim.columns.bottles import BottleColumns
from conveyor_sim.engine.lists.riding import skipped_slots
from conveyor_sim.errors import SimulationError
from conveyor_sim.physics.stepping.guard.chatter import ChatterMeter
from conveyor_sim.scene import Scene, parse_overrides, parse_scene
from conveyor_sim.simulation import Simulation

SAMPLES = 1000
"""Ticks that are looked at, at the most, evenly spread; all of them in runs of fewer."""

PAIR = 0

F8 = NDArray[np.float64]


@dataclass
class Outcome:
    """What came of a run."""

    measures: dict[str, float] = field(default_factory=dict)
    """By name, as in MEASURES."""
    sentence: str = ""
    """Why it stopped early; empty if it did not."""
    reasons: list[str] = field(default_factory=list)
    """Why commands were refused."""
    hash: int = 0
    """Of the state at the tick that was asked for; 0 if it was not reached."""


MEASURES = {
    "overlap": "deepest overlap at a tick, or seen by the guard, over the radius of the smaller bottle",
    "peak_force": "N, largest contact force in any step",
    "speed": "m/s, largest at any tick",
    "final_speed": "m/s, largest at the end",
    "slip": "m/s, largest at a tick between a bottle and the belt under it",
    "final_spin": "rad/s, largest at the end",
    "momentum": "kg m/s, at the end",
    "energy_kept": "kinetic energy at the end over that at the start, of the bottle whose ratio is furthest from 1",
    "travel": "m, of the mean of all bottles since `settled`",
    "breadth": "m, extent of the axes of all bottles across x, at the end",
    "drift": "m, furthest that a bottle went from where it was at `settled`",
    "rail_force": "N, normal forces of all rails, mean since `settled`",
    "chatter": "amplitude to and fro at every step at the end, over slip_limit",
    "tunnelled": "bottles whose axis crossed a rail from tick to tick",
    "lost": "bottles at the start and fed, less those removed and present",
    "fed": "bottles",
    "removed": "bottles",
    "blocked_ticks": "ticks at which an infeed had no room",
    "shortened_ticks": "ticks that the guard had done again in shorter steps",
    "residual": "energy that the ledger can't place, over its turnover",
    "simulated": "s",
    "riding": "bottles that ride at once, at most, of those that are looked at",
    "asleep": "bottles asleep at once, at most, of those that are looked at",
    "woken": "bottles that slept and were awake at a later tick that is looked at",
    "unlike_stepped": "1 if a run in which nobody rides ends in another state, else 0; where a row expects it",
}
"""What is measured, and in what; NaN where there is nothing to measure it on."""


def run(
    case: Case,
    scene: Scene,
    threads: int = 1,
    most_ticks: int | None = None,
    hash_at: int = -1,
    beside: Callable[[Simulation], None] | None = None,
) -> Outcome:
    """Run a scene of a case to its end, or for some ticks, and measure it.

    hash_at: a tick whose state is hashed. beside: called at every tick that is looked at.
    """
    simulation = Simulation(scene, threads=threads)
    ticks = scene.duration_ticks if most_ticks is None else min(most_ticks, scene.duration_ticks)
    watch = _Watch(simulation, case.settled)
    outcome = Outcome()
    every = max(1, math.ceil(ticks / SAMPLES))
    saved = -1 if case.saved is None else round(case.saved / scene.tick)
    stops, done = sorted({*_acts(case, scene), hash_at, saved}), 0
    # A run that is unstable overflows before it ends.
    with np.errstate(over="ignore", invalid="ignore"):
        try:
            watch.look(simulation)
            while done < ticks:
                if done == saved:
                    simulation = _reloaded(simulation, threads)
                _act(case, simulation, done)
                step = min([every - done % every, ticks - done, *(tick - done for tick in stops if tick > done)])
                simulation.advance(step)
                done += step
                watch.look(simulation)
                if beside is not None:
                    beside(simulation)
                if done == hash_at:
                    outcome.hash = simulation.state_hash()
        except SimulationError as error:
            outcome.sentence = str(error)
        outcome.reasons = [told.reason for told in simulation.take_outcomes() if not told.accepted]
        outcome.measures = watch.measures(simulation, done)
        if case.put:
            outcome.measures["residual"] = math.nan  # what is put in from outside is in no ledger
        outcome.measures["chatter"] = math.nan if outcome.sentence else chatter(simulation)
        if "unlike_stepped" in case.expect:
            outcome.measures["unlike_stepped"] = float(_end(simulation) != _end(_stepped(case, scene, done)))
    return outcome


def _reloaded(simulation: Simulation, threads: int) -> Simulation:
    """As it goes on from its checkpoint."""
    with TemporaryDirectory() as folder:
        simulation.save(Path(folder) / "case")
        return Simulation.load(Path(folder) / "case", threads=threads)


def _stepped(case: Case, scene: Scene, ticks: int) -> Simulation:
    """The same run with nobody riding."""
    overrides = {**parse_overrides(scene.overrides_text), "effects": {**scene.effects, "riding": "off"}}
    simulation = Simulation(parse_scene(scene.source_text, scene.source_name, overrides), threads=1)
    with suppress(SimulationError):
        for tick in range(ticks):
            _act(case, simulation, tick)
            simulation.advance()
    return simulation


def _end(simulation: Simulation) -> tuple[Any, ...]:
    """What a run came to, to the bit."""
    books = (
        repr(simulation.ledger()),
        simulation.peak_force,
        simulation.integration.deepest_overlap,
        simulation.integration.shortened_ticks,
    )
    return (simulation.tick, simulation.state_hash(), *books)


def riders(simulation: Simulation) -> int:
    """Bottles that the last step of the last tick left out, on one thread; 0 where nobody can ride."""
    world = simulation._state.world
    ids = world.bottles.id
    return int((skipped_slots(world.riding, ids.size) & (ids >= 0)).sum())


def sleepers(simulation: Simulation) -> set[int]:
    """IDs of the bottles that sleep; none without the effect."""
    world = simulation._state.world
    if world.impulses is None or world.impulses.sleep is None:
        return set()
    return set(world.bottles.id[world.impulses.sleep.asleep != 0].tolist())


def _acts(case: Case, scene: Scene) -> list[int]:
    """Ticks before which something is done from outside, in order."""
    times = [act["at"] for act in (*case.commands, *case.put)]
    ticks = {round(time / scene.tick) for time in times}
    if case.ramp:
        ticks |= set(range(math.ceil(abs(case.ramp["to"] - case.ramp["from"]) / _rise(case, scene)) + 1))
    return sorted(ticks)


def _rise(case: Case, scene: Scene) -> float:
    """m/s by which a ramp rises in a tick."""
    return float(case.ramp["acceleration"]) * scene.tick


def _act(case: Case, simulation: Simulation, tick: int) -> None:
    """Do what is to be done from outside before the tick that begins now."""
    scene = simulation.scene
    for command in case.commands:
        if round(command["at"] / scene.tick) == tick:
            given = {name: value for name, value in command.items() if name != "at"}
            for name in given.keys() & set(simulation.process_image.fault_names):
                simulation.inject(name, given.pop(name))
            names = [name if "/" in name else f"belts/{name}/cmd_speed" for name in given]
            if names:
                simulation.command(names, list(given.values()))
    if case.ramp:
        way = case.ramp["to"] - case.ramp["from"]
        gone = min(abs(way), _rise(case, scene) * (tick + 1))
        simulation.command([f"belts/{case.ramp['belt']}/cmd_speed"], [case.ramp["from"] + math.copysign(gone, way)])
    for put in case.put:
        if round(put["at"] / scene.tick) == tick and put.get("taken"):
            simulation.delete(put["bottle"])
        elif round(put["at"] / scene.tick) == tick:
            count = simulation.counts.present
            by, push = np.zeros((2, count)), np.zeros((2, count))
            by[:, put["bottle"]] = put.get("by", (0.0, 0.0))
            push[:, put["bottle"]] = put.get("push", (0.0, 0.0))
            displace(simulation, by[0], by[1], push[0], push[1])


class _Watch:
    """What is kept of a run from tick to tick."""

    def __init__(self, simulation: Simulation, settled: float) -> None:
        self._settled = settled
        self._first = simulation.counts.present - simulation.counts.fed
        self._at_first = simulation.bottles()
        self._most = dict.fromkeys(("overlap", "peak_force", "speed", "slip", "riding", "asleep"), 0.0)
        self._slept: set[int] = set()
        self._woken: set[int] = set()
        self._crossed: set[int] = set()
        self._before: BottleColumns | None = None
        self._start: BottleColumns | None = None
        self._rail_forces: list[float] = []
        outlines = [rail.outline() for rail in simulation.model.plant.rails]
        self._starts = np.vstack([np.empty((0, 2)), *(outline[:-1] for outline in outlines)])
        self._ends = np.vstack([np.empty((0, 2)), *(outline[1:] for outline in outlines)])

    def look(self, simulation: Simulation) -> None:
        """Take this tick in."""
        bottles, contacts = simulation.bottles(), simulation.contacts()
        speed = np.hypot(bottles.vx, bottles.vy)
        self._raise("speed", speed)
        self._raise("peak_force", np.array([simulation.peak_force or 0.0]))
        self._raise("slip", slips(simulation, bottles))
        self._raise("riding", np.array([float(riders(simulation))]))
        asleep = sleepers(simulation)
        self._raise("asleep", np.array([float(len(asleep))]))
        self._slept |= asleep
        self._woken |= (self._slept & set(bottles.id.tolist())) - asleep
        radius = simulation.model.type_radius[bottles.type]
        smaller = radius[np.searchsorted(bottles.id, contacts.a)]
        pairs = contacts.kind == PAIR
        smaller[pairs] = np.minimum(smaller[pairs], radius[np.searchsorted(bottles.id, contacts.b[pairs])])
        self._raise("overlap", contacts.overlap / smaller)
        if self._before is not None:
            self._crossings(self._before, bottles)
        self._before = bottles
        if simulation.time >= self._settled - 1e-9:
            self._start = self._start or bottles
            self._rail_forces.append(float(contacts.normal_force[~pairs].sum()))

    def _raise(self, name: str, values: F8) -> None:
        self._most[name] = float(np.max(values, initial=self._most[name]))

    def _crossings(self, before: BottleColumns, now: BottleColumns) -> None:
        _, here, there = np.intersect1d(before.id, now.id, assume_unique=True, return_indices=True)
        one = np.column_stack([before.x[here], before.y[here]])
        other = np.column_stack([now.x[there], now.y[there]])
        for bottle in np.flatnonzero(crossing(one, other, self._starts, self._ends)):
            self._crossed.add(int(now.id[there[bottle]]))

    def measures(self, simulation: Simulation, ticks: int) -> dict[str, float]:
        """All of MEASURES but chatter."""
        bottles, counts = simulation.bottles(), simulation.counts
        mass = simulation.model.type_mass[bottles.type]
        found = {
            **self._most,
            "overlap": max(self._most["overlap"], simulation.integration.deepest_overlap),
            "shortened_ticks": float(simulation.integration.shortened_ticks),
            "final_speed": float(np.max(np.hypot(bottles.vx, bottles.vy), initial=0.0)),
            "final_spin": float(np.max(np.abs(bottles.omega), initial=0.0)),
            "momentum": float(np.hypot(mass @ bottles.vx, mass @ bottles.vy)),
            "energy_kept": _energy_kept(self._at_first, bottles),
            "travel": math.nan,
            "breadth": float(np.ptp(bottles.y)) if bottles.id.size else math.nan,
            "drift": math.nan,
            "rail_force": float(np.mean(self._rail_forces)) if self._rail_forces else math.nan,
            "tunnelled": float(len(self._crossed)),
            "woken": float(len(self._woken)),
            "lost": float(self._first + counts.fed - counts.removed - counts.present),
            "fed": float(counts.fed),
            "removed": float(counts.removed),
            "blocked_ticks": float(counts.blocked_ticks),
            "residual": residual(simulation),
            "simulated": ticks * simulation.scene.tick,
            "unlike_stepped": math.nan,
        }
        if self._start is not None:
            _, here, there = np.intersect1d(self._start.id, bottles.id, assume_unique=True, return_indices=True)
            dx, dy = bottles.x[there] - self._start.x[here], bottles.y[there] - self._start.y[here]
            if dx.size:
                found["travel"] = float(np.hypot(dx.mean(), dy.mean()))
                found["drift"] = float(np.hypot(dx, dy).max())
        return found


def _energy_kept(first: BottleColumns, last: BottleColumns) -> float:
    """NaN if no bottle that is left moved at first. Their masses stay, so speeds tell."""
    _, here, there = np.intersect1d(first.id, last.id, assume_unique=True, return_indices=True)
    before = first.vx[here] ** 2 + first.vy[here] ** 2
    after = last.vx[there] ** 2 + last.vy[there] ** 2
    ratios = after[before > 0.0] / before[before > 0.0]
    return float(ratios[np.argmax(np.abs(ratios - 1.0))]) if ratios.size else math.nan


def slips(simulation: Simulation, bottles: BottleColumns) -> F8:
    """Speed of each bottle relative to the surface under it, (bottles,), m/s."""
    ux, uy = np.zeros(bottles.x.size), np.zeros(bottles.x.size)
    for index, (shape, speed) in enumerate(
        zip(simulation.model.plant.surfaces, simulation.belts().actual, strict=True)
    ):
        on = bottles.belt == index
        if shape.kind == "straight":
            ux[on], uy[on] = speed * math.cos(shape.angle), speed * math.sin(shape.angle)
        else:
            turn = speed / shape.centre_radius
            ux[on] = -turn * (bottles.y[on] - shape.centre[1])
            uy[on] = turn * (bottles.x[on] - shape.centre[0])
    return np.hypot(bottles.vx - ux, bottles.vy - uy)


def crossing(one: F8, other: F8, starts: F8, ends: F8) -> NDArray[np.bool_]:
    """Whether the straight way between points (n, 2) and (n, 2) crosses any of m segments; (n,)."""

    def turn(a: F8, b: F8, c: F8) -> F8:
        return np.asarray((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]))

    p, q, a, b = one.T[:, :, None], other.T[:, :, None], starts.T, ends.T
    apart = turn(p, q, a) * turn(p, q, b) < 0.0
    return np.asarray((apart & (turn(a, b, p) * turn(a, b, q) < 0.0)).any(axis=1))


def chatter(simulation: Simulation) -> float:
    """Amplitude by which velocities jump to and fro at every step from now on, over slip_limit; 0 without bottles.

    NaN with tangential springs and impulses, which would begin anew, and where a method divides its steps itself.
    """
    scene = simulation.scene
    if simulation.model.integrator in ("dormand_prince", "impulses") or any(c.tangential for c in scene.contacts):
        return math.nan
    step = round(max(1, round(scene.tick_ns / simulation.model.steps_per_tick)) * 1e-9, 9)
    supply = {name: "off" for name, there in (("infeed", scene.infeeds), ("outfeed", scene.outfeeds)) if there}
    setting = Setting(simulation.model.integrator, 1, error=scene.accuracy.error)
    # The same effects as those of the run, whose kernels are compiled.
    outputs = {} if simulation.ledger() is None else {"ledger": 1.0 / step}
    probe = variant(scene, setting, tick=step, duration=step, effects=supply, outputs=outputs)
    probe.restore_from(simulation)
    radius = simulation.model.type_radius[simulation.bottles().type]
    meter = ChatterMeter()
    for _ in range(STEPS):
        try:
            probe.advance()
        except SimulationError:
            return math.nan
        now = probe.bottles()
        meter.note(now.vx, now.vy, radius * now.omega)
    return meter.worst()[1] / scene.slip_limit


def residual(simulation: Simulation) -> float:
    """What the energy ledger can't place, over what went through it; NaN without a ledger, 0 if nothing did."""
    ledger = simulation.ledger()
    if ledger is None:
        return math.nan
    return abs(float(ledger.residual)) / float(ledger.turnover) if ledger.turnover > 0.0 else 0.0
