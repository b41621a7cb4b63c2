# SPDX-License-Identifier: Apache-2.0
"""Units of the texts in a scene file, and the dimensions that they measure.

An angle is a separate dimension, so that degrees can't pass for a plain number. `pint` would do the same, but its
import and registry take 0.23 s of CPU, more than reading a scene of 100 conveyors.
"""

from collections.abc import Mapping
from fractions import Fraction
from typing import NamedTuple


class Dimension(NamedTuple):
    """Exponents of metre, kilogram, second and radian. Laws of springs have halves among them."""

    length: float = 0.0
    mass: float = 0.0
    time: float = 0.0
    angle: float = 0.0

    def times(self, other: "Dimension", exponent: float = 1.0) -> "Dimension":
        """Return the dimension of a product with a power of another quantity."""
        return Dimension(*(mine + exponent * its for mine, its in zip(self, other, strict=True)))

    def __str__(self) -> str:
        """Return the dimension in words: `a speed`, or its SI unit: `m^2/s`."""
        if self in _NOUNS:
            return _NOUNS[self].noun
        powers = list(zip(("m", "kg", "s", "rad"), self, strict=True))
        above = " ".join(_power(unit, exponent) for unit, exponent in powers if exponent > 0.0)
        below = "".join(f"/{_power(unit, -exponent)}" for unit, exponent in powers if exponent < 0.0)
        return f"a quantity in {above or '1'}{below}"

    @property
    def example(self) -> str:
        """Text of such a quantity; "" without one."""
        return _NOUNS[self].example if self in _NOUNS else ""


class _Noun(NamedTuple):
    noun: str
    example: str


class Unit(NamedTuple):
    """A unit: `factor` times pi to the power of `pis`, in SI units."""

    factor: Fraction
    dimension: Dimension
    pis: int = 0


NONE = Dimension()
LENGTH, MASS, TIME, ANGLE = Dimension(length=1), Dimension(mass=1), Dimension(time=1), Dimension(angle=1)
_FORCE = Dimension(1, 1, -2)
_PRESSURE = Dimension(-1, 1, -2)
_ENERGY = Dimension(2, 1, -2)

_NOUNS: Mapping[Dimension, _Noun] = {
    NONE: _Noun("a quantity without dimension", ""),
    LENGTH: _Noun("a length", "33 mm"),
    MASS: _Noun("a mass", "350 g"),
    TIME: _Noun("a time", "250 ms"),
    ANGLE: _Noun("an angle", "90 deg"),
    Dimension(1, 0, -1): _Noun("a speed", "0.2 m/s"),
    Dimension(1, 0, -2): _Noun("an acceleration", "0.5 m/s^2"),
    Dimension(1, 0, -3): _Noun("a jerk", "5 m/s^3"),
    Dimension(0, 0, -1): _Noun("a rate", "24 000 /h"),
    Dimension(0, 0, -1, 1): _Noun("an angular speed", "90 deg/s"),
    Dimension(0, 0, -2, 1): _Noun("an angular acceleration", "360 deg/s^2"),
    _FORCE: _Noun("a force", "2 kN"),
    Dimension(0, 1, -2): _Noun("a stiffness", "5 kN/m"),
    _ENERGY: _Noun("a torque or an energy", "15 N m"),
    _PRESSURE: _Noun("a pressure", "6 bar"),
    Dimension(2, 1): _Noun("a moment of inertia", "0.02 kg m^2"),
    Dimension(0, 1, -1): _Noun("a damping coefficient", "3 kg/s"),
    Dimension(-1): _Noun("a number per length", "2000 /m"),
    Dimension(2): _Noun("an area", "0.5 m^2"),
}

UNITS: Mapping[str, Unit] = {
    "m": Unit(Fraction(1), LENGTH),
    "km": Unit(Fraction(1000), LENGTH),
    "cm": Unit(Fraction(1, 100), LENGTH),
    "mm": Unit(Fraction(1, 1000), LENGTH),
    **dict.fromkeys(("um", "\u00b5m", "\u03bcm"), Unit(Fraction(1, 10**6), LENGTH)),
    "in": Unit(Fraction(254, 10**4), LENGTH),
    "ft": Unit(Fraction(3048, 10**4), LENGTH),
    "kg": Unit(Fraction(1), MASS),
    "g": Unit(Fraction(1, 1000), MASS),
    "t": Unit(Fraction(1000), MASS),
    "s": Unit(Fraction(1), TIME),
    "ms": Unit(Fraction(1, 1000), TIME),
    **dict.fromkeys(("us", "\u00b5s", "\u03bcs"), Unit(Fraction(1, 10**6), TIME)),
    "min": Unit(Fraction(60), TIME),
    "h": Unit(Fraction(3600), TIME),
    "rad": Unit(Fraction(1), ANGLE),
    **dict.fromkeys(("deg", "\u00b0"), Unit(Fraction(1, 180), ANGLE, pis=1)),
    "Hz": Unit(Fraction(1), Dimension(time=-1)),
    "N": Unit(Fraction(1), _FORCE),
    "kN": Unit(Fraction(1000), _FORCE),
    "Pa": Unit(Fraction(1), _PRESSURE),
    "bar": Unit(Fraction(10**5), _PRESSURE),
    "J": Unit(Fraction(1), _ENERGY),
    "mJ": Unit(Fraction(1, 1000), _ENERGY),
    "%": Unit(Fraction(1, 100), NONE),
}
"""Units by the names in texts. A parameter of a scene can't have such a name."""


def _power(unit: str, exponent: float) -> str:
    return unit if exponent == 1.0 else f"{unit}^{exponent:g}"
