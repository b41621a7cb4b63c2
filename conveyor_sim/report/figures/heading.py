"""The heading of a figure, and what must be said under it."""

from __future__ import annotations

from collections.abc import Sequence
from textwrap import wrap

from matplotlib.figure import Figure
from matplotlib.layout_engine import ConstrainedLayoutEngine

from conveyor_sim.report.figures import style

_AIR = 0.09  # inches above and below axes
_LISTED = 10
_LETTERS_PER_INCH = 12


def heading(figure: Figure, text: str) -> None:
    """Above all axes, at the left, in as many lines as it takes."""
    figure.suptitle(text, x=0.01, ha="left", fontsize=13.0, fontweight="bold", wrap=True)
    engine = figure.get_layout_engine()
    assert isinstance(engine, ConstrainedLayoutEngine)
    engine.set(h_pad=_AIR)


def note_forced(figure: Figure, forced: Sequence[str]) -> None:
    """Below all axes, where any signals are or were forced: controllers did not read what the line had."""
    if not forced:
        return
    more = f" and {len(forced) - _LISTED} more" if len(forced) > _LISTED else ""
    lines = wrap(f"forced: {', '.join(forced[:_LISTED])}{more}", int(_LETTERS_PER_INCH * figure.get_figwidth()))
    figure.supxlabel("\n".join(lines), x=0.01, ha="left", fontsize=9.0, color=style.FORCE)
