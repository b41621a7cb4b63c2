# SPDX-License-Identifier: Apache-2.0
"""Function blocks of TIA Portal: its names of the standard ones, and IEC_TIMER.

An instance of IEC_TIMER is called with the instruction: `"t".TON(IN := x, PT := T#1s)`. Source: help of TIA Portal
V18, "IEC timers" and "IEC counters".
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from conveyor_sim.control.st.blocks import CLASSES as STANDARD_CLASSES
from conveyor_sim.control.st.blocks import STANDARD, TOF, TON, TP
from conveyor_sim.control.st.types import BlockType

INSTRUCTIONS = ("ton", "tof", "tp")
"""Names of instructions by which an IEC_TIMER is called, in small letters."""


class IecTimer(TP):
    """Timer that is called as TON, TOF or TP."""

    __slots__ = ()

    run_ton, run_tof, run_tp = TON.run, TOF.run, TP.run


IEC_TIMER = replace(STANDARD["TON"], name="IEC_TIMER", python="_IEC_TIMER")

BLOCKS: Mapping[str, BlockType] = {
    **{f"{name}_TIME": STANDARD[name] for name in ("TON", "TOF", "TP")},
    "IEC_TIMER": IEC_TIMER,
}
"""Block types by name."""

CLASSES: Mapping[str, Any] = {**STANDARD_CLASSES, IEC_TIMER.python: IecTimer}
"""Classes of all blocks by their names in the code."""
