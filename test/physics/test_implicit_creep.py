# SPDX-License-Identifier: Apache-2.0
"""Creep of a zigzag queue: implicit against explicit friction, and every prediction that resting load has no error."""

from __future__ import annotations

import json
from functools import cache
from typing import Any

import pytest
from study_page import load_study

from conveyor_sim.physics.model.remedies import step_limit
from conveyor_sim.physics.timestep.presets import PRESETS
from conveyor_sim.scene import parse_scene
from conveyor_sim.simulation import Simulation

WARM = ("leapfrog", "semi_implicit_euler", "velocity_verlet")
BOTTLES, RADIUS, MASS, WIDTH, MU = 40, 0.033, 0.4, 0.1, 0.25
COARSE = 320
"""Steps per tick with which explicit friction is stable."""
FEW = 40
"""Steps per tick of implicit friction, far beyond the limit of explicit friction."""
LEAST = 2e-4
"""Change of the load in MEASURED, relative to the load, that counts as none. The queue's load changes by 1.7 %."""
PACKED, MEASURED = 50, 25
"""Ticks."""

POINT: dict[str, Any] = {"type": {}, "base": {}}
RING: dict[str, Any] = {"type": {"base_radius": 0.02}, "base": {}}
SPRING: dict[str, Any] = {"type": {}, "base": {"tangential": {"stiffness": 20000.0, "damping": 160.0}}}
BASES = {"point": POINT, "ring": RING, "spring": SPRING}

EXPLICIT = (*WARM, "rk4", "dormand_prince", "linearly_implicit")
ZERO = [
    *((integrator, base) for integrator in EXPLICIT for base in ("point", "ring")),
    *((integrator, "spring") for integrator in WARM),  # the others refuse springs under bottles
]
"""Integrators and bases for which no error in the resting load of a queue is predicted, with explicit friction."""


def queue(integrator: str, solver: str, base: str = "point", **accuracy: Any) -> Simulation:
    """A zigzag queue before a stop, on a chain that runs below it."""
    along = 1.002 * (4.0 * RADIUS**2 - (WIDTH - 2.0 * RADIUS) ** 2) ** 0.5
    end = along * BOTTLES + 3.0 * RADIUS
    sides = WIDTH - 1.001 * RADIUS, 1.001 * RADIUS
    walls = {"right": ((0.0, 0.0), (end, 0.0)), "left": ((end, WIDTH), (0.0, WIDTH)),
             "stop": ((end, 0.01 * WIDTH), (end, 0.99 * WIDTH))}  # fmt: skip
    damping = {"law": "normal", "restitution": 0.5}
    # A type without bottles, on a ring: queues on points and on rings share their kernels.
    kind = {"radius": RADIUS, "mass": MASS, "material": "glass"}
    fields = {
        "accuracy": {"integrator": integrator, **accuracy},
        "friction_solver": solver,
        "contacts": [
            {"between": ["glass", other], "friction": MU, "damping": damping, "stiffness": 2e5}
            for other in ("glass", "steel")
        ],
        "base": [{"between": ["glass", "chain"], "friction": 0.3, **BASES[base]["base"]}],
        "bottle_types": {
            "b": {**kind, **BASES[base]["type"]},
            **({} if base == "spring" else {"absent": {**kind, **RING["type"]}}),
        },
        "belts": {"chain": {"kind": "straight", "start": [0, 0], "angle": 0, "length": end + 0.1, "width": WIDTH,
                            "speed": 0.45, "material": "chain"}},
        "rails": {name: {"kind": "segment", "material": "steel", "from": p, "to": q} for name, (p, q) in walls.items()},
        "bottles": [
            {"type": "b", "position": [end - 1.01 * RADIUS - along * k, sides[k % 2]],
             "velocity": [0.45, 0.0]}
            for k in range(BOTTLES)
        ],
    }  # fmt: skip
    return Simulation(parse_scene(json.dumps({"name": "queue", "duration": 10.0, **fields})), threads=1)


