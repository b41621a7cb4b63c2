"""`missing`: the facts that a sentence of the project must state, however it is worded."""


def missing(text: str | None, *facts: str) -> list[str]:
    """Return the facts that a text does not contain; all of them without a text."""
    return [fact for fact in facts if fact not in (text or "")]
