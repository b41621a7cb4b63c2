# SPDX-License-Identifier: Apache-2.0
"""Gap control on a line: bottles that arrive nose to tail leave with the set gap."""

from __future__ import annotations

import numpy as np
from scenes import base, belt, contact, kind, scene, segment

from conveyor_sim.control.gap import GapControl
from conveyor_sim.testing import Scenario

DIAMETER, GAP, SPEED = 0.08, 0.1, 0.6


def metered() -> Scenario:
    """Return a metering belt, a discharge belt at 0.6 m/s, and an eye behind the transfer."""
    return Scenario(
        scene(
            duration=60.0,
            accuracy="draft",
            bottle_types={"bottle": kind(0.5 * DIAMETER, 0.35)},
            base=base(0.4),
            contacts=[contact(5e4, damping=("normal", 30.0)), contact(5e4, "steel", damping=("normal", 30.0))],
            belts={
                "metering": belt(0.3, (-1.0, -0.05), 1.0, 0.1),
                "discharge": belt(SPEED, (0.0, -0.05), 1.5, 0.1),
            },
            rails={"left": segment((-1.0, 0.045), (1.5, 0.045)), "right": segment((1.5, -0.045), (-1.0, -0.045))},
            infeeds={"in": {"bottle": "bottle", "position": [-0.9, 0.0], "direction": 0.0, "speed": 0.3, "gap": 0.0}},
            outfeeds={"out": {"region": [[1.4, -0.1], [1.6, -0.1], [1.6, 0.1], [1.4, 0.1]]}},
            photo_eyes={"behind": {"from": [0.6, -0.1], "to": [0.6, 0.1]}},
        )
    )


def test_the_gaps_are_as_asked_for() -> None:
    line = metered()
    control = GapControl("metering", "discharge", "behind", GAP, DIAMETER, lowest=0.05, highest=0.6)
    line.attach(control)
    line.run_until(lambda s: s["photo_eyes/behind/edges"] >= 20, within=20.0)
    gaps = []
    while len(gaps) < 20:
        line.run_for(0.01)
        if control.measured is not None and (not gaps or control.measured != gaps[-1]):
            gaps.append(control.measured)
    assert np.abs(np.array(gaps) - GAP).max() < 0.05 * GAP


def test_without_metering_there_is_another_gap() -> None:
    """At half the speed of the discharge belt, the gap is one diameter, 20 % less than the set gap."""
    line = metered()
    control = GapControl("metering", "discharge", "behind", GAP, DIAMETER, lowest=0.5 * SPEED, highest=0.5 * SPEED)
    line.attach(control)
    line.run_until(lambda s: s["photo_eyes/behind/edges"] >= 40, within=30.0)
    assert control.measured is not None
    assert abs(control.measured - GAP) > 0.1 * GAP
