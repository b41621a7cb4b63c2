# SPDX-License-Identifier: Apache-2.0
"""The filler block with the fast tier: it starts without bottles, gears in, and fills at its rate, in phase."""

import math

from conveyor_sim.control.filler_block import filler_block
from conveyor_sim.testing import Scenario

RATE = 24_000 / 3600
SLAVES = {"inlet": 12, "filler": 48, "outlet": 12, "capper": 16}
"""Pockets by axis."""


def test_the_block_fills_at_its_rate_with_the_fast_tier() -> None:
    plant = Scenario("filler_block", {"accuracy": "fast"})
    plant.attach(filler_block())
    plant.run_for(1.0)
    plant.panel.press("start")
    plant.run_for(0.2)
    plant.panel.release("start")
    plant.eventually(lambda s: s["carousels/heads/good"] >= 10, within=30.0)
    filled = plant.signals["carousels/valves/good"]
    plant.run_for(6.0)
    signals = plant.signals
    assert abs(signals["carousels/valves/good"] - filled - 6.0 * RATE) <= 2.0
    assert signals["carousels/valves/lost"] == signals["carousels/heads/defective"] == 0.0
    assert not plant.alarms
    assert plant.simulation.integration.shortened_ticks == 0
    for axis, pockets in SLAVES.items():
        wrong = signals[f"axes/{axis}/position"] * pockets - signals["axes/block/position"]
        assert abs(math.remainder(wrong, 2.0 * math.pi)) < 1e-6
