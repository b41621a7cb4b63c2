"""What a controller may know of a line before its first scan: what there is to read and to write."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field


@dataclass(frozen=True)
class LineTags:
    """Kinds by name: "bool", "count", "number" or "enumeration"."""

    signals: Mapping[str, str]
    commands: Mapping[str, str]
    limits: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    """Minimum and maximum that the line accepts, by command; empty: not known."""


def bind(controller: object, tags: LineTags) -> None:
    """Give a controller with a method `bind` the line's tags, before its first scan. Raises as that does."""
    method = getattr(controller, "bind", None)
    if callable(method):
        method(tags)
