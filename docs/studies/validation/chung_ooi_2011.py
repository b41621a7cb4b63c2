# SPDX-License-Identifier: Apache-2.0
"""Benchmarks of single impacts for discrete-element programs (Chung and Ooi 2011), tests 1 to 4."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from typing import NamedTuple

from conveyor_sim import Simulation
from conveyor_sim.scene import parse_scene
from validation.source import Case, Range, Row, Run, Source

STEPS = (2000, 4000)
"""Steps per contact; twice the change between both is the interval of the simulated value."""
STORED = 1e-5
"""Relative error of values stored with six digits, twice."""
OBLIQUE_SPEED, OBLIQUE_FRICTION, OBLIQUE_RESTITUTION = 3.9, 0.092, 0.98


class Sphere(NamedTuple):
    """A sphere of one test, and its speed of approach relative to its partner."""

    modulus: float
    """Pa"""
    poisson: float
    density: float
    """kg/m^3"""
    radius: float
    """m"""
    speed: float
    """m/s"""

    @property
    def mass(self) -> float:
        """Return the mass, kg."""
        return self.density * 4.0 / 3.0 * math.pi * self.radius**3


PAIRS = {
    "glass": Sphere(4.8e10, 0.20, 2800.0, 0.010, 20.0),
    "limestone": Sphere(2.0e10, 0.25, 2500.0, 0.010, 20.0),
}
"""Test 1: two equal spheres, each at 10 m/s."""
PLANES = {
    "aluminium alloy": Sphere(7.0e10, 0.30, 2699.0, 0.100, 0.2),
    "magnesium alloy": Sphere(4.0e10, 0.35, 1800.0, 0.100, 0.2),
}
"""Test 2: sphere and rigid plane."""
OXIDE = Sphere(3.8e11, 0.23, 4000.0, 0.0025, OBLIQUE_SPEED)
"""Tests 3 and 4: sphere of aluminium oxide and rigid plane."""
RESTITUTIONS = (0.2, 0.4, 0.6, 0.8, 1.0)
ANGLES = (40.0, 60.0, 80.0)
"""Degrees from the normal, at which the contact slides throughout."""


def cases() -> list[Case]:
    """Return all tests, each with half of the steps and with all of them."""
    tests: list[tuple[str, str, float, float]] = [("pair", name, 1.0, 0.0) for name in PAIRS]
    tests += [("plane", name, 1.0, 0.0) for name in PLANES]
    tests += [("plane", "aluminium oxide", e, 0.0) for e in RESTITUTIONS]
    tests += [("plane", "aluminium oxide", OBLIQUE_RESTITUTION, angle) for angle in ANGLES]
    return [
        {"with": kind, "material": name, "restitution": e, "angle": angle, "steps": steps}
        for kind, name, e, angle in tests
        for steps in STEPS
    ]


def hertz(sphere: Sphere, pair: bool) -> tuple[float, float, float]:
    """Return stiffness (N/m^1.5), peak force (N) and contact time (s) of an elastic impact (Hertz 1882)."""
    modulus = sphere.modulus / (1.0 - sphere.poisson**2) / (2.0 if pair else 1.0)
    radius, mass = (0.5 * value if pair else value for value in (sphere.radius, sphere.mass))
    stiffness = 4.0 / 3.0 * modulus * math.sqrt(radius)
    deepest = (1.25 * mass * sphere.speed**2 / stiffness) ** 0.4
    return stiffness, stiffness * deepest**1.5, 2.9432750 * deepest / sphere.speed


def simulate(case: Case) -> Mapping[str, float]:
    """Return peak force (N), restitution, tangential restitution and angular velocity (rad/s) of one impact."""
    pair, angle = case["with"] == "pair", math.radians(float(case["angle"]))
    sphere = {**PAIRS, **PLANES, "aluminium oxide": OXIDE}[str(case["material"])]
    e = float(case["restitution"])
    stiffness, _, duration = hertz(sphere, pair)
    tick = float(f"{2.0 * duration:.3g}")
    normal, tangential = sphere.speed * math.cos(angle), sphere.speed * math.sin(angle)
    damping = {"law": "none"} if e == 1.0 else {"law": "normal", "restitution": e}
    friction = OBLIQUE_FRICTION if angle else 0.0
    gap = 0.05 * normal * tick
    first = {"type": "sphere", "position": [-sphere.radius - gap, 0.0], "velocity": [normal, tangential]}
    second = {"type": "sphere", "position": [sphere.radius, 0.0]}
    wide = 4.0 * sphere.radius
    scene = {
        "name": "impact", "duration": 100.0 * tick, "tick": tick, "floor": "none", "slip_limit": 1e-3,
        "lever_arm": "radius", "accuracy": {"per_tick": 2 * int(case["steps"])}, "effects": {"peaks": "on"},
        "outputs": dict.fromkeys(("bottles", "poses", "contacts", "belts", "signals"), 0),
        "bottle_types": {"sphere": {"radius": sphere.radius, "mass": sphere.mass, "material": "sphere",
                                    "inertia": 0.4 * sphere.mass * sphere.radius**2}},
        "contacts": [{"between": ["sphere", other], "hertz_stiffness": stiffness, "damping": damping,
                      "friction": friction} for other in ("sphere", "plane")],
        "rails": {} if pair else {"plane": {"kind": "segment", "from": [0.0, -wide], "to": [0.0, wide],
                                            "material": "plane"}},
        "bottles": [first, second] if pair else [first],
    }  # fmt: skip
    sim = Simulation(parse_scene(json.dumps(scene)), threads=1)
    sim.advance(2)
    state = sim.bottles()
    after = float(state.vx[1] - state.vx[0]) if pair else -float(state.vx[0])
    return {
        "peak": float(state.peak_force[0]),
        "rebound": after / normal,
        "tangential": float(state.vy[0]) / tangential if tangential else 1.0,
        "spin": float(state.omega[0]),
    }


def _value(runs: Sequence[Run], result: str, **wanted: str | float) -> Range | None:
    """Return a result with all steps; None if a run is missing."""
    found = {run["steps"]: run[result] for run in runs if all(run[name] == value for name, value in wanted.items())}
    if set(found) != set(STEPS):
        return None
    value = found[STEPS[1]]
    return Range.within(value, 2.0 * abs(value - found[STEPS[0]]) + STORED * abs(value))


def rows(runs: Sequence[Run]) -> list[Row]:
    """Compare each test with its closed form."""
    compared = []
    for of, spheres, test in (("two spheres of", PAIRS, "test 1"), ("a plane and a sphere of", PLANES, "test 2")):
        for name, sphere in spheres.items():
            peak = _value(runs, "peak", material=name)
            published = Range.exact(hertz(sphere, spheres is PAIRS)[1])
            compared.append(Row(f"peak force between {of} {name}, N", published, peak, f"{test}, Hertz"))
    for e in RESTITUTIONS:
        simulated = _value(runs, "rebound", material="aluminium oxide", restitution=e, angle=0.0)
        compared.append(Row(f"restitution, {e:g} in the scene", Range.exact(e), simulated, "test 3"))
    for angle in ANGLES:
        change = OBLIQUE_FRICTION * (1.0 + OBLIQUE_RESTITUTION) / math.tan(math.radians(angle))
        spin = 2.5 * change * OBLIQUE_SPEED * math.sin(math.radians(angle)) / OXIDE.radius
        wanted = {"material": "aluminium oxide", "angle": angle}
        rigid = "test 4, impulse with sliding"
        compared += [
            Row(f"tangential restitution at {angle:g} degrees", Range.exact(1.0 - change),
                _value(runs, "tangential", **wanted), rigid),
            Row(f"angular velocity after impact at {angle:g} degrees, rad/s", Range.exact(spin),
                _absolute(_value(runs, "spin", **wanted)), rigid),
        ]  # fmt: skip
    return compared


def _absolute(value: Range | None) -> Range | None:
    return None if value is None else Range.within(abs(value.value), value.high - value.value)


SOURCE = Source(
    name="chung_ooi_2011",
    title="Impacts of single spheres",
    citation="Y. C. Chung, J. Y. Ooi, Benchmark tests for verifying discrete element modelling codes at particle "
    "impact level, Granular Matter 13, 643 (2011).",
    read="Not the paper. Its input values for tests 1 to 4 are from the benchmark scripts of Yade, which repeat them.",
    measured="Eight tests of one impact with closed forms: elastic pairs and planes, restitution, oblique impacts.",
    simulated="Spheres by their mass, radius, moment of inertia and Hertz stiffness; leapfrog with "
    f"{STEPS[1]} steps per contact. The interval is twice the change from half the steps.",
    cases=cases,
    simulate=simulate,
    rows=rows,
    seconds=0.5,
    discussion="Peak force, rebound and sliding impulse follow from the input values in closed form. Oblique impacts "
    "that stick have an elastic tangential rebound in the paper (Mindlin), whose values could not be read; the "
    "friction curve has none. Tests 5 to 8 (spin, oblique impacts of two spheres) have the same closed forms, checked "
    "for a hoop in `test/physics/test_oblique_impact.py`; their input values could not be read.",
)
