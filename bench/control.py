# SPDX-License-Identifier: Apache-2.0
"""Cost of control tests: ticks of a line without the step kernels, and a scenario, in CPU time of one core."""

from __future__ import annotations

import runpy
import time
from collections.abc import Callable
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from bench.markdown import table as markdown
from bench.measure import Effort, say
from bench.rows import Row, Rows
from conveyor_sim.scene import Scene, load_scene
from conveyor_sim.simulation import Simulation
from conveyor_sim.support.resources import scene_path
from conveyor_sim.testing import Scenario

ROOT = Path(__file__).resolve().parent.parent
CASE = "control"
FACTOR, OUTSIDE, WHOLE = "times real time", "us a tick outside the step kernels", "us a tick"
BESIDE = "us a tick of scan, conditions, history and outputs"
LINES = ("zoned_line", "reject_line", "buffer_lane", "watched_eyes")
DOWNSTREAM_STOP = "scenario of a stopped packer"
WITH_EVIDENCE = f"{DOWNSTREAM_STOP}, with evidence"
"""Scenario as the fixture `line` runs it; formerly it was recorded to a bag as well."""
FEW, MANY = 6, 60
"""Photo-eyes behind the outfeed, where no bottle comes."""
SECONDS, QUICK_SECONDS = 60.0, 2.0
"""Simulated, from the start of the scene."""


def measure(effort: Effort) -> list[Row]:
    """Lines alone, then a scenario with its controller, conditions and history, without and with evidence."""
    rows = []
    for turn in range(1 if effort.quick else effort.rounds):
        seconds = QUICK_SECONDS if effort.quick else SECONDS
        for name in LINES:
            for riding in (True, False):
                say(f"control, round {turn + 1}: {line_name(name, riding)}")
                scene = load_scene(scene_path(f"scenarios/{name}"), {} if riding else {"effects": {"riding": "off"}})
                rows += _line(line_name(name, riding), scene, seconds, turn)
        for number in (FEW, MANY):
            say(f"control, round {turn + 1}: {eyes_name(number)}")
            rows += _line(eyes_name(number), _with_eyes(number), seconds, turn)
        if not effort.quick:
            say(f"control, round {turn + 1}: {DOWNSTREAM_STOP}")
            rows += _scenario(turn, DOWNSTREAM_STOP, None)
            with TemporaryDirectory() as folder:
                rows += _scenario(turn, WITH_EVIDENCE, Path(folder))
    return rows


def line_name(name: str, riding: bool) -> str:
    """Return the name of a line in tables."""
    return name if riding else f"{name}, riding off"


def eyes_name(number: int) -> str:
    """Return the name, in tables, of a line with `number` more photo-eyes."""
    return f"{number} photo-eyes that see nothing"


def _with_eyes(number: int) -> Scene:
    places = [2.31 + 0.08 * i / number for i in range(number)]
    eyes = {f"eye{i}": {"from": [x, -0.05], "to": [x, 0.05]} for i, x in enumerate(places)}
    return load_scene(scene_path("scenarios/watched_eyes"), {"photo_eyes": eyes})


def _line(name: str, scene: Scene, seconds: float, turn: int) -> list[Row]:
    simulation = Simulation(scene, threads=1)
    simulation.advance(1)
    kernels = _Clock()
    pool: Any = simulation.integration._pool
    pool.advance = kernels.around(pool.advance)
    ticks = round(seconds / scene.tick)
    whole = _Clock()
    whole.around(simulation.advance)(ticks)
    return [
        Row(CASE, 0.0, name, FACTOR, turn, seconds / whole.seconds),
        Row(CASE, 0.0, name, WHOLE, turn, 1e6 * whole.seconds / ticks),
        Row(CASE, 0.0, name, OUTSIDE, turn, 1e6 * (whole.seconds - kernels.seconds) / ticks),
    ]


def _scenario(turn: int, contestant: str, inputs: Path | None) -> list[Row]:
    example = runpy.run_path(str(ROOT / "examples" / "scenarios" / "test_downstream_stop.py"))
    with Scenario("scenarios/zoned_line", inputs=inputs) as plant:
        plant.attach(example["cascade"]())
        clock, line = _Clock(), _Clock()
        simulation: Any = plant.simulation
        simulation.advance = line.around(simulation.advance)
        clock.around(example["check"])(plant)
        ticks = simulation.tick
        return [
            Row(CASE, 0.0, contestant, FACTOR, turn, plant.time / clock.seconds),
            Row(CASE, 0.0, contestant, WHOLE, turn, 1e6 * clock.seconds / ticks),
            Row(CASE, 0.0, contestant, BESIDE, turn, 1e6 * (clock.seconds - line.seconds) / ticks),
        ]


class _Clock:
    """Adds up the processor time of calls, s."""

    def __init__(self) -> None:
        self.seconds = 0.0

    def around(self, function: Callable[..., Any]) -> Callable[..., Any]:
        """Return the function with a timer."""

        def timed(*arguments: Any) -> Any:
            begin = time.process_time()
            try:
                return function(*arguments)
            finally:
                self.seconds += time.process_time() - begin

        return timed


def tables(rows: Rows) -> str:
    """Return one table."""
    body = []
    for name in rows.contestants(CASE):
        for quantity in (FACTOR, WHOLE, OUTSIDE, BESIDE):
            now = rows.spread(CASE, 0.0, name, quantity)
            if now is not None:
                body.append([name, quantity, now])
    return markdown(["", "", "measured"], body)
