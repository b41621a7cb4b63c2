# SPDX-License-Identifier: Apache-2.0
"""Freedoms of CODESYS and TwinCAT: a unit without END_FUNCTION_BLOCK and its like, and TYPE as the name of a field."""

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
    for token in _with_names(tokens):
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


def _with_names(tokens: Iterator[Token]) -> Iterator[Token]:
    """Yield the tokens, TYPE as a name after a period and before a colon, as fields of B&R and TwinCAT have it."""
    before: Token | None = None
    for token in tokens:
        if before is not None and before.type == "TYPE" and token.type == "COLON":
            before.type = "NAME"
        elif token.type == "TYPE" and before is not None and before.type == "DOT":
            token.type = "NAME"
        if before is not None:
            yield before
        before = token
    if before is not None:
        yield before
