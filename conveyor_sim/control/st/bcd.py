# SPDX-License-Identifier: Apache-2.0
"""Conversions between numbers and bit strings of decimal digits, four bits each (IEC 61131-3:2013, table 24).

A value that can't be converted stops the program. In CODESYS, BCD_TO_INT returns -1 and INT_TO_BCD returns 255 instead
(library Util). TIA Portal has BCD16 and BCD32, with a sign in the highest four bits.
"""

from __future__ import annotations

import math

from conveyor_sim.control.st.application import Application, Build, Standard, standard
from conveyor_sim.control.st.errors import Fault
from conveyor_sim.control.st.types import BITS, BOOL, BYTE, DINT, DWORD, INT, INTEGERS, WORD, Type
from conveyor_sim.control.st.values import NAMESPACE, Value, converted

_NEGATIVE = 15
"""Sign of a negative number in BCD16 and BCD32; 0 is that of others."""


def _number_of(source: Type | None, target: Type) -> Build:
    """Return the compiler of a conversion of digits to a number. source: None for any bit string."""

    def build(call: Application) -> Value:
        (value,) = call.values
        literal = next((one for one in BITS if value.literal == "int" and value.constant <= one.high), BYTE)
        kind = source or (literal if value.literal else value.type.base)
        if kind not in BITS:
            raise call.refuse(value, "BYTE, WORD, DWORD or LWORD")
        instead = -1 if _is_marked(call) else None
        return call.result(f"_of_bcd({converted(value, kind)}, {call.name!r}, {target.high}, {instead})", target)

    return build


def _digits_of(source: Type | None, target: Type) -> Build:
    """Return the compiler of a conversion of a number to digits. source: None for any integer."""

    def build(call: Application) -> Value:
        (value,) = call.values
        code = call.whole(value) if source is None else converted(value, source)
        instead = target.high if _is_marked(call) else None
        return call.result(f"_to_bcd({code}, {call.name!r}, {target.width // 4}, {instead})", target)

    return build


def _signed(source: Type, target: Type, python: str) -> Build:
    def build(call: Application) -> Value:
        (value,) = call.values
        width = (source if source in BITS else target).width
        return call.result(f"{python}({converted(value, source)}, {call.name!r}, {width // 4 - 1})", target)

    return build


def _is_marked(call: Application) -> bool:
    """Return True if a value that can't be converted does not stop the program."""
    return call.name in ("BCD_TO_INT", "INT_TO_BCD") and call.expressions.scope.names.dialect.bcd_marks


def _number(word: int, name: str, most: int, instead: int | None = None) -> int:
    digits = f"{word:x}"
    if digits.isdecimal() and int(digits) <= most:
        return int(digits)
    if instead is not None:
        return instead
    raise Fault(f"{name}: found 16#{digits.upper()}, expected decimal digits of at most {most}")


def _word(number: int, name: str, digits: int, instead: int | None) -> int:
    if 0 <= number < 10**digits:
        return int(str(number), 16)
    if instead is not None:
        return instead
    raise Fault(f"{name}: found {number}, expected 0 to {10**digits - 1}")


def _signed_number(word: int, name: str, digits: int) -> int:
    sign, rest = word >> 4 * digits, word & (1 << 4 * digits) - 1
    if sign not in (0, _NEGATIVE):
        raise Fault(f"{name}: found the sign 16#{sign:X}, expected 0 or F")
    number = _number(rest, name, 10**digits - 1)
    return -number if sign else number


def _signed_word(number: int, name: str, digits: int) -> int:
    if abs(number) >= 10**digits:
        raise Fault(f"{name}: found {number}, expected {1 - 10**digits} to {10**digits - 1}")
    return int(str(abs(number)), 16) | (_NEGATIVE << 4 * digits if number < 0 else 0)


BCD: dict[str, Standard] = {
    **{f"BCD_TO_{one.name}": standard("IN", _number_of(None, one)) for one in INTEGERS},
    **{f"{b.name}_BCD_TO_{one.name}": standard("IN", _number_of(b, one)) for b in BITS for one in INTEGERS},
    **{f"TO_BCD_{b.name}": standard("IN", _digits_of(None, b)) for b in BITS},
    **{f"{one.name}_TO_BCD_{b.name}": standard("IN", _digits_of(one, b)) for b in BITS for one in INTEGERS},
    "INT_TO_BCD": standard("IN", _digits_of(INT, BYTE)),
    "BCD16_TO_INT": standard("IN", _signed(WORD, INT, "_of_signed_bcd")),
    "BCD32_TO_DINT": standard("IN", _signed(DWORD, DINT, "_of_signed_bcd")),
    "INT_TO_BCD16": standard("IN", _signed(INT, WORD, "_to_signed_bcd")),
    "DINT_TO_BCD32": standard("IN", _signed(DINT, DWORD, "_to_signed_bcd")),
}
"""Functions by name."""


def _is_valid(call: Application) -> Value:
    (value,) = call.values
    if call.name == "IS_VALID_BCD":
        if value.literal or value.type.base not in BITS:
            raise call.refuse(value, "BYTE, WORD, DWORD or LWORD")
        return call.result(f"_is_bcd({value.code})", BOOL)
    if value.literal or value.type.base.kind != "real":
        raise call.refuse(value, "a REAL or LREAL")
    return call.result(f"_isfinite({value.code})", BOOL)


BCD |= {name: standard("IN", _is_valid) for name in ("IS_VALID", "IS_VALID_BCD")}

NAMESPACE.update(_is_bcd=lambda word: f"{word:x}".isdecimal(), _isfinite=math.isfinite)
NAMESPACE.update(_of_bcd=_number, _to_bcd=_word, _of_signed_bcd=_signed_number, _to_signed_bcd=_signed_word)
