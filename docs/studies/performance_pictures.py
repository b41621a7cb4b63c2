# SPDX-License-Identifier: Apache-2.0
"""Pictures of docs/performance/ from its raw numbers: python docs/studies/performance_pictures.py.

Needs matplotlib and Pillow, as the tests do.
"""

from __future__ import annotations

import io
import sys
from pathlib import Path

from PIL import Image

ROOT = Path(__file__).resolve().parents[2]
IMAGES = ROOT / "docs" / "images"
sys.path.insert(0, str(ROOT))

from bench import control, dense  # noqa: E402
from bench.measure import RATE  # noqa: E402
from bench.rows import Rows, Spread  # noqa: E402
from conveyor_sim.report.figures import style  # noqa: E402

BOTTLES = 1000.0
"""Number of bottles of the dense table."""


def draw(name: str, unit: str, bars: dict[str, Spread]) -> Path:
    """Draw one horizontal bar per contestant, from the smallest value to the largest. Return the picture."""
    bars = dict(sorted(bars.items(), key=lambda bar: bar[1].middle))
    with style.look():
        figure = style.new_figure(8.0, 0.45 * len(bars) + 1.0)
        ax = figure.subplots()
        ax.barh([*bars], [bar.middle for bar in bars.values()], color="#2a6f97")
        for row, bar in enumerate(bars.values()):
            ax.annotate(f"{bar.middle:.3g}", (bar.middle, row), (4, 0), textcoords="offset points", va="center")
        ax.set_xlabel(unit)
        image = Image.open(io.BytesIO(style.rendered(figure, (".png",))[".png"])).convert("RGB")
    image.thumbnail((960, 960))
    file = IMAGES / f"performance_{name}.webp"
    image.save(file, quality=60, method=6)
    return file


def bars_of(part: str, case: str, size: float, quantity: str) -> dict[str, Spread]:
    """Return the measurements of one quantity by contestant."""
    rows = Rows.read(ROOT / "docs" / "performance" / f"{part}.csv")
    found = {name: rows.spread(case, size, name, quantity) for name in rows.contestants(case)}
    return {name: spread for name, spread in found.items() if spread is not None}


def main() -> None:
    """Draw all pictures."""
    rates = bars_of("dense", dense.CASE, BOTTLES, RATE)
    print(draw("kernels", f"{RATE}, 1 000 bottles", rates))
    print(draw("lines", "times real time, one thread", bars_of("control", control.CASE, 0.0, control.FACTOR)))


if __name__ == "__main__":
    main()
