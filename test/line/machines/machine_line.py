# SPDX-License-Identifier: Apache-2.0
"""Belt with machines at its ends, in single file."""

from typing import Any

from scenes import base, belt, contact, segment, simulation

from conveyor_sim.simulation import Simulation

END = [[1.75, -0.2], [2.0, -0.2], [2.0, 0.2], [1.75, 0.2]]
"""Region before the rail at the end of the belt."""


def source(rate: float = 2.0, **more: Any) -> dict[str, Any]:
    """Return a source at the start of the belt."""
    return {"kind": "source", "bottle": "bottle", "position": [0.0, 0.0], "direction": 0.0, "speed": 0.5,
            "rate": rate, **more}  # fmt: skip


def sink(rate: float = 2.0, **more: Any) -> dict[str, Any]:
    """Return a sink at the end of the belt."""
    return {"kind": "sink", "region": END, "rate": rate, **more}


def line(**fields: Any) -> Simulation:
    """Return a belt of 2 m at 0.5 m/s in single file, with a rail at its end."""
    given = {
        "accuracy": {"per_tick": 50},
        "base": base(0.4),
        "contacts": [contact(5e4, damping=("normal", 30.0)), contact(5e4, "steel", damping=("normal", 30.0))],
        "belts": {"one": belt(0.5, (-0.2, -0.1), 2.2, 0.2)},
        "rails": {"end": segment((2.0, 0.1), (2.0, -0.1))},
    }
    return simulation(**{**given, **fields})


def signals(sim: Simulation) -> dict[str, float]:
    """Return the signals by name."""
    return dict(zip(sim.process_image.signal_names, sim.signals().tolist(), strict=True))


def station(region: list[list[float]], position: list[float], rate: float = 2.0, **more: Any) -> dict[str, Any]:
    """Return a station that gives bottles as fast as the belt runs."""
    return {"kind": "station", "region": region, "position": position, "direction": 0.0, "speed": 0.5, "rate": rate,
            **more}  # fmt: skip
