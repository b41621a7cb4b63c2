# SPDX-License-Identifier: Apache-2.0
"""Which effects a scene calls for, by which of its fields, and what forcing them does."""

from typing import Any

import pytest
from facts import missing
from scenes import NO_FLOOR, NO_OUTPUTS, arc, base, belt, bottle, contact, kind, line, scene, segment

from conveyor_sim.errors import SceneError
from conveyor_sim.physics.effects.choice import EFFECTS, choose_effects
from conveyor_sim.physics.model import build_model
from conveyor_sim.physics.plant import Plant
from conveyor_sim.scene import parse_overrides, parse_scene
from conveyor_sim.scene.effect_names import EFFECT_NAMES

TWO = [bottle(0.0, 0.0), bottle(1.0, 0.0)]
GLASS = [contact(1000.0)]
RAIL = {"edge": segment((0.0, 1.0), (1.0, 1.0))}
SHAKEN = belt(0.1, vibration={"amplitude": 1e-4, "frequency": 50.0})
CURVED = {
    "kind": "curved", "centre": [50.0, 50.0], "inner_radius": 0.3, "width": 0.2, "start_angle": 0.0, "span": 1.0,
    "material": "chain", "speed": 0.5,
}  # fmt: skip
ENTERING: dict[str, Any] = {"bottle": "bottle", "position": [0.0, 0.0], "direction": 0.0, "speed": 0.1, "gap": 0.0}
PAIR = {"bottle_contact": "bottles: 2 bottles in all", "linear": "contacts[0].stiffness: 1000 N/m"}


def choices(**fields: Any) -> dict[str, str]:
    """Effects that are on, with why."""
    return {choice.name: choice.why for choice in choose_effects(Plant.of(scene(**fields))) if choice.on}