@cache
def packed(base: str) -> Simulation:
    sim = queue("leapfrog", "explicit", base, per_tick=COARSE)
    sim.advance(PACKED)
    return sim


def load(sim: Simulation) -> float:
    """Sum of the normal forces, N."""
    return float(sim.contacts().normal_force.sum())


def creep_term(sim: Simulation) -> float:
    """Predicted relative error of the creep."""
    (term,) = (term for term in sim.model.prediction.terms if "creep of pressed" in term.quantity)
    return term.value


def rise(sim: Simulation, base: str = "point") -> float:
    """Change of the load from the packed state within MEASURED, relative to the load."""
    sim.restore_from(packed(base))
    before = load(sim)
    sim.advance(MEASURED)
    return (load(sim) - before) / before


@pytest.mark.parametrize("base", BASES)
@pytest.mark.parametrize("integrator", WARM)
def test_a_queue_creeps_as_with_explicit_friction(integrator: str, base: str) -> None:
    """Within 5 %, in steps that explicit friction can't take. Half the step makes half the error."""
    exact = rise(queue("leapfrog", "explicit", base, per_tick=COARSE), base)
    assert abs(exact) > 50.0 * LEAST
    errors = [abs(rise(queue(integrator, "implicit", base, per_tick=n), base) / exact - 1.0) for n in (FEW, 2 * FEW)]
    assert errors[0] < 0.05
    assert errors[1] <= 0.5 * errors[0] + LEAST


@pytest.mark.parametrize(("integrator", "base"), ZERO)
def test_a_prediction_of_no_error_in_resting_load(integrator: str, base: str) -> None:
    """Twice the steps change the rise of the load by less than LEAST."""
    coarse, fine = (queue(integrator, "explicit", base, per_tick=n) for n in (COARSE, 2 * COARSE))
    assert coarse.model.prediction.resting == fine.model.prediction.resting == 0.0
    assert rise(coarse, base) == pytest.approx(rise(fine, base), abs=LEAST)


def test_creep_of_implicit_friction_by_rk4_is_predicted() -> None:
    """It is solved anew in each step: too fast, at most by what is predicted for the largest expected load."""
    exact = rise(queue("leapfrog", "explicit", per_tick=COARSE))
    sim = queue("rk4", "implicit", per_tick=2 * FEW)
    assert 0.1 < rise(sim) / exact - 1.0 < creep_term(sim)
    assert sim.model.prediction.resting is not None and sim.model.prediction.resting > 0.0
    assert queue("rk4", "implicit", per_tick=100 * COARSE).model.prediction.resting == 0.0


@pytest.mark.parametrize("preset", PRESETS)
def test_presets_of_rk4_keep_the_promise_of_resting_load(preset: str) -> None:
    """The bound is tight: the prediction is the promise, up to the rounding of steps."""
    predicted = queue("rk4", "implicit", preset=preset).model.prediction.resting
    assert predicted == pytest.approx(PRESETS[preset], rel=0.1) and predicted <= PRESETS[preset]


@pytest.mark.parametrize("integrator", [*WARM, "rk4"])
def test_implicit_friction_is_offered_where_creep_is_right(integrator: str) -> None:
    scene = queue(integrator, "explicit", preset="draft").scene
    words = [remedy.words for remedy in step_limit(scene).remedies]
    assert ("friction_solver: implicit" in words) == (integrator in WARM)


@pytest.mark.parametrize("number", [8, 9, 16])
def test_promises_hold_on_generated_queues(number: int) -> None:
    """Three scenes of docs/studies/implicit_queues.py, one of each integrator; its table has all."""
    rows = list(load_study("implicit_queues").measure(number, ("draft", "standard")))
    assert rows[0]["steps"] < rows[0]["explicit steps"]
    for row in rows:
        assert float(row["resting error"]) <= PRESETS[row["preset"]]
        assert row["rise N"] == pytest.approx(row["reference rise N"], rel=0.05)
