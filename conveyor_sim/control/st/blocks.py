# SPDX-License-Identifier: Apache-2.0
"""The standard function blocks (IEC 61131-3:2013, tables 43 to 46). Times are whole ns of simulated time.

Each is a class with a slot for every variable, and `run(now)`, one call.
"""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from typing import Any

from conveyor_sim.control.st.types import BOOL, DINT, INT, LINT, TIME, UDINT, ULINT, WORD, BlockType, Member, Type


class _Timer:
    __slots__ = ("since", "v_et", "v_in", "v_pt", "v_q")

    def __init__(self) -> None:
        self.v_in = self.v_q = False
        self.v_pt = self.v_et = 0
        self.since = -1
        """Start of the count, ns; -1 while it does not count."""


class TON(_Timer):
    """On-delay: Q turns on once IN has been on for PT; ET rises to PT, and is 0 while IN is off."""

    __slots__ = ()

    def run(self, now: int) -> None:
        """Execute one call."""
        if not self.v_in:
            self.v_q, self.v_et, self.since = False, 0, -1
            return
        if self.since < 0:
            self.since = now
        elapsed = now - self.since
        self.v_q = elapsed >= self.v_pt
        self.v_et = max(0, min(elapsed, self.v_pt))


class TOF(_Timer):
    """Off-delay: Q turns on with IN, and off once IN has been off for PT; ET then stays at PT until IN is on."""

    __slots__ = ()

    def run(self, now: int) -> None:
        """Execute one call."""
        if self.v_in:
            self.v_q, self.v_et, self.since = True, 0, -1
        elif self.v_q:
            if self.since < 0:
                self.since = now
            elapsed = now - self.since
            self.v_q = elapsed < self.v_pt
            self.v_et = max(0, min(elapsed, self.v_pt))


class TP(_Timer):
    """Pulse: Q is on for PT from a rising edge of IN, regardless of later edges; ET stays at PT until IN is off."""

    __slots__ = ("before",)

    def __init__(self) -> None:
        super().__init__()
        self.before = False

    def run(self, now: int) -> None:
        """Execute one call."""
        rose = self.v_in and not self.before
        self.before = self.v_in
        if self.since >= 0 and now - self.since >= self.v_pt and (rose or not self.v_in):
            self.since = -1
        if self.since < 0 and rose:
            self.since = now
        elapsed = now - self.since if self.since >= 0 else self.v_pt
        self.v_q = elapsed < self.v_pt
        self.v_et = 0 if self.since < 0 else max(0, min(elapsed, self.v_pt))


class R_TRIG:
    """Rising edge: Q is on for one call when CLK turns on. CLK counts as off before the first call."""

    __slots__ = ("before", "v_clk", "v_q")

    def __init__(self) -> None:
        self.v_clk = self.v_q = self.before = False

    def run(self, now: int) -> None:
        """Execute one call."""
        self.v_q = self.v_clk and not self.before
        self.before = self.v_clk


class F_TRIG:
    """Falling edge: Q is on for one call when CLK turns off.

    The standard's body, Q := NOT CLK AND NOT M; M := NOT CLK, makes an edge in the first call if CLK is off then. Its
    text speaks of a transition, and compilers follow the text, so there is no edge here.
    """

    __slots__ = ("before", "v_clk", "v_q")

    def __init__(self) -> None:
        self.v_clk = self.v_q = self.before = False

    def run(self, now: int) -> None:
        """Execute one call."""
        self.v_q = self.before and not self.v_clk
        self.before = self.v_clk


class SR:
    """Set-dominant flip-flop: Q1 := S1 OR (NOT R AND Q1)."""

    __slots__ = ("v_q1", "v_r", "v_s1")

    def __init__(self) -> None:
        self.v_s1 = self.v_r = self.v_q1 = False

    def run(self, now: int) -> None:
        """Execute one call."""
        self.v_q1 = self.v_s1 or (self.v_q1 and not self.v_r)


class RS:
    """Reset-dominant flip-flop: Q1 := NOT R1 AND (S OR Q1)."""

    __slots__ = ("v_q1", "v_r1", "v_s")

    def __init__(self) -> None:
        self.v_s = self.v_r1 = self.v_q1 = False

    def run(self, now: int) -> None:
        """Execute one call."""
        self.v_q1 = not self.v_r1 and (self.v_s or self.v_q1)


class _Counter:
    __slots__ = ("down", "high", "low", "up", "v_cv", "v_pv")

    def __init__(self, low: int, high: int) -> None:
        self.v_pv = self.v_cv = 0
        self.up = self.down = False
        self.low, self.high = low, high
        """PVmin and PVmax: at these it counts no further."""

    def _count(self, up: bool, down: bool) -> None:
        """Count edges up and down. Both in one call cancel each other."""
        rose, fell = up and not self.up, down and not self.down
        self.up, self.down = up, down
        if rose and not fell and self.v_cv < self.high:
            self.v_cv += 1
        elif fell and not rose and self.v_cv > self.low:
            self.v_cv -= 1


