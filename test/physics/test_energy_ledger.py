# SPDX-License-Identifier: Apache-2.0
"""The energy ledger: every account against a closed form, and a residual that falls as the integrator's error does."""

import math
from typing import Any

import numpy as np
import pytest
from physics.test_tangential_spring import PULL, SPRING, STIFFNESS, leaning
from scenes import (
    COMMON,
    MASS,
    RADIUS,
    arc,
    base,
    belt,
    bottle,
    contact,
    kind,
    line,
    scene,
    segment,
    simulation,
    with_bends,
)

from conveyor_sim.accuracy.trajectory import displace
from conveyor_sim.columns.ledger import Ledger
from conveyor_sim.physics.model import build_model
from conveyor_sim.physics.state import State
from conveyor_sim.simulation import Simulation

ON: dict[str, Any] = {"effects": {"energy_ledger": "on"}}
ORDERS = {
    "semi_implicit_euler": (1, 100),
    "velocity_verlet": (2, 50),
    "rk4": (4, 50),
    "dormand_prince": (5, 40),
    "linearly_implicit": (3, 50),
}
"""Order in which the ledger closes where forces are smooth, and the coarser of two steps a tick to see it at.

The implicit midpoint rule is of order 2, but linear springs give it their energy back exactly.
"""


def ledger_of(sim: Simulation) -> Ledger:
    ledger = sim.ledger()
    assert ledger is not None
    return ledger


def pressed(steps: int, integrator: str, **effects: str) -> Simulation:
    """Two bottles, one behind the other, that a belt presses against a stop from the first tick on: no force jumps.

    No contact slips.
    """
    laws: dict[str, Any] = {"damping": ("normal", 10.0), "friction": 0.2}
    given = {
        "tick": 0.01,
        "accuracy": {"per_tick": steps, "integrator": integrator},
        "contacts": [contact(5e3, **laws), contact(5e3, "steel", **laws)],
        "base": base(0.4),
        "belts": {"belt": belt(0.5)},
        "rails": {"stop": segment((0.0, -1.0), (0.0, 1.0))},
        "bottles": [bottle(-RADIUS - 2.0 * RADIUS * i, 0.0) for i in range(2)],
        "effects": {**COMMON, **effects},
    }
    return simulation(**with_bends(given))


@pytest.mark.parametrize("integrator", ORDERS)
def test_the_residual_falls_as_the_integrators_error_does(integrator: str) -> None:
    order, steps = ORDERS[integrator]
    residuals = []
    for per_tick in (steps, 2 * steps):
        sim = pressed(per_tick, integrator)
        sim.advance(3)
        ledger = ledger_of(sim)
        residuals.append(abs(ledger.residual))
        assert ledger.damping > 1e-3 * ledger.base_friction
        assert ledger.elastic > 1e-3 * ledger.base_friction
        # The belt outruns both, so pulls with mu m g all the time.
        assert ledger.belt_work == pytest.approx([2.0 * 0.4 * MASS * 9.81 * 0.5 * sim.time, 0.0, 0.0], rel=1e-9)
    assert residuals[0] < 1e-4 * ledger.turnover
    assert math.log2(residuals[0] / residuals[1]) == pytest.approx(order, abs=0.3)


@pytest.mark.parametrize("integrator", ["velocity_verlet", "linearly_implicit"])
def test_to_keep_the_ledger_changes_no_bit(integrator: str) -> None:
    kept, plain = pressed(50, integrator), pressed(50, integrator, energy_ledger="off")
    for sim in (kept, plain):
        sim.advance(20)
    assert plain.ledger() is None
    assert kept.state_hash() == plain.state_hash()


