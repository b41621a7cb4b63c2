# SPDX-License-Identifier: Apache-2.0
"""Creep of zigzag queues with implicit friction: 20 scenes of a seeded generator, written after the solver was settled.

    python docs/studies/implicit_queues.py              # all scenes to implicit_queues.csv: five minutes of a processor
    python docs/studies/implicit_queues.py --scene 3    # one scene, printed

Each scene is a lane with a stop, wider than a bottle, in which 10 to 200 bottles stand in a zigzag on a running chain,
with friction of 0.05 to 0.5 in contacts and one of three integrators. It runs with explicit friction until the queue
presses on the stop and creeps. From this state it runs on for a second, with explicit friction in fine steps (the
reference), and with implicit friction at each preset. The table has

- rise: change of the sum of normal forces in that second, N
- resting error: RMS over closed contacts of the error in the mean force, divided by the RMS of the reference, as
  `conveyor-sim accuracy` defines resting load; the prediction for it, and the promise of the preset
"""

import argparse
import csv
import json
import math
import random
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from conveyor_sim.physics.timestep.presets import PRESETS
from conveyor_sim.scene import Scene, parse_scene
from conveyor_sim.simulation import Simulation

SCENES = 20
SEED = 40
INTEGRATORS = ("leapfrog", "semi_implicit_euler", "velocity_verlet")
REFERENCE_STEPS = 2.0
"""Steps of the reference, as a multiple of those of explicit friction at `standard`."""
PACKED = 3.0
"""Simulated seconds in which a queue packs before it is measured."""


def queue_scene(number: int, seed: int = SEED) -> dict[str, Any]:
    """Return the fields of scene `number` of the generator."""
    draw = random.Random(f"{seed}/{number}")
    radius = draw.uniform(0.02, 0.05)
    mass = draw.uniform(0.1, 0.8)
    count = round(10.0 * 20.0 ** draw.random())
    width = 2.0 * radius * draw.uniform(1.2, 1.7)
    mu = round(0.05 * 10.0 ** draw.random(), 3)
    speed = draw.uniform(0.1, 0.6)
    stiffness = 10.0 ** draw.uniform(4.5, 5.5)
    restitution = draw.uniform(0.3, 0.7)
    # Neighbours touch across the lane: their axes are this far apart along it, with a gap of 0.2 % to close.
    along = 1.002 * math.sqrt(4.0 * radius**2 - (width - 2.0 * radius) ** 2)
    length = along * count + 4.0 * radius
    end = length - radius
    near, far = 1.001 * radius, width - 1.001 * radius
    bottles = [
        {"type": "b", "position": [end - 1.01 * radius - along * k, near if k % 2 else far], "velocity": [speed, 0.0]}
        for k in range(count)
    ]

    def wall(x0: float, y0: float, x1: float, y1: float) -> dict[str, Any]:
        return {"kind": "segment", "material": "steel", "from": [x0, y0], "to": [x1, y1]}

    def touch(other: str, stiff: float) -> dict[str, Any]:
        damping = {"law": "normal", "restitution": restitution}
        return {"between": ["glass", other], "friction": mu, "damping": damping, "stiffness": stiff}

    return {
        "name": f"implicit_queue_{number}",
        "duration": 60.0,
        "outputs": {"poses": 0, "contacts": 0, "belts": 0, "signals": 0, "bottles": 0, "counters": 0},
        "contacts": [touch("glass", stiffness), touch("steel", 1.5 * stiffness)],
        "base": [{"between": ["glass", "chain"], "friction": round(draw.uniform(0.1, 0.4), 3)}],
        "bottle_types": {"b": {"radius": radius, "mass": mass, "material": "glass"}},
        "belts": {
            "chain": {
                "kind": "straight", "start": [0, 0], "angle": 0, "length": length, "width": width, "speed": speed,
                "material": "chain",
            }
        },
        "rails": {
            "right": wall(0.0, 0.0, length, 0.0),
            "left": wall(length, width, 0.0, width),
            "stop": wall(end, 0.02 * width, end, 0.98 * width),
        },
        "bottles": bottles,
        "accuracy": {"integrator": INTEGRATORS[number % len(INTEGRATORS)]},
    }  # fmt: skip


