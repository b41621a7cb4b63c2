# SPDX-License-Identifier: Apache-2.0
"""Texts of quantities in a scene file: `33 mm`, `24 000 /h`, `gap/2 + 5 mm`.

A text is an expression of + - * / and parentheses over numbers, units and parameters. It is computed in exact fractions
and rounded once, so that `33 mm` has the bits of 0.033. An angle in degrees has the bits of `math.radians`.
"""

import difflib
import math
import re
import sys
from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction
from functools import lru_cache
from typing import Any, NamedTuple

from conveyor_sim.scene.units import ANGLE, NONE, UNITS, Dimension, Unit

LONGEST = 200
"""Characters of a text. Its evaluation is in proportion to them, apart from the digits of the fractions."""
FULL_TURN = 2.0 * math.pi * (1.0 + 1e-9)
"""Largest angle (rad) that is read from a number without unit. Beyond, degrees may have been meant."""
_MOST_BITS = 256
"""Size of a fraction beyond which it is rounded, so that parameters made of parameters stay small."""
_MOST_PIS = 8  # powers of pi, likewise
_LARGEST_EXPONENT = 6  # of a unit
_LONGEST_NAME = 40  # characters of an unknown name in an error

_SPACE = "[ \u00a0\u2009\u202f]"
_TOKEN = re.compile(
    rf"(?P<number>(?:[0-9]{{1,3}}(?:{_SPACE}[0-9]{{3}})+(?![0-9])|[0-9]+)(?:\.[0-9]*)?(?:[eE][-+]?[0-9]{{1,3}}(?![0-9]))?"
    r"|\.[0-9]+(?:[eE][-+]?[0-9]{1,3}(?![0-9]))?)"
    r"|(?P<name>[A-Za-z\u00b5\u03bc][A-Za-z0-9_]*|[%\u00b0])"
    r"(?P<power>\^[-+]?[0-9](?:\.5)?(?![.0-9A-Za-z_])|[\u00b2\u00b3])?"
    r"|(?P<operator>[-+*/()\u00b7\u00d7\u2212])"
)
_QUOTED = re.compile(r"[-+]?[0-9.]+([eE][-+]?[0-9]+)?")
"""Numbers that YAML reads as texts only if they are quoted."""
_BLANKS = re.compile(r"\s*")
_SAME = {"\u00b7": "*", "\u00d7": "*", "\u2212": "-"}
"""Typographic signs and the operators that they stand for."""
_PRECEDENCE = {"+": 1, "-": 1, "*": 2, "/": 2, "neg": 3, "of": 4}
"""Binding of operators; `of` joins a number with its unit, so that `1/2 s` is 1/(2 s)."""


@dataclass(frozen=True)
class Quantity:
    """An exact quantity: `factor` times pi to the power of `pis`, in SI units.

    dimension: None of a number without unit, which takes the unit of its field.
    """

    factor: Fraction
    dimension: Dimension | None = None
    pis: int = 0

    @classmethod
    def of(cls, value: float, dimension: Dimension | None = None) -> "Quantity":
        """Return the quantity of a finite number in SI units, read as the shortest decimal that has its bits."""
        return cls(Fraction(repr(value)) if isinstance(value, float) else Fraction(value), dimension)

    @property
    def value(self) -> float:
        """Value in SI units. Raise ValueError if it is beyond a double."""
        try:
            number = _rounded(self.factor, self.pis)
        except OverflowError:
            number = math.inf
        if math.isinf(number) or (number == 0.0) != (self.factor == 0):
            raise ValueError("a number out of range")
        return number

    def __str__(self) -> str:
        """Return the dimension in words."""
        return "a number without unit" if self.dimension is None else str(self.dimension)


class Scoped(str):
    """A text of a scene with the parameters that are visible where it stands."""

    scope: Mapping[str, Quantity]

    def __new__(cls, text: str, scope: Mapping[str, Quantity]) -> "Scoped":
        """Return the text with its parameters by name."""
        scoped = super().__new__(cls, text)
        scoped.scope = scope
        return scoped


@dataclass(frozen=True)
class Unconverted:
    """A value in place of one that can't be converted. It fails in every field; `reason` goes into the error."""

    value: Any
    reason: str


class _Token(NamedTuple):
    kind: str
    """`number`, `unit`, `name`, or an operator of `_PRECEDENCE` or a parenthesis."""
    text: str
    value: Quantity | None = None


def evaluate(text: str, unit: str = "") -> Quantity:
    """Return the quantity of a text, rounded if it has many digits.

    unit: of the field; in sums with quantities of its dimension, a number without unit takes it. Raise ValueError with
    a phrase such as `a length + a time`.
    """
    scope: Mapping[str, Quantity] = getattr(text, "scope", {})
    stack: list[Quantity] = []
    expected = dimensions(unit)
    for token in _postfix(str(text)):
        if token.value is not None:
            stack.append(token.value)
        elif token.kind == "name":
            stack.append(_parameter(token.text, scope))
        elif token.kind == "neg":
            one = stack.pop()
            stack.append(Quantity(-one.factor, one.dimension, one.pis))
        else:
            right, left = stack.pop(), stack.pop()
            stack.append(
                _sum(token.kind, left, right, expected) if token.kind in "+-" else _product(token.kind, left, right)
            )
    return _short(stack.pop())


