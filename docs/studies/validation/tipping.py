# SPDX-License-Identifier: Apache-2.0
"""Stability rule of a chain maker: a container tips if friction exceeds its radius over its height."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence

import numpy as np

from conveyor_sim import Simulation
from conveyor_sim.scene import parse_scene
from validation.source import Case, Range, Row, Run, Source

RADIUS, MASS = 0.033, 0.35
SLENDERNESS = (3.0, 4.0, 6.0)
"""Height over radius of the load: of the centre of gravity, or of the contact band."""
SHARES = (0.8, 0.9, 1.0, 1.1, 1.2)
"""Friction of the chain, as a multiple of R/h."""
LOADS = ("held by a rail at height h", "dragged by the chain, h of the centre of gravity")
BELT = 20.0
"""m/s: faster than any bottle becomes, so that the base slips throughout."""
DURATION = 2.0
"""s; the index follows a lasting load with the delay sqrt(h/g), at most 0.14 s here."""


def cases() -> list[Case]:
    """Return each load with each height and friction."""
    return [{"load": load, "h/R": h, "mu h/R": share} for load in LOADS for h in SLENDERNESS for share in SHARES]


def simulate(case: Case) -> Mapping[str, float]:
    """Return the index of tipping under a lasting load."""
    high, low = float(case["h/R"]) * RADIUS, 0.5 * RADIUS
    held = case["load"] == LOADS[0]
    friction = float(case["mu h/R"]) / float(case["h/R"])
    heights = {"contact_height": high, "gravity_height": low if held else high}
    x = -RADIUS if held else -30.0
    contact = {"stiffness": 1e5, "damping": {"law": "normal", "restitution": 0.3}}
    scene = {
        "name": "tipping", "duration": DURATION, "accuracy": "standard",
        "outputs": {"bottles": 0, "poses": 0, "contacts": 0, "belts": 0, "signals": 0, "damage": 1},
        "bottle_types": {"bottle": {"radius": RADIUS, "mass": MASS, "material": "glass", **heights}},
        "contacts": [{"between": ["glass", other], **contact} for other in ("glass", "steel")],
        "base": [{"between": ["glass", "chain"], "friction": friction}],
        "belts": {"chain": {"kind": "straight", "start": [-40.0, -0.5], "angle": 0.0, "length": 50.0, "width": 1.0,
                            "speed": BELT, "speed_limits": [0.0, BELT], "material": "chain"}},
        "rails": {"stop": {"kind": "segment", "from": [0.0, -0.5], "to": [0.0, 0.5], "material": "steel"}},
        "bottles": [{"type": "bottle", "position": [x, 0.0]}],
    }  # fmt: skip
    sim = Simulation(parse_scene(json.dumps(scene)), threads=1)
    sim.advance(round((DURATION - sim.scene.tick) / sim.scene.tick))
    sim.damage()
    sim.advance()
    damage = sim.damage()
    assert damage is not None
    return {"index": float(damage.tipping[0])}


def rows(runs: Sequence[Run]) -> list[Row]:
    """Compare the friction at which the index is 1 with R/h."""
    compared = []
    for load in LOADS:
        for h in SLENDERNESS:
            of = sorted((run["mu h/R"], run["index"]) for run in runs if (run["load"], run["h/R"]) == (load, h))
            simulated = None
            if len(of) == len(SHARES):
                friction, index = np.array(of).T
                # The interval is the spacing's share that straight interpolation can miss: second differences over 8.
                doubt = (
                    float(np.abs(np.diff(index, 2)).max())
                    / 8.0
                    / float(np.diff(index).mean())
                    * (SHARES[1] - SHARES[0])
                )
                simulated = Range.within(float(np.interp(1.0, index, friction)) / h, max(doubt, 5e-4) / h)
            compared.append(Row(f"friction at index 1, {load}, h = {h:g} R", Range.exact(1.0 / h), simulated, "rule"))
    return compared


SOURCE = Source(
    name="tipping",
    title="Stability of containers on a chain",
    citation="Rexnord, rule for the stability of containers on table-top chains (engineering manual).",
    read="Validation notes: stable if R/h exceeds the friction coefficient. The manual was not available.",
    measured="A rule of thumb of a chain maker, not a measurement.",
    simulated="One bottle of radius 33 mm on a slipping chain: held by a rail, or dragged from rest. The model is "
    "plane and does not tip; it reports an index. Friction where the index is 1 is interpolated from five runs.",
    cases=cases,
    simulate=simulate,
    rows=rows,
    seconds=2.0,
    discussion="The index contains the same balance of moments as the rule, so agreement shows that loads are computed "
    "correctly. It does not show at which load a real bottle tips. That needs a tilting or braking test with "
    "bottles on a chain.",
)