@pytest.mark.parametrize(
    ("fields", "expected"),
    [
        ({"bottles": TWO[:1], **NO_FLOOR}, {}),
        ({"bottles": TWO, "contacts": GLASS, **NO_FLOOR}, PAIR),
        (
            {"infeeds": {"in": ENTERING}, "contacts": GLASS},
            {**PAIR, "bottle_contact": "infeeds.in: endless", "infeed": "infeeds.in"},
        ),
        ({"infeeds": {"in": {**ENTERING, "count": 1}}, "contacts": GLASS}, {"infeed": "infeeds.in"}),
        (
            {"infeeds": {"in": {**ENTERING, "count": 3}}, "contacts": GLASS},
            {**PAIR, "bottle_contact": "infeeds: 3 bottles in all", "infeed": "infeeds.in"},
        ),
        (
            {"rails": RAIL, "contacts": [contact(1000.0, "steel")], "bottles": TWO[:1]},
            {"segment_rails": "rails.edge", "linear": "contacts[0].stiffness: 1000 N/m"},
        ),
        (
            {"rails": {"bend": arc((0.0, 9.0), 1.0, 0.0, 1.0)}, "contacts": [contact(1000.0, "steel")]},
            {"arc_rails": "rails.bend", "linear": "contacts[0].stiffness: 1000 N/m"},
        ),
        (
            {
                "belts": {"bend": {**CURVED, "rails": {"outer": True, "material": "steel"}}},
                "base": base(0.0),
                "contacts": [contact(1000.0, "steel")],
            },
            {"arc_rails": "belts.bend.rails.outer", "linear": "contacts[0].stiffness: 1000 N/m"},
        ),
        (
            {"contacts": GLASS, "bottle_types": {"bottle": kind(), "small": kind(0.03)}, "bottles": TWO},
            {**PAIR, "unequal_radii": "bottle_types.small.radius: 0.03 m, bottle has 0.065 m"},
        ),
        ({"bottle_types": {"bottle": kind(), "small": kind(0.03)}, "bottles": TWO[:1]}, {}),
        (
            {"contacts": [contact(None, hertz_stiffness=1e9)], "bottles": TWO},
            {"bottle_contact": PAIR["bottle_contact"], "hertz": "contacts[0].hertz_stiffness: 1e+09 N/m^1.5"},
        ),
        (
            {"contacts": [contact(None, table=[[0.001, 5.0], [0.002, 12.0]])], "bottles": TWO},
            {"bottle_contact": PAIR["bottle_contact"], "table": "contacts[0].table: 2 points"},
        ),
        (
            {"contacts": [contact(1000.0, damping=("paper", 0.5))], "bottles": TWO},
            {**PAIR, "paper_damping": "contacts[0].damping: 0.5 kg/s", "rotation": "contacts[0].damping: 0.5 kg/s"},
        ),
        (
            {"contacts": [contact(1000.0, damping=("normal", 0.5))], "bottles": TWO},
            {**PAIR, "normal_damping": "contacts[0].damping: 0.5 kg/s"},
        ),
        ({"contacts": [contact(1000.0, damping=("normal", 0.0))], "bottles": TWO}, PAIR),
        (
            {"contacts": [contact(1000.0) | {"damping": {"law": "normal", "restitution": 0.5}}], "bottles": TWO},
            {**PAIR, "normal_damping": "contacts[0].damping.restitution: 0.5"},
        ),
        ({"contacts": [contact(1000.0) | {"damping": {"law": "normal", "restitution": 1}}], "bottles": TWO}, PAIR),
        (
            {"contacts": [contact(None, hertz_stiffness=1e9) | {"damping": {"law": "normal", "restitution": 0.5}}],
             "bottles": TWO},
            {
                "bottle_contact": PAIR["bottle_contact"],
                "hertz": "contacts[0].hertz_stiffness: 1e+09 N/m^1.5",
                "tsuji_damping": "contacts[0].damping.restitution: 0.5",
            },
        ),
        (
            {"contacts": [contact(1000.0, damping=("onset", 0.5))], "bottles": TWO},
            {**PAIR, "onset_damping": "contacts[0].damping: 0.5 s/m"},
        ),
        (
            {"contacts": [contact(1000.0, friction=0.2)], "bottles": TWO},
            {**PAIR, "contact_friction": "contacts[0].friction: 0.2", "rotation": "contacts[0].friction: 0.2"},
        ),
        (
            {"contacts": [contact(1000.0, friction=0.2, tangential={"stiffness": 800.0})], "bottles": TWO},
            {
                **PAIR,
                "contact_friction": "contacts[0].friction: 0.2",
                "tangential_spring": "contacts[0].tangential: 800 N/m",
                "rotation": "contacts[0].friction: 0.2",
            },
        ),
        ({"friction_curve": "atan", "friction_solver": "implicit"}, {}),
        (
            {"friction_curve": "atan", "friction_solver": "implicit", "floor": {"friction": 0.3}},
            {
                "base_friction": "floor: friction 0.3",
                "atan_friction": "friction_curve: atan",
                "implicit_friction": "friction_solver: implicit",
            },
        ),
        ({"bottles": [bottle(0.0, 0.0, spin=2.0)]}, {"rotation": "bottles[0].spin: 2 rad/s"}),
        ({"bottles": [bottle(0.0, 0.0, angle=2.0)]}, {"rotation": "bottles[0].angle: 2 rad"}),
        ({"floor": {"friction": 0.3}}, {"base_friction": "floor: friction 0.3"}),
        ({"floor": {"friction": 0.3}, "gravity": 0.0}, {}),
        (
            {"floor": {"friction": 0.3}, "bottle_types": {"bottle": kind(base_radius=0.04)}},
            {
                "base_friction": "floor: friction 0.3",
                "ring_base": "bottle_types.bottle.base_radius: 0.04 m",
                "rotation": "bottle_types.bottle.base_radius: 0.04 m",
            },
        ),
        ({"bottle_types": {"bottle": kind(base_radius=0.04)}, "bottles": TWO[:1], **NO_FLOOR}, {}),
        (
            {"belts": {"one": belt(0.1)}, "base": base(0.4)},
            {"base_friction": "belts.one: friction 0.4", "belts": "belts.one", "riding": "belts.one"},
        ),
        (
            {"belts": {"one": belt(0.1)}, "base": [{**base(0.4)[0], "tangential": {"stiffness": 900.0}}]},
            {
                "base_friction": "belts.one: friction 0.4",
                "static_friction": "base[0].tangential: 900 N/m",
                "belts": "belts.one",
            },
        ),
        ({"belts": {"one": belt(0.1)}, "base": base(0.0)}, {}),
        (
            {"belts": {"one": SHAKEN}, "base": base(0.4)},
            {
                "base_friction": "belts.one: friction 0.4",
                "belts": "belts.one",
                "vibration": "belts.one.vibration: 0.0001 m at 50 Hz",
            },
        ),
        ({"belts": {"one": SHAKEN}, "base": base(0.0)}, {}),
        (
            {"belts": {"one": belt(0.1), "bend": CURVED}, "base": base(0.4)},
            {
                "base_friction": "belts.one: friction 0.4",
                "belts": "belts.one",
                "curved_belts": "belts.bend",
                "riding": "belts.one",
            },
        ),
        (
            {"outfeeds": {"out": {"region": [[0, 0], [1, 0], [1, 1]]}}, "bottles": TWO[:1]},
            {"outfeed": "outfeeds.out"},
        ),
        (
            {"outputs": {"bottles": 50, "contacts": 10, "ledger": 5}, "bottles": TWO[:1]},
            {
                "peaks": "outputs.bottles: 50 Hz",
                "contact_arrays": "outputs.contacts: 10 Hz",
                "energy_ledger": "outputs.ledger: 5 Hz",
            },
        ),
        (
            {"outputs": {**NO_OUTPUTS, "damage": 5}, "limits": {"opposed_force": 20}, "bottles": TWO[:1]},
            {
                "scuffing": "outputs.damage: 5 Hz",
                "crushing": "limits.opposed_force: 20",
                "impacts": "outputs.damage: 5 Hz",
            },
        ),
        (
            {
                "bottle_types": {"bottle": kind(contact_height=0.1, gravity_height=0.08)},
                "limits": {"tipping": 0.8},
                "bottles": TWO[:1],
            },
            {"tipping": "limits.tipping: 0.8"},
        ),
    ],
)  # fmt: skip
def test_what_calls_for_an_effect(fields: dict[str, Any], expected: dict[str, str]) -> None:
    assert choices(**fields) == expected


