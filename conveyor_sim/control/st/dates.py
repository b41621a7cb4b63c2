# SPDX-License-Identifier: Apache-2.0
"""Dates and times of day: literals, texts, and the calendar (IEC 61131-3:2013, 6.3.4 and tables 35 and 36).

A DATE and a DT are whole ns since 1970-01-01, a TOD is whole ns since midnight. No time zone is implied.
"""

from __future__ import annotations

import re
from dataclasses import replace
from datetime import date

from conveyor_sim.control.st.dialect import Dialect
from conveyor_sim.control.st.errors import Fault, Position, SourceError
from conveyor_sim.control.st.types import DATE, DT, LDATE, LDT, LTOD, TOD, Moment, Type

DAY = 86_400_000_000_000
"""Nanoseconds of a day."""

_FIRST = -(2**63 // DAY)
_EPOCH = date(1970, 1, 1).toordinal()
_SHORT = {"DATE": "D", "LDATE": "LD"}
"""Names of types as texts have them, where they differ."""

PREFIXES: dict[str, Moment] = {
    **dict.fromkeys(("D", "DATE"), DATE),
    **dict.fromkeys(("LD", "LDATE"), LDATE),
    **dict.fromkeys(("TOD", "TIME_OF_DAY"), TOD),
    **dict.fromkeys(("LTOD", "LTIME_OF_DAY"), LTOD),
    **dict.fromkeys(("DT", "DATE_AND_TIME"), DT),
    **dict.fromkeys(("LDT", "LDATE_AND_TIME"), LDT),
}
"""Types by the words before # in a literal."""

_DATE, _TIME = r"(?P<year>\d+)-(?P<month>\d+)-(?P<day>\d+)", r"(?P<hour>\d+):(?P<minute>\d+)(?::(?P<second>[\d.]+))?"
_FORMS = {
    "DATE": (re.compile(_DATE, re.ASCII), "D#2024-02-29"),
    "TOD": (re.compile(_TIME, re.ASCII), "TOD#23:59:59.999"),
    "DT": (re.compile(f"{_DATE}-{_TIME}", re.ASCII), "DT#2024-02-29-23:59:59"),
}
_LONGEST = 60
"""Largest number of characters of a literal."""
_SECONDS = re.compile(r"(\d{1,2})(?:\.(\d{1,9}))?", re.ASCII)


def moment(at: Position, text: str) -> int:
    """Return the value of D#2024-02-29, TOD#15:36:55.36 or DT#2024-02-29-15:36. Raise SourceError."""
    word, _, digits = text.partition("#")
    part = PREFIXES[word.upper()].part
    form, _ = _FORMS[part]
    match = form.fullmatch(digits.replace("_", "")) if len(digits) <= _LONGEST else None
    try:
        if match is not None:
            fields = match.groupdict()
            days = _days(*(int(fields[name]) for name in ("year", "month", "day"))) if "year" in fields else 0
            return days + _of_day(fields) if "hour" in fields else days
    except (ValueError, OverflowError):
        pass
    years = "" if part == "TOD" else ", 1678 to 2261"
    raise SourceError(at, f"found {text[:_LONGEST]}, expected {expected_literal(part)}{years}")


def in_dialect(kind: Type, dialect: Dialect) -> Type:
    """Return a type with the begin and the unit of dates in a dialect (S7-1200 System Manual, 5.4.4)."""
    if not dialect.dates_of_1990 or kind.base not in (DATE, DT):
        return kind
    begin = _days(1990, 1, 1)
    return replace(DATE, start=str(begin), unit=DAY, zero=begin) if kind.base == DATE else replace(DT, start=str(begin))


def expected_literal(part: str) -> str:
    """Return a description of a literal, with an example."""
    what = {"DATE": "a date", "TOD": "a time of day", "DT": "a date and a time of day"}[part]
    return f"{what} such as {_FORMS[part][1]}"


def _days(year: int, month: int, day: int) -> int:
    """Return a day as ns since 1970. Raise ValueError for one that does not exist."""
    if not 1678 <= year <= 2261:
        raise ValueError
    return (date(year, month, day).toordinal() - _EPOCH) * DAY


def _of_day(fields: dict[str, str | None]) -> int:
    match = _SECONDS.fullmatch(fields["second"] or "0")
    hour, minute = int(fields["hour"] or 0), int(fields["minute"] or 0)
    if match is None or hour > 23 or minute > 59 or int(match[1]) > 59:
        raise ValueError
    return ((hour * 60 + minute) * 60 + int(match[1])) * 1_000_000_000 + int((match[2] or "").ljust(9, "0"))


def moment_text(value: int, kind: str) -> str:
    """Return a value as a literal.

    kind: name of its type.
    """
    part = kind.removeprefix("L")
    texts = []
    if part != "TOD":
        texts.append(_civil(value).isoformat())
    if part != "DATE":
        second, rest = divmod(value % DAY, 1_000_000_000)
        fraction = f".{rest:09}".rstrip("0") if rest else ""
        texts.append(f"{second // 3600:02}:{second // 60 % 60:02}:{second % 60:02}{fraction}")
    return f"{_SHORT.get(kind, kind)}#{'-'.join(texts)}"


def _civil(value: int) -> date:
    return date.fromordinal(value // DAY + _EPOCH)


def date_of(name: str, year: int, month: int, day: int) -> int:
    """Return the DATE of a year, a month and a day. Raise Fault for one that does not exist.

    name: of the calling function, for the message.
    """
    try:
        return _days(year, month, day)
    except (ValueError, OverflowError):
        raise Fault(f"{name}: found {year}-{month}-{day}, expected a date from 1678-1-1 to 2261-12-31") from None


def time_of_day(name: str, hour: int, minute: int, second: int, millisecond: int) -> int:
    """Return the TOD of hours, minutes, seconds and milliseconds. Raise Fault for values that no day has."""
    if not (0 <= hour < 24 and 0 <= minute < 60 and 0 <= second < 60 and 0 <= millisecond < 1000):
        found = f"{hour}:{minute}:{second} and {millisecond} ms"
        raise Fault(f"{name}: found {found}, expected a time from 0:0:0 to 23:59:59 and 0 to 999 ms")
    return (((hour * 60 + minute) * 60 + second) * 1000 + millisecond) * 1_000_000


def midnight(value: int) -> int:
    """Return the begin of a day, or of the first whole one that 64 bits hold."""
    return max(value // DAY, _FIRST) * DAY


def date_fields(value: int) -> tuple[int, int, int]:
    """Return year, month and day."""
    day = _civil(value)
    return day.year, day.month, day.day


def time_fields(value: int) -> tuple[int, int, int, int]:
    """Return hour, minute, second and millisecond."""
    milliseconds = value % DAY // 1_000_000
    return milliseconds // 3_600_000, milliseconds // 60_000 % 60, milliseconds // 1000 % 60, milliseconds % 1000


def day_of_week(value: int) -> int:
    """Return 0 for Sunday to 6 for Saturday."""
    return (value // DAY + 4) % 7  # 1970-01-01 was a Thursday
