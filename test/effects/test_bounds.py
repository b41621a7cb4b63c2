"""The bounds on the time step that effects bring, by the numbers that make them."""

import math
from typing import Any

import pytest
from scenes import MASS, RADIUS, base, belt, bottle, contact, kind, scene, segment

from conveyor_sim.effects.terms import impact_speed
from conveyor_sim.model import build_model
from conveyor_sim.restitution import onset_damping, tsuji_damping
from conveyor_sim.timestep import (
    base_friction_bound,
    contact_bound,
    contact_friction_bound,
    damping_bound,
    hertz_contact_time,
    lattice_bound,
)

REDUCED = MASS / 2
INERTIA = MASS * RADIUS**2
RAIL = {"edge": segment((0.0, 6.0), (1.0, 6.0))}


def bounds(*contacts: dict[str, Any], **fields: Any) -> dict[str, float]:
    """Bounds (s) by name of two bottles, the first at 2 m/s."""
    two = [bottle(0.0, 0.0, 2.0), bottle(1.0, 0.0)]
    model = build_model(scene(**{"contacts": list(contacts), "bottles": two, "floor": "none", **fields}))
    return {bound.name: bound.dt for bound in model.bounds}


def test_hertz() -> None:
    """At the fastest bottle's speed; the rail, with twice the reduced mass, is longer in touch."""
    k = 1e9
    found = bounds(contact(None, hertz_stiffness=k), contact(None, "steel", hertz_stiffness=k), rails=RAIL)
    deepest = (2.5 * 0.5 * REDUCED * 2.0**2 / k) ** 0.4
    assert found == {
        "Hertz contact time": pytest.approx(hertz_contact_time(k, REDUCED, 2.0) / 20),
        "Hertz lattice stability": pytest.approx(lattice_bound(1.5 * k * math.sqrt(deepest), MASS)),
    }


def test_hertz_in_a_queue() -> None:
    """A soft packing on a fast belt is pressed deeper by the queue than by a slow impact."""
    k, slow = 1e4, [bottle(0.2 * n, 0.0, 1e-3) for n in range(50)]
    found = bounds(contact(None, hertz_stiffness=k), bottles=slow, floor={"friction": 0.5})
    overlap = (50 * 0.5 * MASS * 9.81 / k) ** (2 / 3)
    assert found["Hertz lattice stability"] == pytest.approx(lattice_bound(1.5 * k * math.sqrt(overlap), MASS))


def test_table_is_bounded_by_its_steepest_slope() -> None:
    found = bounds(contact(None, table=[[0.001, 5.0], [0.002, 25.0], [0.003, 30.0]]))
    assert found == {
        "table contact time": pytest.approx(contact_bound(2e4, REDUCED)),
        "table lattice stability": pytest.approx(lattice_bound(2e4, MASS)),
    }


def test_dashpots() -> None:
    assert bounds(contact(5e3, damping=("paper", 3.0)))["paper damping"] == pytest.approx(damping_bound(3.0, REDUCED))
    assert bounds(contact(5e3, damping=("normal", 3.0)))["normal damping"] == pytest.approx(damping_bound(3.0, REDUCED))
    both = bounds(contact(5e3, damping=("paper", 3.0)), contact(5e3, "steel", damping=("normal", 8.0)), rails=RAIL)
    assert both["paper damping"] == pytest.approx(damping_bound(3.0, REDUCED))
    assert both["normal damping"] == pytest.approx(damping_bound(8.0, MASS))


def test_tsuji_dashpot_at_the_deepest_of_an_impact() -> None:
    k, e = 1e9, 0.5
    found = bounds(contact(None, hertz_stiffness=k) | {"damping": {"law": "normal", "restitution": e}})
    deepest = (1.25 * REDUCED * 2.0**2 / k) ** 0.4
    c = tsuji_damping(e, k, REDUCED) * deepest**0.25
    assert found["Tsuji damping"] == pytest.approx(damping_bound(c, REDUCED))


ONSET = {"damping": {"law": "onset", "restitution": 0.5, "speed": 2.0}}
SPEED_AT_A_MILLIMETRE = math.sqrt(2 * 0.5 * 5.0 * 1e-3 / REDUCED)
"""m/s of an impact whose energy the first piece of the table, 5 N at 1 mm, just takes."""


