# SPDX-License-Identifier: Apache-2.0
"""Texts of quantities: values to the last bit, dimensions, refusals."""

import math
import random
import string
from typing import Annotated

import pytest
from facts import missing

from conveyor_sim.errors import SceneError
from conveyor_sim.scene import parse_again, parse_scene
from conveyor_sim.scene.conversion import in_si_units
from conveyor_sim.scene.part import Part, part_from
from conveyor_sim.scene.quantities import LONGEST, Quantity, Scoped, dimensions, evaluate, to_si
from conveyor_sim.scene.reference import sections
from conveyor_sim.scene.types import Count, Holds, Limit, Number, Point, PointList, Positive, quantity
from conveyor_sim.scene.units import UNITS
from conveyor_sim.scene.words import unit_of

SCENE = """
name: units
duration: 1 min
tick: 10 ms
bottle_types: {jar: {radius: 3.3 cm, mass: 350 g, material: glass}}
belts: {a: {kind: straight, start: [0 m, -33 mm], angle: -90 deg, length: 2.4 m, width: 75 mm,
  speed: 30 m/min, speed_limits: [0 m/s, 60 m/min], material: chain}}
contacts: [{between: [glass, glass], table: [[0.1 mm, 2 N], [0.2 mm, 0.005 kN]]}]
base: [{between: [glass, chain], friction: 15 %}]
"""


class Fields(Part):
    """A part with fields of several kinds."""

    length: Positive | None = quantity("A length.", "m", default=None)
    at: Point | None = quantity("A point.", "m", default=None)
    points: PointList | None = quantity("Points.", "m", default=None)
    count: Count | None = quantity("A count.", "1", default=None)
    limit: Limit = quantity("A limit.", "N", default=1.0)
    turn: Number = quantity("An angle.", "rad", default=0.0)
    level: Number = quantity("A level.", "that of the signal", default=0.0)
    by_name: Annotated[dict[str, Positive], Holds("a mapping of names to numbers")] = quantity(
        "Lengths by name.", "m", default={}
    )


@pytest.mark.parametrize(
    ("text", "unit", "value"),
    [
        ("33 mm", "m", 0.033),
        ("33mm", "m", 0.033),
        ("1 in", "m", 0.0254),
        ("2 ft", "m", 0.6096),
        ("7 um", "m", 7e-6),
        ("7 \u00b5m", "m", 7e-6),
        ("24 000 /h", "1/s", 24000 / 3600),
        ("24\u2009000 / h", "Hz", 24000 / 3600),
        ("1 000 000", "N", 1e6),
        ("30 m/min", "m/s", 0.5),
        ("5 kN/m", "N/m", 5000.0),
        ("3 N/mm", "N/m", 3000.0),
        ("250 ms", "s", 0.25),
        ("1.5 h + 6 min", "s", 5760.0),
        ("350 g", "kg", 0.35),
        ("15 N m", "N m", 15.0),
        ("2 kN\u00b7m", "N m", 2000.0),
        ("200 kg cm^2", "kg m^2", 0.02),
        ("9.81 m/s\u00b2", "m/s^2", 9.81),
        ("15 %", "1", 0.15),
        ("6 bar", "Pa", 6e5),
        ("90 deg/s", "rad/s", math.radians(90)),
        ("-90 deg", "rad", -math.radians(90)),
        ("3 * 30\u00b0", "rad", math.radians(90)),
        ("126.86989764584402 deg", "rad", math.radians(126.86989764584402)),
        ("0.5 rad + 90 deg", "rad", 0.5 + math.radians(90)),
        ("0.1 m * 3", "m", 0.3),
        ("(1 + 2) * 4 mm", "m", 0.012),
        ("2 m / 4 s", "m/s", 0.5),
        ("1 - 2 - 3", "1", -4),
        ("-2 * -(3 - 1)", "1", 4),
        ("0.1 + 5 mm", "m", 0.105),
        ("1e-3 km", "m", 1.0),
        (".5 m", "m", 0.5),
        ("5 N/m^1.5", "N/m^1.5", 5.0),
        ("0.3 s/m", "kg/s or s/m", 0.3),
    ],
)
def test_texts_have_the_bits_of_their_values(text: str, unit: str, value: float) -> None:
    assert to_si(text, unit) == value


