"""PLC programs in Structured Text (IEC 61131-3:2013), as controllers of a line.

A text goes one way: `pragmas.py` leaves one branch of its conditional pragmas; `parse.py` (with `grammar.lark`) makes
the tree of `tree.py`; `declarations.py` its types (`types.py`), names (`scope.py`), qualifiers (`sections.py`) and
addresses (`located.py`); `expressions.py`, `integers.py`, `calls.py` and `statements.py` check what is done and write
it as Python, and `compile.py` puts that together. `functions.py`, `conversions.py` and `blocks.py` are the standard
library, `operations.py` the functions of code at run time. `program.py` runs it. `library.py` runs a shared library
that another compiler has made of a program. docs/structured_text.md lists the decisions that the standard leaves open.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from conveyor_sim.control.st.controller import StructuredText
    from conveyor_sim.control.st.library import CompiledProgram

__all__ = ["CompiledProgram", "StructuredText"]


def __getattr__(name: str) -> Any:
    """Imports what is first asked for: `load.py` and `CompiledProgram` are there without lark."""
    if name == "StructuredText":
        from conveyor_sim.control.st.controller import StructuredText

        return StructuredText
    if name == "CompiledProgram":
        from conveyor_sim.control.st.library import CompiledProgram

        return CompiledProgram
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
