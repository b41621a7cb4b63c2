# SPDX-License-Identifier: Apache-2.0
"""Efficiency against the length of the conveyor between two machines, and the closed form: of results.parquet here.

conveyor-sim sweep docs/studies/table_length/study.yaml --out runs/table_length     (two CPU minutes)
cp runs/table_length/results.parquet docs/studies/table_length
python docs/studies/table_length/compare.py         (prints, and draws docs/images/study_table_length.png)
"""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path

from conveyor_sim.support.interrupt import one_line, while_importing

with while_importing():
    import numpy as np
    from line import MACHINE, closed_form

    from conveyor_sim.report.figures import style
    from conveyor_sim.statistics.comparisons import paired_difference, pairing_gain
    from conveyor_sim.statistics.intervals import mean_interval
    from conveyor_sim.statistics.words import plus_minus, told
    from conveyor_sim.studies.results import read_results

HERE = Path(__file__).parent
PICTURE = HERE.parent.parent / "images" / "study_table_length.png"


def main() -> None:
    """Print and draw."""
    by_length: dict[float, list[tuple[int, float]]] = {}
    for row in read_results(HERE / "results.parquet").rows:
        by_length.setdefault(row.parameters["length"], []).append((row.seed, 100.0 * row.metrics["efficiency"]))
    lengths = sorted(by_length)
    values = [np.array([value for _, value in sorted(by_length[length])]) for length in lengths]
    theory = [100.0 * closed_form(length) for length in lengths]
    for length, found, expected in zip(lengths, values, theory, strict=True):
        print(f"{length} m: {plus_minus(mean_interval(found), '%')}, closed form {expected:.1f} %")
    for one, other in pairwise(range(len(lengths))):
        apart = paired_difference(values[other], values[one])
        gain = pairing_gain(values[other], values[one])
        print(f"{told(apart, f'{lengths[other]} m', f'{lengths[one]} m', '%')}; gain by common seeds {gain:.1f}")
    shorter = [paired_difference(found, values[0]) for found in values]
    with style.look():
        figure = style.new_figure(9.0, 4.2)
        means, differences = figure.subplots(1, 2)
        intervals = [mean_interval(found) for found in values]
        means.errorbar(
            lengths, [one.mean for one in intervals], [one.half_width for one in intervals], fmt="o", capsize=4.0,
            color=style.SERIES[0], label="simulated, ten seeds, 95 %",
        )  # fmt: skip
        means.plot(lengths, theory, color=style.SERIES[1], marker="_", label="closed form")
        means.axhline(100.0 * MACHINE.alone, color=style.MUTED, linestyle=":", label="endless conveyor")
        means.set_title("Efficiency")
        differences.errorbar(
            lengths[1:], [one.mean for one in shorter[1:]], [one.half_width for one in shorter[1:]], fmt="o",
            capsize=4.0, color=style.SERIES[0],
        )  # fmt: skip
        differences.plot(lengths[1:], [value - theory[0] for value in theory[1:]], color=style.SERIES[1], marker="_")
        differences.set_title(f"More than at {lengths[0]} m, in pairs by seed")
        for ax in (means, differences):
            ax.set_xlabel("length of the conveyor (m)")
            ax.set_ylabel("%")
            ax.grid(True, axis="y")
        differences.set_ylim(bottom=0.0)
        figure.legend(loc="outside lower center", ncols=3)
        style.save_png(figure, PICTURE)


if __name__ == "__main__":
    with one_line():
        main()
