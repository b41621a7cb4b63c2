# SPDX-License-Identifier: Apache-2.0
"""Forces at rest, by every integrator, against closed forms: the preset's promise for contacts that stay closed.

On a turn-table that carries a bottle round along a smooth rim nothing slips, so the rim alone bends its way:
N = m Omega^2 r. The same on a curved lane. test_moving_rails.py has what a rail bears that pushes a bottle.
"""

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
import pytest
from scenes import COMMON, base, belt, bottle, contact, kind, scene, segment, with_bends

from conveyor_sim.physics.model import build_model
from conveyor_sim.physics.timestep.presets import PRESETS
from conveyor_sim.scene import Scene
from conveyor_sim.scene.accuracy import INTEGRATOR_NAMES
from conveyor_sim.simulation import Simulation

MASS, RADIUS, MU, G = 0.36, 0.033, 0.3, 9.81
TABLES = ((0.5, 0.25), (0.5, 0.6), (0.9, 0.5))
"""Radius (m) of the rim and speed (m/s) of the belt at half of it."""
LANE = (0.4, 0.7, 0.45)
"""Inner and outer radius of a curved lane, m, and its speed at the centre line, m/s."""
STIFFNESS = 2e4
"""N/m"""
GAP = 1e-6
"""m, between bottle and rim at first."""
SMOOTH = 1e-15
"""Friction of contacts: as good as none, with the kernels of scenes that have it."""


def turning(**accuracy: Any) -> Scene:
    """Bottles that turn-tables and a curved lane carry along their outer rails, without friction there."""
    belts, rails, bottles = {}, {}, []
    rims = [(0.0, rim, speed) for rim, speed in TABLES] + [LANE]
    for number, (inner, outer, speed) in enumerate(rims):
        centre = (3.0 * number, 0.0)
        omega = speed / (0.5 * (inner + outer))
        belts[f"belt_{number}"] = {
            "kind": "curved", "centre": centre, "inner_radius": inner, "width": outer - inner, "start_angle": 0.0,
            "span": 2.0 * math.pi, "material": "chain", "speed": speed,
        }  # fmt: skip
        rails[f"rim_{number}"] = {
            "kind": "arc", "centre": centre, "radius": outer, "start_angle": 0.0, "span": 2.0 * math.pi,
            "material": "steel",
        }  # fmt: skip
        at = outer - RADIUS - GAP
        bottles.append(bottle(centre[0] + at, 0.0, 0.0, omega * at))
    # No bottle uses them: with them the scene has the kernels of other tests.
    belts["straight"] = belt(0.0, (-1.0, 3.0), 0.5, 0.2)
    rails["straight"] = segment((-1.0, 3.0), (-0.5, 3.0))
    return scene(
        tick=0.01,
        duration=3.0,
        gravity=G,
        slip_limit=0.01,
        accuracy=accuracy,
        contacts=[contact(STIFFNESS, other, ("normal", 10.0), SMOOTH) for other in ("glass", "steel")],
        base=base(MU),
        bottle_types={"bottle": kind(radius=RADIUS, mass=MASS)},
        belts=belts,
        rails=rails,
        bottles=bottles,
        effects=COMMON,
    )


def rim_forces() -> list[float]:
    """m Omega^2 r of each, N, where the rim gives way by N / k."""
    rims = [(speed / (0.5 * rim), rim) for rim, speed in TABLES]
    rims.append((LANE[2] / (0.5 * (LANE[0] + LANE[1])), LANE[1]))
    return [MASS * omega**2 * (rim - RADIUS) / (1.0 - MASS * omega**2 / STIFFNESS) for omega, rim in rims]


def mean_forces(sim: Simulation, settling: float) -> Sequence[float]:
    """Normal forces of the contacts, by bottle: means over the second after some have passed, N."""
    sim.advance(round(settling / sim.scene.tick))
    total = np.zeros(len(sim.bottles().id))
    ticks = round(1.0 / sim.scene.tick)
    for _ in range(ticks):
        sim.advance(1)
        contacts = sim.contacts()
        np.add.at(total, contacts.a.astype(int), contacts.normal_force)
    return list(total / ticks)


