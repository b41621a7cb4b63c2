# SPDX-License-Identifier: Apache-2.0
"""PLC programs in Structured Text (IEC 61131-3:2013), as controllers of a line.

A text passes through the files in this order. `pragmas.py` selects one branch of its conditional pragmas, and
`parse.py` (with `grammar.lark`) builds the tree of `tree.py`. `declarations.py` resolves its types (`types.py`), names
(`scope.py`), qualifiers (`sections.py`), addresses (`located.py`) and initial values (`initial_values.py`).
`expressions.py`, `integers.py`, `calls.py` and `statements.py` check the body and write it as Python, which
`compile.py` puts together. `functions.py`, `conversions.py`, `blocks.py` and `tia_blocks.py` are the standard library,
`operations.py` the run-time functions of the code.
`dialect.py` decides the differences between CODESYS, TwinCAT, TIA Portal and the standard. `program_files.py` joins the
files of a program; `scl.py` and `data_blocks.py` read those of TIA Portal, `br.py` those of B&R.
`unit_ends.py` and `called_programs.py` supply what CODESYS leaves out, `foreign.py` names foreign forms.
`program.py` runs it. `library.py` runs a shared library that another compiler built from a program.
docs/structured_text.md lists the decisions that the standard leaves open.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from conveyor_sim.control.st.controller import StructuredText
    from conveyor_sim.control.st.library import CompiledProgram

__all__ = ["CompiledProgram", "StructuredText"]


def __getattr__(name: str) -> Any:
    """Import on first use, so that `load.py` and `CompiledProgram` work without lark."""
    if name == "StructuredText":
        from conveyor_sim.control.st.controller import StructuredText

        return StructuredText
    if name == "CompiledProgram":
        from conveyor_sim.control.st.library import CompiledProgram

        return CompiledProgram
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
