# SPDX-License-Identifier: Apache-2.0
"""Movers on the page and in plans: each rail of a divider and each jaw of a clamp, and gates that leave the plane."""

from typing import Any

import pytest
from scenes import contact, scene

from conveyor_sim.page.drawings.plan import plan_of
from conveyor_sim.page.head import plan_head
from conveyor_sim.report.figures.data import StaticGeometry
from conveyor_sim.scene import Scene

MOVES: dict[str, Any] = {"material": "steel", "max_speed": 1.0, "acceleration": 5.0}


@pytest.fixture(scope="module")
def line() -> Scene:
    lift = {"kind": "lift", "from": [3.0, 0.0], "to": [3.0, 0.1], **MOVES}
    return scene(
        contacts=[contact(1e3, "steel")],
        gates={"closed": lift, "opened": {**lift, "open": True}},
        clamps={"grip": {"from": [1.0, 0.0], "to": [1.1, 0.0], "direction": "90 deg", "opening": 0.1, "stroke": 0.02,
                         **MOVES}},
        dividers={"arm": {"kind": "swing", "from": [2.0, 0.0], "to": [2.5, 0.0], "positions": [0.0, 0.2],
                          "clearance": 0.08, **MOVES}},
    )  # fmt: skip


def test_the_page_gets_every_rail_with_its_pivot(line: Scene) -> None:
    movers = plan_head(line)["movers"]
    assert [mover["name"] for mover in movers] == [
        "gates/closed", "gates/opened", "dividers/arm", "dividers/arm", "clamps/grip", "clamps/grip",
    ]  # fmt: skip
    assert [mover["present"] for mover in movers] == [0.5, 0.5, 1.0, 1.0, 1.0, 1.0]
    right, left = movers[2:4]
    assert right["pivot"] == left["pivot"] == (2.0, 0.0)
    assert (right["from"], left["from"]) == ((2.0, -0.04), (2.0, 0.04))
    one, other = movers[4:]
    assert one["along"] == tuple(-part for part in other["along"])
    assert other["from"] == pytest.approx((1.0, 0.1))


def test_plans_and_figures_show_them(line: Scene) -> None:
    """A figure leaves out a gate that is lifted; a plan shows its place."""
    drawn = [(shape.layer, shape.name) for shape in plan_of(line) if shape.layer != "RAILS"]
    assert sorted(drawn) == [
        ("CLAMPS", "grip"), ("CLAMPS", "grip"), ("DIVIDERS", "arm"), ("DIVIDERS", "arm"),
        ("GATES", "closed"), ("GATES", "opened"),
    ]  # fmt: skip
    moving = [rail.name for rail in StaticGeometry.of(line).rails if "/" in rail.name]
    assert "gates/closed" in moving and "gates/opened" not in moving
    assert moving.count("clamps/grip") == 2
