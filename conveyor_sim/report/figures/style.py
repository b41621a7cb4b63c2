# SPDX-License-Identifier: Apache-2.0
"""One look for all pictures: colours that read for everybody, and files whose bytes depend on the data alone."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from io import BytesIO
from pathlib import Path
from textwrap import wrap
from typing import Any, Final

import matplotlib
import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import Colormap, LinearSegmentedColormap
from matplotlib.figure import Figure
from matplotlib.layout_engine import ConstrainedLayoutEngine
from numpy.typing import NDArray

from conveyor_sim.errors import ConveyorError
from conveyor_sim.report.figures.files import PNG_AND_SVG, Picture, write

INK: Final = "#1f2933"
MUTED: Final = "#616e7c"
GRID: Final = "#d5dbe1"
RAIL: Final = "#111827"
BELT_EDGE: Final = "#98a4b0"
CHEVRON: Final = "#5b6875"
BOTTLE_EDGE: Final = "#243b53"
FORCE: Final = "#d1330d"
INFEED: Final = "#00735c"
OUTFEED: Final = "#a3447f"
PHOTO_EYE: Final = "#c2410c"
COUNTER: Final = "#5b21b6"
INSPECTION: Final = "#0e5a8a"
ZONE: Final = "#4d5f0a"
# Okabe and Ito's palette without its yellow, which is too faint for lines on white.
SERIES: Final = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#56b4e9", "#e69f00")

# Pale when slow, dark when fast: bottles that queue are slow, and the lines of force on them must stand out.
SPEED: Final[Colormap] = LinearSegmentedColormap.from_list(
    "speed", matplotlib.colormaps["YlGnBu"](np.linspace(0.03, 0.84, 256))
)

_PNG_DPI: Final = 150
_SVG_DPI: Final = 90  # of what an SVG holds as a picture
_SAVED: Final[dict[str, dict[str, Any]]] = {
    ".png": {"dpi": _PNG_DPI, "metadata": {"Software": None}},
    ".svg": {"dpi": _SVG_DPI, "metadata": {"Date": None, "Creator": None}},
}

_RC: Final[dict[Any, Any]] = {
    "font.family": "DejaVu Sans",
    "font.size": 10.0,
    "axes.titlesize": 11.0,
    "axes.titleweight": "bold",
    "axes.titlelocation": "left",
    "axes.labelcolor": INK,
    "axes.edgecolor": MUTED,
    "axes.linewidth": 0.8,
    "axes.axisbelow": True,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": False,
    "grid.color": GRID,
    "grid.linewidth": 0.7,
    "text.color": INK,
    "xtick.color": MUTED,
    "ytick.color": MUTED,
    "xtick.labelcolor": INK,
    "ytick.labelcolor": INK,
    "legend.frameon": False,
    "figure.facecolor": "white",
    "savefig.facecolor": "white",
    "svg.hashsalt": "conveyor_sim",
    "svg.fonttype": "path",
    "path.simplify": True,
}
_AIR = 0.09  # inches above and below axes
_LISTED = 10
_LETTERS_PER_INCH = 12


@contextmanager
def look() -> Iterator[None]:
    """Apply the drawing style, independent of the user's matplotlib settings, to all drawing and saving."""
    with matplotlib.rc_context():
        matplotlib.rcdefaults()
        matplotlib.rcParams.update(_RC)
        yield


def new_figure(width: float, height: float) -> Figure:
    """Return a figure of `width` by `height` inches on the Agg canvas, laid out without overlaps."""
    figure = Figure(figsize=(width, height), layout="constrained")
    FigureCanvasAgg(figure)
    return figure


def freeze(figure: Figure) -> None:
    """Keep the layout found by the last drawing: to find it again takes as long as drawing."""
    figure.set_layout_engine(None)


def lay_out(figure: Figure) -> None:
    """Find the layout that the PNG has, and keep it: matplotlib would draw the whole figure once more to find it."""
    engine = figure.get_layout_engine()
    if engine is not None:
        dpi = figure.dpi
        figure.set_dpi(_PNG_DPI)
        engine.execute(figure)
        freeze(figure)
        figure.set_dpi(dpi)


def rendered(figure: Figure, suffixes: Sequence[str] = PNG_AND_SVG) -> Picture:
    """Return a figure as files of these suffixes; equal figures give equal bytes."""
    lay_out(figure)
    picture = {}
    for suffix in suffixes:
        content = BytesIO()
        figure.savefig(content, format=suffix[1:], **_SAVED[suffix])
        picture[suffix] = content.getvalue()
    return picture


def save(figure: Figure, stem: Path) -> list[Path]:
    """Write `stem`.png and `stem`.svg. Raises ConveyorError if the files can't be written."""
    return write(rendered(figure), stem)


def save_png(figure: Figure, path: Path) -> Path:
    """Write a PNG alone. Raises ConveyorError if it can't be written."""
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        figure.savefig(path, **_SAVED[".png"])
    except OSError as error:
        raise ConveyorError(f"{path} can't be written: {error.strerror or error}") from error
    return path


def pale(colour: NDArray[np.float64], strength: float) -> NDArray[np.float64]:
    """RGBA colours (..., 4) mixed with white; `strength` 1 leaves them as they are, 0 gives white."""
    mixed = 1.0 - strength * (1.0 - colour)
    mixed[..., 3] = 1.0
    return mixed


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
    figure.supxlabel("\n".join(lines), x=0.01, ha="left", fontsize=9.0, color=FORCE)
