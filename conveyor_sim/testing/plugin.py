"""The pytest plugin: fixtures (`line`, `warm_start`, `modbus`, `opcua`), and what tests leave that fail or are killed.

pytest loads it in every run by the entry point pytest11, so nothing of the simulation is imported until a test asks
for a fixture. setup.py names it there by its module, so that `-p` of the same name does not load it twice.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Generator, Iterator, Mapping
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

_LONGEST_NAME = 120


class Lines:
    """What the fixture `line` is: called, it makes a Scenario whose inputs are written as it runs."""

    def __init__(self, place: Path) -> None:
        """place: folder for what is left if the test fails; while it runs, the inputs are in one beside it."""
        self._place = place
        self._folder: Path | None = None
        self.made: list[tuple[Scenario, Path]] = []
        """Scenarios and the folders of their inputs."""

    def __call__(
        self,
        scene: Scene | str | PathLike[str],
        overrides: Mapping[str, Any] | None = None,
        *,
        start: str | PathLike[str] | None = None,
        history: float | None = None,
    ) -> Scenario:
        """A Scenario; arguments and errors as there."""
        from conveyor_sim.testing.scenario import Scenario
        from conveyor_sim.testing.unfinished import make_folder

        if self._folder is None:
            self._folder = make_folder(self._place)
        folder = _part(self._folder, len(self.made))
        scenario = Scenario(scene, overrides, start=start, inputs=folder, history=history)
        self.made.append((scenario, folder))
        return scenario

    def close(self) -> None:
        """End the scenarios and forget them and their inputs."""
        from conveyor_sim.testing.unfinished import remove_folder

        made, self.made = self.made, []
        folder, self._folder = self._folder, None
        try:
            for scenario, _ in made:
                scenario.close()
        finally:
            if folder is not None:
                remove_folder(folder)

    def keep(self, place: Path) -> list[str]:
        """Keep bags, pages and pictures in a folder; one line each, to be shown: where it is, or why it is not.

        Inputs of which no bag could be made stay where they are.
        """
        from conveyor_sim.errors import ConveyorError
        from conveyor_sim.page.watch import Watch
        from conveyor_sim.testing.evidence import PAGE, PICTURE, SHOWN, draw_moment, keep_bag, keep_page

        lines = []
        for number, (scenario, inputs) in enumerate(self.made):
            part, watch = _part(place, number), Watch(SHOWN)
            for what, keep in (
                ("bag", partial(keep_bag, scenario, inputs, part / "bag", watch)),
                ("page", partial(keep_page, scenario, part / "bag", part / PAGE, watch)),
                ("picture", partial(draw_moment, scenario, part / PICTURE)),
            ):
                # A plugin that limits a test's time ends by `Failed` what is done for its report, too.
                try:
                    lines.append(f"{what}: {keep()}")
                except (ConveyorError, OSError, pytest.fail.Exception) as error:
                    lines.append(f"{what}: not kept: {error}")
                    if what == "bag":
                        lines.append(f"inputs: {inputs} (`conveyor-sim recover` makes the bag)")
                        self._folder = None
        return lines


class WarmStarts:
    """What the fixture `warm_start` is: called, it warms up a line and gives the checkpoint to start from."""

    def __init__(self, folder: Path, place: Path) -> None:
        """folder: for the checkpoints. place: as for Lines, of a warm-up that fails."""
        self._folder = folder
        self._made: dict[tuple[str, Callable[[Scenario], object]], Path] = {}
        self.lines = Lines(place)
        """Those that are being warmed up."""

    def __call__(
        self,
        scene: Scene | str | PathLike[str],
        warm_up: Callable[[Scenario], object],
        overrides: Mapping[str, Any] | None = None,
    ) -> Path:
        """The checkpoint of a line that `warm_up` has run, for `line(scene, overrides, start=...)`.

        It is called once for a scene, however often this is. Raises as Scenario, and whatever `warm_up` raises.
        """
        from conveyor_sim.control.scan import ControlError
        from conveyor_sim.testing.scene_of import scene_of

        loaded = scene_of(scene, overrides)
        digest = blake2b(f"{loaded.source_text}\0{loaded.overrides_text}".encode(), digest_size=6).hexdigest()
        if (digest, warm_up) not in self._made:
            plant = self.lines(loaded)
            warm_up(plant)
            path = self._folder / f"{digest}_{len(self._made) + 1}.npz"
            try:
                plant.save(path)
            except ControlError:  # one that can't be held: tests attach a new one, as they may
                plant.simulation.save(path)
            self.lines.close()
            self._made[digest, warm_up] = path
        return self._made[digest, warm_up]


_LINES = pytest.StashKey[Lines]()
_WARMING = pytest.StashKey[Lines]()


def pytest_addoption(parser: pytest.Parser) -> None:
    """The option --line-failures."""
    parser.getgroup("conveyor_sim").addoption(
        "--line-failures",
        metavar="DIR",
        default=DEFAULT_FOLDER,
        help="folder for the bag, the page and the picture of every line whose test failed, a folder a test "
        "(default: %(default)s)",
    )


@pytest.fixture
def line(request: pytest.FixtureRequest) -> Iterator[Lines]:
    """Makes lines under test: `line("accumulation_table")`, `line("my_line.yaml", {"seed": 2})` is a Scenario.

    `start="warm.npz"` begins from a checkpoint. The inputs are written as the line runs. If the test fails, a bag is
    made of them and kept with a page and a picture (option --line-failures); if it passes, nothing is. A test that is
    killed leaves its inputs.
    """
    lines = Lines(_root(request.config) / _name(request.node))
    request.node.stash[_LINES] = lines
    yield lines
    lines.close()


@pytest.fixture
def modbus() -> Iterator[ModbusFaces]:
    """Serves lines to Modbus TCP clients: `modbus(my_line, role="operator").port`. Skips a test without pymodbus."""
    from conveyor_sim.testing.faces import MODBUS_MISSING, ModbusFaces

    if find_spec("pymodbus") is None:
        pytest.skip(MODBUS_MISSING)
    with ModbusFaces() as faces:
        yield faces


@pytest.fixture
def opcua() -> Iterator[OpcUaFaces]:
    """Serves lines to OPC UA clients: `opcua(my_line, users={"jo": ("operator", "secret")}).address`. Skips a test
    without asyncua.
    """
    from conveyor_sim.testing.faces import OPCUA_MISSING, OpcUaFaces

    if find_spec("asyncua") is None:
        pytest.skip(OPCUA_MISSING)
    with OpcUaFaces() as faces:
        yield faces


@pytest.fixture(scope="session")
def warm_start(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Iterator[WarmStarts]:
    """Warms up a line once for many tests: `warm_start("my_line.yaml", fill)` calls `fill` with a Scenario.

    It returns a checkpoint of what that leaves, from which each test starts: `line("my_line.yaml", start=...)`. The
    files are temporary; processes of pytest-xdist have their own.
    """
    starts = WarmStarts(tmp_path_factory.mktemp("warm_start"), _root(request.config) / "warm_start")
    request.config.stash[_WARMING] = starts.lines
    yield starts
    starts.lines.close()


@pytest.hookimpl(wrapper=True, tryfirst=True)
def pytest_runtest_makereport(
    item: pytest.Item, call: pytest.CallInfo[None]
) -> Generator[None, pytest.TestReport, pytest.TestReport]:
    """Keep what is to be kept while the lines are as they were, and tell where in the report."""
    report = yield
    lines, warming = item.stash.get(_LINES, None), item.config.stash.get(_WARMING, None)
    place = _root(item.config) / _name(item)
    if report.failed and call.when != "teardown" and lines is not None and lines.made:
        report.sections.append(("line at the moment of failure", "\n".join(lines.keep(place))))
    if warming is not None and warming.made:
        if report.failed:
            kept = warming.keep(place.with_name(f"{place.name}_warm_up"))
            report.sections.append(("line at the moment when its warm-up failed", "\n".join(kept)))
        warming.close()
    return report


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter, config: pytest.Config) -> None:
    """Say what tests that were killed have left."""
    root = _root(config)
    if not root.is_dir():
        return
    from conveyor_sim.testing.unfinished import left_over

    if folders := left_over(root):
        terminalreporter.section("inputs that killed tests have left")
        for folder in folders:
            terminalreporter.write_line(f"{folder}: `conveyor-sim recover {folder}` makes the bag")


def _root(config: pytest.Config) -> Path:
    return config.invocation_params.dir / str(config.getoption("line_failures"))


def _name(item: pytest.Item) -> str:
    return re.sub(r"[^\w.-]+", "_", item.nodeid)[-_LONGEST_NAME:].strip("_")


def _part(folder: Path, number: int) -> Path:
    return folder if number == 0 else folder / f"line_{number + 1}"