@pytest.mark.parametrize("preset", ["standard", "fine"])
@pytest.mark.parametrize(
    ("integrator", "solver"),
    [*((name, "explicit") for name in INTEGRATOR_NAMES), *((name, "implicit") for name in INTEGRATOR_NAMES[:3])],
)
def test_the_load_of_a_turning_belt_on_its_rim(integrator: str, solver: Any, preset: Any) -> None:
    """Within the promise of the preset, and within what is predicted."""
    turns = turning(preset=preset, integrator=integrator).model_copy(update={"friction_solver": solver})
    sim = Simulation(turns, threads=1)
    found, expected = np.array(mean_forces(sim, 1.0)), np.array(rim_forces())
    error = math.sqrt(float(np.mean((found - expected) ** 2) / np.mean(expected**2)))
    predicted = sim.model.prediction.resting
    assert predicted is not None
    # What still rings and creeps after a second is some millionths.
    assert error <= predicted + 2e-6
    # Bounds make one term equal to the promise; others are far smaller.
    assert predicted <= PRESETS[preset] * (1.0 + 1e-9)


@pytest.mark.parametrize("per_tick", [16, 48])
def test_what_semi_implicit_euler_misses_of_it_is_predicted(per_tick: int) -> None:
    """One part in the steps in v_lim / (mu g): its velocity lags on the circle, and friction answers the slip.

    The lag is up to a twelfth of v_lim, where the friction curve is 4 % below its slope at rest.
    """
    sim = Simulation(turning(per_tick=per_tick, integrator="semi_implicit_euler"), threads=1)
    found, expected = np.array(mean_forces(sim, 1.0)), np.array(rim_forces())
    predicted = sim.model.prediction.resting
    assert predicted == pytest.approx(MU * G * sim.model.dt / 0.01)
    assert found / expected == pytest.approx(np.full(4, 1.0 - predicted), abs=0.05 * predicted)


JOINT = ((0.3, 0.2), (0.7, 0.35))
"""Speed (m/s) and friction of two straight belts, one after the other."""
QUEUE = 6
"""Bottles in single file against a stop, half of them on each belt."""


def across_a_joint(**accuracy: Any) -> dict[str, Any]:
    """Fields of a scene: a queue on two belts of different speed and friction, before a stop; contacts are smooth."""
    length = 2.0 * RADIUS * QUEUE
    belts = {
        f"belt_{number}": {
            "kind": "straight", "start": (0.5 * length * (number - 1), -0.1), "angle": 0.0, "length": 0.5 * length,
            "width": 0.2, "material": f"chain_{number}", "speed": speed,
        }
        for number, (speed, _) in enumerate(JOINT)
    }  # fmt: skip
    end = 0.5 * length
    drags = [{"between": ["glass", f"chain_{number}"], "friction": mu} for number, (_, mu) in enumerate(JOINT)]
    return {
        "tick": 0.01,
        "duration": 3.0,
        "gravity": G,
        "slip_limit": 0.01,
        "accuracy": accuracy,
        # So much damping that the queue has stopped ringing after 2 s, to 1e-8.
        "contacts": [contact(STIFFNESS, other, ("normal", 100.0), SMOOTH) for other in ("glass", "steel")],
        "base": [*drags, *base(MU)],
        "bottle_types": {"bottle": kind(radius=RADIUS, mass=MASS)},
        "belts": belts,
        "rails": {"stop": segment((end, -0.1), (end, 0.1))},
        "bottles": [bottle(end - RADIUS * (1.0 + 2.0 * n), 0.0) for n in range(QUEUE)],
        "effects": COMMON,
    }


@pytest.mark.parametrize("preset", ["standard", "fine"])
@pytest.mark.parametrize("integrator", INTEGRATOR_NAMES)
def test_a_queue_across_a_joint_of_belts(integrator: str, preset: Any) -> None:
    """Each bottle drags with mu m g of its belt at any belt speed. The bottles behind press with the sum of drags.

    Straight belts take nothing from resting load at any step; rounding is left.
    """
    given = across_a_joint(preset=preset, integrator=integrator)
    model = build_model(scene(**given))
    assert model.prediction.resting == 0.0
    given["accuracy"] = {"per_tick": model.steps_per_tick, "integrator": integrator}
    found = mean_forces(Simulation(scene(**with_bends(given)), threads=1), 2.0)
    drags = [MASS * G * mu for _, mu in reversed(JOINT) for _ in range(QUEUE // 2)]
    pressed = [sum(drags[n:]) for n in range(QUEUE + 1)]
    # A contact counts for the bottle that is farther on; the first has the stop's besides.
    assert found == pytest.approx([pressed[0] + pressed[1], *pressed[2:]], rel=1e-7)
