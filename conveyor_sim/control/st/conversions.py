# SPDX-License-Identifier: Apache-2.0
"""X_TO_Y, TO_Y and TRUNC: every conversion of elementary types that there is, by the standard where it says how.

Whole numbers and bit strings keep their lowest bits; reals become the nearest whole number, of two the even one, and
stop the program where the type has none. A DWORD is the bits of a REAL, an LWORD those of an LREAL. A TIME is a number
of milliseconds and an LTIME a number of nanoseconds, as in CODESYS and TwinCAT; the standard leaves this open.
`date_arithmetic.py` converts dates and times of day.
"""

from __future__ import annotations

import math
import re
import struct
from dataclasses import replace
from typing import Any

from conveyor_sim.control.st.date_arithmetic import conversion_code
from conveyor_sim.control.st.dates import PREFIXES, in_dialect, moment
from conveyor_sim.control.st.dialect import Dialect
from conveyor_sim.control.st.errors import Fault, Position, SourceError
from conveyor_sim.control.st.implicit import as_number
from conveyor_sim.control.st.literals import duration, long_time_text, time_text
from conveyor_sim.control.st.types import (
    DINT,
    DWORD,
    ELEMENTARY,
    LREAL,
    LTIME,
    LWORD,
    REAL,
    STRING,
    TIME,
    Enumeration,
    Moment,
    String,
    Type,
    single,
)
from conveyor_sim.control.st.values import NAMESPACE, Value, converted, described, folded

_UNITS = {TIME: 1_000_000, LTIME: 1}
"""Nanoseconds per unit of a number."""
_BASES = {"2": 2, "8": 8, "16": 16}
_DURATION = re.compile("L?T(IME)?#", re.IGNORECASE)
_NAME = re.compile(r"(?:(\w+?)_)?(TO|TRUNC)_(\w+)")


def conversion(name: str, hint: Type | None) -> tuple[Type | None, Type, bool] | None:
    """Return the source type (None: any) and target type of a conversion, and whether it truncates; None if unknown."""
    if name.upper() == "TRUNC":
        return None, hint.base if hint is not None and hint.base.kind == "int" else DINT, True
    if not (match := _NAME.fullmatch(name.upper())):
        return None
    source, word, target = match.groups()
    if target not in ELEMENTARY or (source is not None and source not in ELEMENTARY):
        return None
    return ELEMENTARY[source] if source else None, ELEMENTARY[target], word == "TRUNC"


def convert(at: Position, name: str, value: Value, hint: Type | None, dialect: Dialect) -> Value:
    """Compile a call of a conversion function."""
    types = conversion(name, hint)
    assert types is not None
    source, target, cut = types
    target, value = in_dialect(target, dialect), replace(value, type=in_dialect(value.type, dialect))
    if source is not None:
        source = in_dialect(source, dialect)
        into = replace(source, high=value.type.high) if isinstance(source, String) else source
        argument = converted(value, into, name)
        known = value.constant
        if source.kind == "int" and known is not None:
            known = source.wrap(known)
        value = Value(at, value.type if isinstance(source, String) else source, argument, known)
    elif value.literal:
        value = Value(at, value.type, value.code, value.constant)
    if target.kind == "real":
        value = as_number(value, dialect)
    into = as_number(Value(at, target, ""), dialect).type if value.type.base.kind == "real" else target
    code = _cut(value, into) if cut else _code(value, into)
    if code is None:
        raise SourceError(
            at, f"found {name} of {described(value)}, which is no conversion, expected one of the standard"
        )
    if isinstance(target, String) and isinstance(value.type, String):
        target = replace(target, high=value.type.high)  # nothing is lost between STRING and WSTRING
    return folded(Value(at, target, code), value)


def _cut(value: Value, target: Type) -> str | None:
    if value.type.base.kind != "real" or target.kind != "int":
        return None
    return f"_truncated({value.code}, {target.low}, {target.high})"


