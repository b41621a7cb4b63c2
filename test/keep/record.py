# SPDX-License-Identifier: Apache-2.0
"""The record of what the shipped scenes do, and how far ahead two ways of rounding agree on it.

    python test/keep/record.py            # writes record.json from the engine of this checkout
    python test/keep/record.py horizon    # prints, for each scene and time, what the tolerance was chosen from

The record was made by the engine before its rewrite for speed (commit d8fa553).
"""

from __future__ import annotations

import json
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from conveyor_sim.scene import Scene, initial_bottles, load_scene, parse_scene
from conveyor_sim.simulation import Simulation
from conveyor_sim.support.resources import scene_path

RECORD = Path(__file__).with_name("record.json")
OLD = Path(__file__).parents[1] / "scene" / "layout" / "old"

TIMES = {
    "paper_plant": (2.0, 3.0, 3.8),
    "turntable": (5.0, 10.0, 20.0),
    "accumulation_table": (1.3, 1.6, 2.0),
    "two_bottles": (0.475, 0.6, 1.0),
}
"""s, inside the horizon of each scene: a nudge of one bottle has grown less than threefold by then."""

BOTTLES = 5
"""So many bottles of a scene are recorded, evenly spread over the ids."""
CONTACTS = 5
"""So many contacts, the strongest."""
FAINT = 1e-3
"""N, a contact below it may be there or not by a rounding; it isn't counted."""

QUANTITIES = ("x", "y", "theta", "vx", "vy", "omega")
NUDGE = 1e-12
"""m"""
SHIFT = 8.0
"""m. A scene moved by it rounds its positions otherwise, and more coarsely."""

Instant = dict[str, Any]


def recorded_path(name: str) -> Path:
    """Return the file of a shipped scene as it was written for the record, which has indices of rails."""
    old = OLD / f"{name}.yaml"
    return old if old.exists() else scene_path(name)


def as_recorded(scene: Scene) -> Scene:
    """A scene whose random streams are keyed by place, as they were before they had names: the record is older."""
    scene._source = replace(scene._source, streams_by_index=True)
    return scene


def instants(simulation: Simulation, times: tuple[float, ...]) -> list[Instant]:
    """What is recorded of a simulation at each of the times, s."""
    found = []
    for time in times:
        simulation.advance(round(time / simulation.scene.tick) - simulation.tick)
        found.append(_instant(simulation, time))
    return found


def _instant(simulation: Simulation, time: float) -> Instant:
    bottles, counts = simulation.bottles(), simulation.counts
    chosen = np.unique(np.linspace(0, bottles.id.size - 1, BOTTLES).astype(int))
    forces = contact_forces(simulation)
    strongest = sorted(forces, key=lambda key: -forces[key][0])[:CONTACTS]
    return {
        "time": time,
        "counts": [counts.fed, counts.removed, counts.present],
        "signals": dict(zip(simulation.process_image.signal_names, simulation.signals().tolist(), strict=True)),
        "contacts closed": sum(normal > FAINT for normal, _ in forces.values()),
        "bottles": [
            {
                "id": int(bottles.id[i]),
                "belt": int(bottles.belt[i]),
                **{name: float(getattr(bottles, name)[i]) for name in QUANTITIES},
            }
            for i in chosen
        ],
        "contacts": [
            {"between": list(key), "normal": forces[key][0], "tangential": forces[key][1]} for key in strongest
        ],
    }


def contact_forces(simulation: Simulation) -> dict[tuple[int, int, int], tuple[float, float]]:
    """Normal and tangential force, N, by kind of contact and the two that touch, bottles in the order of their ids."""
    contacts = simulation.contacts()
    kind, a, b = (column.astype(int).tolist() for column in (contacts.kind, contacts.a, contacts.b))
    swapped = [(k, j, i) if k == 0 and j < i else (k, i, j) for k, i, j in zip(kind, a, b, strict=True)]
    forces = zip(contacts.normal_force.tolist(), contacts.tangential_force.tolist(), strict=True)
    return dict(zip(swapped, forces, strict=True))


