# SPDX-License-Identifier: Apache-2.0
"""Bottles on industrial conveyors: discrete-element simulation, recorded like a real line.

A scene file (YAML) describes belts, rails, bottles, infeeds and outfeeds. `load_scene` validates it.
`Simulation` compiles the kernels that it needs and advances it in ticks:

    from conveyor_sim import Simulation, load_scene
    simulation = Simulation(load_scene("config/two_bottles.yaml"))
    simulation.advance(100)
    print(simulation.bottles().x)

The same simulation runs as a ROS 2 node (`sim_node`) or without ROS (`conveyor-sim run`), into the same bags.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from conveyor_sim.scene import load_scene
    from conveyor_sim.simulation import Simulation

__version__ = "0.2.0"
"""Version of this package; package.xml repeats it, and a test compares them."""

__all__ = ["Simulation", "__version__", "load_scene"]


def __getattr__(name: str) -> Any:
    """Import an entry point on first use, so that importing the package stays cheap."""
    if name == "Simulation":
        from conveyor_sim.simulation import Simulation

        return Simulation
    if name == "load_scene":
        from conveyor_sim.scene import load_scene

        return load_scene
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
