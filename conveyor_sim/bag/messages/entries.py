"""Entries of messages in words, by Line, message and index, for the first difference of a replay."""

from __future__ import annotations

from typing import Any


def bottle_name(line: Any, message: Any, index: int) -> str:
    """Return an entry of columns by bottle in words."""
    return f"bottle {message.id[index]}"


def contact_name(line: Any, message: Any, index: int) -> str:
    """Return an entry of contacts in words."""
    other = int(message.b[index])
    if message.kind[index] == 0:
        return f"the contact of bottles {message.a[index]} and {other}"
    rail = line.rails[other] if other < len(line.rails) else other
    return f"the contact of bottle {message.a[index]} and rail {rail}"


def command_name(line: Any, message: Any, index: int) -> str:
    """Return an entry of read-back values in words."""
    names = line.command_names
    return f"command {names[index]}" if index < len(names) else ""  # there may be more writers than commands


def bin_name(line: Any, message: Any, index: int) -> str:
    """Return an entry of rail wear in words."""
    return f"rail {line.rails[message.rail[index]]} at ({message.x[index]:.4g}, {message.y[index]:.4g}) m"