@pytest.mark.parametrize(
    ("elastic", "speed", "force"),
    [
        ({"stiffness": 5e3}, 2.0, 2.0 * math.sqrt(5e3 * REDUCED)),
        ({"hertz_stiffness": 1e9}, 2.0, 1e9 * (1.25 * REDUCED * 4.0 / 1e9) ** 0.6),
        ({"table": [[1e-3, 5.0], [2e-3, 5.0]]}, 0.5 * SPEED_AT_A_MILLIMETRE, 2.5),
        ({"table": [[1e-3, 5.0], [2e-3, 5.0]]}, 2.0 * SPEED_AT_A_MILLIMETRE, 5.0),
        ({"table": [[1e-3, 5.0], [2e-3, 10.0]]}, 3.0 * SPEED_AT_A_MILLIMETRE, 15.0),
    ],
    ids=["linear", "hertz", "first piece", "level piece", "beyond the last point"],
)
def test_onset_dashpot_at_the_largest_force_of_an_impact(elastic: dict[str, Any], speed: float, force: float) -> None:
    two = [bottle(0.0, 0.0, speed), bottle(1.0, 0.0)]
    found = bounds({"between": ["glass", "glass"], **elastic, **ONSET}, bottles=two)
    c = onset_damping(0.5, 2.0) * force
    assert found["onset damping"] == pytest.approx(damping_bound(c, REDUCED))


def test_tangential_spring() -> None:
    """1/m_t is 4/m of two hoops, 2/m of a hoop and a rail: the pair rules. No bound of the friction curve."""
    spring = {"tangential": {"stiffness": 4e3, "damping": 2.0}}
    found = bounds(
        contact(5e3, friction=0.3, **spring),
        contact(5e3, "steel", friction=0.3, **spring),
        rails=RAIL,
        floor={"friction": 0.4},
    )
    assert found["tangential spring"] == pytest.approx(contact_bound(4e3, MASS / 4))
    assert found["tangential damping"] == pytest.approx(damping_bound(2.0, MASS / 4))
    assert "contact friction" not in found
    without = bounds(
        contact(5e3, friction=0.3, **spring), floor={"friction": 0.4}, effects={"tangential_spring": "off"}
    )
    assert "tangential spring" not in without
    assert without["contact friction"] == pytest.approx(
        contact_friction_bound(0.3, 2 * 0.4 * MASS * 9.81, MASS, INERTIA, RADIUS, 0.01)
    )


def test_ring_base() -> None:
    """As the point's for the sliding; for the spin, times J / (m R_b^2)."""
    types = {"bottle": kind(base_radius=0.05, inertia=INERTIA / 4)}
    fields: dict[str, Any] = {"bottle_types": types, "floor": {"friction": 0.4}}
    point = base_friction_bound(0.4, 9.81, 0.01)
    assert bounds(contact(5e3), **fields)["base friction"] == pytest.approx(point)
    assert bounds(contact(5e3), **fields)["spin on the base"] == pytest.approx(point * (RADIUS / 0.05) ** 2 / 4)


def test_implicit_friction_lifts_the_bounds_of_friction() -> None:
    """Those of points; a ring's friction is explicit all the same."""
    fields: dict[str, Any] = {"floor": {"friction": 0.4}, "friction_solver": "implicit"}
    rough = contact(5e3, friction=0.3)
    assert set(bounds(rough, **fields)) == {"contact time", "lattice stability"}
    assert "contact friction" in bounds(rough, **fields, effects={"implicit_friction": "off"})
    ring = bounds(rough, **fields, bottle_types={"bottle": kind(base_radius=0.05)})
    assert {"base friction", "spin on the base"} < set(ring)


def test_atan_has_the_bounds_of_the_polynomial() -> None:
    """Of the same slope at rest."""
    fields: dict[str, Any] = {"floor": {"friction": 0.4}}
    rough = contact(5e3, friction=0.3)
    assert bounds(rough, **fields, friction_curve="atan") == bounds(rough, **fields)


ENTERING = {"bottle": "bottle", "position": [3.0, 0.0], "direction": 0.0, "gap": 0.0, "count": 1}


def test_impact_speed_is_the_fastest_at_the_start() -> None:
    fields: dict[str, Any] = {"bottles": [bottle(0.0, 0.0, 0.3, 0.4)], "base": base(0.1), "contacts": [contact(1e3)]}
    assert impact_speed(scene(**fields)) == 0.5
    assert impact_speed(scene(**fields, belts={"back": belt(-0.7)})) == 0.7
    assert impact_speed(scene(**fields, infeeds={"in": {**ENTERING, "speed": 0.9}})) == 0.9
    assert impact_speed(scene(bottles=[bottle(0.0, 0.0)])) == 1.0