def test_a_line_closes_with_bottles_that_come_and_go() -> None:
    """On any number of threads, of which no bit knows; slots and lists grow on the way."""
    sims = [Simulation(scene(**line(**ON)), threads) for threads in (1, 2)]
    plain = simulation(**line())
    for sim in (*sims, plain):
        sim.command(["belts/end/cmd_speed"], [0.25])
        sim.advance(500)
    first, second = (ledger_of(sim) for sim in sims)
    assert [sim.state_hash() for sim in sims] == [plain.state_hash()] * 2
    for name in Ledger.__dataclass_fields__:
        np.testing.assert_array_equal(getattr(first, name), getattr(second, name))
    assert sims[0]._state.world.bottles.id.size > 16
    signals = dict(zip(plain.process_image.signal_names, plain.signals(), strict=True))
    packed, timed = signals["infeeds/packed/fed"], signals["infeeds/timed/fed"]
    assert packed > 4 and timed > 20 and plain.counts.removed > 5
    assert first.fed == pytest.approx(0.5 * (packed * MASS * 0.8**2 + timed * 0.05 * 0.3**2), rel=1e-9)
    assert first.removed > 0.0
    assert min(first.base_friction, first.contact_friction, first.damping) > 0.0
    assert abs(first.residual) < 2e-4 * first.turnover


def apart(*bottles: dict[str, Any], **fields: Any) -> Simulation:
    """The little line's laws for a few bottles, on a floor without friction where they are on no belt."""
    sim = simulation(
        **line(**ON, infeeds={}, outfeeds={}, bottles=list(bottles), floor={"friction": 0.0},
               **{"accuracy": {"per_tick": 500}, **fields})
    )  # fmt: skip
    assert ledger_of(sim).belt_work == pytest.approx(np.zeros(5))
    return sim


def test_an_undamped_impact_is_held_by_the_contact_and_given_back() -> None:
    """Two of pet head on, at speed v each: at rest with 2 (m v^2 / 2) in the contact."""
    v, m = 0.5, 0.05
    half_contact = 0.5 * math.pi * math.sqrt(0.5 * m / 2000.0)
    gap = 2.0 * v * (0.01 - half_contact)
    sim = apart(bottle(50.0, 0.0, v, type="small"), bottle(50.06 + gap, 0.0, -v, type="small"))
    sim.advance()
    middle = ledger_of(sim)
    assert middle.elastic == pytest.approx(m * v**2, rel=5e-3)
    assert middle.kinetic < 0.01 * middle.elastic
    sim.advance()
    ledger = ledger_of(sim)
    assert ledger.elastic == 0.0
    assert ledger.kinetic == pytest.approx(m * v**2, rel=1e-4)
    assert ledger.residual == pytest.approx(ledger.kinetic - m * v**2, abs=1e-15)
    assert (ledger.damping, ledger.contact_friction) == pytest.approx((0.0, 0.0), abs=1e-15)


SWINGS = {
    "leapfrog": lambda angle: 0.5 * angle / (1.0 - 0.5 * angle),
    "velocity_verlet": lambda angle: 0.25 * angle**2 / (1.0 - 0.25 * angle**2),
}
"""Greatest residual in a closed contact, over the energy at first touch, by w dt.

A linear contact conserves a shadow energy (v^2 + w^2 x^2 - w^2 dt x v) / 2 with semi-implicit Euler, which leapfrog is
here, and (v^2 + w^2 x^2 (1 - (w dt)^2 / 4)) / 2 with velocity Verlet.
"""


@pytest.mark.parametrize("law", ["none", "normal"])
@pytest.mark.parametrize("integrator", SWINGS)
def test_the_energy_of_a_closed_contact_swings_as_the_shadow_energy_tells(integrator: str, law: str) -> None:
    """At 20 steps a contact; a dashpot makes it swing less."""
    steps, v, m, stiffness = 20.0, 0.5, 0.05, 2000.0
    angle = 2.0 * math.sin(math.pi / (2.0 * steps))
    dt = round(angle / math.sqrt(stiffness / (0.5 * m)), 9)
    damping = {"law": law, "coefficient": 2.0 if law == "normal" else 0.0}
    pets = {"between": ["pet", "pet"], "stiffness": stiffness, "damping": damping, "friction": 0.3}
    sim = apart(
        bottle(50.0, 0.0, v, type="small"),
        bottle(50.06 + 1e-9, 0.0, -v, type="small"),
        accuracy={"per_tick": 1, "integrator": integrator},
        tick=dt,
        contacts=[pets, *(pair for pair in line()["contacts"] if pair["between"] != ["pet", "pet"])],
    )
    shares = []
    for _ in range(round(steps) - 1):
        sim.advance()
        ledger = ledger_of(sim)
        assert ledger.elastic > 0.0
        shares.append(abs(ledger.residual) / ledger.fed)
    assert (ledger.damping > 1e-3 * ledger.fed) == (law == "normal")
    assert max(shares) <= 1.001 * SWINGS[integrator](angle)
    if law == "none":
        assert max(shares) >= 0.9 * SWINGS[integrator](angle)


