"""Which tests belong to `-m quick`, the inner loop: about a minute once the kernels are in the cache."""

from pathlib import Path

import pytest

HERE = Path(__file__).parent
QUICK = frozenset({"control", "effects", "laws", "model", "scene", "state", "support", "timestep"})
"""Folders. The others start nodes and processes, take whole lines through minutes, or draw."""


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Mark them."""
    for item in items:
        if item.path.is_relative_to(HERE) and item.path.relative_to(HERE).parts[0] in QUICK:
            item.add_marker(pytest.mark.quick)
