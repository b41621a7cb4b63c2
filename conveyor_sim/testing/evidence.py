# SPDX-License-Identifier: Apache-2.0
"""Files saved from a failed scenario: its bag, a page of its last seconds, a picture of the moment of failure.

The folder with the inputs of a running test stays if the test is killed.
"""

from __future__ import annotations

import shutil
import tempfile
from contextlib import suppress
from itertools import count
from pathlib import Path

import numpy as np

from conveyor_sim.bag.folder import alone
from conveyor_sim.bag.input_log import input_folders
from conveyor_sim.bag.rerun import rerun
from conveyor_sim.control.scan import ALARMS
from conveyor_sim.errors import BagError
from conveyor_sim.page.one_file import FailedCondition, LastAction, write_page
from conveyor_sim.page.watch import Watch
from conveyor_sim.report.figures import style
from conveyor_sim.report.figures.data import PlantFrame, StaticGeometry
from conveyor_sim.report.figures.moment import MarkedEvent, Trace, moment_figure
from conveyor_sim.report.figures.recording import contact_lines
from conveyor_sim.testing.history import HistoryMark, ScenarioHistory
from conveyor_sim.testing.scenario import Scenario

UNFINISHED = ".unfinished"


def make_folder(place: Path) -> Path:
    """Return a new folder beside the folder for a failed test, or else in the temporary folder of the system."""
    try:
        for number in count(1):
            folder = place.with_name(f"{place.name}{UNFINISHED}{'' if number == 1 else f'_{number}'}")
            place.parent.mkdir(parents=True, exist_ok=True)
            # Another process may have made this folder, or just have removed the empty folder above.
            with suppress(FileExistsError, FileNotFoundError):
                folder.mkdir()
                return folder
    except OSError:
        pass
    return Path(tempfile.mkdtemp(prefix="conveyor_sim_"))


def remove_folder(folder: Path) -> None:
    """Remove a folder of `make_folder`, and the folder above if it is empty."""
    shutil.rmtree(folder, ignore_errors=True)
    if UNFINISHED in folder.name:
        with suppress(OSError):
            folder.parent.rmdir()


def left_over(root: Path) -> list[Path]:
    """Return the folders that killed tests left, without those from which a bag was made."""
    return [folder for folder in sorted(root.glob(f"*{UNFINISHED}*")) if _is_left(folder)]


def _is_left(folder: Path) -> bool:
    parts = [part for part in input_folders(folder) if not (part / "bag").exists()]
    try:
        for part in parts:
            with alone(part / "inputs.jsonl"):
                pass
    except (BagError, OSError):
        return False  # its test is running
    return bool(parts)


PICTURE = "line.png"
PAGE = "line.html"
SHOWN = 120.0
"""Time at the end of the run that the page draws, s."""

EYES = "photo_eyes/"

_BEFORE = 20.0  # s of traces before the time of the assertion
_MOST_ROWS = 10
_MOST_EVENTS = 4


def draw_moment(scenario: Scenario, path: Path) -> Path:
    """Draw the present line, and the last seconds of the signals that its test and controller read, as a PNG.

    Raises ConveyorError if the file can't be written.
    """
    failed, history, time = scenario.failed, scenario.history, scenario.history.time
    length = _BEFORE + (0.0 if failed is None else scenario.time - failed.since)
    shown = slice(int(np.searchsorted(time, time[-1] - length - 1e-9)), None)
    forced = scenario.simulation.line.forcing.names
    traces = [
        Trace(name, history.unit(name), history.kind(name), history[name][shown], name in forced)
        for name in traced(scenario)
    ]
    events = [MarkedEvent(mark.time, _words(mark)) for mark in history.marks][-_MOST_EVENTS:]
    if failed is not None and failed.since < scenario.time:
        events.append(MarkedEvent(failed.since, f"{failed.word} asserted"))
    eyes = [name for name in history.names if name.startswith(EYES) and name.endswith("/blocked")]
    blocked = {name.split("/")[1] for name in eyes if history[name][-1]}
    with style.look():
        figure = moment_figure(
            StaticGeometry.of(scenario.scene),
            _frame(scenario),
            scenario.scene.name,
            scenario.failure,
            blocked,
            time[shown],
            traces,
            sorted((event for event in events if event.time >= time[shown][0]), key=lambda event: event.time),
            forced,
        )
        return style.save_png(figure, path)


def keep_bag(scenario: Scenario, inputs: Path, folder: Path, watch: Watch) -> str:
    """End a scenario, repeat it with its inputs, and record the repetition to a folder, which is replaced.

    watch: observes the repetition. Returns the folder, with the first departure from the scenario, if there is one.
    Raises as `rerun`, and OSError.
    """
    scenario.close()
    folder.parent.mkdir(parents=True, exist_ok=True)
    made = rerun(inputs, inputs / folder.name, watch=watch)
    if folder.exists():
        shutil.rmtree(folder)
    shutil.move(made.bag, folder)
    return f"{folder} ({made.departure})" if made.departure else str(folder)


def keep_page(scenario: Scenario, bag: Path, path: Path, watch: Watch, reason: str = "") -> Path:
    """Write a page from the bag of a scenario: its last seconds, and the events since its start.

    reason: message of the test if no condition failed. Raises BagError, and ConveyorError if the file can't be written.
    """
    return write_page(bag, path, failures=[failure_of(scenario, reason)], watch=watch, trends=traced(scenario))


def failure_of(scenario: Scenario, reason: str = "") -> FailedCondition:
    """Return the failed condition of a scenario with its values, and the last input of the test before it."""
    failed, marks = scenario.failed, scenario.history.marks
    return FailedCondition(
        scenario.time,
        scenario.failure or (f"the test failed: {reason}" if reason else "the test failed"),
        None if failed is None else failed.since,
        scenario.values_at_failure,
        [name for name in scenario.values_at_failure if name in scenario.simulation.line.forcing.names],
        LastAction(marks[-1].time, _words(marks[-1])) if marks else None,
    )


def traced(scenario: Scenario) -> list[str]:
    """Return the names to trace: read by the last conditions, alarms, commands in force, read by the controller."""
    history = scenario.history
    commands = [name for name in scenario.simulation.process_image.command_names if np.isfinite(history[name][-1])]
    alarms = came(history)
    names = dict.fromkeys([*scenario.read_by_conditions, *alarms, *commands, *scenario.read_by_controller])
    return list(names)[:_MOST_ROWS]


def came(history: ScenarioHistory) -> list[str]:
    """Return the names of the alarms that stood at any time, in the order of their first time."""
    columns = {name: history[name] for name in history.names if name.startswith(ALARMS)}
    return sorted((name for name, column in columns.items() if column.any()), key=lambda name: columns[name].argmax())


def _words(mark: HistoryMark) -> str:
    return mark.name if np.isnan(mark.value) else f"{mark.name} = {mark.value:g}"


def _frame(scenario: Scenario) -> PlantFrame:
    simulation = scenario.simulation
    bottles = simulation.bottles()
    return PlantFrame(
        time=simulation.time,
        x=bottles.x,
        y=bottles.y,
        theta=bottles.theta,
        radius=np.asarray(simulation.model.type_radius)[bottles.type],
        speed=np.hypot(bottles.vx, bottles.vy),
        belt_speeds=simulation.belts().actual,
        contacts=contact_lines(bottles, simulation.contacts()),
        moving=simulation.moving_rails(),
    )
