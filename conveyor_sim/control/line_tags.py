"""`LineTags`: signals and commands of a line, which a controller can get before its first scan."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field


@dataclass(frozen=True)
class LineTags:
    """Signals and commands of a line by name, with their kinds: "bool", "count", "number" or "enumeration"."""

    signals: Mapping[str, str]
    commands: Mapping[str, str]
    limits: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    """Accepted minimum and maximum by command; empty: not known."""


def bind(controller: object, tags: LineTags) -> None:
    """Pass the line's tags to a controller that has a method `bind`, before its first scan. Raise its exceptions."""
    method = getattr(controller, "bind", None)
    if callable(method):
        method(tags)
