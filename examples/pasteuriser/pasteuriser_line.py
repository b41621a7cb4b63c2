# SPDX-License-Identifier: Apache-2.0
"""Controller of pasteuriser_line.yaml: bottles go into the pasteuriser only if the buffer behind it can take them.

cd examples/pasteuriser; conveyor-sim run pasteuriser_line.yaml --controller pasteuriser_line.py:controller
"""

from collections.abc import Mapping

from conveyor_sim.control.scan import Controller, Inputs

ROOM = 70
"""Number of bottles in the full buffer: 5 m of bottles of 66 mm, less the places of the packer and the outlet."""


class RoomBehind:
    """Belt before the pasteuriser: it stops while the buffer has no room for all bottles in the pasteuriser."""

    def __init__(self) -> None:
        """Start with a belt that runs."""
        self._runs = True

    def scan(self, inputs: Inputs) -> Mapping[str, float]:
        """Return the speed of the belt, m/s."""
        room = ROOM - inputs["zones/buffer/bottles"] - inputs["machines/pasteuriser/held"]
        # Bottles that wait in the pasteuriser's infeed may still enter after the belt has stopped.
        self._runs = room > (2 if self._runs else 6)
        return {"belts/feed/cmd_speed": 0.35 if self._runs else 0.0}


def controller() -> Controller:
    """Return the controller of the line."""
    return RoomBehind()
