# SPDX-License-Identifier: Apache-2.0
"""The V-curve of the line beside it, with the two numbers that whoever runs such a line has to choose."""

from __future__ import annotations

from conveyor_sim.control.level import Count
from conveyor_sim.control.scan import Controller
from conveyor_sim.control.v_curve import Neighbour, VCurve

RATE = 2.0  # 1/s, of the packer, the bottleneck
SLACK = 2.0  # bottles, by which the level may be off before the filler's rate changes


def v_curve(margin: float = 0.25, level: float = 24.0) -> Controller:
    """margin: of the rate, by which the filler is faster when the lane is short. level: bottles that it holds there."""
    filler = Neighbour("machines/filler/rate", Count("zones/lane/bottles"), level - SLACK, level, level + SLACK)
    return VCurve("machines/packer/rate", RATE, margin, upstream=(filler,))
