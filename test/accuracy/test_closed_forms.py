# SPDX-License-Identifier: Apache-2.0
"""Errors in closed forms: every law that has one, in one scene, under every integrator."""

import math
from typing import Any

import numpy as np
import pytest
from scenes import base, belt, bottle, kind, scene, segment, stiffness_for

from conveyor_sim.accuracy.cases.closed_forms import cases_of, orders
from conveyor_sim.accuracy.cases.collision import Collision, collision_of, duration, terms_of
from conveyor_sim.accuracy.cases.head_on import HeadOn
from conveyor_sim.accuracy.results import Order
from conveyor_sim.engine.contact.laws.hertz import hertz_contact_time
from conveyor_sim.engine.contact.laws.onset import onset_damping, onset_restitution
from conveyor_sim.engine.integrators import INTEGRATORS, SWEPT
from conveyor_sim.physics.effects.terms import meetings
from conveyor_sim.scene import Scene

MASS, SPEED = 0.2, 0.7
K = stiffness_for(0.002, MASS / 2.0)
HERTZ = 3.0e6
"""N/m^1.5; a contact of 2 ms, too."""


def contact(a: str, b: str, **fields: Any) -> dict[str, Any]:
    return {"between": [a, b], **fields}


def everything() -> Scene:
    """Three bottle types whose pairs have six laws, a rail with three more, and a belt."""
    friction = {"friction": 0.2}
    return scene(
        tick=0.01,
        accuracy={"per_tick": 100},
        slip_limit=0.05,
        bottle_types={
            "glass": kind(mass=MASS, material="glass"),
            "pet": kind(mass=MASS, material="pet"),
            "can": kind(mass=MASS, material="can", base_radius=0.03),
        },
        contacts=[
            contact("glass", "glass", stiffness=K),
            contact("glass", "pet", stiffness=K, damping={"law": "paper", "restitution": 0.4}),
            contact("pet", "pet", stiffness=K, damping={"law": "normal", "restitution": 0.5}),
            contact("glass", "can", hertz_stiffness=HERTZ),
            contact("pet", "can", hertz_stiffness=HERTZ, damping={"law": "normal", "restitution": 0.4}),
            contact("can", "can", table=[[2e-4, 0.5 * K * 2e-4], [1.0, K]]),
            contact("glass", "steel", stiffness=K, damping={"law": "onset", "restitution": 0.3, "speed": SPEED}),
            contact("pet", "steel", stiffness=K, damping={"law": "paper", "restitution": 0.4}, **friction),
            contact("can", "steel", hertz_stiffness=HERTZ, damping={"law": "paper", "coefficient": 1.0}, **friction),
        ],
        base=[{"between": [kind, "chain"], "friction": 0.4} for kind in ("glass", "pet", "can")],
        belts={"belt": belt(SPEED)},
        rails={"rail": segment((-5.0, -6.0), (5.0, -6.0))},
        bottles=[
            {"grid": {"type": kind, "origin": [0.3 * i, 0.0], "rows": 2, "columns": 1, "pitch": 0.2}}
            for i, kind in enumerate(("glass", "pet", "can"))
        ],
    )


@pytest.fixture(scope="module")
def rows() -> list[Order]:
    return orders(everything(), [name for name in INTEGRATORS if name not in SWEPT], lambda done, whole: None)[0]


def test_every_law_with_a_closed_form_is_there(rows: list[Order]) -> None:
    assert {row.case for row in rows} == {
        "head on, linear spring, undamped",
        "head on, linear spring, dashpot",
        "head on, linear spring, clamped dashpot",
        "head on, linear spring, damping from zero on",
        "head on, Hertz, undamped",
        "head on, Hertz, Tsuji's dashpot",
        "head on, table, undamped",
        "sliding impact, linear spring, dashpot",
        "set down on a belt, on a point",
        "set down on a belt, on a ring",
    }
    assert {row.integrator for row in rows} == set(INTEGRATORS) - SWEPT
    assert {row.phases for row in rows} == {64}


def test_observed_orders_are_those_expected(rows: list[Order]) -> None:
    """Within 0.15, as docs/accuracy.md and the integrators state them, and what friction adds to it."""
    wrong = [row for row in rows if row.expected is not None and abs(row.observed - row.expected) > 0.15]
    assert not wrong
    # Only where the errors of a ring's smooth friction drown in rounding there is nothing to expect.
    assert {(row.case, row.integrator) for row in rows if row.expected is None} == {
        ("set down on a belt, on a ring", "dormand_prince")
    }


def test_errors_go_to_zero(rows: list[Order]) -> None:
    """The closed forms are the limit: at 640 steps a contact errors are below 2 % / 64, the coarsest order-1 law's."""
    for row in rows:
        assert row.errors[-1] < 0.1 / 64.0
        assert row.steps[-1] == 640


