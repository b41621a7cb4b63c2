"""A controller by what names it: a program in Structured Text, one that is compiled, or one in Python."""

from __future__ import annotations

from collections.abc import Mapping
from importlib.util import find_spec

from conveyor_sim.control import load as python
from conveyor_sim.control.scan import ControlError, Controller

SUFFIX, LIBRARY = ".st", ".so"


def load(reference: str, parameters: Mapping[str, object] | None = None) -> Controller:
    """`program.st`, `library.so`, or as `conveyor_sim.control.load` has it. parameters: of the factory; of a program
    `tags` (tags by variable) and, in Structured Text, `modbus_map` (a file). Raises ControlError, and MapError for such
    a file.
    """
    if reference.lower().endswith(LIBRARY):
        return _compiled(reference, dict(parameters or {}))
    if not reference.lower().endswith(SUFFIX):
        return python(reference, parameters)
    if find_spec("lark") is None:
        raise ControlError(f"controller {reference!r}: lark is missing, expected it: pip install 'conveyor_sim[st]'")
    from conveyor_sim.st.controller import StructuredText

    given = dict(parameters or {})
    tags, modbus_map = given.pop("tags", {}), given.pop("modbus_map", None)
    if given or not isinstance(tags, dict) or not isinstance(modbus_map, (str, type(None))):
        raise ControlError(
            f"controller {reference!r}: parameters {parameters} given, expected none, tags (a mapping of names) or "
            "modbus_map (a file)"
        )
    return StructuredText(reference, {str(name): str(tag) for name, tag in tags.items()}, modbus_map=modbus_map)


def _compiled(reference: str, parameters: dict[str, object]) -> Controller:
    from conveyor_sim.st.library import CompiledProgram

    tags = parameters.pop("tags", {})
    if parameters or not isinstance(tags, dict):
        raise ControlError(
            f"controller {reference!r}: parameters {parameters} given, expected tags, a mapping of names"
        )
    return CompiledProgram(reference, {str(name): str(tag) for name, tag in tags.items()})
