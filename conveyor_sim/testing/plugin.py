"""The pytest plugin: the fixture `line`, and what it leaves of a test that fails.

pytest loads it in every run by the entry point pytest11, so nothing of the simulation is imported until a test asks
for the fixture. setup.py names it there by its module, so that `-p` of the same name does not load it twice.
"""

from __future__ import annotations

import re
import tempfile
from collections.abc import Generator, Iterator, Mapping
from functools import partial
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

if TYPE_CHECKING:
    from conveyor_sim.scene import Scene
    from conveyor_sim.testing.scenario import Scenario

DEFAULT_FOLDER = "line-failures"

_LONGEST_NAME = 120


class Lines:
    """What the fixture `line` is: called, it makes a Scenario that is recorded from its start."""

    def __init__(self, folder: Path) -> None:
        """folder: to record in; it does not outlive the test."""
        self._folder = folder
        self.made: list[tuple[Scenario, Path]] = []
        """Scenarios and their bags."""

    def __call__(self, scene: Scene | str | PathLike[str], overrides: Mapping[str, Any] | None = None) -> Scenario:
        """A Scenario; arguments and errors as there."""
        from conveyor_sim.testing.scenario import Scenario

        bag = self._folder / f"bag_{len(self.made) + 1}"
        scenario = Scenario(scene, overrides, bag=bag)
        self.made.append((scenario, bag))
        return scenario

    def close(self) -> None:
        """End the recordings."""
        for scenario, _ in self.made:
            scenario.close()

    def keep(self, folder: Path) -> list[str]:
        """Keep bags and pictures in a folder; one line each, to be shown, that says where it is or why it is not."""
        from conveyor_sim.errors import ConveyorError
        from conveyor_sim.testing.evidence import PICTURE, draw_moment, keep_bag

        lines = []
        for number, (scenario, bag) in enumerate(self.made):
            place = folder if number == 0 else folder / f"line_{number + 1}"
            for what, keep in (
                ("bag", partial(keep_bag, scenario, bag, place / "bag")),
                ("picture", partial(draw_moment, scenario, place / PICTURE)),
            ):
                try:
                    lines.append(f"{what}: {keep()}")
                except (ConveyorError, OSError) as error:
                    lines.append(f"{what}: not kept: {error}")
        return lines


_LINES = pytest.StashKey[Lines]()


def pytest_addoption(parser: pytest.Parser) -> None:
    """The option --line-failures."""
    parser.getgroup("conveyor_sim").addoption(
        "--line-failures",
        metavar="DIR",
        default=DEFAULT_FOLDER,
        help="folder for the bag and the picture of every line whose test failed, a folder a test "
        "(default: %(default)s)",
    )


@pytest.fixture
def line(request: pytest.FixtureRequest) -> Iterator[Lines]:
    """Makes lines under test: `line("accumulation_table")`, `line("my_line.yaml", {"seed": 2})` is a Scenario.

    It is recorded as it runs. If the test fails, its bag and a picture are kept (option --line-failures); if it
    passes, nothing is.
    """
    with tempfile.TemporaryDirectory(prefix="conveyor_sim_") as folder:
        lines = Lines(Path(folder))
        request.node.stash[_LINES] = lines
        yield lines
        lines.close()


@pytest.hookimpl(wrapper=True, tryfirst=True)
def pytest_runtest_makereport(
    item: pytest.Item, call: pytest.CallInfo[None]
) -> Generator[None, pytest.TestReport, pytest.TestReport]:
    """Keep what is to be kept while the lines are as they were, and tell where in the report."""
    report = yield
    lines = item.stash.get(_LINES, None)
    if report.failed and call.when != "teardown" and lines is not None and lines.made:
        root = item.config.invocation_params.dir / item.config.getoption("line_failures")
        name = re.sub(r"[^\w.-]+", "_", item.nodeid)[-_LONGEST_NAME:].strip("_")
        report.sections.append(("line at the moment of failure", "\n".join(lines.keep(root / name))))
    return report
