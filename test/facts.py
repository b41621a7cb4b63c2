# SPDX-License-Identifier: Apache-2.0
"""Facts of a message: names, values, numbers, units and expectations that it must state, in any wording."""

import re
from collections.abc import Iterable


def missing(text: str | None, *facts: str | Iterable[str]) -> list[str]:
    """Return the facts that a text does not state; all of them without a text.

    A fact by itself may be any part of the text. Facts of a list are whole words, so that a number is not found within
    a longer one.
    """
    absent = []
    for fact in facts:
        if isinstance(fact, str):
            absent += [] if fact in (text or "") else [fact]
        else:
            absent += [word for word in fact if not re.search(_pattern(word), text or "", re.IGNORECASE)]
    return absent


def stating(*facts: str) -> str:
    """Return a regular expression, for `pytest.raises(match=...)`, of the texts that state all of these facts."""
    return "(?is)^" + "".join(f"(?=.*{_pattern(fact)})" for fact in facts)


def _pattern(fact: str) -> str:
    return rf"(?<![\w.]){re.escape(fact)}(?!\w|\.\d)"
