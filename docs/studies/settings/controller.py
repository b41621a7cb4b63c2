# SPDX-License-Identifier: Apache-2.0
"""A V-curve with all of its settings, for the line of ../v_curve."""

from __future__ import annotations

from conveyor_sim.control.level import Count
from conveyor_sim.control.scan import Controller
from conveyor_sim.control.v_curve import Neighbour, VCurve

RATE = 2.0  # 1/s, of the packer, the bottleneck


def v_curve(margin: float, level: float, slack: float) -> Controller:
    """margin: of the rate, by which the filler is faster. level: bottles in the lane that it holds, within slack."""
    filler = Neighbour("machines/filler/rate", Count("zones/lane/bottles"), level - slack, level, level + slack)
    return VCurve("machines/packer/rate", RATE, margin, upstream=(filler,))
