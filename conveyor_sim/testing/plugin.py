# SPDX-License-Identifier: Apache-2.0
"""Plugin of pytest: fixtures (`line`, `warm_start`, `modbus`, `opcua`), and files of tests that fail or are killed.

pytest loads it in every run by the entry point pytest11. Modules of the simulation are therefore imported when a test
requests a fixture. The entry point in setup.py has the name of the module, so that `-p` does not load it twice.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Generator, Iterator, Mapping
from contextlib import closing
from functools import partial
from hashlib import blake2b
from importlib.util import find_spec
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

if TYPE_CHECKING:
    from conveyor_sim.scene import Scene
    from conveyor_sim.testing.faces import ModbusFaces, OpcUaFaces
    from conveyor_sim.testing.scenario import Scenario

DEFAULT_FOLDER = "line-failures"

_LONGEST_MESSAGE = 300
_LONGEST_NAME = 120


class Lines:
    """Fixture `line`: a function that makes a Scenario, whose inputs are written as it runs."""

    def __init__(self, place: Path) -> None:
        """place: folder for the files of a failed test. While the test runs, the inputs are in a folder beside it."""
        self._place = place
        self._folder: Path | None = None
        self.made: list[tuple[Scenario, Path]] = []
        """Scenarios and the folders of their inputs."""

    def __call__(
        self,
        scene: Scene | str | PathLike[str],
        overrides: Mapping[str, Any] | None = None,
        *,
        parameters: Mapping[str, Any] | None = None,
        variant: str | None = None,
        format: str | None = None,
        start: str | PathLike[str] | None = None,
        history: float | None = None,
    ) -> Scenario:
        """Return a Scenario. Parameters and exceptions are those of `Scenario`."""
        from conveyor_sim.testing.evidence import make_folder
        from conveyor_sim.testing.scenario import Scenario

        if self._folder is None:
            self._folder = make_folder(self._place)
        folder = _part(self._folder, len(self.made))
        scenario = Scenario(
            scene,
            overrides,
            parameters=parameters,
            variant=variant,
            format=format,
            start=start,
            inputs=folder,
            history=history,
        )
        self.made.append((scenario, folder))
        return scenario

    def close(self) -> None:
        """End the scenarios and forget them and their inputs."""
        from conveyor_sim.testing.evidence import remove_folder

        made, self.made = self.made, []
        folder, self._folder = self._folder, None
        try:
            for scenario, _ in made:
                scenario.close()
        finally:
            if folder is not None:
                remove_folder(folder)

    def keep(self, place: Path, reason: str = "") -> list[str]:
        """Write bags, pages and pictures to a folder. Return one line per file: its path, or why it is missing.

        reason: message of the test. Inputs stay if no bag could be made from them.
        """
        from conveyor_sim.errors import ConveyorError
        from conveyor_sim.page.watch import Watch
        from conveyor_sim.testing.evidence import PAGE, PICTURE, SHOWN, draw_moment, keep_bag, keep_page

        lines = []
        for number, (scenario, inputs) in enumerate(self.made):
            part, watch = _part(place, number), Watch(SHOWN)
            for what, keep in (
                ("bag", partial(keep_bag, scenario, inputs, part / "bag", watch)),
                ("page", partial(keep_page, scenario, part / "bag", part / PAGE, watch, reason)),
                ("picture", partial(draw_moment, scenario, part / PICTURE)),
            ):
                # A plugin that limits the time of tests raises `Failed` even while the report is made.
                try:
                    lines.append(f"{what}: {keep()}")
                except (ConveyorError, OSError, pytest.fail.Exception) as error:
                    lines.append(f"{what}: not saved: {error}")
                    if what == "bag":
                        lines.append(f"inputs: {inputs} (`conveyor-sim recover` makes the bag)")
                        self._folder = None
        return lines


class WarmStarts:
    """Fixture `warm_start`: a function that warms up a line, and returns a checkpoint to start from."""

    def __init__(self, folder: Path, place: Path) -> None:
        """folder: folder of the checkpoints. place: as for Lines, for a warm-up that fails."""
        self._folder = folder
        self._made: dict[tuple[str, Callable[[Scenario], object]], Path] = {}
        self.lines = Lines(place)
        """Lines that are being warmed up."""

    def __call__(
        self,
        scene: Scene | str | PathLike[str],
        warm_up: Callable[[Scenario], object],
        overrides: Mapping[str, Any] | None = None,
    ) -> Path:
        """Return the checkpoint of a line after `warm_up`, for `line(scene, overrides, start=...)`.

        `warm_up` is called once per scene. Raises the exceptions of Scenario and of `warm_up`.
        """
        from conveyor_sim.control.scan import ControlError
        from conveyor_sim.testing.scenario import scene_of

        loaded = scene_of(scene, overrides)
        digest = blake2b(f"{loaded.source_text}\0{loaded.overrides_text}".encode(), digest_size=6).hexdigest()
        if (digest, warm_up) not in self._made:
            plant = self.lines(loaded)
            warm_up(plant)
            path = self._folder / f"{digest}_{len(self._made) + 1}.npz"
            try:
                plant.save(path)
            except ControlError:  # its memory can't be saved: tests attach a new controller
                plant.simulation.save(path)
            self.lines.close()
            self._made[digest, warm_up] = path
        return self._made[digest, warm_up]


_LINES = pytest.StashKey[Lines]()
_WARMING = pytest.StashKey[Lines]()


def pytest_addoption(parser: pytest.Parser) -> None:
    """Add the option --line-failures."""
    parser.getgroup("conveyor_sim").addoption(
        "--line-failures",
        metavar="DIR",
        default=DEFAULT_FOLDER,
        help="folder for the bag, the page and the picture of every line whose test failed, one folder per test "
        "(default: %(default)s)",
    )


@pytest.fixture
def line(request: pytest.FixtureRequest) -> Iterator[Lines]:
    """Make lines under test: `line("accumulation_table")`, `line("my_line.yaml", {"seed": 2})` is a Scenario.

    `line("my_line.yaml", parameters={"length": "3 m"}, variant="long", format="half")` chooses a version of the scene.

    `start="warm.npz"` begins from a checkpoint. The inputs are written as the line runs. If the test fails, a bag, a
    page and a picture are made from them (option --line-failures). If it passes, the inputs are removed. A test that
    is killed leaves its inputs.
    """
    lines = Lines(_root(request.config) / _name(request.node))
    request.node.stash[_LINES] = lines
    yield lines
    lines.close()


@pytest.fixture
def modbus() -> Iterator[ModbusFaces]:
    """Serve lines to Modbus TCP clients: `modbus(my_line, role="operator").port`. Skip the test without pymodbus."""
    from conveyor_sim.testing.faces import MODBUS_MISSING, ModbusFaces

    if find_spec("pymodbus") is None:
        pytest.skip(MODBUS_MISSING)
    with closing(ModbusFaces()) as faces:
        yield faces


@pytest.fixture
def opcua() -> Iterator[OpcUaFaces]:
    """Serve lines to OPC UA clients: `opcua(my_line, users={"jo": ("operator", "secret")}).address`.

    Skip the test without asyncua.
    """
    from conveyor_sim.testing.faces import OPCUA_MISSING, OpcUaFaces

    if find_spec("asyncua") is None:
        pytest.skip(OPCUA_MISSING)
    with closing(OpcUaFaces()) as faces:
        yield faces


@pytest.fixture(scope="session")
def warm_start(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Iterator[WarmStarts]:
    """Warm up a line once for many tests: `warm_start("my_line.yaml", fill)` calls `fill` with a Scenario.

    It returns a checkpoint, from which each test starts: `line("my_line.yaml", start=...)`. The files are temporary.
    Each process of pytest-xdist makes its own.
    """
    starts = WarmStarts(tmp_path_factory.mktemp("warm_start"), _root(request.config) / "warm_start")
    request.config.stash[_WARMING] = starts.lines
    yield starts
    starts.lines.close()


@pytest.hookimpl(wrapper=True, tryfirst=True)
def pytest_runtest_makereport(
    item: pytest.Item, call: pytest.CallInfo[None]
) -> Generator[None, pytest.TestReport, pytest.TestReport]:
    """Write the files of a failed test while its lines exist, and list them in the report."""
    report = yield
    lines, warming = item.stash.get(_LINES, None), item.config.stash.get(_WARMING, None)
    place = _root(item.config) / _name(item)
    if report.failed and call.when != "teardown" and lines is not None and lines.made:
        report.sections.append(("line at the moment of failure", "\n".join(lines.keep(place, _message(call)))))
    if warming is not None and warming.made:
        if report.failed:
            kept = warming.keep(place.with_name(f"{place.name}_warm_up"), _message(call))
            report.sections.append(("line at the moment when its warm-up failed", "\n".join(kept)))
        warming.close()
    return report


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter, config: pytest.Config) -> None:
    """List inputs left by killed tests."""
    root = _root(config)
    if not root.is_dir():
        return
    from conveyor_sim.testing.evidence import left_over

    if folders := left_over(root):
        terminalreporter.section("inputs left by killed tests")
        for folder in folders:
            terminalreporter.write_line(f"{folder}: `conveyor-sim recover {folder}` makes the bag")


def _message(call: pytest.CallInfo[None]) -> str:
    """Return the first line of the exception that failed a test."""
    return "" if call.excinfo is None else call.excinfo.exconly(tryshort=True).partition("\n")[0][:_LONGEST_MESSAGE]


def _root(config: pytest.Config) -> Path:
    return config.invocation_params.dir / str(config.getoption("line_failures"))


def _name(item: pytest.Item) -> str:
    return re.sub(r"[^\w.-]+", "_", item.nodeid)[-_LONGEST_NAME:].strip("_")


def _part(folder: Path, number: int) -> Path:
    return folder if number == 0 else folder / f"line_{number + 1}"
