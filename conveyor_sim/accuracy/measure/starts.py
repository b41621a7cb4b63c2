# SPDX-License-Identifier: Apache-2.0
"""States of a scene to compare settings from: shortly before the strongest contacts of its run."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from conveyor_sim.accuracy.candidates import standard_steps
from conveyor_sim.accuracy.cases.collision import collision_of, duration, terms_of
from conveyor_sim.accuracy.setting import Setting
from conveyor_sim.accuracy.trajectory import variant
from conveyor_sim.engine.arrays.types import F8
from conveyor_sim.errors import SimulationError
from conveyor_sim.line.devices.divider import NAMES
from conveyor_sim.line.devices.mover import WORDS
from conveyor_sim.physics.effects.terms import meetings
from conveyor_sim.scene import Scene
from conveyor_sim.scene.moving import axes_of
from conveyor_sim.simulation import Simulation

HALF = 2.0
"""s from one command of a mover to the next, or less in a short scene."""

LEAST_HALVES = 6
"""Commands of each mover in the scene's duration, at least."""


_COMMANDS = {
    **{field: order for field, (order, *_) in WORDS.items()},
    **{field: setpoint for field, (_, setpoint, _) in NAMES.items()},
}
"""Commands of movers, by field. Those with several positions take 0 and 1, the first two of them."""


class Exercise:
    """Sends every moving rail of a scene to and fro, one after the other. A run with it depends on the scene alone.

    A scene has no controller. Without commands its moving rails would stand still in all comparisons.
    """

    def __init__(self, scene: Scene) -> None:
        self._half = max(1, round(min(HALF, scene.duration / LEAST_HALVES) / scene.tick))
        """Ticks between two commands of one mover."""
        self._movers = [
            (f"{axis.name}/{_COMMANDS[axis.name.split('/')[0]]}", axis.first != 0.0)
            for axis in axes_of(scene)
            if axis.kind == "position"
        ]
        """The command of each, and whether it is at the far end of its stroke at the start."""

    def __bool__(self) -> bool:
        """Return True if the scene has moving parts."""
        return bool(self._movers)

    def command(self, simulation: Simulation) -> None:
        """Queue what is due at this tick; to be called before every `advance`."""
        for index, (name, away) in enumerate(self._movers):
            # They take turns.
            since = simulation.tick - self._half // 2 - math.floor(self._half * index / len(self._movers))
            if since >= 0 and since % self._half == 0:
                on = (since // self._half) % 2 == 0
                simulation.command([name], [float(on != away)], "exercise")


PARTS = 3
"""Parts of the run, each with a start before its strongest contact."""

MOST_WORK = 4e8
"""Bottle steps of the run in which starts are looked for, some ten seconds: what is longer is looked at in part."""

UNTOUCHED_WORK = 1.2e9
"""Work limit while nothing touches: riding bottles cost less, and no second run follows."""

TICK_WORK = 4e3
"""Bottle steps that cost as much as the rest of a tick, in round numbers."""

STROKED = (
    "Moving rails were sent to and fro where impacts are compared; in resting load and long runs they stood still."
)
STILL = "The strokes of moving rails are not covered: they stood still throughout"

Progress = Callable[[float, float], None]
"""Called with what is done so far and the whole."""


@dataclass(frozen=True, eq=False)
class Start:
    """A state of a scene."""

    simulation: Simulation
    """At the state, to be left there."""
    untouched: bool
    """No contact has closed before: a state of the scene at every stiffness."""


@dataclass(frozen=True)
class Found:
    """Starts, and how the scene was run to find them."""

    starts: list[Start]
    """In order of time."""
    moving: str
    """A sentence on what moving rails did; empty where there are none."""
    looked: float
    """s, simulated, of the run that was looked at."""
    touched: bool
    """True if a contact closed in that time."""


def find_starts(scene: Scene, progress: Progress) -> Found:
    """One start before the first contact of the run, one before the strongest of each part; its end without contacts.

    The scene runs at the preset `standard`, its moving rails to and fro (`Exercise`); where they stop the run, they
    stand still instead, which is said. Tangential springs start anew at a start. SimulationError if it fails.
    Progress in simulated seconds; the scene runs twice.
    """
    if not Exercise(scene):
        return _find(scene, None, "", progress)
    try:
        return _find(scene, Exercise(scene), STROKED, progress)
    except SimulationError as error:
        return _find(scene, None, f"{STILL} (sent to and fro, they stop the run: {error}).", progress)


def _find(scene: Scene, exercise: Exercise | None, moving: str, progress: Progress) -> Found:
    setting = Setting("leapfrog", standard_steps(scene))
    whole = 2.0 * scene.duration
    looked, strongest = _strongest(scene, setting, exercise, lambda share: progress(share * scene.duration, whole))
    touched = np.flatnonzero(strongest)
    if not touched.size:
        progress(whole, whole)
        return Found([_start(scene, setting, looked, True)], moving, looked.time, False)
    first = int(touched[0])
    chosen = {first}
    for part in np.array_split(np.arange(strongest.size), PARTS):
        if part.size and strongest[part].max() > 0.0:
            peak = int(part[np.argmax(strongest[part])])
            chosen.add(max(first, peak - _lead(scene)))
    ticks = sorted(chosen)
    again, starts = variant(scene, setting), []
    for tick in ticks:
        while again.tick < tick:
            _advance(again, exercise)
            progress((1.0 + again.tick / ticks[-1]) * scene.duration, whole)
        starts.append(_start(scene, setting, again, tick == first))
    progress(whole, whole)
    return Found(starts, moving, looked.time, True)


def _start(scene: Scene, setting: Setting, at: Simulation, untouched: bool) -> Start:
    """At the state of a run that goes on."""
    state = variant(scene, setting)
    state.restore_from(at)
    return Start(state, untouched)


def _advance(simulation: Simulation, exercise: Exercise | None) -> None:
    if exercise is not None:
        exercise.command(simulation)
    simulation.advance()


def _strongest(
    scene: Scene, setting: Setting, exercise: Exercise | None, progress: Callable[[float], None]
) -> tuple[Simulation, F8]:
    """Return the observed part of the run, and the largest contact force (N) in each of its ticks, (ticks,).

    Progress is the share of that part.
    """
    simulation = variant(scene, setting, outputs={"bottles": 1e9 / scene.tick_ns})
    forces: list[float] = []
    work, most = 0.0, UNTOUCHED_WORK
    while len(forces) < scene.duration_ticks and work < most:
        _advance(simulation, exercise)
        bottles = simulation.bottles()
        forces.append(float(bottles.peak_force.max(initial=0.0)))
        if forces[-1] > 0.0:
            most = MOST_WORK
        work += TICK_WORK + bottles.id.size * simulation.model.steps_per_tick
        progress(min(1.0, max(len(forces) / scene.duration_ticks, work / most)))
    return simulation, np.array(forces)


def _lead(scene: Scene) -> int:
    """Ticks from a start to that of the peak: the first half of the longest contact that ends.

    A short contact, of the beginning of which up to a twentieth of a tick would be lost, gets none.
    """
    terms = terms_of(scene)
    times = [duration(collision_of(meeting, terms), terms.plant.impact_speed) for meeting in meetings(terms)]
    longest = max((time for time in times if time < math.inf), default=0.0)
    return math.ceil(0.5 * longest / scene.tick - 0.05)
