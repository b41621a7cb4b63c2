# SPDX-License-Identifier: Apache-2.0
"""Tests of control logic on a simulated line: `Scenario`, and the pytest fixture `line` that makes them.

    def test_the_table_is_emptied(line):
        plant = line("paper_plant")
        plant.attach(MyController())
        plant.eventually(lambda s: s["belts/table/bottles"] > 20, within=60)

docs/testing_control_logic.md explains it. pytest loads the plugin by its entry point.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from conveyor_sim.testing.scenario import Scenario

__all__ = ["Scenario"]


def __getattr__(name: str) -> Any:
    """Import `Scenario` at its first use, because pytest loads this package in every run."""
    if name == "Scenario":
        from conveyor_sim.testing.scenario import Scenario

        return Scenario
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
