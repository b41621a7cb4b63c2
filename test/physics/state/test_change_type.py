# SPDX-License-Identifier: Apache-2.0
"""A bottle on the line gets another type: mass, forces, energy, and the same bits from checkpoints."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scenes import MASS, RADIUS, base, belt, bottle, contact, kind, segment, simulation

from conveyor_sim.simulation import Simulation

FRICTION = 0.4
TYPES = {"bottle": kind(), "full": kind(RADIUS, 3.0 * MASS), "light": kind(RADIUS, 0.5 * MASS)}


def queue(**fields: Any) -> Simulation:
    """Return three bottles that a belt presses in a row against a rail."""
    given: dict[str, Any] = {
        "accuracy": {"per_tick": 100},
        "base": base(FRICTION),
        "contacts": [contact(5e4, other, damping=("normal", 60.0), friction=0.2) for other in ("glass", "steel")],
        "belts": {"one": belt(0.2, (-1.0, -0.1), 2.0, 0.2)},
        "rails": {"end": segment((0.5, 0.1), (0.5, -0.1))},
        "bottles": [bottle(0.43 - 0.1315 * n, 0.0) for n in range(3)],
        "bottle_types": TYPES,
        "machines": {"filler": {"kind": "source", "bottle": "full", "position": [-0.9, 0.0], "direction": 0.0,
                                "speed": 0.2, "rate": 1e-3}},
        "outputs": {"ledger": 1.0, "contacts": 100.0},
    }  # fmt: skip
    return simulation(**{**given, **fields})


def change(sim: Simulation, number: int, kind_of: str) -> None:
    """Change the type of a bottle, by its id, as a carousel does: while bottles are fed."""
    with sim._accounts.feeding():
        (slot,) = np.flatnonzero(sim._state.world.bottles.id == number)
        sim._state.change_type(int(slot), sim.model.bottle_types.index(kind_of))
    sim._state.make_lists()
    sim.integration.put_in()


def on_rail(sim: Simulation) -> float:
    """Return the force on the rail, N."""
    contacts = sim.contacts()
    return float(contacts.normal_force[contacts.kind == 1].sum())


def test_the_belt_drags_the_new_mass() -> None:
    """The force on the rail is mu g times the sum of the masses, before and after; the rail does not move."""
    sim = queue()
    sim.advance(300)
    gravity = sim.model.gravity
    assert on_rail(sim) == pytest.approx(FRICTION * gravity * 3.0 * MASS, rel=1e-3)
    change(sim, 1, "full")
    sim.advance(300)
    assert sim.bottles().type.tolist() == [0, 1, 0]
    assert on_rail(sim) == pytest.approx(FRICTION * gravity * 5.0 * MASS, rel=1e-3)
    change(sim, 1, "light")
    sim.advance(300)
    assert on_rail(sim) == pytest.approx(FRICTION * gravity * 2.5 * MASS, rel=1e-3)


def test_a_moving_bottle_keeps_its_velocity_and_the_ledger_books_the_energy() -> None:
    """Energy (m' - m) v^2 / 2 comes with the filling, and its opposite with the emptying."""
    sim = queue(bottles=[bottle(-0.5, 0.0, 0.2)])
    sim.advance(10)
    for kind_of, gained in (("full", 2.0 * MASS), ("light", -2.5 * MASS)):
        before, vx = sim.ledger(), float(sim.bottles().vx[0])
        change(sim, 0, kind_of)
        after = sim.ledger()
        assert before is not None and after is not None
        assert float(sim.bottles().vx[0]) == vx
        assert after.fed - before.fed == pytest.approx(0.5 * gained * vx**2)
        sim.advance(10)
        assert float(sim.bottles().vx[0]) == pytest.approx(0.2), "it rides on"
    ledger = sim.ledger()
    assert ledger is not None
    assert abs(ledger.residual) < 1e-9 * ledger.turnover + 1e-15


@pytest.mark.parametrize("threads", [1, 2])
def test_a_checkpoint_after_the_change_gives_the_same_bits(threads: int, tmp_path: Path) -> None:
    sim = queue()
    sim.advance(100)
    change(sim, 2, "full")
    sim.save(tmp_path / "there")
    loaded = Simulation.load(tmp_path / "there", threads)
    for each in (sim, loaded):
        each.advance(100)
    assert loaded.full_state_hash() == sim.full_state_hash()
