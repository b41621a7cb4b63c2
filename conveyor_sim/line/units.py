"""Units of tags, and their codes in UNECE Recommendation 20, which OPC UA and other systems know them by."""

from collections.abc import Mapping
from typing import NamedTuple


class Unit(NamedTuple):
    """A unit."""

    code: str
    """The common code of UNECE Recommendation 20."""
    name: str
    """As it is called there."""


UNITS: Mapping[str, Unit] = {
    "1": Unit("C62", "one"),
    "m": Unit("MTR", "metre"),
    "m/s": Unit("MTS", "metre per second"),
    "s": Unit("SEC", "second"),
    "Hz": Unit("HTZ", "hertz"),
    "1/s": Unit("C97", "reciprocal second"),
    "1/min": Unit("C94", "reciprocal minute"),
    "1/h": Unit("H10", "reciprocal hour"),
    "1/m^2": Unit("C93", "reciprocal square metre"),
    "N": Unit("NEW", "newton"),
    "J": Unit("JOU", "joule"),
    "%": Unit("P1", "percent"),
}
"""By how a tag writes them."""
