# SPDX-License-Identifier: Apache-2.0
"""The paper's plant against the clock: as shipped, without outputs, recorded, and with bottles of glass."""

from __future__ import annotations

import math
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from bench import ours
from bench.markdown import table as markdown
from bench.measure import Effort, say
from bench.packed import NO_OUTPUTS
from bench.packed import table as dense_table
from bench.rows import Row, Rows
from conveyor_sim.run.compilation import compile_kernels
from conveyor_sim.run.runner import run_scene
from conveyor_sim.scene import Scene, load_scene
from conveyor_sim.support.resources import scene_path

CASE = "plant"
FACTOR = "times real time"
DURATION, QUICK_DURATION = 20.0, 0.5
"""s"""
SOFT = 5e3
"""N/m, the paper's between bottles; at rails it is twice that."""
DAMPING = 0.1
"""kg/s, the paper's."""
REDUCED_MASS = 0.1
"""kg, of two bottles; with twice the mass and twice the stiffness a contact with a rail lasts as long."""
GLASS = tuple((stiffness, steps) for stiffness in (1e7, 1e8) for steps in (20, 50))
PAPER, SHIPPED, RECORDED = "the paper's, no outputs", "as shipped (peaks)", "recorded to disk"
CROWD, CROWD_STIFFNESS, CROWD_STEPS, CROWD_TICKS = 1_000, 1e8, 12, 20
"""12 steps a contact is the least that keeps a peak within 1 %: (pi/12)^2/8 is 0.9 %."""
ROUNDS = 3
"""A run of 20 s is long enough to be a mean by itself."""


def glass_name(stiffness: float, steps: int) -> str:
    """Return the name of a contestant."""
    return f"glass {stiffness:.0e} N/m, {steps} steps a contact"


def glass_contacts(stiffness: float) -> list[dict[str, Any]]:
    """Contacts of stiffer bottles that keep their restitution.

    With damping c the restitution of a linear contact depends on c / sqrt(k m_r) alone, so c grows as sqrt(k).
    """
    damping = {"law": "paper", "coefficient": DAMPING * math.sqrt(stiffness / SOFT)}
    return [
        {"between": ["bottle", other], "stiffness": k, "damping": damping, "friction": 0.1}
        for other, k in (("bottle", stiffness), ("rail", 2.0 * stiffness))
    ]


def glass_step(stiffness: float, steps: int) -> float:
    """Step for so many in a contact, s."""
    return math.pi * math.sqrt(REDUCED_MASS / stiffness) / steps


def glass(stiffness: float, steps: int, duration: float) -> Scene:
    """Build the plant of glass."""
    per_tick = math.ceil(_plant(duration).tick / glass_step(stiffness, steps))
    return _plant(duration, outputs=NO_OUTPUTS, contacts=glass_contacts(stiffness), accuracy={"per_tick": per_tick})


def measure(effort: Effort) -> list[Row]:
    """FACTOR of each, from bottles entering to the end."""
    duration = QUICK_DURATION if effort.quick else DURATION
    scenes = {
        PAPER: _plant(duration, outputs=NO_OUTPUTS),
        SHIPPED: _plant(duration),
        RECORDED: _plant(duration),
        **{glass_name(*which): glass(*which, duration) for which in GLASS},
    }
    for name, scene in scenes.items():
        say(f"plant: compiling for {name}")
        compile_kernels(scene)
    rows = []
    for turn in range(min(ROUNDS, effort.rounds)):
        for name, scene in scenes.items():
            say(f"plant, round {turn + 1}: {name}")
            wall = _timed(_recorded if name == RECORDED else _simulated, scene)
            rows.append(Row(CASE, 0.0, name, FACTOR, turn, duration / wall))
    return [*rows, *_crowd_of_glass(effort)]


def _crowd_of_glass(effort: Effort) -> list[Row]:
    """FACTOR of the dense table of glass, by brute force."""
    scene = dense_table(
        CROWD, "paper", glass_step(CROWD_STIFFNESS, CROWD_STEPS), contacts=glass_contacts(CROWD_STIFFNESS)
    )
    ticks = 1 if effort.quick else CROWD_TICKS
    say(f"plant: packing {CROWD} bottles of glass")
    simulations = {threads: ours.packed(scene, 0.1, threads) for threads in (1, 2)}
    rows = []
    for turn in range(effort.rounds):
        for threads, simulation in simulations.items():
            start = time.perf_counter()
            simulation.advance(ticks)
            wall = time.perf_counter() - start
            rows.append(Row(CASE, 0.0, crowd_name(threads), FACTOR, turn, ticks * scene.tick / wall))
    return rows


def crowd_name(threads: int) -> str:
    """Return the name of a contestant."""
    return f"{CROWD} of glass {CROWD_STIFFNESS:.0e} N/m on the dense table, {CROWD_STEPS} steps, {threads} thread(s)"


def _plant(duration: float, **changes: Any) -> Scene:
    return load_scene(scene_path("paper_plant"), {"duration": duration, **changes})


def _timed(run: Callable[[Scene], None], scene: Scene) -> float:
    start = time.perf_counter()
    run(scene)
    return time.perf_counter() - start


def _simulated(scene: Scene) -> None:
    ours.simulate(scene, threads=1).advance(scene.duration_ticks)


def _recorded(scene: Scene) -> None:
    with tempfile.TemporaryDirectory() as folder:
        run_scene(scene, Path(folder) / "bag")


def tables(rows: Rows) -> str:
    """One table."""
    body = [[name, rows.spread(CASE, 0.0, name, FACTOR)] for name in rows.contestants(CASE)]
    return f"One thread unless stated; the recorded run chooses their number.\n\n{markdown(['', FACTOR], body)}"
