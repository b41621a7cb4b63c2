# SPDX-License-Identifier: Apache-2.0
"""Cost of bodies under axes, in CPU time of one core: distant gates beside a crowd, and a star wheel that turns."""

from __future__ import annotations

import json
import math
import time
from typing import Any

from bench.markdown import table as markdown
from bench.measure import Effort, say
from bench.packed import NO_OUTPUTS
from bench.rows import Row, Rows, Spread
from conveyor_sim.scene import Scene, parse_scene
from conveyor_sim.simulation import Simulation

CASE, WHEEL_CASE = "distant gates", "star wheel"
TICK = "us a tick"
GATES = (1, 40, 160)
TURNING, WITHOUT = "12 pockets with 12 bottles", "the bottles alone"
TICKS, QUICK_TICKS = 40, 5
REPEATS = 10
RATE, POCKETS, PITCH_RADIUS, RADIUS = 24_000 / 3_600, 12, 0.3, 0.033


def measure(effort: Effort) -> list[Row]:
    """All of one kind in turn; each value is the least of several."""
    ticks = QUICK_TICKS if effort.quick else TICKS
    say("bodies: compiling")
    crowds = {str(gates): _ready(_crowd(gates)) for gates in GATES}
    wheels = {TURNING: _ready(_wheel(True)), WITHOUT: _ready(_wheel(False))}
    rows = []
    for turn in range(effort.rounds):
        for case, simulations in ((CASE, crowds), (WHEEL_CASE, wheels)):
            say(f"bodies, round {turn + 1}: {case}")
            least = dict.fromkeys(simulations, math.inf)
            for _ in range(REPEATS):
                for name, simulation in simulations.items():
                    least[name] = min(least[name], _tick(simulation, ticks))
            rows += [Row(case, 0.0, name, TICK, turn, value) for name, value in least.items()]
    return rows


def _ready(scene: Scene) -> Simulation:
    simulation = Simulation(scene, threads=1)
    simulation.advance(30)
    return simulation


def _tick(simulation: Simulation, ticks: int) -> float:
    """CPU time of a tick, us."""
    begin = time.process_time()
    simulation.advance(ticks)
    return 1e6 * (time.process_time() - begin) / ticks


def _scene(stiffness: float, **fields: Any) -> Scene:
    law = {"stiffness": stiffness, "friction": 0.15, "damping": {"law": "normal", "restitution": 0.5}}
    given: dict[str, Any] = {
        "name": "bodies",
        "duration": 1e4,
        "accuracy": {"preset": "draft"},
        "bottle_types": {"bottle": {"radius": RADIUS, "mass": 0.5, "material": "pet"}},
        "contacts": [{"between": ["pet", other], **law} for other in ("pet", "steel")],
        "outputs": NO_OUTPUTS,
    }
    return parse_scene(json.dumps({**given, **fields}))


def _crowd(gates: int) -> Scene:
    """Build 200 bottles that a belt presses against a stop, and closed gates 50 m away."""
    gate = {
        "kind": "slide", "material": "steel", "direction": 0.5 * math.pi, "stroke": 0.2, "max_speed": 0.5,
        "acceleration": 5.0,
    }  # fmt: skip
    places = [(50.0 + 0.5 * (k % 40), 5.0 + k // 40) for k in range(gates)]
    wall = {"kind": "segment", "material": "steel"}
    return _scene(
        5e3,
        base=[{"between": ["pet", "chain"], "friction": 0.3}],
        belts={"main": {"kind": "straight", "start": [0.0, -0.2], "angle": 0.0, "length": 6.0, "width": 0.4,
                        "speed": 0.3, "material": "chain"}},
        rails={"left": {**wall, "from": [0.0, 0.2], "to": [6.0, 0.2]},
               "right": {**wall, "from": [6.0, -0.2], "to": [0.0, -0.2]},
               "stop": {**wall, "from": [5.0, -0.2], "to": [5.0, 0.2]}},
        bottles=[{"grid": {"type": "bottle", "origin": [1.2, -0.15], "rows": 5, "columns": 40, "pitch": 0.0665,
                           "pattern": "square"}}],
        gates={f"g{k}": {**gate, "from": [x, y], "to": [x + 0.3, y]} for k, (x, y) in enumerate(places)},
    )  # fmt: skip


def _wheel(turns: bool) -> Scene:
    """Build a wheel with a bottle in each pocket and a guide all round; or the bottles and the guide alone."""
    omega, pitch = 2.0 * math.pi * RATE / POCKETS, 2.0 * math.pi / POCKETS
    bottles = [
        {"type": "bottle", "position": [PITCH_RADIUS * cos, PITCH_RADIUS * sin],
         "velocity": [-omega * PITCH_RADIUS * sin, omega * PITCH_RADIUS * cos]}
        for cos, sin in ((math.cos(k * pitch), math.sin(k * pitch)) for k in range(POCKETS))
    ]  # fmt: skip
    guide = {"kind": "arc", "centre": [0.0, 0.0], "radius": PITCH_RADIUS + RADIUS + 1e-3, "start_angle": 0.0,
             "span": 2.0 * math.pi, "material": "steel"}  # fmt: skip
    star = {"centre": [0.0, 0.0], "pockets": POCKETS, "pitch_radius": PITCH_RADIUS, "pocket_radius": 0.034,
            "axis": "star", "material": "steel", "turn": "left", "phase": 0.0, "entry": 0.0}  # fmt: skip
    machine: dict[str, Any] = {"axes": {"star": {"rate": RATE / POCKETS}}, "stars": {"in": star}} if turns else {}
    return _scene(2e4, floor={"friction": 0.15}, rails={"guide": guide}, bottles=bottles, **machine)


def tables(rows: Rows) -> str:
    """Return a table of both cases."""
    body: list[list[object]] = []
    for name in rows.contestants(CASE):
        ratio = rows.ratio(CASE, 0.0, name, str(GATES[0]), TICK)
        body.append([f"200 bottles, {name} closed gates 50 m away", rows.spread(CASE, 0.0, name, TICK), ratio])
    body += [[f"star wheel, {name}", rows.spread(WHEEL_CASE, 0.0, name, TICK), None] for name in (TURNING, WITHOUT)]
    return markdown(["", TICK, "times one gate"], body)


def rise(rows: Rows) -> float | None:
    """Return the share by which a tick is longer with the most gates than with one."""
    ratio = rows.ratio(CASE, 0.0, str(GATES[-1]), str(GATES[0]), TICK)
    return None if ratio is None else ratio.middle - 1.0


def wheel_cost(rows: Rows) -> float | None:
    """Return what the wheel adds to a tick of its bottles, us."""
    with_, without = (rows.spread(WHEEL_CASE, 0.0, name, TICK) for name in (TURNING, WITHOUT))
    return _difference(with_, without)


def _difference(one: Spread | None, other: Spread | None) -> float | None:
    return None if one is None or other is None else one.middle - other.middle
