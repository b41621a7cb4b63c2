# SPDX-License-Identifier: Apache-2.0
"""Notes beside points: no note on another, on a point or on a line, if there is room for it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from conveyor_sim.report.figures import style
from conveyor_sim.report.figures.data import Floats

_CELL: Final = 3.0  # pixels of the map of what is taken
_DIRECTIONS: Final = np.stack([np.cos(np.arange(16) * np.pi / 8), np.sin(np.arange(16) * np.pi / 8)], axis=1)


@dataclass(frozen=True)
class Note:
    """A text to place beside `at`, in data coordinates."""

    text: str
    at: tuple[float, float]
    colour: str = style.INK
    points: float = 7.5
    gaps: tuple[float, ...] = (7.0,)
    """Pixels from the point that it may stand away, best first."""
    needed: bool = False
    """Stands where it covers least; else it is left out where it would cover anything."""
    box: dict[str, Any] = field(default_factory=dict)
    """Box around the text, as in matplotlib's bbox; a line then connects it to its point."""


def place_notes(ax: Axes, notes: Sequence[Note], points: Floats, lines: Sequence[Floats]) -> None:
    """Put each note, in the given order, clear of `points` (n, 2), `lines` (k, 2 each), texts of the axes and notes.

    The axes must have their final limits; the figure is laid out here.
    """
    figure = ax.figure
    assert isinstance(figure, Figure)
    figure.draw_without_rendering()
    style.freeze(figure)
    area = ax.get_window_extent()
    taken = _Taken(area.width, area.height)
    origin = np.array([area.x0, area.y0])
    for x, y in ax.transData.transform(points) - origin if len(points) else []:
        taken.fill(x - 5.0, y - 5.0, x + 5.0, y + 5.0)
    for line in lines:
        taken.line(ax.transData.transform(line) - origin)
    for text in ax.texts:
        extent = text.get_window_extent()
        taken.fill(extent.x0 - area.x0, extent.y0 - area.y0, extent.x1 - area.x0, extent.y1 - area.y0)
    for note in notes:
        _put(ax, note, taken, origin)


def _put(ax: Axes, note: Note, taken: _Taken, origin: Floats) -> None:
    text = ax.text(
        *note.at,
        note.text,
        fontsize=note.points,
        color=note.colour,
        ha="center",
        va="center",
        linespacing=1.3,
        zorder=9.0,
        bbox=note.box or None,
    )
    text.set_in_layout(False)
    extent = text.get_window_extent()
    size = np.array([extent.width, extent.height]) + (14.0 if note.box else 0.0)
    anchor = ax.transData.transform(note.at) - origin
    reach = 0.5 * np.abs(_DIRECTIONS) @ size
    centres = [anchor + (gap + reach)[:, None] * _DIRECTIONS for gap in note.gaps]
    costs = np.array([taken.share(*(c - 0.5 * size), *(c + 0.5 * size)) for ring in centres for c in ring])
    best = int(np.argmin(costs + 1e-3 * (np.arange(len(costs)) // len(_DIRECTIONS))))
    if costs[best] > 0.0 and not note.needed:
        text.remove()
        return
    centre = np.concatenate(centres)[best]
    x, y = ax.transData.inverted().transform(centre + origin)
    text.set_position((float(x), float(y)))
    if note.box:
        ends = np.array([note.at, text.get_position()])
        ax.plot(*ends.T, color=note.colour, linewidth=0.8, zorder=2.5)
        taken.line(np.array([anchor, centre]))
    taken.fill(*(centre - 0.5 * size), *(centre + 0.5 * size))


class _Taken:
    """A map of cells of the axes: 1 where something is, and everywhere outside."""

    def __init__(self, width: float, height: float) -> None:
        self._cells: NDArray[np.float64] = np.zeros((int(height // _CELL) + 1, int(width // _CELL) + 1))

    def fill(self, x0: float, y0: float, x1: float, y1: float) -> None:
        """Take a box, in pixels from the axes' corner."""
        low, high = self._cell(x0, y0), self._cell(x1, y1) + 1
        self._cells[max(0, low[1]) : max(0, high[1]), max(0, low[0]) : max(0, high[0])] = 1.0

    def line(self, line: Floats) -> None:
        """Take a polyline (n, 2), in pixels from the axes' corner."""
        for x, y in _dense(line):
            self.fill(x - 1.0, y - 1.0, x + 1.0, y + 1.0)

    def share(self, x0: float, y0: float, x1: float, y1: float) -> float:
        """Return the occupied share of a box; more than 1 if it reaches beyond the axes."""
        low, high = self._cell(x0, y0), self._cell(x1, y1) + 1
        rows, columns = self._cells.shape
        if low.min() < 0 or high[0] > columns or high[1] > rows:
            return 2.0
        return float(self._cells[low[1] : high[1], low[0] : high[0]].mean())

    def _cell(self, x: float, y: float) -> NDArray[np.int64]:
        return np.floor(np.array([x, y]) / _CELL).astype(np.int64)


def _dense(line: Floats) -> Floats:
    """Points (n, 2) along a polyline in pixels, no further apart than a cell."""
    legs = np.hypot(*np.diff(line, axis=0).T)
    parts = [np.linspace(line[i], line[i + 1], int(leg // _CELL) + 2) for i, leg in enumerate(legs)]
    return np.concatenate(parts) if parts else line
