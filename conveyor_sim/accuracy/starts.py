"""States of a scene to compare settings from: shortly before the strongest contacts of its run."""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from conveyor_sim.accuracy.candidates import standard_steps
from conveyor_sim.accuracy.collision import collision_of, duration, terms_of
from conveyor_sim.accuracy.exercise import Exercise
from conveyor_sim.accuracy.setting import Setting
from conveyor_sim.accuracy.trajectory import variant
from conveyor_sim.effects.terms import impact_speed, meetings
from conveyor_sim.engine.arrays.types import F8
from conveyor_sim.errors import SimulationError
from conveyor_sim.scene import Scene
from conveyor_sim.simulation import Simulation

PARTS = 3
"""Of the run, each with a start before its strongest contact."""

MOST_WORK = 4e8
"""Bottle steps of the run in which starts are looked for, some ten seconds: what is longer is looked at in part."""

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


def find_starts(scene: Scene, progress: Progress) -> Found:
    """One start before the first contact of the run, and one before the strongest of each part.

    The scene runs at the preset `standard`, its moving rails to and fro (`Exercise`); where they stop the run, they
    stand still instead, which is said. Tangential springs start anew at a start. SimulationError if it fails.
    Progress in simulated seconds; the scene runs twice.
    """
    if not Exercise(scene):
        return Found(_find(scene, None, progress), "")
    try:
        return Found(_find(scene, Exercise(scene), progress), STROKED)
    except SimulationError as error:
        return Found(_find(scene, None, progress), f"{STILL} (sent to and fro, they stop the run: {error}).")


def _find(scene: Scene, exercise: Exercise | None, progress: Progress) -> list[Start]:
    setting = Setting("leapfrog", standard_steps(scene))
    whole = 2.0 * scene.duration
    strongest = _strongest(scene, setting, exercise, lambda share: progress(share * scene.duration, whole))
    touched = np.flatnonzero(strongest)
    first = int(touched[0]) if touched.size else strongest.size // 2
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
        state = variant(scene, setting)
        state.restore_from(again)
        starts.append(Start(state, untouched=tick == first))
    progress(whole, whole)
    return starts


def _advance(simulation: Simulation, exercise: Exercise | None) -> None:
    if exercise is not None:
        exercise.command(simulation)
    simulation.advance()


def _strongest(scene: Scene, setting: Setting, exercise: Exercise | None, progress: Callable[[float], None]) -> F8:
    """The largest contact force (N) in each tick of the run, (ticks,); progress as a share of what is looked at."""
    simulation = variant(scene, setting, outputs={"bottles": 1e9 / scene.tick_ns})
    forces: list[float] = []
    work = 0
    while len(forces) < scene.duration_ticks and work < MOST_WORK:
        _advance(simulation, exercise)
        bottles = simulation.bottles()
        forces.append(float(bottles.peak_force.max(initial=0.0)))
        work += bottles.id.size * simulation.model.steps_per_tick
        progress(max(len(forces) / scene.duration_ticks, work / MOST_WORK))
    return np.array(forces)


def _lead(scene: Scene) -> int:
    """Ticks from a start to that of the peak: the first half of the longest contact that ends.

    A short contact, of the beginning of which up to a twentieth of a tick would be lost, gets none.
    """
    terms = terms_of(scene)
    times = [duration(collision_of(meeting, terms), impact_speed(scene)) for meeting in meetings(terms)]
    longest = max((time for time in times if time < math.inf), default=0.0)
    return math.ceil(0.5 * longest / scene.tick - 0.05)