@pytest.mark.parametrize(
    ("text", "unit", "facts"),
    [
        ("33 mm", "m/s", ["a length", "a speed", "0.2 m/s"]),
        ("3 kg m", "m", ["m kg", "a length"]),
        ("90 deg", "1", ["an angle"]),
        ("1 + 2 s", "m", ["without unit", "a time"]),
        ("1 m + 2 s", "m", ["a length", "a time"]),
        ("1/0", "1", ["division by zero"]),
        ("1 m / (2 mm - 0.002 m)", "1", ["division by zero"]),
        ("fast", "m/s", ["fast", "0.2 m/s"]),
        ("33 mn", "m", ["mn", "unit", "mm"]),
        ("gap", "m", ["gap", "gaps"]),
        ("nan", "m", ["nan"]),
        ("inf", "m", ["inf"]),
        ("1e999 m", "m", ["out of range"]),
        ("1e-999 m", "m", ["out of range"]),
        ("1e9999 m", "m", ["e9999"]),
        ("0.5", "m", ["quotes"]),
        ("-90 + 1", "rad", ["-89 deg"]),
        ("mm", "m", ["without a number"]),
        ("(mm)", "m", ["without a number"]),
        ("", "m", ["empty"]),
        ("  ", "m", ["empty"]),
        ("1 +", "m", ["unfinished"]),
        ("* 2", "m", ["nothing before *"]),
        ("(1", "m", ["("]),
        ("1)", "m", [")"]),
        ("()", "m", [")"]),
        ("1 2", "m", ["operator"]),
        ("24 0000", "m", ["operator"]),
        ("2(3)", "m", ["operator"]),
        ("2^3", "m", ["^3"]),
        ("gaps^2", "m", ["gaps", "power"]),
        ("2 m^9", "m", ["9"]),
        ("1,5 m", "m", [",5 m"]),
        ("__import__", "m", ["__import__"]),
    ],
)
def test_refusals_name_the_reason_and_the_expectation(text: str, unit: str, facts: list[str]) -> None:
    with pytest.raises(ValueError, match="expected") as error:
        to_si(Scoped(text, {"gaps": Quantity.of(0.5)}), unit)
    assert missing(str(error.value), facts) == []


def test_parameters_keep_their_dimension_and_bare_ones_take_that_of_the_field() -> None:
    scope = {"gap": evaluate("75 mm"), "bare": Quantity.of(0.075), "rate": evaluate("24 000 /h")}
    assert to_si(Scoped("-gap/2", scope), "m") == -0.0375
    assert to_si(Scoped("-bare/2", scope), "m") == -0.0375
    assert to_si(Scoped("gap * rate", scope), "m/s") == 0.5
    with pytest.raises(ValueError, match="a length"):
        to_si(Scoped("gap", scope), "s")


def test_long_chains_of_parameters_stay_small() -> None:
    scope = {"p": evaluate("1.0123456789 mm"), "a": evaluate("1.1 deg")}
    for _ in range(200):
        scope["p"] = evaluate(Scoped("p * p / (p + 1e-3 m) * 2", scope))
    assert scope["p"].factor.denominator.bit_length() < 4000
    with pytest.raises(ValueError, match=r"out of range"):
        for _ in range(2000):
            scope["a"] = evaluate(Scoped("a * a", scope))


@pytest.mark.parametrize(
    "text", ["(" * LONGEST, "-" * (LONGEST - 1) + "1", "1" * LONGEST, "1e999*" * 33 + "1", "1" + " 000" * 48]
)
def test_longest_texts_end(text: str) -> None:
    try:
        assert math.isfinite(to_si(text, "m"))
    except ValueError as error:
        assert "expected" in str(error)
    with pytest.raises(ValueError, match=str(LONGEST + 1)):
        to_si(text.ljust(LONGEST + 1), "m")


def test_random_texts_give_a_finite_number_or_one_sentence() -> None:
    rng = random.Random(1)
    pieces = [*UNITS, *string.ascii_lowercase, *"0123456789 .+-*/()^", "1e9", "gap", " 000", "\u2009", "\u0661", "\x00"]
    scope = {"gap": evaluate("75 mm")}
    for _ in range(3000):
        text = Scoped("".join(rng.choices(pieces, k=rng.randint(1, 12))), scope)
        try:
            assert math.isfinite(to_si(text, rng.choice(["m", "1", "rad", "m/s"]))), text
        except ValueError as error:
            assert "expected" in str(error), text


