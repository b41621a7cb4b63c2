# SPDX-License-Identifier: Apache-2.0
"""Straight line for tests of sensors: a belt, then a plate that can stop, and bottles in a row. It uses one kernel."""

from __future__ import annotations

from typing import Any

from scenes import RADIUS, base, belt, bottle, contact, segment, simulation

from conveyor_sim.simulation import Simulation

SPEED = 0.5
"""Speed of the belt, m/s."""


def eye_line(speed: float = SPEED, xs: tuple[float, ...] = (0.0,), **fields: Any) -> Simulation:
    """Return a line with bottles at (x, 0) that move with a belt along x, up to x = 2.

    From there on they stand on a plate, initially as fast as the belt.
    """
    given: dict[str, Any] = {
        "tick": 0.01,
        "accuracy": {"per_tick": 20},
        "base": base(0.4),
        "contacts": [contact(5000.0, other, ("normal", 5.0)) for other in ("glass", "steel")],
        "belts": {"belt": belt(speed, (-4.0, -1.0), 6.0, 2.0), "plate": belt(speed, (2.0, -1.0), 4.0, 2.0)},
        # Where no bottle is: with it the kernels are those of test_infeed.py.
        "rails": {"far": segment((30.0, 30.0), (31.0, 30.0))},
        # One that is never in the way, for bottles that can touch are another kernel than one alone.
        "bottles": [*(bottle(x, 0.0, speed) for x in xs), bottle(-3.8, 0.9, speed)],
    }
    return simulation(**{**given, **fields})


def across(x: float, half: float = 0.2, **more: Any) -> dict[str, Any]:
    """Return a beam, or the line of a counter, across the belt. A counter's forward direction is along x."""
    return {"from": [x, -half], "to": [x, half], **more}


def read(sim: Simulation, place: str = "") -> dict[str, float]:
    """Return signals by name; of those that begin with a place, by the rest of the name."""
    image = zip(sim.process_image.signal_names, sim.signals().tolist(), strict=True)
    return {name.removeprefix(place): value for name, value in image if name.startswith(place)}


def rises(x: float, speed: float = SPEED) -> float:
    """Return the time when a bottle that started at 0 breaks a beam at x, s."""
    return (x - RADIUS) / speed


def falls(x: float, speed: float = SPEED) -> float:
    """Return the time when the bottle frees the beam, s."""
    return (x + RADIUS) / speed
