# SPDX-License-Identifier: Apache-2.0
"""Bottles on points roll along rails where real ones rub: said where it can matter, and nowhere else."""

from typing import Any

import pytest
from click.testing import CliRunner
from scenes import base, belt, bottle, contact, kind, scene, segment

from conveyor_sim.cli import main
from conveyor_sim.physics.effects.notes import CAN, notes
from conveyor_sim.physics.model import build_model

RAIL = {"side": segment((0.0, -0.1), (1.0, -0.1))}
GATE = {
    "kind": "slide", "from": [3, 0], "to": [3, 1], "direction": 0, "stroke": 0.2, "max_speed": 1, "acceleration": 5,
    "material": "steel",
}  # fmt: skip
RUBS: dict[str, Any] = {
    "contacts": [contact(5e3, friction=0.1), contact(5e3, "steel", friction=0.1)],
    "base": base(0.4),
    "belts": {"belt": belt(0.3)},
    "rails": RAIL,
    "bottles": [bottle(0.0, 0.0), bottle(0.5, 0.0)],
}


def noted(**fields: Any) -> list[str]:
    given = scene(**{**RUBS, **fields})
    model = build_model(given)
    return notes(model.plant, {choice.name for choice in model.effects if choice.on})


@pytest.mark.parametrize("fields", [{}, {"rails": {}, "gates": {"stop": GATE}}], ids=["rail", "gate"])
def test_a_point_that_may_rub_is_told_with_the_remedy(fields: dict[str, Any]) -> None:
    (sentence,) = noted(**fields)
    assert sentence.startswith("bottle_types.bottle stands on a point: ")
    assert sentence.endswith(f"give base_radius, for a can {CAN} times the radius: 0.0474 m")
    two = {"bottle": kind(), "ring": kind(base_radius=0.04), "small": kind(0.05)}
    assert noted(**fields, bottle_types=two)[0].startswith("bottle_types.bottle, and 1 more, stands on a point")


@pytest.mark.parametrize(
    "fields",
    [
        {"bottle_types": {"bottle": kind(base_radius=0.04)}},
        {"rails": {}},
        {"contacts": [contact(5e3, friction=0.1), contact(5e3, "steel")]},
        {"base": base(0.0)},
        {"effects": {"rotation": "off"}},
        {"effects": {"segment_rails": "off"}},
        {"base": [{**base(0.4)[0], "tangential": {"stiffness": 2e4}}]},
    ],
    ids=["ring", "no rail", "smooth rail", "no friction under it", "no rotation", "rail off", "base on a spring"],
)
def test_nothing_is_said_where_nothing_rolls_or_a_ring_can_t_be(fields: dict[str, Any]) -> None:
    assert noted(**fields) == []


@pytest.mark.parametrize(("name", "said"), [("funnel", True), ("two_bottles", False)])
def test_explain_tells_it(name: str, said: bool) -> None:
    shown = CliRunner().invoke(main, ["explain", name], env={"COLUMNS": "200"}).output
    assert ("stands on a point" in " ".join(shown.split())) == said
