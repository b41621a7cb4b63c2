# SPDX-License-Identifier: Apache-2.0
"""Parts of bit strings and integers: bits (w.3, w.%X3), bytes (%B), words (%W) and double words (%D).

Source: IEC 61131-3:2013, 6.5.3.3 (partial access). Integers are in two's complement.
"""

from __future__ import annotations

from conveyor_sim.control.st import tree
from conveyor_sim.control.st.dialect import Dialect
from conveyor_sim.control.st.errors import SourceError
from conveyor_sim.control.st.types import BOOL, BYTE, DWORD, LWORD, WORD, Subrange, Type
from conveyor_sim.control.st.values import Place

_TYPES = {1: BOOL, 8: BYTE, 16: WORD, 32: DWORD, 64: LWORD}
"""Types of parts by their number of bits."""


def part(base: Place, node: tree.Bit, dialect: Dialect) -> Place:
    """Return a part of a variable. Raise SourceError."""
    kind, size = base.type.base, node.size
    written = f"bit {node.number}" if size == 1 else f"%{_TYPES[size].name[0]}{node.number}"
    found, expected = f"{written} of {kind.name}", "BYTE, WORD, DWORD or LWORD before it"
    if kind.kind == "int":
        dialect.require("integer_bits", node.at, found, expected)
    elif kind.kind != "bits":
        raise SourceError(node.at, f"found {found}, expected {expected}")
    count = kind.width // size
    if not 0 <= node.number < count or count < 2:
        numbers = f"0 to {count - 1}" if count > 1 else "a smaller part"
        raise SourceError(node.at, f"found {found}, expected {numbers}")
    shift, fixed = node.number * size, base.fixed
    if isinstance(base.type, Subrange):
        fixed = fixed or f"{written} of a subrange"
    elif not base.reference:
        fixed = fixed or f"{written} of a part"
    return Place(
        node.at,
        _TYPES[size],
        _read(base.code, shift, size),
        write=lambda new: _written(base, kind, shift, size, new),
        fixed=fixed,
        lacks=base.lacks,
        root=base.root,
    )


def _read(code: str, shift: int, size: int) -> str:
    if size == 1:
        return f"({code} & {1 << shift} != 0)"
    return f"({f'{code} >> {shift}' if shift else code} & {(1 << size) - 1})"


def _written(base: Place, kind: Type, shift: int, size: int, new: str) -> str:
    """Return the code that writes a part. Calls in the code of the base are made once."""
    once = "(" in base.code
    if size == 1:
        # The highest bit of a signed number is negative.
        bit, rest = 1 << shift, ~(1 << shift) if kind.low else kind.high - (1 << shift)
        if kind.low and shift == kind.width - 1:
            bit, rest = -bit, bit - 1
        if once:
            return f"_set_bit({base.reference}, {bit}, {rest}, {new})"
        return base.write(f"{base.code} | {bit} if {new} else {base.code} & {rest}")
    mask = (1 << size) - 1 << shift
    value = f"({new}) << {shift}" if shift else new
    if once:
        return f"_set_part({base.reference}, {~mask}, {value}, {kind.low}, {kind.high})"
    code = f"({base.code} & {~mask} | {value})"
    return base.write(kind.wrapped(code) if kind.low else code)
