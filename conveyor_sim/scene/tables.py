# SPDX-License-Identifier: Apache-2.0
"""Tables of contacts in CSV files that a scene names."""

import csv
from typing import Any

from conveyor_sim.scene.beside import Beside
from conveyor_sim.scene.problems import Problem
from conveyor_sim.scene.words import shown
from conveyor_sim.support.files import MB, in_mb

_MOST_ROWS = 100_000
_MOST_BYTES = 10 * MB
_MOST_BYTES_TOGETHER = 100 * MB
"""Largest size of all tables of a scene, bytes. A scene may name one file many times."""
_NO_FILE = "expected a list of points [overlap, force]: a scene that is no file has no files beside it"
_ROWS = "expected two numbers a line, overlap and force (m, N)"


def with_tables(data: Any, beside: Beside) -> tuple[Any, list[Problem]]:
    """Return the data of a scene with points instead of paths, and problems of the files.

    Without paths the same object is returned. beside: place of the files.
    """
    contacts = data.get("contacts") if isinstance(data, dict) else None
    if not isinstance(contacts, list):
        return data, []
    problems: list[Problem] = []
    read: list[Any] = []
    left = _MOST_BYTES_TOGETHER
    for index, contact in enumerate(contacts):
        path = contact.get("table") if isinstance(contact, dict) else None
        if not isinstance(path, str):
            read.append(contact)
            continue
        try:
            if left <= 0:
                raise ValueError(f"expected tables of at most {in_mb(_MOST_BYTES_TOGETHER)} together")
            if beside.is_none:
                raise ValueError(_NO_FILE)
            content, is_inside = beside.read(path, _MOST_BYTES, "a CSV file")
            left -= len(content)
            read.append({**contact, "table": _points(content, is_inside)})
        except ValueError as error:
            problems.append(Problem(("contacts", index, "table"), f"{shown(path)} given, {error}"))
    if problems or all(one is other for one, other in zip(read, contacts, strict=True)):
        return data, problems
    return {**data, "contacts": read}, []


def _points(content: bytes, is_inside: bool) -> list[list[float]]:
    """Return the points [overlap, force] of a CSV file. Raise ValueError with the problem.

    is_inside: the file lies in the scene's folder, so it may be quoted.
    """
    try:
        text = content.decode("utf-8-sig")
    except UnicodeDecodeError:
        raise ValueError("expected a CSV file in UTF-8") from None
    points: list[list[float]] = []
    rows = csv.reader(text.splitlines())
    while (row := _next(rows)) is not None:
        cells = [cell.strip() for cell in row]
        if not any(cells):
            continue
        try:
            overlap, force = (float(cell) for cell in cells)
        except ValueError:
            if rows.line_num == 1 and not any(map(_is_number, cells)):
                continue  # the names of the columns
            # A file elsewhere may hold a secret instead of a table.
            wrong = f"is {shown(','.join(row))}" if is_inside else "is something else"
            raise ValueError(f"{_ROWS}: line {rows.line_num} of it {wrong}") from None
        points.append([overlap, force])
        if len(points) > _MOST_ROWS:
            raise ValueError(f"expected at most {_MOST_ROWS} points")
    if not points:
        raise ValueError(f"{_ROWS}: it has none")
    return points


def _next(rows: Any) -> list[str] | None:
    """Return the next row of a CSV reader; None after the last. Raise ValueError for text that is no CSV."""
    try:
        row: list[str] | None = next(rows, None)
    except csv.Error as error:
        raise ValueError(f"{_ROWS}: line {rows.line_num} of it can't be read ({error})") from None
    return row


def _is_number(cell: str) -> bool:
    try:
        float(cell)
    except ValueError:
        return False
    return True
