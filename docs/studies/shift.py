# SPDX-License-Identifier: Apache-2.0
"""A shift of eight hours on a line of a filler, two stations, accumulation and a packer: what its report says.

python docs/studies/shift.py        (about 5 minutes; writes shift.csv and shift_stops.csv beside itself, and the
                                     pictures docs/images/shift_*.png)
"""

import csv
import shutil
import time
from collections.abc import Iterable, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory

from conveyor_sim.support.interrupt import one_line, while_importing

with while_importing():
    from rich.console import Console

    from conveyor_sim.report.figures.draw import plot_production
    from conveyor_sim.report.periods import stop_reasons
    from conveyor_sim.report.production import read_production
    from conveyor_sim.report.production_report import render
    from conveyor_sim.run.compilation import Compilation
    from conveyor_sim.run.runner import run_scene
    from conveyor_sim.scene import load_scene
    from conveyor_sim.support.progress import ProgressBar

HERE = Path(__file__).parent
IMAGES = HERE.parent / "images"
COUNTS = ("processed", "good", "defective", "failures")
TIMES = ("running", "starved", "blocked", "down", "planned", "idle")
FIGURES = ("availability", "effectiveness", "quality", "oee", "mtbf", "mttr")


def main() -> None:
    """Run it, and keep what is said of it."""
    scene, console = load_scene(HERE / "shift.yaml"), Console()
    Compilation(scene, console.print).run()
    with TemporaryDirectory() as folder, ProgressBar(scene.name, scene.duration) as bar:
        bag = Path(folder) / "bag"
        began = time.process_time()
        run_scene(scene, bag, bar.update, threads=1)
        spent = time.process_time() - began
        production = read_production(bag)
        size = sum(file.stat().st_size for file in bag.iterdir())
        for picture in plot_production(production, Path(folder)):
            if picture.suffix == ".png":
                shutil.copy(picture, IMAGES / f"shift_{picture.name}")
    console.print(render(production))
    speed = scene.duration / spent
    console.print(f"{spent:.0f} s of processor time, {speed:.0f} x real time, {size / 1e6:.1f} MB recorded")
    made = production.counters
    rows = [
        [name, *(int(getattr(made, field)[row]) for field in COUNTS)]
        + [f"{getattr(made, field)[row]:.1f}" for field in TIMES]
        + [f"{getattr(made, field)[row]:.4g}" for field in FIGURES]
        for row, name in enumerate(made.name)
    ]
    heads = ["", *COUNTS, *(f"{name}, s" for name in TIMES), *FIGURES[:4], "mtbf, s", "mttr, s"]
    write("shift.csv", heads, rows)
    reasons = stop_reasons(period for machine in production.periods.values() for period in machine)
    stops = ([entry.machine, entry.category, entry.why, entry.stops, f"{entry.length:.1f}"] for entry in reasons)
    write("shift_stops.csv", ["machine", "category", "reason", "stops", "in all, s"], stops)


def write(name: str, heads: Sequence[str], rows: Iterable[Sequence[object]]) -> None:
    """Write a CSV file beside this one."""
    with (HERE / name).open("w", newline="") as file:
        table = csv.writer(file, lineterminator="\n")
        table.writerow(heads)
        table.writerows(rows)


if __name__ == "__main__":
    with one_line():
        main()
