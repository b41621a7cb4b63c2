# SPDX-License-Identifier: Apache-2.0
"""Speed against error from `fast` to `fine`: the picture of docs/accuracy.md, beside Box2D, pymunk and soft contacts.

    python docs/studies/front.py             # measures what front.csv lacks, two minutes of one core; draws
    python docs/studies/front.py --draw      # draws only

Three errors against true stiffness in converged steps, each against bottles x real time per core (processor time):

- overlap: the largest in a crowd of 1 000 bottles that a belt presses against a wall. Impulses, Box2D and pymunk are
  those of docs/performance/impulses.csv (`make bench ARGS=impulses`); softer contacts, at the same restitution, are
  measured here in explicit steps (`draft`);
- forces: RMS error of single forces in a crowd of CROWD bottles at rest, over that of the forces. All settings start
  from one state at rest, impulses without any held impulse: COLD s or SETTLED s later they are compared;
- flow: the difference of the funnel's throughput from that of the stiff reference, in pairs by seed
  (docs/studies/stiffness_throughput/results.csv). Its speeds are measured here, one run each.
"""

from __future__ import annotations

import csv
import io
import sys
import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, fields
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from PIL import Image

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT), str(Path(__file__).parent / "stiffness_throughput")]

import compare  # noqa: E402
import line  # noqa: E402

from bench import impulses, ours  # noqa: E402
from bench.discs import largest_overlap  # noqa: E402
from bench.packed import RADIUS, TICK, box_for  # noqa: E402
from bench.rows import Rows  # noqa: E402
from conveyor_sim.report.figures import style  # noqa: E402
from conveyor_sim.simulation import Simulation  # noqa: E402
from conveyor_sim.statistics.comparisons import paired_difference  # noqa: E402

CSV = Path(__file__).with_suffix(".csv")
PICTURE = ROOT / "docs" / "images" / "accuracy_front.webp"
CROWD, COLD, SETTLED = 100, 1.0, 10.0
"""Bottles; s."""
PRESETS = ("draft", "standard", "fine")
SETTINGS = ((4, 1), (8, 1), (8, 2), (16, 1), (16, 2))
REFERENCE = 2
"""Times as many steps as `fine`."""
SOFT = (1e7, 1e6, 1e5, 1e4)
"""N/m; the true stiffness is 1e8."""
FLOWS = (
    *(("impulses_" + name, 1e8) for name in ("4x1", "8x1", "8x2", "16x2")),
    *(("draft", k) for k in (1e8, 1e6, 1e5, 1e4)),
    *(("implicit_16", k) for k in (1e5, 1e4, 3e3)),
)
"""Settings of the funnel, and N/m."""
FLOOR = 1e-5
"""Error below which a mark is drawn at this error."""


@dataclass(frozen=True)
class Point:
    """A measured point."""

    panel: str
    """overlap, forces or flow."""
    series: str
    label: str
    speed: float
    """Bottles x real time per core."""
    error: float
    """Error as a share of a diameter or of the RMS force; 0 for flows, whose bias results.csv has."""


def measure() -> Iterator[Point]:
    """Yield all points that are measured here."""
    yield from _overlaps()
    yield from _forces()
    yield from _flows()


def _overlaps() -> Iterator[Point]:
    for stiffness in SOFT:
        scene = impulses.glass(impulses.COMPARED, {"preset": "draft"}, stiffness)
        simulation = ours.packed(scene, impulses.PRESSED, 1)
        began = time.process_time()
        simulation.advance(10)
        speed = impulses.COMPARED * 10 * TICK / (time.process_time() - began)
        bottles = simulation.bottles()
        deepest = largest_overlap(np.column_stack([bottles.x, bottles.y]), box_for(impulses.COMPARED))
        yield Point("overlap", "softer contacts", f"{stiffness:.0e}", speed, deepest / (2.0 * RADIUS))


