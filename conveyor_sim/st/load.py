"""A controller by what names it: a program in Structured Text, or one in Python."""

from __future__ import annotations

from collections.abc import Mapping
from importlib.util import find_spec

from conveyor_sim.control import load as python
from conveyor_sim.control.scan import ControlError, Controller

SUFFIX = ".st"


def load(reference: str, parameters: Mapping[str, object] | None = None) -> Controller:
    """`program.st`, or as `conveyor_sim.control.load` has it. parameters: of the factory; of a program `tags` (tags by
    variable) and `modbus_map` (a file). Raises ControlError, and MapError for such a file.
    """
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