def test_all_fields_of_scenes_have_known_units() -> None:
    for _, model in sections():
        for field in model.model_fields.values():
            for unit in unit_of(field).split(", "):
                dimensions(unit)


def test_a_scene_takes_quantities_in_points_rows_and_presets() -> None:
    scene = parse_scene(SCENE)
    assert (scene.duration, scene.tick) == (60.0, 0.01)
    assert (scene.bottle_types["jar"].radius, scene.bottle_types["jar"].mass) == (0.033, 0.35)
    belt = scene.belts["a"]
    assert belt.kind == "straight"
    assert (belt.start, belt.angle, belt.width) == ((0.0, -0.033), -math.pi / 2, 0.075)
    assert (belt.speed, belt.speed_limits) == (0.5, (0.0, 1.0))
    assert scene.contacts[0].table == ((0.0001, 2.0), (0.0002, 5.0))
    assert scene.base[0].friction == 0.15


def test_numbers_in_si_units_pass_unchanged() -> None:
    data = {"length": 1, "at": [0.5, 1], "points": [[0, 1.0], [2, 3]], "turn": -6.2, "by_name": {"a": 1.0}}
    assert {**data, "by_name": 0} == {**in_si_units(Fields, data), "by_name": 0}
    for name in ("at", "points"):
        assert in_si_units(Fields, data)[name] is data[name]


def test_texts_in_every_kind_of_field() -> None:
    data = {
        "length": Scoped("2 * w", {"w": evaluate("5 cm")}),
        "at": ["1 mm", 2],
        "points": [[0, 1], ["2 mm", 3]],
        "count": "2 * 3",
        "limit": "none",
        "turn": "720 deg",
        "level": "30 m/min",
        "by_name": {"a": "4 mm"},
    }
    part = part_from(Fields, data)
    assert isinstance(part, Fields)
    assert (part.length, part.at, part.points, part.count) == (0.1, (0.001, 2.0), ((0.0, 1.0), (0.002, 3.0)), 6)
    assert (part.limit, part.turn, part.level, part.by_name) == ("none", 4 * math.pi, 0.5, {"a": 0.004})


@pytest.mark.parametrize(
    ("data", "facts"),
    [
        ({"length": "3 s"}, ["length", '"3 s"', "number greater than 0", "(m)", "33 mm", "a time"]),
        ({"length": "-3 mm"}, ["length", '"-3 mm"', "greater than 0", "(m)"]),
        ({"length": True}, ["length", "true", "number"]),
        ({"at": [1, "2 s"]}, ["at", '[1, "2 s"]', "a point", "a time"]),
        ({"points": [[0, 0], [1, "x"]]}, ["points[1]", '[1, "x"]', "x"]),
        ({"count": "3 / 2"}, ["count", '"3 / 2"', "whole number"]),
        ({"limit": "off"}, ["limit", '"off"', '"none"', "2 kN"]),
        ({"turn": -90}, ["turn", "-90", "did you mean -90 deg?"]),
        ({"turn": 6.3}, ["turn", "6.3 deg"]),
        ({"by_name": {"a": "4 s"}}, ["by_name.a", '"4 s"', "a time"]),
    ],
)
def test_errors_show_the_text_as_given(data: dict[str, object], facts: list[str]) -> None:
    said = part_from(Fields, data)
    assert isinstance(said, str)
    assert missing(said, facts) == []


def test_a_bare_angle_beyond_a_full_turn_is_refused_with_its_line() -> None:
    with pytest.raises(SceneError) as error:
        parse_scene(SCENE.replace("-90 deg", "-90"), "plant.yaml")
    assert missing(str(error.value), ["plant.yaml:6", "belts.a.angle", "-90", "-90 deg?"]) == []


def test_an_earlier_text_may_have_bare_angles_beyond_a_full_turn() -> None:
    belt = parse_again(SCENE.replace("-90 deg", "7"), "recorded", {}).belts["a"]
    assert belt.kind == "straight"
    assert belt.angle == 7.0
    with pytest.raises(SceneError):
        parse_scene(SCENE.replace("-90 deg", "7"))
