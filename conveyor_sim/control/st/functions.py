# SPDX-License-Identifier: Apache-2.0
"""The standard functions (IEC 61131-3:2013, tables 28 to 36): what each takes and gives, and its code."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence

from conveyor_sim.control.st import tree
from conveyor_sim.control.st.application import Application, Build, Standard, standard
from conveyor_sim.control.st.bcd import BCD
from conveyor_sim.control.st.conversions import conversion, convert
from conveyor_sim.control.st.date_functions import DATES
from conveyor_sim.control.st.errors import Position, SourceError
from conveyor_sim.control.st.expressions import Expressions
from conveyor_sim.control.st.implicit import adapted, as_number
from conveyor_sim.control.st.integers import intermediate, reach
from conveyor_sim.control.st.types import (
    BOOL,
    INT,
    LREAL,
    LTIME,
    MOST_CHARACTERS,
    REAL,
    STRING,
    TIME,
    Array,
    String,
    Structure,
    Type,
    fits,
)
from conveyor_sim.control.st.values import Place, Value, converted, described, folded, operand
from conveyor_sim.control.st.work import MANY, MANY_SEARCHED
from conveyor_sim.control.st.work import conversion as conversion_work

_NUMERIC = {"ABS", "SQRT", "LN", "LOG", "EXP", "SIN", "COS", "TAN", "ASIN", "ACOS", "ATAN", "ATAN2", "EXPT"}
"""Functions of numbers only."""


def _real(call: Application) -> Value:
    kind = REAL if REAL in (call.hint, call.values[0].type) else LREAL
    if any(one.type == LREAL and not one.literal for one in call.values):
        kind = LREAL
    for one in call.values:
        if not (one.literal or fits(one.type, kind)):
            raise call.refuse(one, "a REAL or LREAL")
    code = f"_{call.name.lower()}({', '.join(converted(one, kind) for one in call.values)})"
    return call.result(f"_single({code})" if kind == REAL else code, kind)


def _abs(call: Application) -> Value:
    (value,) = call.values
    kind = call.joined([value])
    if kind.kind not in ("int", "real"):
        raise call.refuse(value, "a number")
    code = f"abs({operand(value, kind)})"
    if kind.kind == "real":
        return call.result(code, kind)
    return folded(intermediate(call.at, kind, code, 0, max(map(abs, reach(value, kind)))), value)


def _operator(word: str) -> Build:
    def build(call: Application) -> Value:
        first, *others = call.values
        empty = tree.Name(call.at, "")
        for other in others:
            first = call.expressions.binary(tree.Binary(call.at, word, empty, empty), first, other, call.hint)
        return first

    return build


def _compare(call: Application) -> Value:
    kind = call.joined(call.values)
    if isinstance(kind, (Array, Structure)):
        raise call.refuse(call.values[0], "an elementary type")
    codes = [one.code if kind.kind == "string" else operand(one, kind) for one in call.values]
    call.expressions.work += len(codes)
    return call.result(f"_chain(_{call.name.lower()}, {', '.join(codes)})", BOOL)


def _pick(python: str, ordered: bool, before: int = 0) -> Build:
    """Return the compiler of SEL and MUX (`before` arguments, then values of one type), or MAX, MIN and LIMIT.

    ordered: the values need an order.
    """

    def build(call: Application) -> Value:
        choice, values = call.values[:before], call.values[before:]
        kind = call.joined(values)
        if ordered and (isinstance(kind, (Array, Structure)) or kind == BOOL):
            raise call.refuse(values[0], "numbers, times or texts")
        codes = [one.code if kind.kind == "string" else operand(one, kind) for one in values]
        if kind.kind == "string":
            kind = STRING if not call.values else max((one.type for one in values), key=lambda one: one.high)
        if python == "SEL":
            code = f"_sel({converted(choice[0], BOOL, 'G of SEL')}, {', '.join(codes)})"
        else:
            code = f"{python}({', '.join([*(call.whole(one) for one in choice), *codes])})"
        return call.result(code, kind, values)

    return build


def _shift(call: Application) -> Value:
    value, by = call.values
    kind = value.type.base
    if kind.kind == "int" and not value.literal and call.expressions.scope.names.dialect.integer_logic:
        code = f"_shift_signed({converted(value, kind)}, {call.whole(by)}, {kind.width}, {call.name!r})"
        return call.result(code if kind.low else code.replace("_signed", ""), kind)
    if value.literal and call.hint is not None:
        kind = call.hint.base
    if kind.kind != "bits":
        raise call.refuse(value, "BYTE, WORD, DWORD or LWORD")
    code = converted(value, kind)
    return call.result(f"_shift({code}, {call.whole(by)}, {kind.width}, {call.name!r})", kind)


def _texts(parameters: str, result: str) -> Build:
    """Return the compiler of a text function.

    parameters: s for a text, n for a whole number. result: s for a text of the first one's length, n for a number.
    """

    def build(call: Application) -> Value:
        letters = parameters if len(parameters) >= len(call.values) else parameters[0] * len(call.values)
        codes = [
            call.text(one) if letter == "s" else call.whole(one)
            for letter, one in zip(letters, call.values, strict=True)
        ]
        python = "len" if call.name == "LEN" else f"_{call.name.lower()}"
        grows = call.name in ("CONCAT", "INSERT", "REPLACE")
        texts = [one.type for one in call.values if one.type.kind == "string"]
        if result != "n" or len(texts) > 1:
            python += "_counted" if sum(one.high for one in texts) > (MANY_SEARCHED if result == "n" else MANY) else ""
        most = sum(one.high for one in texts) if grows else texts[0].high
        longest = min(MOST_CHARACTERS, most)
        kind = INT if result == "n" else String(texts[0].name.partition("[")[0], "string", 0, longest)
        return call.result(f"{python}({', '.join(codes)})", kind)

    return build


def _convert(call: Application, name: str) -> Value:
    (value,) = call.values
    types = conversion(name, call.hint)
    if types is not None and types[0] is not None:
        value = adapted(value, types[0], call.expressions.scope.names)
    result = convert(call.at, name, value, call.hint, call.expressions.scope.names.dialect)
    call.expressions.work += conversion_work(value.type, result.type)
    return result


def _move(call: Application) -> Value:
    return call.values[0]


def _now(call: Application) -> Value:
    return Value(call.at, LTIME if call.name == "LTIME" else TIME, "_rt.now")


FUNCTIONS: dict[str, Standard] = {
    **{
        name: standard("IN", _real)
        for name in ["SQRT", "LN", "LOG", "EXP", "SIN", "COS", "TAN", "ASIN", "ACOS", "ATAN"]
    },
    "ATAN2": standard("Y X", _real),
    "ABS": standard("IN", _abs),
    "EXPT": standard("IN1 IN2", _operator("**")),
    "ADD": standard("IN1 IN2...", _operator("+")),
    "MUL": standard("IN1 IN2...", _operator("*")),
    "SUB": standard("IN1 IN2", _operator("-")),
    "DIV": standard("IN1 IN2", _operator("/")),
    **{name: standard("IN1 IN2...", _operator(name)) for name in ["AND", "OR", "XOR"]},
    "MOD": standard("IN1 IN2", _operator("MOD")),
    "MOVE": standard("IN", _move),
    "SEL": standard("G IN0 IN1", _pick("SEL", False, 1)),
    "MUX": standard("K IN0 IN1...", _pick("_mux", False, 1)),
    "MAX": standard("IN1 IN2...", _pick("max", True)),
    "MIN": standard("IN1 IN2...", _pick("min", True)),
    "LIMIT": standard("MN IN MX", _pick("_limit", True)),
    **{name: standard("IN1 IN2...", _compare) for name in ["GT", "GE", "EQ", "LE", "LT"]},
    "NE": standard("IN1 IN2", _operator("<>")),
    **{name: standard("IN N", _shift) for name in ["SHL", "SHR", "ROL", "ROR"]},
    "LEN": standard("IN", _texts("s", "n")),
    "LEFT": standard("IN L", _texts("sn", "s")),
    "RIGHT": standard("IN L", _texts("sn", "s")),
    "MID": standard("IN L P", _texts("snn", "s")),
    "CONCAT": standard("IN1 IN2...", _texts("s", "s")),
    "INSERT": standard("IN1 IN2 P", _texts("ssn", "s")),
    "DELETE": standard("IN L P", _texts("snn", "s")),
    "REPLACE": standard("IN1 IN2 L P", _texts("ssnn", "s")),
    "FIND": standard("IN1 IN2", _texts("ss", "n")),
    "TIME": standard("", _now),
    "LTIME": standard("", _now),
    **DATES,
    **BCD,
}
"""Standard functions by name."""


def is_standard(name: str) -> bool:
    """Return True if there is a standard function of a name."""
    return name.upper() in FUNCTIONS or conversion(name, None) is not None


def function_of(name: str) -> Standard:
    """Return a standard function, or a conversion."""
    return FUNCTIONS.get(name.upper()) or standard("IN", lambda call: _convert(call, name))


def apply(
    at: Position,
    name: str,
    given: Sequence[tuple[str | None, Value]],
    expressions: Expressions,
    hint: Type | None,
    outputs: Mapping[str, Place],
) -> Value:
    """Compile a call of a standard function, with values by position or by name. Raise SourceError.

    outputs: variables by the names of the function's outputs.
    """
    function = function_of(name)
    plain = tuple(one.removesuffix("...") for one in function.parameters)
    more = plain != function.parameters
    if given and given[0][0] is not None:
        values = _by_name(at, name, given, plain, more)
    else:
        values = [value for _, value in given]
    if len(values) < len(plain) or (len(values) > len(plain) and not more):
        expected = f"{len(plain)}{' or more' if more else ''}: {', '.join(plain)}" if plain else "none"
        raise SourceError(at, f"found {len(values)} arguments of {name}, expected {expected}")
    expressions.work += 1
    kinds = {one.type.base.kind for one in values if not one.literal} - {"bool"}  # G of SEL
    if name.upper() in _NUMERIC or (len(kinds) > 1 and kinds <= {"bits", "int", "real", "enum"}):
        values = [as_number(one, expressions.scope.names.dialect) for one in values]
    for one in values:
        if one.type.kind in ("block", "void"):
            raise SourceError(one.at, f"found {described(one)} in {name}, expected a value")
    return function.build(Application(at, name.upper(), values, expressions, hint, outputs))


def _by_name(
    at: Position, name: str, given: Sequence[tuple[str | None, Value]], plain: tuple[str, ...], more: bool
) -> list[Value]:
    by_name = {str(word).upper(): value for word, value in given}
    names = list(plain)
    if more:
        stem, start = re.fullmatch(r"([A-Z]+)(\d+)", plain[-1]).groups()  # type: ignore[union-attr]
        names += [f"{stem}{number}" for number in range(int(start) + 1, int(start) + len(given))]
    for word, _ in given:
        if str(word).upper() not in names:
            raise SourceError(at, f"found {word} of {name}, expected {', '.join(plain)}")
    if len(by_name) != len(given):
        raise SourceError(at, f"found an argument of {name} twice, expected each once")
    return [by_name[word] for word in names if word in by_name]
