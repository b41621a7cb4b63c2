# SPDX-License-Identifier: Apache-2.0
"""Flow against the largest overlap: of results.csv here, or of folders of the sweeps, which need not be complete.

    cd docs/studies/stiffness_throughput
    for s in funnel combiner paper_plant implicit impulses; do
        conveyor-sim sweep study_$s.yaml --out runs/stiffness_$s; done
    python compare.py runs/stiffness_*      (writes results.csv; without folders it reads this file)

The sweeps take about 110 minutes of processor time. They can be interrupted: the same command continues.

The stiff reference is the mean, seed by seed, over `draft` at STIFF and more. A point agrees with it if the 95 %
interval of the difference, in pairs by seed, contains 0 or lies within TOLERANCE. This must hold in throughput, in the
share of runs with a jam, and in dwell time. Prints a table, and draws docs/images/study_stiffness_throughput.png, which
leaves out integrator impulses: docs/studies/front.py draws those.
"""

from __future__ import annotations

import csv
import math
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

from conveyor_sim.support.interrupt import one_line, while_importing

with while_importing():
    import numpy as np
    from matplotlib.axes import Axes

    from conveyor_sim.physics.timestep.prediction import DEEP
    from conveyor_sim.report.figures import style
    from conveyor_sim.statistics.comparisons import paired_difference
    from conveyor_sim.statistics.intervals import Interval, mean_interval
    from conveyor_sim.statistics.words import plus_minus
    from conveyor_sim.studies.journal import read_rows

HERE = Path(__file__).parent
CSV = HERE / "results.csv"
PICTURE = HERE.parent.parent / "images" / "study_stiffness_throughput.png"
SCENES = {"funnel": "funnel", "combiner": "combiner", "paper_plant": "paper's plant"}
FLOW = {"throughput": "throughput (1/min)", "jammed": "share of runs with a jam", "dwell": "dwell time (s)"}
COLUMNS = ("throughput", "dwell", "jammed", "overlap", "deepest", "peak_force")
HEADS = ("scene", "setting", "stiffness", "steps", "seed", *COLUMNS, "cpu")
STIFF_NAME = "stiff reference"
MARKS = {"draft": "o", "standard": "s", "fine": "D", "implicit_16": "^"}
IMPULSES = ("impulses_4x1", "impulses_8x1", "impulses_8x2", "impulses_16x2")
TICK = 0.01  # s
TOLERANCE = 0.1  # of the reference; of the share of runs with a jam, a difference of 0.1
STIFF = 1e7  # N/m, from which draft is the stiff reference: overlaps of at most 0.2 % of the diameter


class Point(NamedTuple):
    """A stiffness and a setting of one scene."""

    scene: str
    setting: str
    stiffness: float
    """N/m, between bottles."""
    steps: int
    """Per tick."""
    runs: dict[int, dict[str, float]]
    """Metrics by seed."""


def collect(folders: Sequence[Path]) -> None:
    """Add the runs in folders of sweeps to results.csv; equal runs are replaced."""
    rows = {tuple(row[:5]): row for row in csv.reader(CSV.open(newline=""))} if CSV.exists() else {}
    rows.pop(tuple(HEADS[:5]), None)
    for folder in folders:
        for row in read_rows(folder):
            scene = row.parameters.get("scene", folder.name.removeprefix("stiffness_"))
            stiffness, steps = f"{row.parameters['stiffness']:g}", str(round(TICK / row.dt))
            metrics = [f"{row.metrics[name]:.5g}" for name in COLUMNS]
            head = (scene, row.parameters["setting"], stiffness, steps, str(row.seed))
            rows[head] = [*head, *metrics, f"{row.cpu:.3g}"]
    with CSV.open("w", newline="") as file:
        table = csv.writer(file, lineterminator="\n")
        table.writerow(HEADS)
        table.writerows(rows.values())


def points() -> list[Point]:
    """Return the points of results.csv: of each sweep those seeds that all of its points have finished."""
    made: dict[tuple[str, str, str, str], dict[int, dict[str, float]]] = {}
    with CSV.open(newline="") as file:
        for row in csv.DictReader(file):
            key = row["scene"], row["setting"], row["stiffness"], row["steps"]
            made.setdefault(key, {})[int(row["seed"])] = {name: float(row[name]) for name in COLUMNS}
    return [Point(key[0], key[1], float(key[2]), int(key[3]), runs) for key, runs in made.items()]


def values(point: Point, name: str, seeds: Sequence[int]) -> np.ndarray:
    """Return a metric (n,) by seed."""
    return np.array([point.runs[seed][name] for seed in seeds])


def overlap(point: Point) -> float:
    """Return the mean over seeds of the largest overlap over the diameter.

    It follows from the peak force, but for impulses: their overlaps are errors of the sweeps, and seen at ticks.
    """
    name = "deepest" if point.setting in IMPULSES else "overlap"
    return float(np.mean([run[name] for run in point.runs.values()]))


def is_stiff(point: Point) -> bool:
    """Return True for a part of the stiff reference."""
    return point.setting in ("draft", STIFF_NAME) and point.stiffness >= STIFF


