"""Which tests belong to `-m quick`, and in which order several processes take the files of tests."""

import gc
from hashlib import blake2b
from pathlib import Path

import pytest

HERE = Path(__file__).parent
QUICK = frozenset({"control", "effects", "laws", "model", "scene", "state", "support", "timestep"})
"""Folders. The others start nodes and processes, take whole lines through minutes, or draw."""

LONGEST = (
    "hard_cases/test_hard_cases.py", "fuzz/test_fuzz.py", "ros/test_floods.py", "engine/test_riding.py",
    "state/test_checkpoint.py", "view/test_live.py", "timestep/test_prediction.py", "test_shipped_scenes.py",
    "bag/test_replay.py", "view/test_page.py", "test_simulation.py",
)  # fmt: skip
"""Files that took more than 35 s where three processes shared two cores, the longest first."""


def pytest_collection() -> None:
    """No look for garbage while modules are imported: they stay, and the looks would take a fifth of the time."""
    gc.disable()


def pytest_collection_finish() -> None:
    gc.enable()


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Mark the quick ones; in processes side by side, put files that take long first."""
    if hasattr(config, "workerinput"):
        items.sort(key=lambda item: _turn(item.path))
    for item in items:
        if item.path.is_relative_to(HERE) and item.path.relative_to(HERE).parts[0] in QUICK:
            item.add_marker(pytest.mark.quick)


def _turn(file: Path) -> tuple[int, bytes]:
    """The longest first, so that no process is left with one when the others have ended. The rest by a hash of their
    names: files of one folder at the same time would all wait, or all want the same kernels compiled.
    """
    name = file.relative_to(HERE).as_posix() if file.is_relative_to(HERE) else file.name
    return LONGEST.index(name) if name in LONGEST else len(LONGEST), blake2b(name.encode()).digest()
