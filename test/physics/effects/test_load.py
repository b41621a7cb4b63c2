# SPDX-License-Identifier: Apache-2.0
"""The load that belts can put on a contact: its formula, and that bottles in piles do not feel more."""

import math
from typing import Any

import pytest
from facts import missing
from pressing import DRAG, felt, hopper, lane
from scenes import MASS, RADIUS, base, belt, bottle, contact, kind, scene

from conveyor_sim.physics.effects.load import FILE, PILE, WEDGED, Load
from conveyor_sim.physics.model import build_model
from conveyor_sim.physics.model.step_choice import choose_steps
from conveyor_sim.physics.plant import Plant
from conveyor_sim.scene import load_scene
from conveyor_sim.simulation import Simulation
from conveyor_sim.support.resources import scene_path

W = 0.4 * MASS * 9.81
"""N, of the belt on a bottle."""
ENDLESS = {"in": {"bottle": "bottle", "position": [0.5, 0.5], "direction": 0.0, "speed": 0.1, "gap": 0.0}}


def load_of(**fields: Any) -> Load:
    defaults = {"contacts": [contact(5e3, friction=0.1)], "base": base(0.4)}
    return choose_steps(Plant.of(scene(**{**defaults, **fields}))).terms.load


def table(length: float, width: float, **more: Any) -> dict[str, Any]:
    return belt(0.2, (0.0, 0.0), length, width, **more)


def test_a_file_and_a_pile_press_with_what_is_behind_each_other() -> None:
    in_file = load_of(belts={"a": table(2.6, 0.15)}, infeeds=ENDLESS)
    assert in_file.force == pytest.approx((1.0 + FILE * 2.6 / (2.0 * RADIUS)) * W)
    assert missing(in_file.reason, "bottles", "2.6 m", "belts") == []
    in_pile = load_of(belts={"a": table(2.6, 2.0)}, infeeds=ENDLESS)
    assert in_pile.force == pytest.approx((1.0 + PILE * 2.6 / (2.0 * RADIUS)) * W)
    both = load_of(belts={"a": table(2.6, 0.15), "b": table(1.3, 2.0)}, infeeds=ENDLESS)
    assert both.force == pytest.approx((1.0 + (FILE * 2.6 + PILE * 1.3) / (2.0 * RADIUS)) * W)


def test_a_curved_belt_runs_along_its_middle() -> None:
    bend = {
        "kind": "curved", "centre": [0.0, 0.0], "inner_radius": 0.5, "width": 0.15, "start_angle": 0.0,
        "span": math.pi / 2.0, "speed": 0.2, "material": "chain",
    }  # fmt: skip
    load = load_of(belts={"bend": bend}, infeeds=ENDLESS)
    assert load.force == pytest.approx((1.0 + FILE * 0.575 * math.pi / 2.0 / (2.0 * RADIUS)) * W)


def test_no_more_than_all_bottles_press() -> None:
    three = [bottle(0.2 + 0.2 * n, 0.07) for n in range(3)]
    assert load_of(belts={"a": table(9.0, 0.15)}, bottles=three).force == pytest.approx(FILE * 3 * W)
    wedged = load_of(belts={"a": table(9.0, 0.3)}, bottles=three)
    assert (wedged.force, wedged.reason) == (pytest.approx(WEDGED * 3 * W), "all 3 bottles")
    on_floor = load_of(bottles=three, floor={"friction": 0.4})
    assert (on_floor.force, on_floor.reason) == (pytest.approx(3 * W), "a single-file queue of 3")


def test_a_type_that_no_bottle_has_neither_presses_nor_is_pressed() -> None:
    """Each type weighs by its own number, and friction."""
    types = {"bottle": kind(), "heavy": kind(mass=10.0 * MASS), "never": kind(mass=1e3 * MASS)}
    one_heavy = [bottle(0.2, 0.07), bottle(0.4, 0.07), bottle(0.6, 0.07, type="heavy")]
    fields: dict[str, Any] = {"bottle_types": types, "belts": {"a": table(9.0, 0.15)}, "bottles": one_heavy}
    assert load_of(**fields).force == pytest.approx(FILE * 12 * W)
    without = {**fields, "bottle_types": {name: types[name] for name in ("bottle", "heavy")}}
    defaults = {"contacts": [contact(5e3, friction=0.1)], "base": base(0.4)}
    models = [build_model(scene(**defaults, **some)) for some in (fields, without)]
    assert models[0].bounds == models[1].bounds
    assert models[0].prediction.sentence == models[1].prediction.sentence


def test_without_friction_under_bottles_nothing_presses() -> None:
    assert load_of(bottles=[bottle(0.0, 0.0), bottle(1.0, 0.0)], floor="none").force == 0.0


GIVEN: dict[str, Any] = {"friction_solver": "implicit", "accuracy": {"per_tick": 100}}
"""Friction that needs no bound, to measure what the bound must be: forces at rest do not depend on the solver."""


@pytest.mark.parametrize(
    ("make", "arguments", "seconds"),
    [(hopper, (1000,), 10.0), (lane, (1.45, 60), 12.0), (lane, (1.2, 60), 12.0)],
    ids=["hopper of 1 000 bottles", "zigzag", "single file"],
)
def test_what_bottles_feel_stays_below_the_load(make: Any, arguments: Any, seconds: float) -> None:
    """A hopper reaches 0.7 to 0.9 of it, and a queue of all its bottles would be five times as much."""
    sim = Simulation(make(*arguments, **GIVEN))
    sim.advance(round(seconds / sim.scene.tick))
    load, reached = sim.model.load.force, felt(sim)
    assert reached < load
    assert reached > 0.4 * load
    if make is hopper:
        assert load < 0.25 * 1000 * DRAG


FELT = {
    "funnel": 96.5,
    "paper_plant": 57.9,
    "turntable": 30.0,
    "scenarios/pressureless_combiner": 43.8,
    "scenarios/pressure_combiner": 32.4,
    "accumulation_table": 36.6,
}
"""N, half of the normal forces on a bottle, the largest mean over 1 s: the outfeeds gone and the ends shut, filled up.

The combiner's end was left open, the plant ran for 70 s. It is 1.1 to 1.5 times what friction feels (`felt`).
"""


@pytest.mark.parametrize("name", FELT)
def test_shipped_scenes_were_never_pressed_harder(name: str) -> None:
    assert FELT[name] < choose_steps(Plant.of(load_scene(scene_path(name)))).terms.load.force
