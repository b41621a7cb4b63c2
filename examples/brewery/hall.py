# SPDX-License-Identifier: Apache-2.0
"""Controller of hall.yaml: that of brewery.yaml for each line.

cd examples/brewery; conveyor-sim serve hall.yaml --controller hall.py:hall --web
"""

from pathlib import Path

from conveyor_sim.control import Controller, in_cell, load, together

LINES = 10
BREWERY = Path(__file__).with_name("brewery.py")


def hall() -> Controller:
    """Return the controller of `hall.yaml`."""
    return together(*(in_cell(load(f"{BREWERY}:brewery"), f"line_{number}") for number in range(LINES)))