def _forces() -> Iterator[Point]:
    start = ours.packed(impulses.swept(CROWD, 16, 2), impulses.PACKING, 1)
    settled = _from(start, impulses.glass(CROWD, {"preset": "standard"}), COLD)
    fine = Simulation(impulses.glass(CROWD, {"preset": "fine"}), threads=1).model.steps_per_tick
    reference, _ = impulses.forces(_from(settled, impulses.glass(CROWD, {"per_tick": REFERENCE * fine}), TICK))
    for preset in PRESETS:
        simulation = _from(settled, impulses.glass(CROWD, {"preset": preset}), TICK)
        began = time.process_time()
        forces, _ = impulses.forces(simulation)
        speed = CROWD * impulses.SHOWN * TICK / (time.process_time() - began)
        yield Point("forces", "explicit", preset, speed, impulses.error(forces, reference))
    for setting in SETTINGS:
        for series, seconds in (("impulses, cold", COLD), ("impulses, settled", SETTLED)):
            simulation = _from(settled, impulses.swept(CROWD, *setting), seconds)
            began = time.process_time()
            simulation.advance(100)
            speed = CROWD * 100 * TICK / (time.process_time() - began)
            forces, _ = impulses.forces(simulation)
            yield Point("forces", series, f"{setting[0]} x {setting[1]}", speed, impulses.error(forces, reference))


def _from(start: Simulation, scene: Any, seconds: float) -> Simulation:
    simulation = Simulation(scene, threads=1)
    simulation.restore_from(start)
    simulation.advance(round(seconds / TICK))
    return simulation


def _flows() -> Iterator[Point]:
    for setting, stiffness in FLOWS:
        scene = line.line("funnel", stiffness, setting)
        # Another simulation compiles or loads the kernels, some of which run from the first contact on only.
        Simulation(scene, threads=1).advance(1000)
        simulation = Simulation(scene, threads=1)
        simulation.advance(1)
        began, bottles = time.process_time(), 0.0
        for _ in range(34):
            simulation.advance(100)
            bottles += simulation.counts.present
        yield Point("flow", setting, f"{stiffness:g}", bottles / (time.process_time() - began), 0.0)