def test_every_effect_is_decided_and_says_why_not() -> None:
    found = choose_effects(Plant.of(scene(bottles=TWO[:1], **NO_FLOOR)))
    assert [choice.name for choice in found] == [effect.name for effect in EFFECTS]
    assert [choice.why for choice in found] == [effect.absent for effect in EFFECTS]
    assert not any(choice.on or choice.forced or choice.path for choice in found)
    off = [choice.name for choice in choose_effects(Plant.of(scene(**line()))) if not choice.on]
    assert off == [
        "moving_rails", "hertz", "table", "tsuji_damping", "onset_damping", "viscoelastic_damping",
        "atan_friction", "implicit_friction",
        "tangential_spring", "static_friction", "ring_base", "vibration", "peaks", "contact_arrays", "energy_ledger",
        "scuffing", "crushing", "impacts", "tipping", "sleeping",
    ]  # fmt: skip


@pytest.mark.parametrize(
    ("fields", "why"),
    [
        ({"accuracy": {"integrator": "rk4"}}, "rk4 can't leave bottles out of a step"),
        ({"accuracy": {"integrator": "linearly_implicit"}}, "linearly_implicit can't leave bottles out of a step"),
        ({"base": [{**base(0.4)[0], "tangential": {"stiffness": 900.0}}]}, "static_friction changes the force"),
        ({"belts": {"one": SHAKEN}}, "vibration changes the force"),
        ({"belts": {"bend": CURVED}}, "no straight belt"),
    ],
)  # fmt: skip
def test_riding_names_the_reason_for_its_absence(fields: dict[str, Any], why: str) -> None:
    """Also where it is forced on, which is refused."""
    given = {"belts": {"one": belt(0.1)}, "base": base(0.4), **fields}
    (choice,) = (choice for choice in choose_effects(Plant.of(scene(**given))) if choice.name == "riding")
    assert not choice.on
    assert choice.why.startswith(why)
    with pytest.raises(SceneError, match=f'effects.riding: "on" given, expected "off": {why}'):
        choose_effects(Plant.of(scene(**given, effects={"riding": "on"})))


def test_every_name_that_a_scene_may_force_is_one_effect() -> None:
    assert [effect.name for effect in EFFECTS] == list(EFFECT_NAMES)
    for effect in EFFECTS:
        assert effect.law, effect.name
        assert effect.source, effect.name
        assert effect.absent, effect.name
        assert effect.needs, effect.name
        assert bool(effect.bound) or effect.bounds is None, effect.name


def test_most_bottles() -> None:
    """Bottles of the start and of every infeed count. There is no maximum if an infeed has no end."""
    grid = {"grid": {"type": "bottle", "origin": [3.0, 3.0], "rows": 2, "columns": 5, "pitch": 0.2}}
    fields: dict[str, Any] = {"contacts": GLASS, "bottles": [bottle(0.0, 1.0), grid]}
    assert Plant.of(scene(**fields)).most_bottles == 11
    assert Plant.of(scene(infeeds={"in": {**ENTERING, "count": 4}}, **fields)).most_bottles == 15
    assert Plant.of(scene(infeeds={"in": ENTERING}, **fields)).most_bottles is None


