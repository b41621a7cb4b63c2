"""Entries of messages in words, by Line, message and index: for differences that a replay finds."""

from __future__ import annotations

from typing import Any


def bottle_name(line: Any, message: Any, index: int) -> str:
    """Entry of columns by bottle."""
    return f"bottle {message.id[index]}"


def contact_name(line: Any, message: Any, index: int) -> str:
    """Entry of contacts."""
    other = int(message.b[index])
    if message.kind[index] == 0:
        return f"the contact of bottles {message.a[index]} and {other}"
    rail = line.rails[other] if other < len(line.rails) else other
    return f"the contact of bottle {message.a[index]} and rail {rail}"


def command_name(line: Any, message: Any, index: int) -> str:
    """Entry of read-back values."""
    names = line.command_names
    return f"command {names[index]}" if index < len(names) else ""  # of the writers there may be more


def bin_name(line: Any, message: Any, index: int) -> str:
    """Entry of rail wear."""
    return f"rail {line.rails[message.rail[index]]} at ({message.x[index]:.4g}, {message.y[index]:.4g}) m"