class CTU(_Counter):
    """Up-counter: Q is on from PV rising edges of CU on; R resets, and wins."""

    __slots__ = ("v_cu", "v_q", "v_r")

    def __init__(self, low: int, high: int) -> None:
        super().__init__(low, high)
        self.v_cu = self.v_r = self.v_q = False

    def run(self, now: int) -> None:
        """Execute one call."""
        self._count(self.v_cu, False)
        if self.v_r:
            self.v_cv = 0
        self.v_q = self.v_cv >= self.v_pv


class CTD(_Counter):
    """Down-counter: LD loads PV, and wins; Q is on at 0 and below."""

    __slots__ = ("v_cd", "v_ld", "v_q")

    def __init__(self, low: int, high: int) -> None:
        super().__init__(low, high)
        self.v_cd = self.v_ld = self.v_q = False

    def run(self, now: int) -> None:
        """Execute one call."""
        self._count(False, self.v_cd)
        if self.v_ld:
            self.v_cv = self.v_pv
        self.v_q = self.v_cv <= 0


class CTUD(_Counter):
    """Up-down-counter: R resets, else LD loads, else edges count; both edges in one call cancel each other."""

    __slots__ = ("v_cd", "v_cu", "v_ld", "v_qd", "v_qu", "v_r")

    def __init__(self, low: int, high: int) -> None:
        super().__init__(low, high)
        self.v_cu = self.v_cd = self.v_r = self.v_ld = self.v_qu = self.v_qd = False

    def run(self, now: int) -> None:
        """Execute one call."""
        self._count(self.v_cu, self.v_cd)
        if self.v_r:
            self.v_cv = 0
        elif self.v_ld:
            self.v_cv = self.v_pv
        self.v_qu, self.v_qd = self.v_cv >= self.v_pv, self.v_cv <= 0


def _block(name: str, python: str, inputs: dict[str, Type], outputs: dict[str, Type]) -> BlockType:
    members = {n.lower(): Member(n, t, t.initial, "VAR_INPUT") for n, t in inputs.items()}
    members |= {n.lower(): Member(n, t, t.initial, "VAR_OUTPUT") for n, t in outputs.items()}
    return BlockType(name, "block", members=members, python=python, standard=True)


_TIMER: tuple[dict[str, Type], dict[str, Type]] = {"IN": BOOL, "PT": TIME}, {"Q": BOOL, "ET": TIME}

STANDARD: dict[str, BlockType] = {
    **{name: _block(name, f"_{name}", *_TIMER) for name in ("TON", "TOF", "TP")},
    **{name: _block(name, f"_{name}", {"CLK": BOOL}, {"Q": BOOL}) for name in ("R_TRIG", "F_TRIG")},
    "SR": _block("SR", "_SR", {"S1": BOOL, "R": BOOL}, {"Q1": BOOL}),
    "RS": _block("RS", "_RS", {"S": BOOL, "R1": BOOL}, {"Q1": BOOL}),
}
"""Block types by name."""

CLASSES: dict[str, Any] = {f"_{one.__name__}": one for one in (TON, TOF, TP, R_TRIG, F_TRIG, SR, RS)}
"""Classes by their names in the code."""


for _suffix, _type in (
    ("", INT),
    ("_INT", INT),
    ("_DINT", DINT),
    ("_LINT", LINT),
    ("_UDINT", UDINT),
    ("_ULINT", ULINT),
):
    for _counter, _in, _out in (
        (CTU, {"CU": BOOL, "R": BOOL, "PV": _type}, {"Q": BOOL, "CV": _type}),
        (CTD, {"CD": BOOL, "LD": BOOL, "PV": _type}, {"Q": BOOL, "CV": _type}),
        (
            CTUD,
            {"CU": BOOL, "CD": BOOL, "R": BOOL, "LD": BOOL, "PV": _type},
            {"QU": BOOL, "QD": BOOL, "CV": _type},
        ),
    ):
        _name = f"{_counter.__name__}{_suffix}"
        STANDARD[_name] = _block(_name, f"_{_name}", _in, _out)
        CLASSES[f"_{_name}"] = partial(_counter, _type.low, _type.high)


def _renamed(block: BlockType, names: dict[str, str]) -> BlockType:
    """Return a block with other names of inputs, and with WORD in place of INT."""
    members = {}
    for one in block.members.values():
        name, kind = names.get(one.name, one.name), WORD if one.type == INT else one.type
        members[name.lower()] = replace(one, name=name, type=kind, python=one.slot)
    counts = any(one.type == WORD for one in members.values())
    return replace(block, members=members, python=f"{block.python}_WORD" if counts else block.python)


CODESYS: dict[str, BlockType] = {
    name: _renamed(STANDARD[name], names)
    for name, names in {
        "SR": {"S1": "SET1", "R": "RESET"},
        "RS": {"S": "SET", "R1": "RESET1"},
        "CTU": {"R": "RESET"},
        "CTD": {"LD": "LOAD"},
        "CTUD": {"R": "RESET", "LD": "LOAD"},
    }.items()
}
"""Block types by name, as the library Standard of CODESYS and Tc2_Standard of TwinCAT declare them."""
CLASSES |= {f"_{one.__name__}_WORD": partial(one, WORD.low, WORD.high) for one in (CTU, CTD, CTUD)}