# ---------------------------------------------------------------- forced

ROUGH: dict[str, Any] = {"contacts": [contact(1000.0, friction=0.2)], "bottles": TWO, **NO_FLOOR}


def test_forced_off() -> None:
    (rotation,) = (choice for choice in choose_effects(Plant.of(scene(**ROUGH, effects={"rotation": "off"})))
                   if choice.name == "rotation")  # fmt: skip
    assert not rotation.on
    assert rotation.forced
    assert rotation.path == ("effects", "rotation")
    assert missing(rotation.why, "effects.rotation", "contacts[0].friction", "0.2") == []
    assert "contact_friction" in choices(**ROUGH, effects={"rotation": "off"})


def test_forced_on() -> None:
    smooth: dict[str, Any] = {"contacts": GLASS, "bottles": TWO, **NO_FLOOR}
    assert choices(**smooth, effects={"rotation": "on"}) == {**PAIR, "rotation": "forced on by effects.rotation"}
    for name in ("unequal_radii", "atan_friction", "peaks", "contact_arrays"):
        assert choices(**smooth, effects={name: "on"})[name] == f"forced on by effects.{name}"


def test_what_a_forced_effect_called_for_goes_with_it() -> None:
    """Without contact friction nothing turns a bottle; without belts there are no curved ones."""
    assert choices(**ROUGH, effects={"contact_friction": "off"}) == PAIR
    standing: dict[str, Any] = {"belts": {"one": belt(0.1), "bend": CURVED}, "base": base(0.4)}
    assert set(choices(**standing, effects={"belts": "off"})) == {"base_friction"}
    assert set(choices(**standing, effects={"base_friction": "off"})) == set()
    # Without contact between bottles, the contact of their material with itself is not in use.
    assert choices(**ROUGH, effects={"bottle_contact": "off"}) == {}


def test_a_ring_that_may_not_turn_is_a_point() -> None:
    fields: dict[str, Any] = {"floor": {"friction": 0.3}, "bottle_types": {"bottle": kind(base_radius=0.04)}}
    assert set(choices(**fields)) == {"base_friction", "ring_base", "rotation"}
    assert set(choices(**fields, effects={"rotation": "off"})) == {"base_friction"}


def test_asking_for_what_is_so_anyway_is_no_mistake() -> None:
    found = choices(**ROUGH, effects={"linear": "on", "hertz": "off", "curved_belts": "off"})
    assert missing(found["linear"], "effects.linear", "contacts[0].stiffness", "1000 N/m") == []


TEXT = """\
name: small
duration: 1.0
contacts: [{between: [glass, glass], stiffness: 1000}]
bottle_types:
  jar: {radius: 0.05, mass: 0.2, material: glass}
bottles: [{type: jar, position: [0, 0]}, {type: jar, position: [1, 0]}]
effects:
  hertz: on
  linear: off
"""


def test_what_can_not_be_forced_is_told_by_line() -> None:
    with pytest.raises(SceneError) as error:
        build_model(parse_scene(TEXT, "plant.yaml"))
    assert (
        missing(
            str(error.value),
            'plant.yaml:8: effects.hertz: "on"',
            'plant.yaml:9: effects.linear: "off"',
            "hertz_stiffness",
        )
        == []
    )


def test_what_can_not_be_forced_by_an_override_is_told_so() -> None:
    scene = parse_scene(TEXT.split("effects:")[0], "plant.yaml", {"effects": {"table": "on"}})
    with pytest.raises(SceneError, match=r'plant.yaml \(override\): effects.table: "on" given, expected "off"'):
        build_model(scene)


def test_forced_effects_survive_a_recording() -> None:
    """`on` and `off` are texts, not flags, also after they were written and read again."""
    made = parse_scene(TEXT.split("effects:")[0], "plant.yaml", {"effects": {"peaks": "on", "rotation": "off"}})
    again = parse_scene(made.source_text, "again", parse_overrides(made.overrides_text))
    assert again == made
    assert dict(again.effects) == {"peaks": "on", "rotation": "off"}


def test_contacts_are_never_due_with_their_effect_off() -> None:
    given: dict[str, Any] = {"outputs": {"bottles": 50, "contacts": 50}, "bottles": TWO[:1]}
    assert scene(**given).every("contacts") == 2
    assert scene(**given, effects={"contact_arrays": "off"}).every("contacts") == 0
    assert scene(**given, effects={"peaks": "off"}).every("bottles") == 2
