"""The tables and the picture of docs/stability.md, from what the studies left in docs/stability/."""

from __future__ import annotations

import csv
import math
import statistics
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from hard_cases.case import Case, read_table
from hard_cases.measures import run
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection, PatchCollection
from matplotlib.patches import Circle
from page_parts import with_parts
from stability_limits import LEAST, MOST

from conveyor_sim.model import Model, build_model
from conveyor_sim.observe.columns import BottleColumns
from conveyor_sim.plot import style
from conveyor_sim.scene.accuracy import INTEGRATOR_NAMES
from conveyor_sim.simulation import Simulation

Line = Mapping[str, str]

SHORT = {
    "leapfrog": "leapfrog",
    "semi_implicit_euler": "Euler",
    "velocity_verlet": "Verlet",
    "rk4": "RK4",
    "dormand_prince": "Dormand-Prince",
    "linearly_implicit": "linearly implicit",
}
MARKS = {"kept": "kept", "kept so far": "kept*", "broken": "**broken**", "limit": "limit", "refused": "refused",
         "not run": "not run"}  # fmt: skip
WORST = 6
"""Rows in the picture."""
LONG = ("ten_thousand", "paper_plant", "thousands")
"""Rows that are left out of it, as they take long and overlap little."""


def read(path: Path) -> list[Line]:
    """A CSV file; nothing where there is none."""
    if not path.exists():
        return []
    with path.open(newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


def page(text: str, folder: Path) -> str:
    """The page with its tables made anew from a folder of studies; ValueError without a marker."""
    matrix = read(folder / "matrix.csv")
    parts = {
        "summary": summary(matrix, folder),
        "rows": rows(matrix),
        "exceptions": exceptions(matrix),
        "limits": limits(read(folder / "limits.csv")),
        "guard": guard(read(folder / "guard.csv")),
        "kills": kills(read(folder / "kills.csv")),
        "hour": hour(read(folder / "hour.csv"), read(folder / "denormals.csv")),
    }
    return with_parts(Path("docs/stability.md"), text, parts)


def kills(lines: Sequence[Line]) -> str:
    """What recordings that were killed lost, by pace."""
    if not lines:
        return "Not measured yet."
    table = ["| pace | kills | lost, s of wall time: median | at most | replays to the same bits |"]
    table.append("| --- | ---: | ---: | ---: | ---: |")
    for pace in dict.fromkeys(line["pace"] for line in lines):
        mine = [line for line in lines if line["pace"] == pace]
        lost = [float(line["lost_wall"]) for line in mine]
        same = sum(line["replay"] == "same bits" for line in mine)
        table.append(f"| {pace} | {len(mine)} | {statistics.median(lost):.2f} | {max(lost):.2f} | {same} |")
    return "\n".join(table)


def guard(lines: Sequence[Line]) -> str:
    """What the guard costs."""
    if not lines:
        return "Not measured yet."
    table = [f"| {' | '.join(lines[0])} |", f"| --- |{' ---: |' * (len(lines[0]) - 1)}"]
    return "\n".join(table + [f"| {' | '.join(line.values())} |" for line in lines])


def summary(matrix: Sequence[Line], folder: Path) -> str:
    """How many runs came out how, by integrator, and on what machine."""
    lines = [f"| | {' | '.join(MARKS)} | same on two threads |", f"| --- |{' ---: |' * (len(MARKS) + 1)}"]
    for integrator in INTEGRATOR_NAMES:
        mine = [line for line in matrix if line["integrator"] == integrator]
        verdicts = Counter(line["verdict"] for line in mine)
        threads = Counter(line["two_threads"] for line in mine if line["two_threads"])
        counts = " | ".join(str(verdicts[verdict]) for verdict in MARKS)
        lines.append(f"| {SHORT[integrator]} | {counts} | {threads['same']} of {threads.total()} |")
    machine = folder / "machine.txt"
    told = machine.read_text(encoding="utf-8").strip() if machine.exists() else "no machine yet"
    return "\n".join([*lines, "", f"Measured on {told}."])


def rows(matrix: Sequence[Line]) -> str:
    """A table a family: the row, what is hard, and each integrator at the preset `standard`; measures folded away."""
    parts = []
    families: dict[str, list[Case]] = {}
    for case in read_table():
        families.setdefault(case.family, []).append(case)
    for family, cases in families.items():
        parts.append(f"### {family.capitalize()}\n")
        parts.append(f"| row | what is hard | {' | '.join(SHORT.values())} |")
        parts.append(f"| --- | --- |{' --- |' * len(SHORT)}")
        for case in cases:
            cells = [_verdicts([line for line in matrix if line["row"] == case.name and line["integrator"] == name])
                     for name in SHORT]  # fmt: skip
            parts.append(f"| {case.name} | {case.hard} | {' | '.join(cells)} |")
        names = {case.name for case in cases}
        parts.append(_measured([line for line in matrix if line["row"] in names]))
    return "\n".join(parts)


def _verdicts(lines: Sequence[Line]) -> str:
    """Of all presets and effects: one word if they agree, else how many of each."""
    counts = Counter(line["verdict"] for line in lines)
    if len(counts) == 1:
        return MARKS[next(iter(counts))]
    return ", ".join(f"{count} {MARKS[verdict]}" for verdict, count in counts.most_common())


def _measured(lines: Sequence[Line]) -> str:
    """What was measured, folded away."""
    out = ["", "<details><summary>What was measured</summary>", ""]
    out.append("| row | effects | integrator | preset | verdict | s | overlap | residual | drift (m) | chatter |")
    out.append("| --- | --- | --- | --- | --- | ---: | ---: | ---: | ---: | ---: |")
    for line in lines:
        if line["verdict"] in ("refused", "not run") or not line["simulated"]:
            continue
        cells = [line[name] for name in ("row", "effects")] + [SHORT[line["integrator"]], line["preset"]]
        cells += [MARKS[line["verdict"]], line["simulated"]]
        cells += [_few(line[name]) for name in ("overlap", "residual", "drift", "chatter")]
        out.append(f"| {' | '.join(cells)} |")
    return "\n".join([*out, "", "</details>", ""])


def _few(text: str) -> str:
    return f"{float(text):.2g}" if text else ""


def exceptions(matrix: Sequence[Line]) -> str:
    """Every run that did not keep what is expected, was not run or was refused, with the sentence; alike ones once."""
    told: dict[tuple[str, str, str, str], list[str]] = {}
    for line in matrix:
        if line["verdict"] in ("broken", "limit", "not run", "refused"):
            # Of one cause, figures differ from preset to preset.
            about = (line["row"], line["effects"], line["integrator"], line["verdict"])
            told.setdefault(about, []).append(f"{line['preset']}: {line['said']}")
    if not told:
        return "None."
    lines = ["| row | effects | integrator | | |", "| --- | --- | --- | --- | --- |"]
    for (row, effects, integrator, verdict), said in told.items():
        words = said[0].partition(": ")[2] if verdict == "refused" else "; ".join(said)
        lines.append(f"| {row} | {effects} | {SHORT[integrator]} | {MARKS[verdict]} | {words.replace('|', '/')} |")
    return "\n".join(lines)


def limits(lines: Sequence[Line]) -> str:
    """Largest stable step over the bound, and what happens beyond it."""
    scenes = list(dict.fromkeys((line["scene"], line["bound"], line["seconds"]) for line in lines))
    out = [f"| | bound | {' | '.join(SHORT.values())} |", f"| --- | --- |{' ---: |' * len(SHORT)}"]
    beyond = ["| | integrator | in steps 1.25 times the largest stable one |", "| --- | --- | --- |"]
    for scene, bound, seconds in scenes:
        mine = {line["integrator"]: line for line in lines if line["scene"] == scene}
        ratios = [_ratio(mine[name]["ratio"]) if name in mine else "" for name in SHORT]
        out.append(f"| {scene} | {bound}, {1e6 * float(seconds):.3g} us | {' | '.join(ratios)} |")
        for name, line in mine.items():
            if line["beyond"]:
                beyond.append(f"| {scene} | {SHORT[name]} | {line['beyond']} |")
    return "\n".join([*out, "", *beyond])


def _ratio(text: str) -> str:
    value = float(text)
    return f"over {MOST:g}" if math.isinf(value) else f"under {LEAST:g}" if value == 0.0 else f"{value:.3g}"


def hour(lines: Sequence[Line], denormals: Sequence[Line]) -> str:
    """What became of an hour, and what rest costs."""
    out = []
    if lines:
        first, last = lines[0], lines[-1]
        energies = [float(line["energy"]) for line in lines]
        memory = [float(line["memory_mb"]) for line in lines]
        walls = [float(line["wall"]) for line in lines]
        residuals = [float(line["residual"]) for line in lines if line["residual"]]
        out = [
            f"After {last['minute']} minutes: {last['fed']} bottles fed, {last['present']} present, {last['lost']} "
            "lost, "
            f"{last['shortened_ticks']} ticks done again in shorter steps.",
            f"Energy of all bottles at the full minutes: {min(energies):.3g} to {max(energies):.3g} J.",
            f"Memory after the first minute {first['memory_mb']} MB, at the end {memory[-1]:.1f} MB, "
            f"at most {max(memory):.1f} MB.",
            f"A minute took {min(walls):.1f} to {max(walls):.1f} s.",
        ]
        if residuals:
            out.append(f"Residual of the energy ledger over its turnover: at most {max(residuals):.2g}.")
    for line in denormals:
        out.append(
            f"A tick in which all bottles rest takes {line['rest_over_motion']} of the time of one in which all move "
            f"({line['least']} to {line['most']})."
        )
    return "\n".join(f"- {text}" for text in out) or "Not measured yet."


def picture(path: Path) -> None:
    """The rows that overlap deepest and go on, each at its deepest tick, with the paper's integrator at `standard`.

    Without those that put bottles into each other from outside.
    """
    silent = (case for case in read_table() if not (case.refused or case.stops or case.put))
    cases = [case for case in silent if case.name not in LONG]
    found = sorted((_deepest(case) for case in cases), key=lambda moment: -moment.depth)
    with style.look():
        figure = style.new_figure(12.0, 8.0)
        for axes, moment in zip(np.ravel(figure.subplots(2, WORST // 2)), found[:WORST], strict=True):
            if moment.bottles is not None:
                _draw(axes, moment, moment.bottles)
            axes.set_xlabel("x (m)", fontsize=8)
            axes.set_ylabel("y (m)", fontsize=8)
            axes.set_title(f"{moment.case.name}, {moment.time:g} s\n{moment.depth:.2g} of a radius", fontsize=9)
        figure.savefig(path, dpi=100, metadata={"Software": None})


@dataclass
class _Moment:
    """A tick of a case, with its deepest contact."""

    case: Case
    model: Model
    depth: float = 0.0
    """Over the radius of the smaller bottle."""
    time: float = 0.0
    """s"""
    place: tuple[float, float] = (0.0, 0.0)
    """m, of the contact."""
    bottles: BottleColumns | None = None

    def look(self, simulation: Simulation) -> None:
        """Take a tick in if it is deeper."""
        contacts, bottles = simulation.contacts(), simulation.bottles()
        radius = simulation.model.type_radius[bottles.type]
        smaller = radius[np.searchsorted(bottles.id, contacts.a)]
        pairs = contacts.kind == 0
        smaller[pairs] = np.minimum(smaller[pairs], radius[np.searchsorted(bottles.id, contacts.b[pairs])])
        depth = contacts.overlap / smaller
        if depth.size and depth.max() > self.depth:
            worst = int(np.argmax(depth))
            self.depth, self.time, self.bottles = float(depth[worst]), simulation.time, bottles
            self.place = (float(contacts.x[worst]), float(contacts.y[worst]))


def _deepest(case: Case) -> _Moment:
    scene = case.scene()
    moment = _Moment(case, build_model(scene))
    run(case, scene, beside=moment.look)
    return moment


def _draw(axes: Axes, moment: _Moment, bottles: BottleColumns) -> None:
    radius = moment.model.type_radius[bottles.type]
    circles = [Circle((x, y), r) for x, y, r in zip(bottles.x, bottles.y, radius, strict=True)]
    axes.add_collection(PatchCollection(circles, facecolor="#cfe3f5cc", edgecolor=style.BOTTLE_EDGE, linewidth=0.8))
    rails = [rail.outline() for rail in moment.model.rail_shapes if not rail.name.startswith("annex")]
    axes.add_collection(LineCollection(rails, colors=style.RAIL, linewidths=1.5))
    axes.plot(*moment.place, marker="o", color=style.FORCE, markersize=5)
    # Some bottles about the contact: where there are hundreds, none could be seen.
    half = 8.0 * float(radius.min()) if bottles.x.size > 2 else 2.5 * float(radius.max())
    axes.set_xlim(moment.place[0] - half, moment.place[0] + half)
    axes.set_ylim(moment.place[1] - half, moment.place[1] + half)
    axes.set_aspect("equal")
    axes.tick_params(labelsize=7)
