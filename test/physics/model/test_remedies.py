# SPDX-License-Identifier: Apache-2.0
"""Limits on the steps of a scene, and remedies. Each remedy is applied, and must help as stated."""

import math
from typing import Any

import pytest
from facts import missing
from pressing import hopper
from scenes import MASS, base, belt, bottle, contact, kind, scene

from conveyor_sim.errors import SceneError
from conveyor_sim.physics.model import build_model
from conveyor_sim.physics.model.remedies import IMPLICIT_COST, MANY, StepLimit, step_limit, with_remedy
from conveyor_sim.physics.model.tick_cost import line_size, tick_seconds
from conveyor_sim.scene import Scene, load_scene
from conveyor_sim.scene.accuracy import MANY_STEPS, MOST_STEPS
from conveyor_sim.support.resources import scene_path

DASHPOTS = [contact(1e8) | {"damping": {"law": "normal", "restitution": 0.5}}]
TWO: dict[str, Any] = {"bottles": [bottle(0.0, 0.0, 1.0), bottle(1.0, 0.0)], "floor": "none"}
BIG = hopper(1000)
STIFF_DASHPOT = scene(contacts=[contact(5e3, damping=("paper", 2e4))], accuracy={"integrator": "rk4"}, **TWO)


def light_among_heavy(ratio: float, **fields: Any) -> Scene:
    """Eleven bottles in a file, and one of that part of their mass."""
    row = [bottle(0.1 + 0.14 * n, 0.07, type="light" if n == 5 else "bottle") for n in range(12)]
    types = {"bottle": kind(), "light": kind(mass=MASS * ratio)}
    belts = {"table": belt(0.2, (0.0, 0.0), 2.0, 0.15)}
    rough = [contact(5e3, friction=0.3)]
    return scene(bottle_types=types, bottles=row, belts=belts, base=base(0.5), contacts=rough, **fields)


def checked(limit: StepLimit, what: Scene) -> None:
    """Every remedy, applied, gives the number of steps that it names, and that is fewer."""
    assert limit.remedies
    for remedy in limit.remedies:
        assert build_model(with_remedy(what, remedy.overrides)).steps_per_tick == remedy.steps < limit.steps


@pytest.mark.parametrize(
    ("what", "words"),
    [
        (BIG, "friction_solver: implicit"),
        (light_among_heavy(1e-4), "friction_solver: implicit"),
        (light_among_heavy(1e-6), "friction_solver: implicit"),
        (scene(contacts=DASHPOTS, **TWO), "accuracy: {preset: draft}, less exact"),
        (scene(contacts=DASHPOTS, accuracy="fine", **TWO), "damping: {law: onset, speed: 1} where a restitution"),
        (STIFF_DASHPOT, "accuracy: {integrator: velocity_verlet}"),
        (scene(contacts=DASHPOTS, accuracy={"dt": 1e-8}, **TWO), "without accuracy.dt"),
        (scene(contacts=DASHPOTS, accuracy={"per_tick": 500_000}, **TWO), "without accuracy.per_tick"),
    ],
    ids=["hopper", "1e4", "1e6", "draft", "onset", "integrator", "dt", "per_tick"],
)
def test_a_remedy_helps_as_it_says(what: Scene, words: str) -> None:
    limit = step_limit(what)
    checked(limit, what)
    assert any(remedy.words.startswith(words) for remedy in limit.remedies), limit.lines


@pytest.mark.parametrize("name", ["turntable", "glass_line", "scenarios/pressure_combiner", "accumulation_table"])
def test_remedies_of_shipped_scenes_help(name: str) -> None:
    what = load_scene(scene_path(name))
    checked(step_limit(what), what)


def test_the_hopper_of_1000_bottles_is_told_in_two_lines() -> None:
    limit = step_limit(BIG)
    model = build_model(BIG)
    tightest, second = sorted(model.bounds, key=lambda bound: bound.dt)[:2]
    assert (tightest.name, limit.steps) == ("contact friction", model.steps_per_tick)
    assert limit.ratio == pytest.approx(second.dt / tightest.dt)
    first, remedies = limit.lines
    facts = ["contact friction", f"{limit.steps} steps a tick", f"{limit.ratio:.2g} times the next bound", second.name]
    assert missing(first, [*facts, str(math.ceil(0.01 / second.dt))]) == []
    implicit = build_model(with_remedy(BIG, {"friction_solver": "implicit"})).steps_per_tick
    line = line_size(BIG)
    faster = tick_seconds(limit.steps, 1000, line) / tick_seconds(implicit * IMPLICIT_COST, 1000, line)
    facts = ["fewer steps", "friction_solver: implicit", f"{implicit} steps a tick", f"{faster:.2g} times as fast"]
    assert missing(remedies, facts) == []


