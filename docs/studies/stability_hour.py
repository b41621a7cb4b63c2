# SPDX-License-Identifier: Apache-2.0
"""An hour of the paper's plant: counts, energy, memory and pace once a minute; and what denormal numbers cost."""

from __future__ import annotations

import csv
import statistics
import time
from pathlib import Path

from hard_cases.case import Case, read_table
from hard_cases.measures import residual
from stability_matrix import SOURCES

from conveyor_sim.accuracy.trajectory import energies
from conveyor_sim.simulation import Simulation

HOUR = 3600.0
"""s, simulated."""
MINUTE = 6000
"""Ticks between two lines."""

COLUMNS = (
    "minute", "fed", "present", "lost", "energy", "fastest", "residual", "shortened_ticks", "memory_mb", "wall",
    "sources",
)  # fmt: skip


def measure(path: Path, duration: float = HOUR) -> None:
    """Run it, a line a minute; nothing if the file has all of them from the present sources."""
    ticks = round(duration / 0.01)
    if path.exists():
        with path.open(newline="", encoding="utf-8") as file:
            lines = list(csv.DictReader(file))
        if lines and lines[-1]["sources"] == SOURCES and int(lines[-1]["minute"]) * MINUTE >= ticks:
            return
    scene = _row("paper_plant").scene()
    simulation = Simulation(scene, threads=1)
    with path.open("w", newline="", encoding="utf-8") as file:
        table = csv.writer(file, lineterminator="\n")
        table.writerow(COLUMNS)
        while simulation.tick < ticks:
            began = time.perf_counter()
            simulation.advance(min(MINUTE, ticks - simulation.tick))
            wall = time.perf_counter() - began
            bottles, counts = simulation.bottles(), simulation.counts
            energy = energies(simulation.model, bottles, simulation.contacts()).sum()
            fastest = float(max((bottles.vx**2 + bottles.vy**2) ** 0.5, default=0.0))
            line = (simulation.tick // MINUTE, counts.fed, counts.present, counts.fed - counts.present, f"{energy:.4g}")
            share = f"{residual(simulation):.3g}"
            line += (
                f"{fastest:.4g}",
                share,
                simulation.integration.shortened_ticks,
                f"{_memory():.1f}",
                f"{wall:.2f}",
                SOURCES,
            )
            table.writerow(line)
            file.flush()


def denormals(path: Path, repeats: int = 5) -> None:
    """Wall time of ticks in which all rests, over that of ticks in which all moves, in turns; into a CSV file."""
    scene = _row("denormals").scene(short=False)
    ratios = []
    for _ in range(repeats):
        simulation = Simulation(scene, threads=1)
        simulation.advance(10)
        moving = _wall(simulation, 40)
        simulation.command(["belts/main/cmd_speed"], [0.0])
        simulation.advance(1000)
        ratios.append(_wall(simulation, 40) / moving)
    with path.open("w", newline="", encoding="utf-8") as file:
        table = csv.writer(file, lineterminator="\n")
        table.writerows([("rest_over_motion", "least", "most"), (f"{statistics.median(ratios):.3g}",
                         f"{min(ratios):.3g}", f"{max(ratios):.3g}")])  # fmt: skip


def _row(name: str) -> Case:
    return next(case for case in read_table() if case.name == name)


def _wall(simulation: Simulation, ticks: int) -> float:
    began = time.perf_counter()
    simulation.advance(ticks)
    return time.perf_counter() - began


def _memory() -> float:
    """Resident memory of this process, MB."""
    line = next(line for line in Path("/proc/self/status").read_text().splitlines() if line.startswith("VmRSS"))
    return int(line.split()[1]) / 1024.0
