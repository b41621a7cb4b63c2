# SPDX-License-Identifier: Apache-2.0
"""Controller of the brewery for a study: an operator presses the start button in the first second."""

from __future__ import annotations

from collections import ChainMap
from collections.abc import Mapping

from conveyor_sim.control import Controller
from conveyor_sim.control.brewery import brewery
from conveyor_sim.control.scan import Inputs


class Started:
    """A line whose start button is pressed from 0.1 to 0.5 s."""

    def __init__(self, line: Controller) -> None:
        self._line = line

    def scan(self, inputs: Inputs) -> Mapping[str, float]:
        """Return the commands of the line in one scan."""
        pressed = {"panel/start/contact": float(0.1 <= inputs.time < 0.5)}
        return self._line.scan(Inputs(ChainMap(pressed, inputs), inputs.time, inputs.tick, inputs.length))


def started(supply: float = 4.0, buffer: float = 6.0) -> Controller:
    """Return the controller of the brewery with its start pressed. supply, buffer: lengths of its conveyors, m."""
    return Started(brewery(supply, buffer))