def read() -> list[Point]:
    """Return the points of front.csv."""
    with CSV.open(newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    return [Point(r["panel"], r["series"], r["label"], float(r["speed"]), float(r["error"])) for r in rows]


def write(points: Sequence[Point]) -> None:
    """Write front.csv."""
    with CSV.open("w", newline="", encoding="utf-8") as file:
        table = csv.DictWriter(file, [field.name for field in fields(Point)], lineterminator="\n")
        table.writeheader()
        table.writerows({**asdict(p), "speed": f"{p.speed:.4g}", "error": f"{p.error:.4g}"} for p in points)


def of_bench() -> list[Point]:
    """Return the overlaps of docs/performance/impulses.csv."""
    rows = Rows.read(ROOT / "docs" / "performance" / "impulses.csv")
    points = []
    for name in rows.contestants(impulses.CASE):
        speed = rows.spread(impulses.CASE, impulses.COMPARED, name, impulses.SPEED)
        overlap = rows.spread(impulses.CASE, impulses.COMPARED, name, impulses.OVERLAP)
        if speed is not None and overlap is not None:
            series, _, label = name.partition(", ")
            points.append(Point("overlap", series, label, speed.middle, 1e-3 * overlap.middle / (2.0 * RADIUS)))
    return points


@dataclass(frozen=True)
class Bias:
    """Difference of the throughput of a setting from the stiff reference, over that of the reference."""

    middle: float
    half: float
    """Half of the 95 % interval."""


def biases() -> Mapping[tuple[str, str], Bias]:
    """Return the bias of the funnel's throughput by setting and stiffness (as in a Point)."""
    own = [point for point in compare.points() if point.scene == "funnel"]
    reference = compare.reference_of(own)
    mean = float(np.mean([run["throughput"] for run in reference.runs.values()]))
    out = {}
    for point in own:
        seeds = sorted(point.runs.keys() & reference.runs.keys())
        values = [compare.values(one, "throughput", seeds) for one in (point, reference)]
        apart = paired_difference(*values)
        out[point.setting, f"{point.stiffness:g}"] = Bias(apart.mean / mean, apart.half_width / mean)
    return out


STYLES = {
    "impulses": ("o", 0), "impulses, cold": ("o", 0), "impulses, settled": ("D", 0), "explicit": ("s", 2),
    "softer contacts": ("v", 3), "Box2D": ("^", 1), "pymunk": ("P", 5), "draft": ("s", 2), "implicit_16": ("v", 3),
}  # fmt: skip
"""Mark and colour of a series."""


def draw(points: Sequence[Point]) -> None:
    """Draw the three panels."""
    with style.look():
        figure = style.new_figure(13.0, 4.8)
        axes = figure.subplots(1, 3)
        _panel(axes[0], [*of_bench(), *(p for p in points if p.panel == "overlap")])
        axes[0].set_ylabel("largest overlap (% of a diameter)")
        axes[0].set_title("Overlap, 1 000 bottles pressed")
        _panel(axes[1], [p for p in points if p.panel == "forces"], named=("explicit",))
        axes[1].set_ylabel(f"RMS error of single forces (%; drawn from {100.0 * FLOOR:g} % on)")
        axes[1].set_ylim(50.0 * FLOOR, 100.0)
        axes[1].set_title(f"Forces, {CROWD} bottles at rest")
        _flow_panel(axes[2], [p for p in points if p.panel == "flow"])
        axes[2].set_ylabel("bias of the throughput (%)")
        axes[2].set_title("Flow, funnel, 64 seeds")
        for ax in axes:
            ax.set_xscale("log")
            ax.set_xlabel("bottles x real time per core")
            ax.grid(True)
            ax.margins(0.16, 0.12)
            ax.legend(fontsize=8, loc="best")
        raw = io.BytesIO()
        figure.savefig(raw, dpi=100, format="png")
    Image.open(raw).convert("RGB").save(PICTURE, quality=60, method=6)
    print(PICTURE)


def _panel(ax: Axes, points: Sequence[Point], named: Sequence[str] = tuple(STYLES)) -> None:
    """Draw points by series, with labels beside those of `named`."""
    for series in dict.fromkeys(point.series for point in points):
        own = sorted((p for p in points if p.series == series), key=lambda p: p.speed)
        mark, colour = STYLES[series]
        errors = [100.0 * max(p.error, FLOOR) for p in own]
        ax.plot([p.speed for p in own], errors, mark + ":", color=style.SERIES[colour], label=series,
                markersize=6.0, linewidth=0.8)  # fmt: skip
        for p in own if series in named else ():
            ax.annotate(
                _short(p), (p.speed, 100.0 * max(p.error, FLOOR)), (4, 4), textcoords="offset points", fontsize=7
            )
    ax.set_yscale("log")


def _short(point: Point) -> str:
    """Return the label of a mark."""
    for long, brief in ((", contacts ", ", "), (" x ", "x"), ("e+0", "e")):
        point = Point(point.panel, point.series, point.label.replace(long, brief), point.speed, point.error)
    return point.label


FLOW_NAMES = {"impulses": "impulses, 1e8 N/m", "draft": "draft, by stiffness (N/m)",
              "implicit_16": "implicit friction, 16 steps"}  # fmt: skip


def _flow_panel(ax: Axes, points: Sequence[Point]) -> None:
    found = biases()
    for series, name in FLOW_NAMES.items():
        own = [p for p in points if p.series.startswith(series) and (p.series, p.label) in found]
        mark, colour = STYLES[series]
        bars = [found[p.series, p.label] for p in own]
        ax.errorbar([p.speed for p in own], [100.0 * bar.middle for bar in bars], [100.0 * bar.half for bar in bars],
                    fmt=mark, color=style.SERIES[colour], capsize=3.0, label=name, markersize=6.0)  # fmt: skip
        for p, bar in zip(own, bars, strict=True):
            label = p.series.removeprefix("impulses_") if series == "impulses" else f"{float(p.label):.0e}"
            ax.annotate(label.replace("e+0", "e"), (p.speed, 100.0 * bar.middle), (5, 4), textcoords="offset points",
                        fontsize=7)  # fmt: skip
    ax.axhline(0.0, color=style.INK, linewidth=0.8)


def main() -> None:
    """Measure unless --draw, and draw."""
    if "--draw" not in sys.argv[1:]:
        points = []
        for point in measure():
            print(point, flush=True)
            points.append(point)
        write(points)
    draw(read())


if __name__ == "__main__":
    main()
