# SPDX-License-Identifier: Apache-2.0
"""Effects that a scene does not call for are absent. Present but idle effects change no bit."""

from typing import Any

import numpy as np
import pytest
from scenes import NO_FLOOR, arc, base, belt, bottle, contact, kind, line, scene, segment, simulation

from conveyor_sim.engine.arrays.world import World
from conveyor_sim.physics.model import build_model
from conveyor_sim.physics.state import State
from conveyor_sim.simulation import Simulation

TWO = [bottle(0.0, 0.0), bottle(1.0, 0.0)]
GLASS = [contact(1000.0)]
CURVED = {
    "kind": "curved", "centre": [50.0, 50.0], "inner_radius": 0.3, "width": 0.2, "start_angle": 0.0, "span": 1.0,
    "material": "chain", "speed": 0.5,
}  # fmt: skip


def absent(of: Any) -> set[str]:
    """Names of the groups or columns that are None."""
    return {name for name in of._fields if getattr(of, name) is None}


def world_of(**fields: Any) -> World:
    """The engine's arrays of a scene, of which nothing is compiled."""
    return State(build_model(scene(**fields))).world


def test_an_absent_effect_has_no_arrays() -> None:
    """One bottle, frictionless, alone: nothing to search, nothing to turn, nothing under it."""
    world = world_of(bottles=TWO[:1], **NO_FLOOR)
    present = {"settings", "bottles", "load", "neighbourhood", "probe"}
    assert set(world._fields) - absent(world) == present
    assert absent(world.load) == {"normal_max", "normal_sum"}
    two = world_of(bottles=TWO, contacts=GLASS, belts={"one": belt(0.1)}, base=base(0.4))
    assert two.pairs is not None
    assert two.surface is not None
    assert two.belts is not None
    laws = set(two.pairs.law._fields)
    assert absent(two.pairs.law) == laws - {"stiffness"}
    assert {"reach", "moment", "normal", "touch", "spring"} <= absent(two.pairs)
    assert (two.surface.turn, two.belts.sectors) == (None, None)


OFF = {
    "rotation": ("spin",),
    "bottle_contact": ("pairs", "pair_law", "slots"),
    "segment_rails": ("segments", "near_segments"),
    "arc_rails": ("arcs", "near_arcs"),
    "base_friction": ("surface", "footing", "belts"),
    "belts": ("belts",),
    "peaks": ("peaks",),
}


@pytest.mark.parametrize("name", OFF)
def test_an_effect_forced_off_has_no_arrays(name: str) -> None:
    """Force each effect off in a line with one of every part."""
    outputs = {"bottles": 50, "contacts": 50}
    before = world_of(**line(outputs=outputs))
    world = world_of(**line(outputs=outputs, effects={name: "off"}))
    assert absent(world) - absent(before) >= set(OFF[name])


def test_without_an_infeed_nothing_enters_and_without_an_outfeed_nothing_leaves() -> None:
    fed = simulation(**line())
    dry = simulation(**line(effects={"infeed": "off", "outfeed": "off"}))
    for sim in (fed, dry):
        sim.advance(300)
    assert fed.counts.fed > 0
    assert (dry.counts.fed, dry.counts.removed, dry.counts.present) == (0, 0, 6)


def test_friction_acts_without_rotation_and_turns_nothing() -> None:
    """A bottle that slides along a rail slows down; its spin is not there."""
    rail = {"side": segment((-1.0, -0.065), (3.0, -0.065))}
    fields: dict[str, Any] = {
        "bottles": [bottle(0.0, 0.0, 1.0, -0.2)], "rails": rail,
        "contacts": [contact(5e3, "steel", ("normal", 1.0), 0.3)], **NO_FLOOR,
    }  # fmt: skip
    turning, sliding = simulation(**fields), simulation(**fields, effects={"rotation": "off"})
    for sim in (turning, sliding):
        sim.advance(20)
    # Sliding: mu times the impulse of the rebound, m (v_n + v_n'), off m v_t.
    lost = 0.3 * (0.2 + sliding.bottles().vy[0])
    assert sliding.bottles().vx[0] == pytest.approx(1.0 - lost, rel=1e-3)
    assert sliding.bottles().omega[0] == 0.0
    assert turning.bottles().omega[0] != 0.0


def crowd(**more: Any) -> Simulation:
    """A dozen bottles that meet on a belt, between rails; frictionless and undamped contacts."""
    merged: dict[str, Any] = {
        "tick": 0.01,
        "accuracy": {"per_tick": 60},
        "base": base(0.4),
        "bottle_types": {"bottle": kind()},
        "contacts": [contact(5000.0), contact(8000.0, "steel")],
        "belts": {"one": belt(0.3, (-1.0, -1.0), 3.0, 2.0)},
        "rails": {"stop": segment((0.2, -0.6), (0.1, 0.6)), "side": segment((-1.0, 0.4), (0.1, 0.2))},
        "bottles": [bottle(-0.14 * n, 0.1 * (n % 3) - 0.1, 0.5 + 0.01 * n, 0.1 * (n % 2)) for n in range(12)],
    }
    for field, extra in more.items():
        merged[field] = merged.get(field, {}) | extra if isinstance(extra, dict) else extra
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
    "contacts": [
        contact(5000.0),
        contact(8000.0, "steel"),
        *pet("paper", 0.3, "glass"),
        *pet("normal", 0.0, "pet", "steel"),
    ],
    "base": [*base(0.4), {"between": ["pet", "chain"], "friction": 0.2}],
}
FORCED: dict[str, Any] = {"effects": {"rotation": "on", "unequal_radii": "on", "peaks": "on", "contact_arrays": "on"}}


@pytest.mark.parametrize("more", [FAR_AWAY, UNUSED | FORCED], ids=["far away", "unused and forced on"])
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
    for name in ("x", "y", "vx", "vy"):
        np.testing.assert_array_equal(getattr(full.bottles(), name), getattr(plain.bottles(), name))
    assert plain.state_hash() == full.state_hash() or "belts" in more


def test_what_is_forced_off_was_never_there() -> None:
    """A scene full of laws that are all forced off runs as the one without them, bit for bit."""
    laws = {"law": "paper", "coefficient": 0.5}
    rough = {"damping": laws, "friction": 0.3, "tangential": {"stiffness": 1000.0}}
    plain, full = crowd(), crowd(
        contacts=[contact(5000.0) | rough, contact(8000.0, "steel") | rough],
        friction_curve="atan",
        friction_solver="implicit",
        bottle_types={"bottle": kind(base_radius=0.04)},
        outputs={"bottles": 50, "contacts": 50},
        effects=dict.fromkeys(
            ["paper_damping", "contact_friction", "atan_friction", "implicit_friction", "tangential_spring",
             "ring_base", "rotation", "peaks", "contact_arrays"], "off",
        ),
    )  # fmt: skip
    assert [choice.name for choice in full.model.effects if choice.on] == [
        choice.name for choice in plain.model.effects if choice.on
    ]
    plain.advance(100)
    full.advance(100)
    assert plain.contacts().kind.size > 0
    assert plain.state_hash() == full.state_hash()
