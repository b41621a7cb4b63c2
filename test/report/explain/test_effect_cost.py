# SPDX-License-Identifier: Apache-2.0
"""Prices of effects: what is compared with what. Costs themselves are the machine's, and not tested."""

from math import comb

import pytest
from scenes import bottle, contact, scene

from conveyor_sim.report.explain.effect_cost import ALL, Pricing, _rank

FIELDS = {
    "tick": 0.001,
    "accuracy": {"per_tick": 20},
    "contacts": [contact(5e3, damping=("normal", 0.5))],
    "bottles": [bottle(0.0, 0.0, 0.5), bottle(0.14, 0.0)],
    "floor": "none",
}


def test_every_effect_that_can_be_off_is_priced() -> None:
    seen: list[tuple[float, float]] = []
    pricing = Pricing(scene(**FIELDS), at=0.02)
    pricing.warm_up(lambda done, whole: seen.append((done, whole)))
    assert seen[-1] == (pytest.approx(0.02), pytest.approx(0.02))
    pricing.prepare(lambda done, whole: seen.append((done, whole)))
    assert seen[-1] == (3, 3)
    prices = pricing.measure(lambda done, whole: seen.append((done, whole)), rounds=2)
    assert seen[-1] == (6, 6)
    assert {price.effect for price in prices.prices} == {"bottle_contact", "normal_damping"}
    assert [price.cost for price in prices.prices] == sorted((price.cost for price in prices.prices), reverse=True)
    assert prices.together is not None
    assert prices.together.effect == ALL
    assert prices.fixed == ("linear",)
    assert prices.failed == {}
    assert (prices.time, prices.bottles) == (pytest.approx(0.02), 2)
    without_contact = next(price for price in prices.prices if price.effect == "bottle_contact")
    assert set(without_contact.takes_along) == {"linear", "normal_damping"}
    for price in (*prices.prices, prices.together):
        assert min(price.on, price.off) > 0.0
        assert price.low <= price.cost <= price.high


def test_moving_rails_are_priced_with_their_devices() -> None:
    """A gate beside a bottle: without the effect the gate still has its position, and its device a state."""
    gate = {"from": [0.21, -0.1], "to": [0.21, 0.1], "material": "glass", "direction": "90 deg", "stroke": 0.2}
    moved = {"kind": "slide", **gate, "max_speed": 0.8, "acceleration": 8.0}
    pricing = Pricing(scene(**{**FIELDS, "gates": {"g": moved}}), at=0.02)
    pricing.warm_up(lambda done, whole: None)
    pricing.prepare(lambda done, whole: None)
    prices = pricing.measure(lambda done, whole: None, rounds=1)
    assert {price.effect for price in prices.prices} == {"bottle_contact", "normal_damping", "moving_rails"}
    assert prices.fixed == ("linear",)
    assert prices.failed == {}


def test_variants_take_the_steps_of_the_scene() -> None:
    """Damping that bounds the time step does not buy longer steps where it is off."""
    pricing = Pricing(
        scene(**{**FIELDS, "accuracy": {}, "contacts": [contact(5e3, damping=("normal", 500.0))]}), at=0.001
    )
    pricing.warm_up(lambda done, whole: None)
    pricing.prepare(lambda done, whole: None)
    steps = {variant.simulation.model.steps_per_tick for variant in pricing._variants}
    assert steps == {pricing._warm.model.steps_per_tick}
    assert pricing._warm.model.steps_per_tick > 2


def test_what_takes_fewer_steps_is_measured() -> None:
    """A thousand steps a tick are given where two would do."""
    pricing = Pricing(scene(**{**FIELDS, "accuracy": {"per_tick": 1000}}), at=0.02)
    pricing.warm_up(lambda done, whole: None)
    seen: list[tuple[float, float]] = []
    (gain,) = pricing.gains(lambda done, whole: seen.append((done, whole)), rounds=7)
    assert seen[-1] == (7, 7)
    assert (gain.words, gain.steps) == ("without accuracy.per_tick", 2)
    assert 0.0 < gain.low <= gain.faster <= gain.high
    assert gain.sentence.startswith("without accuracy.per_tick: 2 steps a tick, measured ")


@pytest.mark.parametrize("count", range(1, 40))
def test_interval_of_the_median_covers_95_percent(count: int) -> None:
    """By the binomial distribution of how many values lie below the median; no narrower than that, no wider."""
    rank = _rank(count)
    assert count - 2 * rank >= 1

    def outside(rank: int) -> float:
        return 2.0 * sum(comb(count, k) for k in range(rank + 1)) * 0.5**count

    if rank > 0:
        assert outside(rank) <= 0.05
    if rank + 1 < count // 2:
        assert outside(rank + 1) > 0.05
