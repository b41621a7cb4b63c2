"""A straight line for tests of sensors: a belt, behind it a plate that can stop; bottles in a row. One kernel."""

from __future__ import annotations

from typing import Any

from scenes import RADIUS, base, belt, bottle, contact, segment, simulation

from conveyor_sim.simulation import Simulation

SPEED = 0.5
"""m/s, of the belt."""


def eye_line(speed: float = SPEED, xs: tuple[float, ...] = (0.0,), **fields: Any) -> Simulation:
    """Bottles at (x, 0) that move with a belt along x, up to x = 2; from there on a plate, as fast at first."""
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
    """A beam or a counter's line across the belt; a counter's forward is along x."""
    return {"from": [x, -half], "to": [x, half], **more}


def read(sim: Simulation, place: str = "") -> dict[str, float]:
    """Signals by name, of those that begin with a place by what follows."""
    image = zip(sim.process_image.signal_names, sim.signals().tolist(), strict=True)
    return {name.removeprefix(place): value for name, value in image if name.startswith(place)}


def rises(x: float, speed: float = SPEED) -> float:
    """When a bottle that began at 0 breaks a beam at x, s."""
    return (x - RADIUS) / speed


def falls(x: float, speed: float = SPEED) -> float:
    """When it frees it, s."""
    return (x + RADIUS) / speed
