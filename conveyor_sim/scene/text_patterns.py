# SPDX-License-Identifier: Apache-2.0
"""Regular expressions of the texts that a field takes by its unit, for the JSON Schema of a scene.

A schema cannot evaluate expressions. A single number with a unit must fit the dimension of the field. An expression
may have any operators and names, but no unknown unit behind a number. The syntax is common to ECMAScript and Python.
"""

import re

from conveyor_sim.scene.quantities import dimensions
from conveyor_sim.scene.units import ANGLE, UNITS, Dimension

FORMS = (
    "m", "m^2", "kg", "s", "rad", "Hz", "1/s", "%", "m/s", "m/s^2", "m/s/s", "m/s^3", "rad/s", "rad/s^2", "N", "N/m",
    "kg/s^2", "N m", "J", "kg m^2", "kg/s", "N s/m", "1/m", "N/m^1.5", "s/m", "kg/(s m^0.5)", "Pa", "N/m^2",
)  # fmt: skip
"""Products of units that stand behind a number, each unit for all of its dimension."""

_SPACE = r"[ \u00a0\u2009\u202f]"
_GROUPED = rf"[0-9]{{1,3}}(?:{_SPACE}[0-9]{{3}})+(?:\.[0-9]*)?"
_NUMBER = rf"(?:{_GROUPED}|[0-9]+(?:\.[0-9]*)?|\.[0-9]+)(?:[eE][-+]?[0-9]+)?"
_SIGNED = rf"\s*[-+\u2212]?\s*{_NUMBER}"
_SIGNED_GROUPED = rf"\s*[-+\u2212]?\s*{_GROUPED}"
_CHARACTERS = r"[-+*/()^.0-9A-Za-z_%\s\u00b0\u00b5\u03bc\u00b7\u00d7\u00b2\u00b3\u2212\u00a0\u2009\u202f]+"
_ANY_UNIT = "|".join(sorted(map(re.escape, UNITS), key=len, reverse=True))
_UNKNOWN_UNIT = (
    r"(?!.*(?<![A-Za-z0-9_.])[0-9.]+\s*(?![eE][-+]?[0-9])"
    rf"(?!(?:{_ANY_UNIT})(?![A-Za-z0-9_]))[A-Za-z])"
)
_QUOTED = r"(?!\s*[-+]?[0-9.]+(?:[eE][-+]?[0-9]+)?\s*$)"


def text_pattern(unit: str) -> str:
    """Return the regular expression of all texts that a field with a unit takes."""
    fitting = dimensions(unit)
    forms = [form for form in FORMS if not fitting or dimensions(form)[0] in fitting]
    bare, literal, any_literal = rf"{_SIGNED_GROUPED}\s*", _literal(forms), _literal(list(FORMS))
    expression = rf"(?!{any_literal}$)(?!{bare}$){_QUOTED}{_UNKNOWN_UNIT}{_CHARACTERS}"
    # Separated thousands without a unit are more than a full turn.
    choices = [literal, expression] if ANGLE in fitting else [bare, literal, expression]
    return f"^(?:{'|'.join(choices)})$"


def _literal(forms: list[str]) -> str:
    return rf"{_SIGNED}\s*(?:{'|'.join(map(_form, forms))})\s*"


def _form(form: str) -> str:
    """Return the regular expression of a product of units."""
    tokens = re.findall(r"[A-Za-z%]+|\^[0-9.]+|[ /()]", form.removeprefix("1"))
    return "".join(_token(token) for token in tokens)


def _token(token: str) -> str:
    if token in UNITS:
        return _units_of(UNITS[token].dimension)
    superscripts = {"^2": r"(?:\^2|\u00b2)", "^3": r"(?:\^3|\u00b3)"}
    others = {"/": r"\s*/\s*", " ": r"(?:\s*[*\u00b7]\s*|\s+)"}
    return superscripts.get(token) or others.get(token) or re.escape(token)


def _units_of(dimension: Dimension) -> str:
    names = [name for name, unit in UNITS.items() if unit.dimension == dimension]
    return f"(?:{'|'.join(sorted(names, key=len, reverse=True))})"