def is_finite(value: Any) -> bool:
    """Return True for a number, no bool, that a double can hold. An int may be larger."""
    most = sys.float_info.max
    return isinstance(value, (int, float)) and not isinstance(value, bool) and -most <= value <= most


def names_in(text: str) -> list[str]:
    """Return the names of parameters in an expression. Raise ValueError for a text that is none."""
    return [token.text for token in _postfix(text) if token.kind == "name"]


def to_si(text: str, unit: str) -> float:
    """Return the value of a text for a field, in the field's unit; an int if a field of unit "1" has a whole number.

    Raise ValueError with an expectation.
    """
    try:
        return _in_unit(evaluate(text, unit), unit)
    except ValueError as error:
        raise ValueError(f"expected {wanted(unit)}; found {error}") from None


def converted(text: str, unit: str) -> float | Unconverted:
    """Return the value of a text for a field, see `to_si`, or the refused text with the reason."""
    if not getattr(text, "scope", None) or not _has_names(str(text)):
        return _converted(str(text), unit)
    try:
        return _in_unit(evaluate(text, unit), unit)
    except ValueError as error:
        return Unconverted(str(text), str(error))


@lru_cache(maxsize=4096)
def _has_names(text: str) -> bool:
    try:
        return bool(names_in(text))
    except ValueError:
        return False


@lru_cache(maxsize=4096)
def _converted(text: str, unit: str) -> float | Unconverted:
    try:
        return _in_unit(evaluate(text, unit), unit)
    except ValueError as error:
        return Unconverted(text, str(error))


def wanted(unit: str) -> str:
    """Return the expectation of texts for a unit: `a speed such as 0.2 m/s`."""
    expected = dimensions(unit)
    if not expected:
        return "a number or a quantity with its unit"
    example = example_of(unit)
    return str(expected[0]) + (f" such as {example}" if example else "")


def example_of(unit: str) -> str:
    """Return a text for a field by its unit; "" without dimension."""
    expected = dimensions(unit)
    if not expected or expected[0] == NONE:
        return ""
    return expected[0].example or f"2 {unit}"


@lru_cache(maxsize=256)
def dimensions(unit: str) -> tuple[Dimension, ...]:
    """Return the dimensions that a field takes by its unit: several for `kg/s or s/m`, none for `that of the signal`.

    Without dimensions, every quantity fits. Raise ValueError for an unknown unit.
    """
    if not unit or unit.startswith("that of"):
        return ()
    return tuple(evaluate(f"1*{one}").dimension or NONE for one in unit.split(" or "))


def angle_refused(value: float) -> Unconverted | None:
    """Return the refusal of a number without unit for an angle beyond a full turn; None of other numbers."""
    if not FULL_TURN < abs(value) <= sys.float_info.max:  # whole numbers can be larger
        return None
    return Unconverted(value, f"more than a full turn in rad, did you mean {value:g} deg?")


def _in_unit(quantity: Quantity, unit: str) -> float:
    expected = dimensions(unit)
    if quantity.dimension is not None and expected and quantity.dimension not in expected:
        raise ValueError(str(quantity))
    if quantity.pis == 0 and quantity.factor.denominator == 1 and unit == "1":
        return int(quantity.factor)
    value = quantity.value
    if quantity.dimension is None and ANGLE in expected and (refused := angle_refused(value)) is not None:
        raise ValueError(refused.reason)
    return value


def _rounded(factor: Fraction, pis: int) -> float:
    if pis == 0:
        return float(factor)
    if pis == 1:
        return math.radians(float(180 * factor))
    return float(factor) * math.pi**pis


def _short(quantity: Quantity) -> Quantity:
    """Return a quantity, rounded to a double if its fraction is long."""
    factor = quantity.factor
    is_short = max(factor.numerator.bit_length(), factor.denominator.bit_length()) <= _MOST_BITS
    if is_short and abs(quantity.pis) <= _MOST_PIS:
        return quantity
    return Quantity.of(quantity.value, quantity.dimension)


def _parameter(name: str, scope: Mapping[str, Quantity]) -> Quantity:
    if name in scope:
        return scope[name]
    raise ValueError(f"an unknown name {_like(name, scope)}")


def _like(name: str, known: Mapping[str, Any]) -> str:
    """Return an unknown name for an error, with the known one that it resembles."""
    close = difflib.get_close_matches(name, known, n=1) if len(name) <= _LONGEST_NAME else []
    return name[:_LONGEST_NAME] + (f", did you mean {close[0]}?" if close else "")


