# SPDX-License-Identifier: Apache-2.0
"""A controller by what names it: a program in Structured Text, one that is compiled, or one in Python."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from importlib.util import find_spec
from pathlib import Path

from conveyor_sim.control import load as python
from conveyor_sim.control.scan import ControlError, Controller
from conveyor_sim.control.st.dialect import DIALECTS, SUFFIXES
from conveyor_sim.control.st.foreign import FILES
from conveyor_sim.support.resources import in_config

LIBRARY = ".so"


_TAGS, _MAP = "tags (a mapping from variables to tags)", "modbus_map (a file)"
_RECORD, _BUDGET, _PATIENCE = "record (patterns of variables)", "budget (statements)", "patience (s)"
_FILES = "files (further files or folders)"
_DIALECT = f"dialect ({', '.join(DIALECTS)})"


def load(reference: str, parameters: Mapping[str, object] | None = None) -> Controller:
    """Return the controller of `program.st`, of a folder of such files, of `library.so`, or of a reference in Python.

    A folder may be one that ships with conveyor_sim ("brewery/plc"). A reference in Python is as
    `conveyor_sim.control.load` takes it. parameters: of the factory; for a program, those of `StructuredText` and
    `CompiledProgram` by name. Raise ControlError, and MapError for a wrong map.
    """
    given = dict(parameters or {})
    reference = _shipped(reference)
    if reference.lower().endswith(LIBRARY):
        return _compiled(reference, given)
    if not _is_program(reference):
        return python(reference, given)
    if find_spec("lark") is None:
        raise ControlError(f"controller {reference!r}: lark is missing, expected it: pip install 'conveyor_sim[st]'")
    from conveyor_sim.control.st.controller import StructuredText

    _require(
        reference,
        given,
        {"tags": _TAGS, "modbus_map": _MAP, "record": _RECORD, "budget": _BUDGET, "dialect": _DIALECT, "files": _FILES},
    )
    return StructuredText(reference, **given)  # type: ignore[arg-type]


def _shipped(reference: str) -> str:
    """Return the path of a shipped folder of programs; the reference itself if it names another one, or none."""
    if ":" in reference or os.path.exists(reference):
        return reference
    folder = in_config(Path(reference))
    return str(folder) if folder is not None and os.path.isdir(folder) and any(folder.glob("*.st")) else reference


def _is_program(reference: str) -> bool:
    """Return True for a file of a program, for one that can't be one, and for a folder."""
    path = Path(reference)
    return path.suffix.lower() in (*SUFFIXES, *FILES) or (reference != "" and path.is_dir())


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
    "files": lambda value: isinstance(value, list) and all(map(_is_text, value)),
    "budget": lambda value: _is_number(value) and isinstance(value, int),
    "patience": _is_number,
    "dialect": lambda value: isinstance(value, str) and value in DIALECTS,
}
"""Checks of the parameters, by name."""
