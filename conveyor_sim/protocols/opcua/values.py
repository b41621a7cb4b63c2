# SPDX-License-Identifier: Apache-2.0
"""Values of tags in OPC UA: types, units, status codes."""

from __future__ import annotations

import math
from collections.abc import Sequence

from asyncua import ua

from conveyor_sim.line.run_state import ENDED, PAUSED, STOPPED
from conveyor_sim.line.tag import LONGEST, MOST_COUNT, Tag
from conveyor_sim.protocols.tags.tag_provider import LineSnapshot
from conveyor_sim.support.nice_numbers import nice_above

_WHOLE = {ua.VariantType.UInt32: (0, 2**32 - 1), ua.VariantType.Int32: (-(2**31), 2**31 - 1)}

_UNITS_URI = "http://www.opcfoundation.org/UA/units/un/cefact"


def type_of(tag: Tag) -> ua.VariantType:
    """Return the type of a tag; counts have 32 bits, which all clients support."""
    if tag.kind == "bool":
        return ua.VariantType.Boolean
    if tag.kind == "number":
        return ua.VariantType.Double
    return ua.VariantType.Int32 if tag.low < 0.0 else ua.VariantType.UInt32


def as_variant(tag: Tag, value: float) -> ua.Variant:
    """Return a value of a tag, clipped to the range of its type; NaN as an integer is 0."""
    kind = type_of(tag)
    if kind is ua.VariantType.Boolean:
        return ua.Variant(value != 0.0, kind)
    if kind is ua.VariantType.Double:
        return ua.Variant(float(value), kind)
    low, high = _WHOLE[kind]
    whole = 0 if math.isnan(value) else int(min(float(high), max(float(low), value)))
    return ua.Variant(whole, kind)


_DAY = 86_400.0
"""Time that the range of a total spans, s."""

_MOST_WITHOUT_RATE = 1e6
"""End of the range of counters on a line without machines."""


def counted_in_a_day(tags: Sequence[Tag]) -> float:
    """Return the bottles that the fastest machine of a line handles in a day, rounded up to 1, 2 or 5 times 10^n."""
    rates = [tag.nominal for tag in tags if tag.nominal and tag.unit == "1/s"]
    return nice_above(max(rates) * _DAY) if rates else _MOST_WITHOUT_RATE


def range_of(tag: Tag, counted: float) -> ua.Range:
    """Return the EURange: the values in normal operation (OPC 10000-8, 5.3.2).

    A counter or total time that grows without limit gets the range of a day. counted: bottles in a day.
    """
    low, high = _WHOLE.get(type_of(tag), (-math.inf, math.inf))
    low, high = max(tag.low, low), min(tag.high, high)
    if tag.low >= 0.0 and tag.kind == "count" and tag.high >= MOST_COUNT:
        high = counted
    if tag.low >= 0.0 and tag.unit == "s" and tag.high >= LONGEST:
        high = _DAY
    return ua.Range(low, high)


def unit_of(tag: Tag) -> ua.EUInformation:
    """Return the EngineeringUnits: the characters of the UNECE code, base 256 (OPC 10000-8, 5.6.4.4)."""
    number = int.from_bytes(tag.unece.code.encode("ascii"), "big")
    text = "" if tag.unit == "1" else tag.unit
    return ua.EUInformation(_UNITS_URI, number, ua.LocalizedText(text), ua.LocalizedText(tag.unece.name))


def status_of(snapshot: LineSnapshot) -> int:
    """Return the status code of all values of a line. If it is Good, forced signals have GoodLocalOverride instead."""
    if snapshot.lost:
        return ua.StatusCodes.BadNoCommunication
    if snapshot.run.state in (ENDED, STOPPED):
        return ua.StatusCodes.BadOutOfService
    if snapshot.run.state == PAUSED:
        return ua.StatusCodes.UncertainLastUsableValue
    return ua.StatusCodes.Good
