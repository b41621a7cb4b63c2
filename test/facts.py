"""Facts of a message: names, values, numbers, units and expectations that it must state, in any wording."""

import re
from collections.abc import Iterable


def missing(text: str, facts: Iterable[str]) -> list[str]:
    """Return the facts that a text does not state as whole words; a number is not found within a longer one."""
    return [fact for fact in facts if not re.search(_pattern(fact), text, re.IGNORECASE)]


def stating(*facts: str) -> str:
    """Return a regular expression, for `pytest.raises(match=...)`, of the texts that state all of these facts."""
    return "(?is)^" + "".join(f"(?=.*{_pattern(fact)})" for fact in facts)


def _pattern(fact: str) -> str:
    return rf"(?<![\w.]){re.escape(fact)}(?!\w|\.\d)"