def test_damping_takes_what_a_dashpot_takes() -> None:
    """The paper's dashpot on glass: m_r v^2 / 2 (1 - e^2), e = exp(-pi zeta / sqrt(1 - zeta^2))."""
    v, m_r = 0.6, 0.5 * MASS
    sim = apart(bottle(50.0, 0.0, v), bottle(50.13 + 1e-5, 0.0))
    sim.advance(5)
    zeta = 0.5 / (2.0 * math.sqrt(5000.0 * m_r))
    lost = 0.5 * m_r * v**2 * (1.0 - math.exp(-2.0 * math.pi * zeta / math.sqrt(1.0 - zeta**2)))
    ledger = ledger_of(sim)
    assert ledger.damping == pytest.approx(lost, rel=5e-3)
    assert ledger.contact_friction == pytest.approx(0.0, abs=1e-15)
    assert ledger.fed - ledger.damping + ledger.residual == pytest.approx(ledger.kinetic, rel=1e-12)


def test_friction_takes_its_impulse_times_the_mean_slip() -> None:
    """Glass slides along steel, mu = 0.1: slip falls in proportion to the impulse, so that of both ends counts."""
    v_t, v_n = 1.0, 0.2
    # One more, at rest: a single bottle would need other kernels.
    first, other = bottle(50.0, RADIUS + 1e-5, v_t, -v_n), bottle(60.0, 0.0)
    sim = apart(
        first, other, rails={"wall": segment((49.0, 0.0), (52.0, 0.0)), "bend": arc((60.0, 2.0), 1.0, 0.0, 1.0)}
    )
    sim.advance(4)
    state, ledger = sim.bottles(), ledger_of(sim)
    impulse = MASS * (v_t - state.vx[0])
    slip = state.vx[0] + RADIUS * state.omega[0]
    assert state.vy[0] > 0.0 and slip > 0.5 * v_t
    # Arms are shorter by the overlap, 1 mm at most.
    assert ledger.contact_friction == pytest.approx(impulse * 0.5 * (v_t + slip), rel=0.02)
    assert ledger.damping == pytest.approx(0.5 * MASS * (v_n**2 - state.vy[0] ** 2), rel=0.02)


def test_a_bottle_set_down_takes_twice_what_it_gets() -> None:
    """The belt does m v^2, of which m v^2 / 2 goes into motion and as much into friction."""
    v = 0.6
    sim = apart(bottle(-0.9, 2.0), bottle(50.0, 0.0))
    sim.advance(40)
    ledger = ledger_of(sim)
    energy = 0.5 * MASS * v**2
    assert ledger.belt_work == pytest.approx([0.0, 0.0, 0.0, 2.0 * energy, 0.0], rel=1e-6)
    assert (ledger.base_friction, ledger.kinetic) == pytest.approx((energy, energy), rel=1e-6)
    assert abs(ledger.residual) < 1e-12 * energy


def test_to_push_bottles_by_hand_is_to_bring_energy() -> None:
    sim = apart(bottle(50.0, 0.0), bottle(60.0, 0.0))
    displace(sim, np.zeros(2), np.zeros(2), np.array([1.0, 0.0]))
    assert ledger_of(sim).fed == ledger_of(sim).kinetic == pytest.approx(0.5 * MASS)
    assert ledger_of(sim).residual == 0.0
    fresh = apart(bottle(50.0, 0.0), bottle(60.0, 0.0))
    fresh.restore_from(sim)
    assert ledger_of(fresh).fed == pytest.approx(0.5 * MASS)