def _sum(sign: str, left: Quantity, right: Quantity, expected: tuple[Dimension, ...]) -> Quantity:
    dimension = left.dimension if right.dimension is None else right.dimension
    for one in (left, right):
        if one.dimension != dimension and (one.dimension is not None or dimension not in expected):
            raise ValueError(f"{left} {sign} {right}")
    if left.pis != right.pis:
        left, right = Quantity.of(left.value), Quantity.of(right.value)
    factor = left.factor + right.factor if sign == "+" else left.factor - right.factor
    return Quantity(factor, dimension, left.pis)


def _product(sign: str, left: Quantity, right: Quantity) -> Quantity:
    exponent = -1 if sign == "/" else 1
    if exponent == -1 and right.factor == 0:
        raise ValueError("a division by zero")
    dimension = None
    if left.dimension is not None or right.dimension is not None:
        dimension = (left.dimension or NONE).times(right.dimension or NONE, exponent)
    return Quantity(left.factor * right.factor**exponent, dimension, left.pis + exponent * right.pis)


@lru_cache(maxsize=4096)
def _postfix(text: str) -> tuple[_Token, ...]:
    """Return the tokens of an expression, operators behind their operands. Raise ValueError."""
    if len(text) > LONGEST:
        raise ValueError(f"a text of {len(text)} characters, more than {LONGEST}")
    if _QUOTED.fullmatch(text):
        raise ValueError("a number in quotes")
    output: list[_Token] = []
    waiting: list[_Token] = []
    before = ""
    for token in _tokens(text):
        kind, ends_operand = token.kind, before in ("number", "unit", "name", ")")
        if kind in ("number", "name", "(") and ends_operand:
            what = "an unknown unit" if kind == "name" else "no operator before"
            raise ValueError(f"{what} {_like(token.text, UNITS)}")
        if kind == "unit":
            if before in ("", "+", "-", "neg"):
                raise ValueError(f"a unit without a number, {token.text}")
            if ends_operand:
                _push(_Token("of", ""), output, waiting)
            output.append(token)
        elif kind in ("number", "name"):
            output.append(token)
        elif kind == "(":
            waiting.append(token)
        elif kind == ")":
            if not ends_operand:
                raise ValueError("nothing before )")
            _close(output, waiting)
        elif ends_operand:
            _push(token, output, waiting)
        elif kind == "-":
            waiting.append(token := _Token("neg", "-"))
        elif kind != "+":
            raise ValueError(f"nothing before {token.text}")
        before = token.kind
    if before not in ("number", "unit", "name", ")"):
        raise ValueError("an unfinished expression" if before else "an empty text")
    while waiting:
        if waiting[-1].kind == "(":
            raise ValueError("a ( without )")
        output.append(waiting.pop())
    if not any(token.kind in ("number", "name") for token in output):
        raise ValueError("a unit without a number")
    return tuple(output)


def _push(token: _Token, output: list[_Token], waiting: list[_Token]) -> None:
    """Put an operator on the stack, after those that bind at least as tightly."""
    while waiting and waiting[-1].kind != "(" and _PRECEDENCE[waiting[-1].kind] >= _PRECEDENCE[token.kind]:
        output.append(waiting.pop())
    waiting.append(token)


def _close(output: list[_Token], waiting: list[_Token]) -> None:
    while waiting and waiting[-1].kind != "(":
        output.append(waiting.pop())
    if not waiting:
        raise ValueError("a ) without (")
    waiting.pop()


def _tokens(text: str) -> list[_Token]:
    """Return the numbers, names and operators of a text. Raise ValueError for other characters."""
    tokens = []
    at = _BLANKS.match(text).end()  # type: ignore[union-attr]
    while at < len(text):
        match = _TOKEN.match(text, at)
        if match is None:
            raise ValueError(f"not an expression at {text[at : at + 10]!r}")
        tokens.append(_token(match))
        at = _BLANKS.match(text, match.end()).end()  # type: ignore[union-attr]
    return tokens


def _token(match: re.Match[str]) -> _Token:
    if (number := match["number"]) is not None:
        return _Token("number", number, Quantity(Fraction(re.sub(_SPACE, "", number))))
    if (name := match["name"]) is not None:
        unit, power = UNITS.get(name), match["power"]
        if unit is not None:
            return _Token("unit", match[0], _unit(unit, power))
        if power is not None:
            raise ValueError(f"a power of {name}, which is no unit")
        return _Token("name", name)
    operator = _SAME.get(match[0], match[0])
    return _Token(operator, operator)


def _unit(unit: Unit, power: str | None) -> Quantity:
    if power is None:
        return Quantity(unit.factor, unit.dimension, unit.pis)
    exponent = {"\u00b2": 2.0, "\u00b3": 3.0}.get(power) or float(power[1:])
    if abs(exponent) > _LARGEST_EXPONENT or (unit.pis and exponent != int(exponent)):
        raise ValueError(f"a power {exponent:g} of a unit")
    dimension = NONE.times(unit.dimension, exponent)
    if exponent == int(exponent):
        return Quantity(unit.factor ** int(exponent), dimension, unit.pis * int(exponent))
    return Quantity.of(float(unit.factor) ** exponent, dimension)
