# SPDX-License-Identifier: Apache-2.0
"""Words that are keywords or names depending on the dialect and on the words around them."""

from __future__ import annotations

from collections.abc import Callable, Iterator

from lark import Token
from lark.lark import PostLex

from conveyor_sim.control.st.dialect import Dialect
from conveyor_sim.control.st.errors import SourceError
from conveyor_sim.control.st.mistakes import at_of, not_refused
from conveyor_sim.control.st.unit_ends import with_ends

MOST_TOKENS = 300_000
"""Largest number of words, numbers and signs in a file: about 30 000 statements, which take 6 s to compile and 500
MB."""

TIA_WORDS = ("DATA_BLOCK", "BEGIN", "END_DATA_BLOCK")
"""Words that are names in other dialects."""
_CONFIGURED = {"RESOURCE", "TASK", "ON", "WITH"}
"""Words that are keywords in a CONFIGURATION only, where dialects let them be names outside of it."""


class WordFilter(PostLex):
    """Filter of tokens: counts them, refuses words, and tells keywords from names."""

    always_accept = ()

    def __init__(self, dialect: Callable[[], Dialect]) -> None:
        """Store the access to the dialect of the present text."""
        self._dialect = dialect

    def process(self, stream: Iterator[Token]) -> Iterator[Token]:
        """Yield the tokens. Raise SourceError for more than MOST_TOKENS, and for words of unsupported features."""
        before: Token | None = None
        dialect = self._dialect()
        tia, free = dialect.tia_sources, dialect.configuration_words
        for number, token in enumerate(with_ends(stream, dialect)):
            if number == MOST_TOKENS:
                raise SourceError(at_of(token), f"found more than {MOST_TOKENS} words and signs, expected fewer")
            if before is not None:
                if token.type == "NAME":  # two names in sequence: the first one is a keyword
                    before.type = before.upper()
                    free = free and before.type != "CONFIGURATION"
                yield before
                before = None
            if token.type == "NAME":
                word = token.upper()
                if tia and word in TIA_WORDS:
                    token.type = word
                    yield token
                elif word == "ACTION":
                    before = token
                else:
                    yield not_refused(token)
            elif token.type == "PREFIX":
                yield not_refused(token)
            elif token.type == "CONFIGURATION" and dialect.configuration_words:
                token.type, before = "NAME", token
            else:
                if free and token.type in _CONFIGURED:
                    token.type = "NAME"
                elif token.type == "END_CONFIGURATION":
                    free = dialect.configuration_words
                yield token
        if before is not None:
            yield before
