"""Effects: what a scene calls for is on, with the reason; what it doesn't is absent and costs no bits."""

from typing import Any

import numpy as np
import pytest
from scenes import NO_FLOOR, arc, base, belt, bottle, contact, kind, line, scene, segment, simulation

from conveyor_sim.effects import EFFECTS, choose_effects, most_bottles
from conveyor_sim.simulation import Simulation

TWO = [bottle(0.0, 0.0), bottle(1.0, 0.0)]
GLASS = [contact(1000.0)]
RAIL = {"edge": segment((0.0, 1.0), (1.0, 1.0))}
CURVED = {
    "kind": "curved", "centre": [50.0, 50.0], "inner_radius": 0.3, "width": 0.2, "start_angle": 0.0, "span": 1.0,
    "material": "chain", "speed": 0.5,
}  # fmt: skip


def choices(**fields: Any) -> dict[str, str]:
    """Effects that are on, with why."""
    return {choice.name: choice.why for choice in choose_effects(scene(**fields)) if choice.on}


ENTERING: dict[str, Any] = {"bottle": "bottle", "position": [0.0, 0.0], "direction": 0.0, "speed": 0.1, "gap": 0.0}


@pytest.mark.parametrize(
    ("fields", "expected"),
    [
        ({"bottles": TWO[:1], **NO_FLOOR}, {}),
        ({"bottles": TWO, "contacts": GLASS, **NO_FLOOR}, {"bottle_contact": "2 bottles"}),
        ({"infeeds": {"in": ENTERING}, "contacts": GLASS}, {"bottle_contact": "infeeds: an infeed without end"}),
        ({"infeeds": {"in": {**ENTERING, "count": 1}}, "contacts": GLASS}, {}),
        ({"infeeds": {"in": {**ENTERING, "count": 3}}, "contacts": GLASS}, {"bottle_contact": "3 bottles"}),
        ({"rails": RAIL, "contacts": [contact(1000.0, "steel")], "bottles": TWO[:1]}, {"segment_rails": "rails.edge"}),
        (
            {"rails": {"bend": arc((0.0, 9.0), 1.0, 0.0, 1.0)}, "contacts": [contact(1000.0, "steel")]},
            {"arc_rails": "rails.bend"},
        ),
        (
            {"contacts": [contact(1000.0, damping=("paper", 0.5))], "bottles": TWO},
            {
                "bottle_contact": "2 bottles",
                "paper_damping": "contacts.0.damping: 0.5 kg/s",
                "rotation": "contacts.0.damping: 0.5 kg/s",
            },
        ),
        (
            {"contacts": [contact(1000.0, damping=("normal", 0.5))], "bottles": TWO},
            {"bottle_contact": "2 bottles", "normal_damping": "contacts.0.damping: 0.5 kg/s"},
        ),
        ({"contacts": [contact(1000.0, damping=("normal", 0.0))], "bottles": TWO}, {"bottle_contact": "2 bottles"}),
        (
            {"contacts": [contact(1000.0, friction=0.2)], "bottles": TWO},
            {
                "bottle_contact": "2 bottles",
                "contact_friction": "contacts.0.friction: 0.2",
                "rotation": "contacts.0.friction: 0.2",
            },
        ),
        ({"bottles": [bottle(0.0, 0.0, spin=2.0)]}, {"rotation": "bottles.0.spin: 2 rad/s"}),
        ({"bottles": [bottle(0.0, 0.0, angle=2.0)]}, {"rotation": "bottles.0.angle: 2 rad"}),
        ({"floor": {"friction": 0.3}}, {"base_friction": "floor: friction 0.3"}),
        ({"floor": {"friction": 0.3}, "gravity": 0.0}, {}),
        (
            {"belts": {"one": belt(0.1)}, "base": base(0.4)},
            {"base_friction": "belts.one: friction 0.4", "belts": "belts.one"},
        ),
        ({"belts": {"one": belt(0.1)}, "base": base(0.0)}, {}),
        (
            {"belts": {"one": belt(0.1), "bend": CURVED}, "base": base(0.4)},
            {"base_friction": "belts.one: friction 0.4", "belts": "belts.one", "curved_belts": "belts.bend"},
        ),
    ],
)
def test_what_calls_for_an_effect(fields: dict[str, Any], expected: dict[str, str]) -> None:
    assert choices(**fields) == expected


