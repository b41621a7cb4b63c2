# SPDX-License-Identifier: Apache-2.0
"""Function blocks of TIA Portal: its names of the standard ones, IEC_TIMER, and IEC_COUNTER of every integer type.

An instance of IEC_TIMER or IEC_COUNTER is called with the instruction: `"t".TON(IN := x, PT := T#1s)`. Source: help of
TIA Portal V18, "IEC timers" and "IEC counters".
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import partial
from typing import Any

from conveyor_sim.control.st.blocks import CLASSES as STANDARD_CLASSES
from conveyor_sim.control.st.blocks import CTD, CTU, CTUD, STANDARD, TOF, TON, TP
from conveyor_sim.control.st.types import DINT, INT, LINT, SINT, UDINT, UINT, ULINT, USINT, BlockType, Type


class TONR(TON):
    """Time accumulator: ET adds up the time for which IN is on, Q stays on from PT; R resets both, and wins."""

    __slots__ = ("v_r",)

    def __init__(self) -> None:
        super().__init__()
        self.v_r = False

    def run(self, now: int) -> None:
        """Execute one call."""
        if self.v_r:
            self.v_q, self.v_et, self.since = False, 0, -1
        elif not self.v_in:
            self.since = -1
        else:
            if self.since < 0:
                self.since = now - self.v_et
            self.v_et = max(0, min(now - self.since, self.v_pt))
            self.v_q = self.v_q or self.v_et >= self.v_pt


class IecTimer(TP):
    """Timer that is called as TON, TOF, TP or TONR. R is a variable of TONR only."""

    __slots__ = ("v_r",)

    def __init__(self) -> None:
        super().__init__()
        self.v_r = False

    run_ton, run_tof, run_tp, run_tonr = TON.run, TOF.run, TP.run, TONR.run


class IecCounter(CTUD):
    """Counter that is called as CTU, CTD or CTUD. Q of CTU is QU, and Q of CTD is QD."""

    __slots__ = ()

    run_ctud = CTUD.run

    def run_ctu(self, now: int) -> None:
        """Execute one call of CTU."""
        self._count(self.v_cu, self.down)
        if self.v_r:
            self.v_cv = 0
        self.v_qu = self.v_cv >= self.v_pv

    def run_ctd(self, now: int) -> None:
        """Execute one call of CTD."""
        self._count(self.up, self.v_cd)
        if self.v_ld:
            self.v_cv = self.v_pv
        self.v_qd = self.v_cv <= 0


_COUNTERS = {"S": SINT, "US": USINT, "": INT, "U": UINT, "D": DINT, "UD": UDINT, "L": LINT, "UL": ULINT}
"""Integer types by the letters before COUNTER."""


def _of_type(name: str, block: BlockType, kind: Type) -> BlockType:
    """Return a counter for another integer type."""
    members = {key: replace(one, type=kind if one.type == INT else one.type) for key, one in block.members.items()}
    return replace(block, name=name, members=members, python=f"_{name}")


def _called(block: BlockType, q: str = "") -> BlockType:
    """Return the interface of an instruction. q: name of its output Q in the instance."""
    members = {key: replace(one, python=f"v_{q}" if key == "q" and q else "") for key, one in block.members.items()}
    return replace(block, members=members)


_R = STANDARD["CTU"].members["r"]
_MEMBERS = STANDARD["TON"].members
_TONR = replace(STANDARD["TON"], name="TONR_TIME", members={"in": _MEMBERS["in"], "r": _R, **_MEMBERS}, python="_TONR")
_TIMER = replace(STANDARD["TON"], name="IEC_TIMER", python="_IEC_TIMER")
_LOCAL = {
    f"{one.__name__}_{kind.name}": (one, kind, _of_type(f"{one.__name__}_{kind.name}", STANDARD[one.__name__], kind))
    for one in (CTU, CTD, CTUD)
    for kind in _COUNTERS.values()
}
_SHARED = {
    f"IEC_{letters}COUNTER": (kind, _of_type(f"IEC_{letters}COUNTER", STANDARD["CTUD"], kind))
    for letters, kind in _COUNTERS.items()
}

INSTRUCTIONS: Mapping[BlockType, Mapping[str, BlockType]] = {
    _TIMER: {**{name.lower(): STANDARD[name] for name in ("TON", "TOF", "TP")}, "tonr": _TONR},
    **{
        block: {
            "ctu": _called(_LOCAL[f"CTU_{kind.name}"][2], "qu"),
            "ctd": _called(_LOCAL[f"CTD_{kind.name}"][2], "qd"),
            "ctud": _called(_LOCAL[f"CTUD_{kind.name}"][2]),
        }
        for kind, block in _SHARED.values()
    },
}
"""Interfaces of the instructions by which an instance is called, by its type and by names in small letters."""

BLOCKS: Mapping[str, BlockType] = {
    **{f"{name}_TIME": STANDARD[name] for name in ("TON", "TOF", "TP")},
    _TONR.name: _TONR,
    **{name: block for name, (_, _, block) in _LOCAL.items() if name not in STANDARD},
    **{one.name: one for one in INSTRUCTIONS},
}
"""Block types by name."""

CLASSES: Mapping[str, Any] = {
    **STANDARD_CLASSES,
    _TONR.python: TONR,
    _TIMER.python: IecTimer,
    **{f"_{name}": partial(one, kind.low, kind.high) for name, (one, kind, _) in _LOCAL.items()},
    **{block.python: partial(IecCounter, kind.low, kind.high) for kind, block in _SHARED.values()},
}
"""Classes of all blocks by their names in the code."""