def reference_of(own: Sequence[Point]) -> Point:
    """Return the stiff reference of the points of a scene: means over stiff points, by seed."""
    stiff = [point for point in own if is_stiff(point)]
    seeds = set.intersection(*(set(point.runs) for point in stiff))
    runs = {seed: {name: float(np.mean([p.runs[seed][name] for p in stiff])) for name in COLUMNS} for seed in seeds}
    return Point(own[0].scene, STIFF_NAME, math.inf, 0, runs)


def told(point: Point, reference: Point) -> Iterator[str]:
    """Yield the cells of a row of the table."""
    seeds = sorted(point.runs.keys() & reference.runs.keys())
    yield "" if point is reference else f"{point.stiffness:.1e}".replace(".0e", "e").replace("e+0", "e")
    yield point.setting if point is reference else f"{point.setting.replace('_', ', ')} ({point.steps})"
    yield str(len(seeds))
    yield f"{100.0 * overlap(point):.2g}"
    for name in FLOW:
        scale, unit = (100.0, "%") if name == "jammed" else (1.0, "")
        apart = paired_difference(values(point, name, seeds), values(reference, name, seeds))
        differs = not is_stiff(point) and differing(apart, values(reference, name, seeds), name)
        yield f"{plus_minus(mean_interval(scale * values(point, name, seeds)), unit)}{' *' if differs else ''}"
    yield "reference" if is_stiff(point) else "yes" if agrees(point, reference) else "no"


def differing(apart: Interval, reference: np.ndarray, name: str) -> bool:
    """Return True if a difference is significant and may be larger than TOLERANCE."""
    allowed = TOLERANCE * (1.0 if name == "jammed" else float(np.nanmean(reference)))
    return apart.excludes_zero and max(abs(apart.low), abs(apart.high)) > allowed


def agrees(point: Point, reference: Point) -> bool:
    """Return True if no quantity of the flow differs."""
    seeds = sorted(point.runs.keys() & reference.runs.keys())
    own, stiff = ([values(one, name, seeds) for name in FLOW] for one in (point, reference))
    rows = zip(own, stiff, FLOW, strict=True)
    return not any(differing(paired_difference(mine, theirs), theirs, name) for mine, theirs, name in rows)


def print_tables(made: Sequence[Point]) -> None:
    """Print a table per scene; an asterisk marks a difference from the stiff reference."""
    for scene, title in SCENES.items():
        own = [point for point in made if point.scene == scene]
        if not own:
            continue
        reference = reference_of(own)
        heads = [
            "stiffness, N/m",
            "setting (steps per tick)",
            "seeds",
            "overlap, %",
            "1/min",
            "jams",
            "dwell, s",
            "agrees",
        ]
        print(f"\n{title}\n\n| " + " | ".join(heads) + " |\n" + "|---" * len(heads) + "|")
        own.sort(key=lambda point: ([*MARKS, *IMPULSES].index(point.setting), -point.stiffness))
        for point in (reference, *own):
            print("| " + " | ".join(told(point, reference)) + " |")


def draw(made: Sequence[Point]) -> None:
    """Draw each quantity of each scene against the overlap."""
    scenes = [scene for scene in SCENES if any(point.scene == scene for point in made)]
    with style.look():
        figure = style.new_figure(4.2 * len(scenes) + 0.6, 7.8)
        axes = figure.subplots(len(FLOW), len(scenes), squeeze=False)
        for column, scene in enumerate(scenes):
            own = [point for point in made if point.scene == scene and point.setting not in IMPULSES]
            for row, (name, label) in enumerate(FLOW.items()):
                panel(axes[row, column], own, name)
                axes[row, column].set_ylabel(label if column == 0 else "")
            axes[0, column].set_title(f"{SCENES[scene]}, {len(own[0].runs)} seeds")
            axes[-1, column].set_xlabel("largest overlap (% of the diameter)")
        handles, labels = axes[0, 0].get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside lower center", ncols=4, fontsize=9.0)
        style.save_png(figure, PICTURE)


def panel(ax: Axes, own: Sequence[Point], name: str) -> None:
    """Draw means with 95 % intervals, and that of the stiff reference as a band."""
    reference = mean_interval([run[name] for run in reference_of(own).runs.values()])
    if math.isfinite(reference.half_width):
        ax.axhspan(reference.low, reference.high, color=style.MUTED, alpha=0.25, label="stiff reference, 95 %")
    for index, (setting, mark) in enumerate(MARKS.items()):
        group = [point for point in own if point.setting == setting]
        if not group:
            continue
        found = [mean_interval([run[name] for run in point.runs.values()]) for point in group]
        ax.errorbar(
            [100.0 * overlap(point) for point in group], [one.mean for one in found],
            [one.half_width for one in found], fmt=mark, capsize=3.0, color=style.SERIES[index],
            label=setting.replace("implicit_16", "implicit friction, 16 steps per tick"),
        )  # fmt: skip
    ax.axvline(100.0 * DEEP, color=style.INK, linestyle=":", label="limit of the warning")
    ax.set_xscale("log")
    # The limits leave a margin above the highest mark.
    ax.set_ylim(0.0, 1.05 if name == "jammed" else 1.08 * ax.dataLim.ymax)
    ax.grid(True)


def main() -> None:
    """Collect if folders are given, print and draw."""
    if len(sys.argv) > 1:
        collect([Path(folder) for folder in sys.argv[1:]])
    made = points()
    print_tables(made)
    draw(made)


if __name__ == "__main__":
    with one_line():
        main()