def record() -> None:
    """Write record.json."""
    found: dict[str, Any] = {}
    for name, times in TIMES.items():
        simulation = Simulation(load_scene(recorded_path(name)))
        found[name] = {"dt": simulation.model.dt, "instants": instants(simulation, times)}
    RECORD.write_text(json.dumps(found, indent=1) + "\n")


def horizon() -> None:
    """Print how a nudge grows, and how far rounding alone takes a scene that was moved from itself."""
    print("scene, time: growth of a nudge | apart by rounding alone: m, m/s, rad/s, N")
    for name, times in TIMES.items():
        raw = load_scene(recorded_path(name)).model_dump(mode="json", by_alias=True, exclude_none=True)
        here, nudged, moved = (_simulation(raw, change) for change in (_same, _nudge, _move))
        for time in times:
            for simulation in (here, nudged, moved):
                simulation.advance(round(time / simulation.scene.tick) - simulation.tick)
            growth = _apart(here, nudged, "x", "y") / NUDGE
            noise = (_apart(here, moved, "x", "y"), _apart(here, moved, "vx", "vy"), _apart(here, moved, "omega"))
            print(f"{name}, {time} s: {growth:.2g} | " + ", ".join(f"{v:.1e}" for v in (*noise, _forces(here, moved))))


def _apart(one: Simulation, other: Simulation, *names: str) -> float:
    def columns(simulation: Simulation) -> np.ndarray:
        found = np.array([getattr(simulation.bottles(), name) for name in names])
        return found - (SHIFT * (np.array(names) == "x"))[:, None] if simulation.scene.name.endswith("moved") else found

    return float(np.abs(columns(one) - columns(other)).max(initial=0.0))


def _forces(one: Simulation, other: Simulation) -> float:
    a, b = contact_forces(one), contact_forces(other)
    none = (0.0, 0.0)
    return max((abs(a.get(k, none)[i] - b.get(k, none)[i]) for k in {*a, *b} for i in (0, 1)), default=0.0)


def _simulation(raw: dict[str, Any], change: Callable[[dict[str, Any]], None]) -> Simulation:
    copied = json.loads(json.dumps(raw))
    change(copied)
    return Simulation(parse_scene(json.dumps(copied)))


def _same(raw: dict[str, Any]) -> None:
    pass


def _nudge(raw: dict[str, Any]) -> None:
    """Where there are bottles at the start, the middle one; else all that enter, sidewards."""
    bottles = _one_by_one(raw)
    if bottles:
        bottles[len(bottles) // 2]["position"][0] += NUDGE
    else:
        next(iter(raw["infeeds"].values()))["position"][1] += NUDGE


def _one_by_one(raw: dict[str, Any]) -> list[dict[str, Any]]:
    """The bottles at the start, grids resolved."""
    raw["bottles"] = [
        {"type": kind, "position": [x, y], "angle": theta, "velocity": [vx, vy], "spin": omega}
        for kind, x, y, theta, vx, vy, omega in initial_bottles(parse_scene(json.dumps(raw)))
    ]
    return raw["bottles"]


def _move(raw: dict[str, Any]) -> None:
    _one_by_one(raw)
    raw["name"] += "_moved"
    for group in ("belts", "rails", "infeeds", "outfeeds", "bottles"):
        entries = raw.get(group, {})
        for entry in entries if isinstance(entries, list) else entries.values():
            for field in ("position", "start", "centre", "from", "to"):
                if isinstance(entry.get(field), list):  # an infeed's start is a time
                    entry[field][0] += SHIFT
            for field in ("points", "region"):
                for point in entry.get(field, []):
                    point[0] += SHIFT


if __name__ == "__main__":
    horizon() if sys.argv[1:] == ["horizon"] else record()