def test_undamped_peaks_are_off_by_pi_over_n_squared_over_8(rows: list[Order]) -> None:
    """At most; RMS over phases, a parabola of that height is missed by 1/sqrt(5) of it, 0.447, at the nearest sample.

    64 phases know that to a tenth; leapfrog's amplitude, which depends on the phase, happens to give as much.
    """
    for row in rows:
        if (row.case, row.quantity) == ("head on, linear spring, undamped", "peak force"):
            most = np.array([(math.pi / n) ** 2 / 8.0 for n in row.steps])
            np.testing.assert_allclose(np.array(row.errors) / most, 1.0 / math.sqrt(5.0), rtol=0.15)


def pair(tick: float = 0.01, **law: Any) -> Scene:
    """Two bottles that touch by a law."""
    bottles = [bottle(0.0, 0.0, SPEED), bottle(0.3, 0.0)]
    return scene(tick=tick, contacts=[contact("glass", "glass", **law)], bottles=bottles)


def linear(zeta: float, law: str = "paper") -> dict[str, Any]:
    return {"stiffness": K, "damping": {"law": law, "coefficient": 2.0 * zeta * math.sqrt(K * MASS / 2.0)}}


def collision(of: Scene) -> Collision:
    terms = terms_of(of)
    return collision_of(next(meetings(terms)), terms)


W = math.sqrt(K / (MASS / 2.0))


@pytest.mark.parametrize(
    ("law", "expected"),
    [
        ({"stiffness": K}, math.pi / W),
        (linear(0.3), math.pi / (W * math.sqrt(1.0 - 0.09))),
        (linear(0.3, "normal"), 2.0 * math.acos(0.3) / (W * math.sqrt(1.0 - 0.09))),
        ({"hertz_stiffness": HERTZ}, hertz_contact_time(HERTZ, MASS / 2.0, SPEED)),
        (linear(1.5), math.inf),
    ],
    ids=["undamped", "dashpot", "clamped", "hertz", "overdamped"],
)
def test_duration_of_a_contact(law: dict[str, Any], expected: float) -> None:
    assert duration(collision(pair(**law)), SPEED) == pytest.approx(expected, rel=1e-6)


def test_viscoelastic_damping_is_a_case_of_its_own() -> None:
    """Its rebound is known, by integration, and it is over a little later than without damping."""
    damping = {"law": "viscoelastic", "restitution": 0.8, "speed": SPEED}
    of = pair(hertz_stiffness=HERTZ, damping=damping)
    (case,), skipped = cases_of(of)
    assert not skipped
    assert isinstance(case, HeadOn)
    assert case.name == "head on, Hertz, viscoelastic"
    assert case.restitution == pytest.approx(0.8, rel=1e-9)
    undamped = hertz_contact_time(HERTZ, MASS / 2.0, SPEED)
    assert 0.9 * undamped < duration(collision(of), SPEED) < 1.2 * undamped


@pytest.mark.parametrize("e", [0.01, 0.3, 0.999])
def test_restitution_of_damping_from_zero_on(e: float) -> None:
    assert onset_restitution(onset_damping(e, 1.0)) == pytest.approx(e, rel=1e-9)


@pytest.mark.parametrize(
    ("zeta", "first", "expected"),
    [(0.3, 80, 1.0), (0.01, 300, 1.0), (0.0005, 80, None), (1e-5, 80, 2.0)],
)
def test_a_weak_dashpot_shows_its_order_in_short_steps_only(zeta: float, first: int, expected: float | None) -> None:
    (case,), skipped = cases_of(pair(**linear(zeta)))
    assert not skipped
    assert case.steps == (10, 20, 40, first, 2 * first, 4 * first, 8 * first)
    assert case.expected(2) == expected


@pytest.mark.parametrize(
    ("fields", "case", "reason"),
    [
        ({"law": linear(1.5)}, "head on, linear spring, dashpot", "damped beyond critical"),
        ({"friction_curve": "atan"}, "set down on a belt, on a point", "no closed form"),
        ({"friction_curve": "atan"}, "sliding impact, linear spring, undamped", "never full"),
        ({"tangential": {"stiffness": K}}, "sliding impact, linear spring, undamped", "tangential spring"),
    ],
)
def test_cases_without_a_closed_form_are_told_with_the_reason(fields: dict[str, Any], case: str, reason: str) -> None:
    law, tangential = fields.pop("law", {"stiffness": K}), fields.pop("tangential", None)
    of = scene(
        contacts=[
            contact("glass", "glass", **law),
            contact("glass", "steel", stiffness=K, friction=0.2, **({"tangential": tangential} if tangential else {})),
        ],
        base=base(0.4),
        belts={"belt": belt(SPEED)},
        rails={"rail": segment((-1.0, 1.0), (1.0, 1.0))},
        bottles=[bottle(0.0, 0.0), bottle(0.3, 0.0)],
        **fields,
    )
    cases, skipped = cases_of(of)
    assert reason in skipped[case]
    assert case not in {one.name for one in cases}
