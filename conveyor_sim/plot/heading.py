"""The heading of a figure."""

from __future__ import annotations

from matplotlib.figure import Figure
from matplotlib.layout_engine import ConstrainedLayoutEngine

_AIR = 0.09  # inches above and below axes


def heading(figure: Figure, text: str) -> None:
    """Above all axes, at the left, in as many lines as it takes."""
    figure.suptitle(text, x=0.01, ha="left", fontsize=13.0, fontweight="bold", wrap=True)
    engine = figure.get_layout_engine()
    assert isinstance(engine, ConstrainedLayoutEngine)
    engine.set(h_pad=_AIR)
