# SPDX-License-Identifier: Apache-2.0
"""Pictures of docs/performance/ from its raw numbers: python docs/studies/performance_pictures.py.

Needs matplotlib and Pillow, as the tests do.
"""

from __future__ import annotations

import io
import sys
from collections.abc import Callable, Mapping
from pathlib import Path

from matplotlib.figure import Figure
from PIL import Image

ROOT = Path(__file__).resolve().parents[2]
IMAGES = ROOT / "docs" / "images"
sys.path.insert(0, str(ROOT))

from bench import control, dense, isolation, node, studies, whole  # noqa: E402
from bench import start as first_tick  # noqa: E402
from bench.growth import OURS  # noqa: E402
from bench.measure import RATE  # noqa: E402
from bench.rows import Rows, Spread  # noqa: E402
from conveyor_sim.report.figures import style  # noqa: E402

BOTTLES = 1000.0
"""Number of bottles of the dense table."""
BAR = 0.45
"""Height of a bar, inches."""


def read(part: str) -> Rows:
    """Return the raw numbers of a part."""
    return Rows.read(ROOT / "docs" / "performance" / f"{part}.csv")


def bars_of(part: str, case: str, size: float, quantity: str) -> dict[str, Spread]:
    """Return the measurements of one quantity by contestant."""
    rows = read(part)
    spreads = {name: rows.spread(case, size, name, quantity) for name in rows.contestants(case)}
    return {name: spread for name, spread in spreads.items() if spread is not None}


def bars(unit: str, groups: Mapping[str, Mapping[str, Spread]]) -> Figure:
    """Return horizontal bars, one colour per group, with lines from the least to the greatest measurement."""
    names = list(dict.fromkeys(name for group in groups.values() for name in group))
    figure = style.new_figure(8.0, BAR * len(names) * (1 + (len(groups) - 1) / 2) + 1.2)
    ax = figure.subplots()
    height = 0.8 / len(groups)
    for index, (label, group) in enumerate(groups.items()):
        rows = [names.index(name) + (index - (len(groups) - 1) / 2) * height for name in group]
        middles = [bar.middle for bar in group.values()]
        errors = [
            [bar.middle - bar.least for bar in group.values()],
            [bar.greatest - bar.middle for bar in group.values()],
        ]
        ax.barh(
            rows, middles, height, xerr=errors, color=style.SERIES[index], ecolor=style.INK, capsize=2.0, label=label
        )
        for row, bar in zip(rows, group.values(), strict=True):
            ax.annotate(
                f"{bar.middle:.3g}", (bar.greatest, row), (4, 0), textcoords="offset points", va="center", fontsize=9
            )
    ax.set_yticks(range(len(names)), names)
    ax.invert_yaxis()
    ax.set_xlabel(unit)
    ax.margins(x=0.1)
    if len(groups) > 1:
        ax.legend()
    return figure


def sorted_bars(unit: str, group: Mapping[str, Spread]) -> Figure:
    """Return horizontal bars from the greatest to the smallest."""
    return bars(unit, {"": dict(sorted(group.items(), key=lambda bar: -bar[1].middle))})


def kernels() -> Figure:
    """Return the rates of a dense table."""
    return sorted_bars(f"{RATE}, 1 000 bottles", bars_of("dense", dense.CASE, BOTTLES, RATE))


def growth() -> Figure:
    """Return the time of a bottle-step against the number of bottles."""
    rows = read("growth")
    sizes = rows.ns("bottles")
    rates = [rows.spread("bottles", size, OURS, RATE) for size in sizes]
    times = [1e3 / rate.middle for rate in rates if rate is not None]
    figure = style.new_figure(8.0, 3.2)
    ax = figure.subplots()
    ax.plot(sizes, times, "o-", color=style.SERIES[0])
    for size, time in zip(sizes, times, strict=True):
        ax.annotate(f"{time:.3g}", (size, time), (0, 7), textcoords="offset points", ha="center")
    ax.set(xscale="log", xlabel="bottles on the dense table", ylabel="ns per bottle-step", ylim=(0.0, 1.2 * max(times)))
    return figure


def lines() -> Figure:
    """Return the speeds of shipped lines."""
    return sorted_bars("times real time, one thread", bars_of("control", control.CASE, 0.0, control.FACTOR))


def study_rates() -> Figure:
    """Return the rates of a study by its processes."""
    return bars("runs of 60 s per minute, on two cores", {"": bars_of("studies", studies.SCALING, 0.0, studies.RATE)})


def start() -> Figure:
    """Return the times from the start of a process to the first tick, and of complete commands."""
    first = bars_of("start", first_tick.CASE, 0.0, first_tick.SECONDS)
    named = {f"first tick, kernels {'cached' if name == 'cached' else 'compiled'}": bar for name, bar in first.items()}
    return bars("wall time, s", {"": {**named, **bars_of("whole", whole.CASE, 0.0, whole.WALL)}})


def latency() -> Figure:
    """Return the times from a command to its result."""
    rows = read("node")
    spreads = {
        f"{size:,} bottles, {pace}".replace(",", " ", 1): rows.spread(node.CASE, size, pace, node.LATENCY)
        for size in node.SIZES
        for pace in (node.REAL_TIME, node.FREE)
    }
    return bars(
        "ms from a command to its result", {"": {name: bar for name, bar in spreads.items() if bar is not None}}
    )


def attacks() -> Figure:
    """Return the latencies of Modbus and the page while the OPC UA server is attacked."""
    groups = {}
    for client in isolation.SERVED:
        spreads = bars_of("isolation", isolation.CASE, 0.0, f"{client}: {isolation.P99}")
        groups[client] = {"no attack" if attack == isolation.NONE else attack: bar for attack, bar in spreads.items()}
    return bars("99th percentile of the latency, ms", groups)


PICTURES: dict[str, Callable[[], Figure]] = {
    "kernels": kernels,
    "growth": growth,
    "lines": lines,
    "studies": study_rates,
    "start": start,
    "node": latency,
    "servers": attacks,
}
"""Pictures by the end of their file's name."""


def draw(name: str) -> Path:
    """Draw a picture. Return its file."""
    with style.look():
        image = Image.open(io.BytesIO(style.rendered(PICTURES[name](), (".png",))[".png"])).convert("RGB")
    image.thumbnail((960, 960))
    file = IMAGES / f"performance_{name}.webp"
    image.save(file, quality=60, method=6)
    return file


def main() -> None:
    """Draw the named pictures, or all."""
    for name in sys.argv[1:] or PICTURES:
        print(draw(name))


if __name__ == "__main__":
    main()
