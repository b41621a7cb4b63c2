# SPDX-License-Identifier: Apache-2.0
"""A controller by what names it: a program in Structured Text, one that is compiled, or one in Python."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from importlib.util import find_spec

from conveyor_sim.control import load as python
from conveyor_sim.control.scan import ControlError, Controller
from conveyor_sim.control.st.dialect import DIALECTS

SUFFIX, LIBRARY = ".st", ".so"


_TAGS, _MAP = "tags (a mapping from variables to tags)", "modbus_map (a file)"
_RECORD, _BUDGET, _PATIENCE = "record (patterns of variables)", "budget (statements)", "patience (s)"
_DIALECT = f"dialect ({', '.join(DIALECTS)})"


def load(reference: str, parameters: Mapping[str, object] | None = None) -> Controller:
    """Return the controller of `program.st`, `library.so`, or of another reference of `conveyor_sim.control.load`.

    parameters: of the factory; for a program, those of `StructuredText` and `CompiledProgram` by name. Raise
    ControlError, and MapError for a wrong map.
    """
    given = dict(parameters or {})
    if reference.lower().endswith(LIBRARY):
        return _compiled(reference, given)
    if not reference.lower().endswith(SUFFIX):
        return python(reference, given)
    if find_spec("lark") is None:
        raise ControlError(f"controller {reference!r}: lark is missing, expected it: pip install 'conveyor_sim[st]'")
    from conveyor_sim.control.st.controller import StructuredText

    _require(
        reference, given, {"tags": _TAGS, "modbus_map": _MAP, "record": _RECORD, "budget": _BUDGET, "dialect": _DIALECT}
    )
    return StructuredText(reference, **given)  # type: ignore[arg-type]


def _compiled(reference: str, given: dict[str, object]) -> Controller:
    from conveyor_sim.control.st.library import CompiledProgram

    _require(reference, given, {"tags": _TAGS, "record": _RECORD, "patience": _PATIENCE})
    return CompiledProgram(reference, **{"tags": {}, **given})  # type: ignore[arg-type]


def _require(reference: str, given: Mapping[str, object], known: Mapping[str, str]) -> None:
    """Raise ControlError for parameters with wrong names or types."""
    for name, value in given.items():
        if name not in known or not _IS[name](value):
            shown = f"{name}: {value!r:.200}"
            raise ControlError(
                f"controller {reference!r}: parameter {shown} given, expected {', '.join(known.values())}"
            )


def _is_text(value: object) -> bool:
    return isinstance(value, str)


def _is_number(value: object) -> bool:
    return isinstance(value, (int, float)) and not isinstance(value, bool) and value > 0


_IS: Mapping[str, Callable[[object], bool]] = {
    "tags": lambda value: isinstance(value, dict) and all(map(_is_text, (*value, *value.values()))),
    "modbus_map": _is_text,
    "record": lambda value: _is_text(value) or (isinstance(value, list) and all(map(_is_text, value))),
    "budget": lambda value: _is_number(value) and isinstance(value, int),
    "patience": _is_number,
    "dialect": lambda value: isinstance(value, str) and value in DIALECTS,
}
"""Checks of the parameters, by name."""
