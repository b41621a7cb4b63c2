"""Reads the tables of contacts that a scene names by the path of a CSV file."""

import csv
from pathlib import Path as FilePath
from typing import Any

from conveyor_sim.scene.problems import Problem
from conveyor_sim.scene.words import shown

_MOST_ROWS = 100_000


def with_tables(data: Any, folder: FilePath | None) -> tuple[Any, list[Problem]]:
    """The data of a scene with points in place of paths, and what is wrong with the files.

    The very same object comes back if no contact names a file. `folder` is where paths start; None: none can be read.
    """
    contacts = data.get("contacts") if isinstance(data, dict) else None
    if not isinstance(contacts, list):
        return data, []
    problems: list[Problem] = []
    read: list[Any] = []
    for index, contact in enumerate(contacts):
        path = contact.get("table") if isinstance(contact, dict) else None
        if not isinstance(path, str):
            read.append(contact)
            continue
        try:
            read.append({**contact, "table": _points(path, folder)})
        except ValueError as error:
            problems.append(Problem(("contacts", index, "table"), f"{shown(path)} given, {error}"))
    if problems or all(one is other for one, other in zip(read, contacts, strict=True)):
        return data, problems
    return {**data, "contacts": read}, []


def _points(path: str, folder: FilePath | None) -> list[list[float]]:
    """Points [overlap, force] of a CSV file. ValueError that says what is wrong."""
    if folder is None:
        raise ValueError("expected a list of points [overlap, force]: a scene that is no file has no files beside it")
    try:
        text = (folder / path).read_bytes().decode("utf-8-sig")
    except UnicodeDecodeError:
        raise ValueError("expected a CSV file in UTF-8") from None
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or "not a path"
        raise ValueError(f"expected a CSV file beside the scene ({folder / path}: {reason})") from None
    points: list[list[float]] = []
    rows = csv.reader(text.splitlines())
    for row in rows:
        cells = [cell.strip() for cell in row]
        if not any(cells):
            continue
        try:
            overlap, force = (float(cell) for cell in cells)
        except ValueError:
            if not points and rows.line_num == 1:
                continue  # the names of the columns
            wrong = f"line {rows.line_num} of it is {shown(','.join(row))}"
            raise ValueError(f"expected two numbers a line, overlap and force (m, N): {wrong}") from None
        points.append([overlap, force])
        if len(points) > _MOST_ROWS:
            raise ValueError(f"expected at most {_MOST_ROWS} points")
    if not points:
        raise ValueError("expected two numbers a line, overlap and force (m, N): it has none")
    return points