def test_semi_implicit_euler_on_a_turning_belt_has_leapfrog_for_a_remedy() -> None:
    """It creeps where a belt turns, by one part in the steps of v_lim / (mu g); leapfrog does not."""
    turning = {"kind": "curved", "centre": [0.0, 0.0], "inner_radius": 0.3, "width": 0.4, "start_angle": 0.0,
               "span": "360 deg", "material": "chain", "speed": 0.5}  # fmt: skip
    what = scene(
        belts={"table": turning}, base=base(0.4), contacts=[contact(5e3, damping=("normal", 10.0))],
        bottles=[bottle(0.5, 0.0, 0.0, 0.5), bottle(-0.5, 0.0, 0.0, -0.5)],
        accuracy={"integrator": "semi_implicit_euler"},
    )  # fmt: skip
    limit = step_limit(what)
    checked(limit, what)
    assert "accuracy: {integrator: leapfrog}" in [remedy.words for remedy in limit.remedies]
    straight = scene(
        belts={"table": belt(0.5)}, base=base(0.4), contacts=[contact(5e3, damping=("normal", 10.0))],
        bottles=[bottle(0.5, 0.0), bottle(-0.5, 0.0)],
        accuracy={"integrator": "semi_implicit_euler"},
    )  # fmt: skip
    assert all("leapfrog" not in remedy.words for remedy in step_limit(straight).remedies)


def test_what_is_not_worth_it_is_not_named() -> None:
    """One bound, of impacts without a dashpot: draft would take 9 steps for 20, but a tolerance is given."""
    limit = step_limit(scene(contacts=[contact(1e8)], accuracy={"tolerance": 0.01}, **TWO))
    assert limit.remedies == ()
    assert len(limit.lines) == 1


def test_fewer_steps_that_save_no_time_are_not_named() -> None:
    """Two bottles: half of two steps a tick, but the tick itself costs more than both."""
    what = load_scene(scene_path("two_bottles"))
    assert build_model(with_remedy(what, {"accuracy": {"preset": "draft"}})).steps_per_tick < step_limit(what).steps
    assert step_limit(what).remedies == ()


def test_a_speed_is_that_of_the_bottles_on_the_line() -> None:
    """Steps of implicit friction cost more, and a tick has a cost of its own: it counts more with few bottles."""
    what = load_scene(scene_path("turntable"))
    few, many = (step_limit(what, bottles=count).remedies[0] for count in (16, 1000))
    assert few.steps == many.steps
    assert 1.0 < few.faster < many.faster < step_limit(what).steps / many.steps


def test_bottles_at_the_start_count_beside_an_endless_infeed() -> None:
    """12 x 20 at the start, or 2 x 3, which are fewer than the assumed number."""
    feed = {"bottle": "bottle", "position": [-1.0, 0.0], "direction": 0.0, "speed": 0.3, "rate": 1.0}

    def limit(rows: int, columns: int) -> StepLimit:
        grid = {"type": "bottle", "origin": [0.0, 0.0], "rows": rows, "columns": columns, "pitch": 0.14}
        return step_limit(scene(contacts=[contact(1e3)], bottles=[{"grid": grid}], infeeds={"feed": feed}))

    assert limit(12, 20).bottles == 240
    assert limit(2, 3).bottles == MANY
    assert limit(12, 20).seconds > 2.0 * limit(2, 3).seconds


def test_a_mass_ratio_of_a_million_is_refused_with_what_helps() -> None:
    what = light_among_heavy(1e-6)
    limit = step_limit(what)
    assert limit.steps > 3_500_000
    best = limit.remedies[0]
    with pytest.raises(SceneError) as refused:
        build_model(what)
    (sentence,) = str(refused.value).splitlines()
    assert sentence.startswith(
        f"<text>:1: accuracy: {limit.steps} steps a tick: standard (1 % in contact force), ruled"
    )
    assert sentence.endswith(
        f"; expected at most {MOST_STEPS} steps a tick, as with friction_solver: implicit: {best.steps} steps a tick, "
        f"about {best.faster:.0f} times as fast"
    )


def test_many_steps_are_told_to_be_slow() -> None:
    """100 + 10 bottles, 30 ns each."""
    row = {"grid": {"type": "bottle", "origin": [0.0, 0.0], "rows": 10, "columns": 10, "pitch": 0.14}}
    few, many = (
        step_limit(scene(contacts=[contact(1e3)], bottles=[row], accuracy={"per_tick": steps})).lines[-1]
        for steps in (MANY_STEPS - 1, MANY_STEPS)
    )
    assert "slow" not in few
    assert missing(many, ["slow", "simulated second", "100 bottles", "5.1 s", "one core"]) == []


def test_a_scene_that_nothing_bounds_has_nothing_to_tell() -> None:
    assert step_limit(scene(bottles=[bottle(0.0, 0.0)], floor="none")).lines == []