RING = 0.05


def on_rings(*bottles: dict[str, Any]) -> Simulation:
    """A turn-table about (3, 0), and two belts side by side that meet at y = 0 and run against each other."""
    table = {
        "kind": "curved", "centre": [3.0, 0.0], "inner_radius": 0.0, "width": 1.0, "start_angle": 0.0,
        "span": 2.0 * math.pi, "material": "chain", "speed": 0.5, "speed_limits": [-9, 9],
    }  # fmt: skip
    return simulation(
        **ON,
        accuracy={"per_tick": 100},
        bottle_types={"bottle": kind(base_radius=RING)},
        base=base(0.4),
        belts={
            "table": table,
            "there": belt(0.5, (-5.0, 0.0), 6.0, 1.0),
            "back": belt(-0.5, (-5.0, -1.0), 6.0, 1.0),
        },
        bottles=list(bottles),
    )


def test_a_turntable_does_its_speed_times_the_angular_momentum_it_gives() -> None:
    """Omega L about its centre, spin included: exactly, for kicks change L by their moment and drifts do not."""
    sim = on_rings(bottle(3.4, 0.1, 0.2, -0.1, spin=3.0))
    omega, begun = 0.5 / 0.5, angular_momentum(sim)
    sim.advance(30)
    ledger = ledger_of(sim)
    gained = omega * (angular_momentum(sim) - begun)
    assert abs(gained) > 1e-3
    assert ledger.belt_work == pytest.approx([gained, 0.0, 0.0, 0.0], rel=1e-9)
    assert ledger.base_friction > 0.0
    assert abs(ledger.residual) < 1e-12 * ledger.turnover


def angular_momentum(sim: Simulation) -> float:
    """Return the angular momentum of the only bottle about (3, 0)."""
    state = sim.bottles()
    orbital = (state.x[0] - 3.0) * state.vy[0] - state.y[0] * state.vx[0]
    return float(MASS * orbital + MASS * RADIUS**2 * state.omega[0])


def test_belts_that_a_ring_straddles_do_their_own_work_each() -> None:
    """Astride of belts that run against each other a bottle stays and spins, and each does the same work."""
    sim = on_rings(bottle(-3.0, 0.0))
    sim.advance(20)
    ledger = ledger_of(sim)
    table, there, back, floor = ledger.belt_work
    # The ring is summed over 32 points: right to 0.2 %.
    assert there == pytest.approx(back, rel=5e-3)
    assert there > 0.1 * 0.4 * MASS * 9.81 * 0.5 * sim.time
    assert (table, floor) == (0.0, 0.0)
    assert ledger.base_friction + ledger.kinetic == pytest.approx(there + back, rel=1e-9)
    assert ledger.kinetic == pytest.approx(0.5 * MASS * RADIUS**2 * sim.bottles().omega[0] ** 2, rel=1e-3)


def test_a_spring_that_holds_has_stored_its_force_squared() -> None:
    """At rest under P sin phi along and P cos phi across: F^2 / (2 k) in each spring."""
    sim = leaning("rail", 0.8, **SPRING)
    sim.advance(100)
    phi = math.atan(0.8 * 0.3)
    ledger = ledger_of(sim)
    assert ledger.springs == pytest.approx((PULL * math.sin(phi)) ** 2 / (2.0 * 20e3), rel=1e-4)
    assert ledger.elastic == pytest.approx((PULL * math.cos(phi)) ** 2 / (2.0 * STIFFNESS), rel=1e-4)
    assert 0.0 < ledger.contact_friction < 10.0 * ledger.springs
    assert abs(ledger.residual) < 1e-6 * ledger.turnover


def test_without_the_effect_there_is_nothing_to_keep() -> None:
    """Without an output the ledger has no arrays."""
    absent, there = (State(build_model(scene(**line(**more)))).world for more in ({}, {"outputs": {"ledger": 10}}))
    assert absent.ledger is None and absent.pairs is not None and absent.pairs.parts is None
    assert there.ledger is not None and there.pairs is not None and there.pairs.parts is not None