def _scene(fields: dict[str, Any], solver: str, **accuracy: Any) -> Scene:
    integrator = fields["accuracy"]["integrator"]
    return parse_scene(
        json.dumps({**fields, "friction_solver": solver, "accuracy": {"integrator": integrator, **accuracy}})
    )


def _second(sim: Simulation) -> tuple[dict[tuple[int, int, int], float], float]:
    """Return mean normal forces (N) over a second, of contacts closed throughout, and the rise of their sum (N)."""
    sums: dict[tuple[int, int, int], list[float]] = {}
    ticks = round(1.0 / sim.scene.tick)
    first = float(sim.contacts().normal_force.sum())
    for _ in range(ticks):
        sim.advance(1)
        contacts = sim.contacts()
        keys = zip(contacts.kind.tolist(), contacts.a.tolist(), contacts.b.tolist(), strict=True)
        for key, force in zip(keys, contacts.normal_force.tolist(), strict=True):
            sums.setdefault(key, []).append(force)
    means = {key: sum(forces) / ticks for key, forces in sums.items() if len(forces) == ticks}
    return means, float(sim.contacts().normal_force.sum()) - first


def measure(number: int, presets: tuple[str, ...] = tuple(PRESETS), packed: float = PACKED) -> Iterator[dict[str, Any]]:
    """Yield one row per preset for a scene of the generator. packed: s, until the state that all runs start from."""
    fields = queue_scene(number)
    start = Simulation(_scene(fields, "explicit", preset="standard"), threads=1)
    start.advance(round(packed / start.scene.tick))
    steps = round(REFERENCE_STEPS * start.model.steps_per_tick)
    reference = Simulation(_scene(fields, "explicit", per_tick=steps), threads=1)
    reference.restore_from(start)
    exact, rise = _second(reference)
    for preset in presets:
        sim = Simulation(_scene(fields, "implicit", preset=preset), threads=1)
        sim.restore_from(start)
        means, own_rise = _second(sim)
        both = sorted(exact.keys() & means.keys())
        true = np.array([exact[key] for key in both])
        error = float(np.sqrt(np.mean((np.array([means[key] for key in both]) - true) ** 2) / np.mean(true**2)))
        friction = fields["contacts"][0]["friction"]
        yield {
            "scene": number,
            "integrator": fields["accuracy"]["integrator"],
            "bottles": len(fields["bottles"]),
            "friction": friction,
            "preset": preset,
            "steps": sim.model.steps_per_tick,
            "explicit steps": start.model.steps_per_tick,
            "force N": round(float(true.sum()), 3),
            "reference rise N": round(rise, 4),
            "rise N": round(own_rise, 4),
            "contacts": len(both),
            "resting error": f"{error:.3g}",
            "predicted": f"{sim.model.prediction.resting or 0.0:.3g}",
            "promise": PRESETS[preset],
        }


def main() -> None:
    """Measure one scene, or all to the table beside this file."""
    parser = argparse.ArgumentParser(description="Creep of zigzag queues with implicit friction.")
    parser.add_argument("--scene", type=int, help="one scene, printed")
    chosen = parser.parse_args().scene
    rows: list[dict[str, Any]] = []
    for number in range(SCENES) if chosen is None else [chosen]:
        for row in measure(number):
            rows.append(row)
            print(*row.values(), flush=True)
    if chosen is not None:
        return
    with Path(__file__).with_suffix(".csv").open("w", encoding="utf-8", newline="") as file:
        writer = csv.DictWriter(file, rows[0].keys(), lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)
    missed = [row for row in rows if float(row["resting error"]) > row["promise"]]
    print(f"{len(rows) - len(missed)} of {len(rows)} promises of resting load hold", file=sys.stderr)


if __name__ == "__main__":
    main()