def test_every_effect_is_decided_and_says_why_not() -> None:
    found = choose_effects(scene(bottles=TWO[:1], **NO_FLOOR))
    assert [choice.name for choice in found] == [effect.name for effect in EFFECTS]
    assert [choice.why for choice in found] == [effect.absent for effect in EFFECTS]
    assert all(choice.on for choice in choose_effects(scene(**line())))


def test_most_bottles() -> None:
    """Those of the start and of every infeed; none if one has no end."""
    grid = {"grid": {"type": "bottle", "origin": [3.0, 3.0], "rows": 2, "columns": 5, "pitch": 0.2}}
    fields: dict[str, Any] = {"contacts": GLASS, "bottles": [bottle(0.0, 1.0), grid]}
    assert most_bottles(scene(**fields)) == 11
    assert most_bottles(scene(infeeds={"in": {**ENTERING, "count": 4}}, **fields)) == 15
    assert most_bottles(scene(infeeds={"in": ENTERING}, **fields)) is None


def test_an_absent_effect_has_no_arrays() -> None:
    """One bottle, frictionless, alone: nothing to search, nothing to turn, nothing under it."""
    world = simulation(bottles=TWO[:1], **NO_FLOOR)._state.world
    for group in ("spin", "stage", "pairs", "pair_law", "grid", "segments", "near_segments", "arcs", "near_arcs",
                  "rail_law", "rail_contacts", "belts", "surface"):  # fmt: skip
        assert getattr(world, group) is None
    two = simulation(bottles=TWO, contacts=GLASS, belts={"one": belt(0.1)}, base=base(0.4))._state.world
    assert two.pairs is not None
    assert two.surface is not None
    assert two.belts is not None
    assert (two.pairs.friction, two.pairs.damping_paper, two.pairs.damping_normal) == (None, None, None)
    assert (two.surface.turn, two.belts.sectors) == (None, None)
    full = simulation(**line())._state.world
    assert [name for name in full._fields if getattr(full, name) is None] == ["stage"]


def crowd(**more: Any) -> Simulation:
    """A dozen bottles that meet on a belt, between rails; frictionless and undamped contacts."""
    merged: dict[str, Any] = {
        "tick": 0.01,
        "step": {"per_tick": 60},
        "base": base(0.4),
        "bottle_types": {"bottle": kind()},
        "contacts": [contact(5000.0), contact(8000.0, "steel")],
        "belts": {"one": belt(0.3, (-1.0, -1.0), 3.0, 2.0)},
        "rails": {"stop": segment((0.2, -0.6), (0.1, 0.6)), "side": segment((-1.0, 0.4), (0.1, 0.2))},
        "bottles": [bottle(-0.14 * n, 0.1 * (n % 3) - 0.1, 0.5 + 0.01 * n, 0.1 * (n % 2)) for n in range(12)],
    }
    for field, extra in more.items():
        merged[field] = merged[field] | extra if isinstance(extra, dict) else [*merged[field], *extra]
    return simulation(**merged)


def pet(law: str, friction: float, *others: str) -> list[dict[str, Any]]:
    common = {"stiffness": 100.0, "damping": {"law": law, "coefficient": 1.0}, "friction": friction}
    return [{"between": ["pet", other], **common} for other in others]


FAR_AWAY: dict[str, Any] = {
    "belts": {"far": CURVED},
    "rails": {"bend": arc((60.0, 60.0), 1.0, 0.0, 1.0)},
}
UNUSED: dict[str, Any] = {
    "bottle_types": {"unused": kind(material="pet")},
    "contacts": [*pet("paper", 0.3, "glass"), *pet("normal", 0.0, "pet", "steel")],
    "base": [{"between": ["pet", "chain"], "friction": 0.2}],
}


@pytest.mark.parametrize("more", [FAR_AWAY, UNUSED, FAR_AWAY | UNUSED], ids=["far away", "unused", "both"])
def test_what_nothing_touches_changes_no_bit(more: dict[str, Any]) -> None:
    """A curved belt and an arc far away, a bottle type that is not there: their effects are compiled in, but idle."""
    plain, full = crowd(), crowd(**more)
    extra = {choice.name for choice in full.model.effects if choice.on}
    extra -= {choice.name for choice in plain.model.effects if choice.on}
    assert len(extra) >= 2
    met = 0
    for _ in range(200):
        plain.advance()
        full.advance()
        met += plain.contacts().kind.size
    assert met > 100
    for name in ("x", "y", "vx", "vy", "peak_force", "impulse"):
        np.testing.assert_array_equal(getattr(full.bottles(), name), getattr(plain.bottles(), name))
    assert plain.state_hash() == full.state_hash() or "belts" in more
