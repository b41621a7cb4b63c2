# SPDX-License-Identifier: Apache-2.0
"""Functions of times, dates and times of day (IEC 61131-3:2013, tables 35 and 36)."""

from __future__ import annotations

from conveyor_sim.control.st import tree
from conveyor_sim.control.st.application import Application, Build, Standard, standard
from conveyor_sim.control.st.dates import date_fields, date_of, day_of_week, time_fields, time_of_day
from conveyor_sim.control.st.operations import Attribute, Element
from conveyor_sim.control.st.types import DATE, DT, ELEMENTARY, LDT, LTOD, TOD, USINT, VOID, Type, fits, is_long
from conveyor_sim.control.st.values import NAMESPACE, Place, Value

_DATE, _TIME = "YEAR MONTH DAY", "HOUR MINUTE SECOND MILLISECOND"
_MOST = {"YEAR": 2262, "MONTH": 12, "DAY": 31, "HOUR": 23, "MINUTE": 59, "SECOND": 59, "MILLISECOND": 999}


def _operator(word: str, *types: str) -> Build:
    """Return the compiler of an operator between two values.

    types: of the first one, and of the second one if it is no number.
    """

    def build(call: Application) -> Value:
        for value, name in zip(call.values, types, strict=False):
            if value.literal or not fits(value.type, ELEMENTARY[name]):
                raise call.refuse(value, name)
        empty = tree.Name(call.at, "")
        first, second = call.values
        return call.expressions.binary(tree.Binary(call.at, word, empty, empty), first, second, call.hint)

    return build


def _concat_date_tod(call: Application) -> Value:
    day, time = call.values
    for value, kind in ((day, DATE), (time, TOD)):
        if value.literal or not fits(value.type, kind):
            raise call.refuse(value, kind.name)
    is_wide = "L" in call.name.removeprefix("CONCAT") or is_long(day.type) or is_long(time.type)
    kind = LDT if is_wide else DT
    return call.result(kind.wrapped(f"{day.code} + {time.code}"), kind)


def _concat(python: str, kind: Type) -> Build:
    def build(call: Application) -> Value:
        return call.result(f"{python}({call.name!r}, {', '.join(map(call.whole, call.values))})", kind)

    return build


def _split(python: str, kind: Type) -> Build:
    def build(call: Application) -> Value:
        (value,) = call.values
        if value.literal or not fits(value.type, kind):
            raise call.refuse(value, kind.name)
        codes = [_output(call, name) for name in SPLITS[call.name].outputs]
        return Value(call.at, VOID, f"{python}({', '.join([value.code, *codes])})")

    return build


def _output(call: Application, name: str) -> str:
    """Return the code that passes the variable of an output, None if there is none."""
    place: Place | None = call.outputs.get(name)
    if place is None:
        return "None"
    if place.type.base.kind != "int" or place.type.high < _MOST[name] or not place.reference:
        raise call.refuse(place, f"a variable of an integer type for {name}, up to {_MOST[name]}")
    return place.reference


def _day_of_week(call: Application) -> Value:
    (value,) = call.values
    if value.literal or not fits(value.type, DATE):
        raise call.refuse(value, "DATE")
    kind = call.hint.base if call.hint is not None and call.hint.base.kind == "int" else USINT
    return call.result(f"_day_of_week({value.code})", kind)


def _date_and_time_of(name: str, year: int, month: int, day: int, *time: int) -> int:
    return date_of(name, year, month, day) + time_of_day(name, *time)


def _splitter(*parts: str) -> object:
    """Return the function that writes the fields of a value to references.

    parts: date, time or both.
    """

    def split(value: int, *references: Attribute | Element | None) -> None:
        fields = (*(date_fields(value) if "date" in parts else ()), *(time_fields(value) if "time" in parts else ()))
        for reference, field in zip(references, fields, strict=True):
            if reference is not None:
                reference.set(field)

    return split


_TIMES = ("TIME", "LTIME")
_SUMS = {
    **{f"ADD_{one}": ("+", one, one) for one in _TIMES},
    **{f"SUB_{one}": ("-", one, one) for one in _TIMES},
    **{f"MUL_{one}": ("*", one) for one in _TIMES},
    **{f"DIV_{one}": ("/", one) for one in _TIMES},
    **{f"ADD_{a}_{b}": ("+", a, b) for a, b in (("TOD", "TIME"), ("LTOD", "LTIME"), ("DT", "TIME"), ("LDT", "LTIME"))},
    **{f"SUB_{a}_{b}": ("-", a, b) for a, b in (("TOD", "TIME"), ("LTOD", "LTIME"), ("DT", "TIME"), ("LDT", "LTIME"))},
    **{f"SUB_{one}_{one}": ("-", one, one) for one in ("DATE", "LDATE", "TOD", "LTOD", "DT", "LDT")},
}

SPLITS: dict[str, Standard] = {
    "SPLIT_DATE": standard("IN", _split("_split_date", DATE), _DATE),
    **{f"SPLIT_{one}": standard("IN", _split("_split_time", TOD), _TIME) for one in ("TOD", "LTOD")},
    **{f"SPLIT_{one}": standard("IN", _split("_split_both", DT), f"{_DATE} {_TIME}") for one in ("DT", "LDT")},
}

DATES: dict[str, Standard] = {
    **{name: standard("IN1 IN2", _operator(*how)) for name, how in _SUMS.items()},
    **{f"CONCAT_DATE_{one}": standard("IN1 IN2", _concat_date_tod) for one in ("TOD", "LTOD")},
    "CONCAT_DATE": standard(_DATE, _concat("_date_of", DATE)),
    "CONCAT_TOD": standard(_TIME, _concat("_time_of_day", TOD)),
    "CONCAT_LTOD": standard(_TIME, _concat("_time_of_day", LTOD)),
    "CONCAT_DT": standard(f"{_DATE} {_TIME}", _concat("_date_and_time_of", DT)),
    "CONCAT_LDT": standard(f"{_DATE} {_TIME}", _concat("_date_and_time_of", LDT)),
    **SPLITS,
    "DAY_OF_WEEK": standard("IN", _day_of_week),
}
"""Functions by name."""

NAMESPACE.update(
    _date_of=date_of,
    _time_of_day=time_of_day,
    _date_and_time_of=_date_and_time_of,
    _day_of_week=day_of_week,
    _split_date=_splitter("date"),
    _split_time=_splitter("time"),
    _split_both=_splitter("date", "time"),
)
