# SPDX-License-Identifier: Apache-2.0
"""Ends of units that tools leave out: CODESYS and TwinCAT show a unit without END_FUNCTION_BLOCK and its like."""

from __future__ import annotations

from collections.abc import Iterator

from lark import Token

from conveyor_sim.control.st.dialect import Dialect

_UNITS = ("FUNCTION", "FUNCTION_BLOCK", "PROGRAM")
_ONE_WORD = "FUNCTIONBLOCK"


def with_ends(tokens: Iterator[Token], dialect: Dialect) -> Iterator[Token]:
    """Yield the tokens of a file, FUNCTIONBLOCK as FUNCTION_BLOCK, and at last the end of a unit that has none."""
    if not dialect.open_units:
        yield from tokens
        return
    unit, configured, last = "", False, None
    for token in tokens:
        last = token
        if token.type == "NAME" and token.upper() == _ONE_WORD:
            token.type = "FUNCTION_BLOCK"
        if token.type in ("CONFIGURATION", "END_CONFIGURATION"):
            configured = token.type == "CONFIGURATION"
        elif token.type in _UNITS and not configured:
            unit = token.type
        elif token.type == f"END_{unit}":
            unit = ""
        yield token
    if unit and last is not None:
        yield Token.new_borrow_pos(f"END_{unit}", f"END_{unit}", last)