def _code(value: Value, target: Type) -> str | None:
    source, code = value.type.base, value.code
    if (source == target and source.kind != "int") or source.kind == target.kind == "string":
        return code
    if isinstance(target, String):
        return _to_text(source, code)
    if source.kind == "string":
        return f"_parsed({code}, {target.name!r})"
    if source.kind == "enum" or source.kind == "bool":
        code = f"int({code})" if source.kind == "bool" else code
    if target.kind == "bool":
        return f"({code} != 0)"
    if "date" in (source.kind, target.kind):
        return conversion_code(source, code, target)
    if source.kind == "real":
        return _from_real(source, code, target)
    if target.kind == "real":
        if source.kind == "bits":
            pairs = {(DWORD, REAL): "_from_dword", (LWORD, LREAL): "_from_lword"}
            return f"{pairs[source, target]}({code})" if (source, target) in pairs else None
        number = f"{code} / {_UNITS[source]}.0" if source.kind == "time" else code
        return f"_single({number})" if target == REAL else f"float({number})"
    if source.kind == target.kind == "time":
        return code
    if target.kind == "time":
        return target.wrapped(f"{code} * {_UNITS[target]}")
    if source.kind == "time":
        return target.wrapped(f"_divide({code}, {_UNITS[source]})")
    low, high = value.bounds if source.kind == "int" else (source.low, source.high)
    return code if target.low <= low and high <= target.high else target.wrapped(code)


def _from_real(source: Type, code: str, target: Type) -> str | None:
    if target.kind == "bits":
        pairs = {(REAL, DWORD): "_to_dword", (LREAL, LWORD): "_to_lword"}
        return f"{pairs[source, target]}({code})" if (source, target) in pairs else None
    if target.kind == "real":
        return f"_single({code})" if target == REAL else code
    if target.kind == "time":
        return f"_nearest({code} * {_UNITS[target]}, {target.low}, {target.high})"
    return f"_nearest({code}, {target.low}, {target.high})"


def _to_text(source: Type, code: str) -> str | None:
    if isinstance(source, Enumeration):
        return f"dict({ {value: name[: STRING.high] for name, value in source.values}!r}).get({code}, '')"
    if isinstance(source, Moment):
        return f"_moment_text({code}, {source.name!r})"
    names = {"bool": "_bool_text", "int": "str", "bits": "str", "time": "_time_text", "real": "repr"}
    name = {REAL: "_single_text", LTIME: "_long_time_text"}.get(source) or names.get(source.kind)
    return f"{name}({code})" if name else None


def _bool_text(value: bool) -> str:
    return "TRUE" if value else "FALSE"


def _single_text(value: float) -> str:
    """Return the shortest text that reads as the same REAL."""
    texts = (f"{value:.{digits}g}" for digits in range(1, 10))
    return repr(float(next((text for text in texts if single(float(text)) == value), repr(value))))


def _parsed(text: str, name: str) -> Any:
    """Return a text as a number. Raise Fault."""
    target, plain = ELEMENTARY[name], text.strip().replace("_", "")
    try:
        if target.kind == "bool":
            return {"TRUE": True, "FALSE": False, "1": True, "0": False}[plain.upper()]
        if target.kind == "real":
            number = single(float(plain)) if target == REAL else float(plain)
            if math.isfinite(number):
                return number
        if target.kind in ("int", "bits"):
            base, hash_, digits = plain.partition("#")
            whole = int(digits, _BASES[base]) if hash_ else int(plain)
            if target.low <= whole <= target.high:
                return whole
        if target.kind == "time" and _DURATION.match(plain):
            return duration(Position(1, 1), plain)
        if isinstance(target, Moment) and PREFIXES[plain.partition("#")[0].upper()].part == target.part:
            return moment(Position(1, 1), plain)
    except (ValueError, KeyError, SourceError):
        pass
    raise Fault(f"STRING_TO_{name}: found {text[:40]!r}, expected {name}")


def _bits(packed: str, unpacked: str) -> Any:
    return lambda value: struct.unpack(unpacked, struct.pack(packed, value))[0]


NAMESPACE.update(
    _parsed=_parsed,
    _bool_text=_bool_text,
    _single_text=_single_text,
    _time_text=time_text,
    _long_time_text=long_time_text,
    _from_dword=_bits("<I", "<f"),
    _from_lword=_bits("<Q", "<d"),
    _to_dword=_bits("<f", "<I"),
    _to_lword=_bits("<d", "<Q"),
)
