# SPDX-License-Identifier: Apache-2.0
"""`TimedActions`: actions of an operator at the panel, at simulated times, from a file in CSV or YAML."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any

from conveyor_sim.errors import CommandError
from conveyor_sim.line.commands.inputs import OPERATE, SET, Input
from conveyor_sim.line.commands.panel_actions import PanelInputs
from conveyor_sim.scene.quantities import is_finite, to_si
from conveyor_sim.scene.yaml_lines import Document
from conveyor_sim.simulation import Simulation
from conveyor_sim.support.files import MB, FileError, read_file
from conveyor_sim.support.printable import printable

COLUMNS = ("time", "action")
"""Fields of an action."""

_ROUNDING = 1e-9


class TimedActions:
    """Inputs of an operator by the tick at whose start they act."""

    def __init__(self, path: Path, simulation: Simulation) -> None:
        """Read a file. Raise CommandError for a wrong line, with its number, field, value and expectation."""
        self._simulation = simulation
        inputs, tick = PanelInputs(simulation.process_image.tags), simulation.scene.tick
        self._by_tick: dict[int, list[Input]] = {}
        for place, time, action in _rows(path):
            try:
                seconds = _seconds(time)
                name, value = inputs.parse(action if isinstance(action, str) else "")
            except ValueError as error:
                raise CommandError(f"{path}:{place}: time: {printable(time)} given, {error}") from None
            except CommandError as error:
                raise CommandError(f"{path}:{place}: action: {error}") from None
            request = Input(OPERATE, "operator", "operator", SET, (name,), (value,))
            self._by_tick.setdefault(math.ceil(seconds / tick - _ROUNDING), []).append(request)

    def before_tick(self) -> None:
        """Give the inputs of the present tick."""
        for request in self._by_tick.get(self._simulation.tick, ()):
            self._simulation.give(request)


def _seconds(time: Any) -> float:
    """Return a time in s. Raise ValueError with an expectation."""
    seconds = time
    if isinstance(time, str):
        try:
            seconds = float(time)
        except ValueError:
            with suppress(ValueError):
                seconds = to_si(time, "s")
    if not is_finite(seconds) or seconds < 0.0:
        raise ValueError("expected a time such as 2.5 s, 0 s or more")
    return float(seconds)


def _rows(path: Path) -> Iterator[tuple[int, Any, Any]]:
    """Yield line, time and action of each entry. Raise CommandError for a file of another form."""
    try:
        text = read_file(path, MB).decode("utf-8-sig")
    except FileError as error:
        raise CommandError(f"{path}: {error}, expected a file of actions") from error
    except UnicodeDecodeError:
        raise CommandError(f"{path}: is not UTF-8, expected a file of actions") from None
    yield from _yaml_rows(text, path) if path.suffix in (".yaml", ".yml") else _csv_rows(text, path)


def _csv_rows(text: str, path: Path) -> Iterator[tuple[int, Any, Any]]:
    reader = csv.reader(io.StringIO(text), strict=True)
    try:
        header = next(reader, [])
        if tuple(cell.strip() for cell in header) != COLUMNS:
            raise CommandError(f"{path}:1: {printable(','.join(header))} given, expected {','.join(COLUMNS)}")
        for cells in reader:
            if not cells:
                continue
            if len(cells) != len(COLUMNS):
                raise CommandError(f"{path}:{reader.line_num}: {len(cells)} cells given, expected a time and an action")
            yield reader.line_num, cells[0].strip(), cells[1]
    except csv.Error as error:
        raise CommandError(f"{path}:{reader.line_num}: not valid CSV: {error}") from None


def _yaml_rows(text: str, path: Path) -> Iterator[tuple[int, Any, Any]]:
    document = Document(text, str(path))
    if not isinstance(document.data, list):
        raise CommandError(f"{path}:1: no list given, expected a list of {{time, action}}")
    for place, entry in enumerate(document.data):
        line = document.line_of((place,))
        if not isinstance(entry, dict) or set(entry) != set(COLUMNS):
            found = ", ".join(map(str, entry)) if isinstance(entry, dict) else type(entry).__name__
            raise CommandError(f"{path}:{line}: {printable(found)} given, expected the fields {' and '.join(COLUMNS)}")
        yield line, entry["time"], entry["action"]
