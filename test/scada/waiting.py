"""Waiting for what will happen."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

PATIENCE = 60.0  # s of wall time; only a failing test waits so long


def until(condition: Callable[[], Any], what: str) -> None:
    """Wait for something that will happen."""
    end = time.monotonic() + PATIENCE
    while not condition():
        assert time.monotonic() < end, f"in vain: {what}"
        time.sleep(0.01)
