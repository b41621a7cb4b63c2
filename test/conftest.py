# SPDX-License-Identifier: Apache-2.0
"""Which tests belong to `-m quick`, which are repeated, and in which order processes take the files of tests."""

import gc
from hashlib import blake2b
from pathlib import Path
from typing import Any

import pytest
from ctrl_c import restore_for_children

HERE = Path(__file__).parent
QUICK = (
    "control/test_", "physics/effects/", "physics/laws/", "physics/model/", "physics/state/", "physics/timestep/",
    "scene/", "support/",
)  # fmt: skip
"""Starts of paths. Other tests start nodes and processes, simulate minutes of complete lines, or draw."""

OVER_SOCKETS = ("page/", "protocols/", "ros/")
"""Folders of tests that wait for other processes: DDS discovery, brokers, browsers. On two shared cores one of some
thousands fails without a fault of the project, so a failure is repeated once; the summary counts it as `rerun`.
"""

COMPILING = (
    "hard_cases/", "physics/", "engine/test_riding.py",
    "engine/test_dormand_prince.py", "accuracy/test_closed_forms.py", "accuracy/test_resting.py", "bag/test_replay.py",
)  # fmt: skip
"""Folders and files that spend most of their time compiling kernels. One process takes them all: kernels share parts,
and each process compiles the parts again.
"""

LONGEST = (
    "fuzz/test_fuzz.py", "testing/test_cookbook.py", "test_shipped_scenes.py", "accuracy/test_study.py",
    "ros/test_pages.py", "test_brewery.py", "ros/test_node_source.py", "ros/test_floods.py", "page/test_live.py",
    "testing/test_tutorial_line.py", "page/test_page.py", "test_simulation.py",
)  # fmt: skip
"""Other files that took more than 35 s where processes shared two cores, the longest first."""


def pytest_configure() -> None:
    restore_for_children()


def pytest_collection() -> None:
    """No garbage collection while test modules are imported: it takes a fifth of the time, and modules stay."""
    gc.disable()


def pytest_collection_finish() -> None:
    gc.enable()


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Mark the quick ones; in processes side by side, put files that take long first."""
    if hasattr(config, "workerinput"):
        items.sort(key=lambda item: _turn(item.path))
    for item in items:
        file = item.path.relative_to(HERE).as_posix() if item.path.is_relative_to(HERE) else ""
        if file.startswith(QUICK):
            item.add_marker(pytest.mark.quick)
        if file.startswith(OVER_SOCKETS):
            item.add_marker(pytest.mark.flaky(reruns=1))


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config: pytest.Config, log: Any) -> Any:
    """`--dist=loadfile`, but all that compiles is one unit of work."""
    if config.getoption("dist") != "loadfile":
        return None
    from xdist.scheduler import LoadFileScheduling

    class Scheduling(LoadFileScheduling):
        def _split_scope(self, nodeid: str) -> str:
            file: str = super()._split_scope(nodeid)
            return "what compiles" if file.removeprefix("test/").startswith(COMPILING) else file

    return Scheduling(config, log)


def _turn(file: Path) -> tuple[int, bytes]:
    """What compiles, then the longest first, so that no process is left with one when the others have ended. The rest
    by a hash of their names: files of one folder at the same time would all wait, or all want the same kernels.
    """
    name = file.relative_to(HERE).as_posix() if file.is_relative_to(HERE) else file.name
    first = -1 if name.startswith(COMPILING) else LONGEST.index(name) if name in LONGEST else len(LONGEST)
    return first, blake2b(name.encode()).digest()
