# SPDX-License-Identifier: Apache-2.0
"""A whole line in production: it starts from standstill, and every machine works in line with its neighbours.

Run it by hand: `pytest examples/scenarios/test_brewery.py`.
"""

from pathlib import Path

from conveyor_sim.control.load import load
from conveyor_sim.testing.plugin import Lines

FOLDER = Path(__file__).resolve().parents[1] / "brewery"
RATE = 40_000 / 3600  # bottles per second
AT_START = 4800


def test_the_line_starts_and_fills(line: Lines) -> None:
    plant = line(FOLDER / "brewery.yaml")
    plant.attach(load(f"{FOLDER / 'brewery.py'}:brewery"))
    plant.run_for(0.5)
    assert plant.signals["belts/supply/speed"] == plant.signals["axes/block_master/speed"] == 0.0
    plant.panel.press("start")
    plant.run_for(0.2)
    plant.panel.release("start")
    plant.eventually(lambda s: s["carousels/block_heads/good"] >= 1, within=55.0)
    filled, packed = plant.signals["carousels/block_valves/good"], plant.signals["machines/packer/taken"]
    plant.run_for(6.0)
    signals = plant.signals
    assert abs(signals["carousels/block_valves/good"] - filled - 6.0 * RATE) <= 3.0
    assert signals["machines/packer/taken"] > packed > 200
    assert signals["machines/pasteuriser/held"] > 300
    assert signals["carousels/block_valves/lost"] == signals["carousels/block_heads/lost"] == 0.0
    counts = plant.simulation.counts
    assert AT_START + counts.fed == counts.present + counts.removed + counts.held
    plant.panel.press("estop")
    plant.eventually(lambda s: s["axes/block_master/speed"] == 0.0 and s["belts/block_infeed/speed"] == 0.0, within=3.0)
    assert plant.signals["carousels/block_valves/lost"] == 0.0
