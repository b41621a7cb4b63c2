"""Promised, predicted and measured: presets on all shipped scenes and on ten that nothing was fitted to.

    make promises                       # all scenes, two processes: 5 minutes, and compiling before
    make promises ARGS="funnel"         # some of them
    make promises ARGS=--tables         # measures nothing: predictions and tables anew, measured figures as they are

Impacts and resting load are measured as in `conveyor-sim accuracy` (docs/accuracy.md). Each preset is run with each of
the integrators that may be the default, so that the table also tells what the same promise costs with another.
"""

from __future__ import annotations

import csv
from collections.abc import Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from multiprocessing import get_context
from pathlib import Path
from typing import Any

from conveyor_sim.support.interrupt import one_line, while_importing

with while_importing():
    import click
    from page_parts import with_parts
    from unseen_scenes import write

    from conveyor_sim.accuracy.candidates import compared
    from conveyor_sim.accuracy.cpu import Meter
    from conveyor_sim.accuracy.measured import foretold
    from conveyor_sim.accuracy.precision import WorkPrecision
    from conveyor_sim.accuracy.results import Point
    from conveyor_sim.accuracy.setting import Setting
    from conveyor_sim.errors import ConveyorError
    from conveyor_sim.model.step_choice import choose_steps
    from conveyor_sim.scene import Scene, load_scene
    from conveyor_sim.scene.accuracy import Preset, explicit
    from conveyor_sim.support.progress import ProgressBar
    from conveyor_sim.timestep.presets import PRESETS

ROOT = Path(__file__).resolve().parents[2]
PAGE = ROOT / "docs" / "accuracy.md"
TABLE = ROOT / "docs" / "accuracy" / "promises.csv"
SCENES = ROOT / "docs" / "accuracy" / "unseen"

INTEGRATORS = ("leapfrog", "semi_implicit_euler", "velocity_verlet", "rk4")
"""Those that may be the default."""

LONGEST = 20.0
"""s, simulated: a scene that runs for longer is looked at so far."""

COLUMNS = (
    "scene", "integrator", "preset", "steps", "promised", "impacts_predicted", "impacts", "resting_predicted",
    "resting", "cost", "failure", "rests", "reference_doubt", "cpu", "compiling",
)  # fmt: skip
"""Errors relative; cost in processor s a simulated s; `rests`: what resting load was measured on; cpu and compiling:
processor s of the whole scene."""


def scene_files() -> Mapping[str, Path]:
    """All shipped scenes, and those of the generator, by name."""
    folders = (ROOT / "config", ROOT / "config" / "scenarios", ROOT / "examples", SCENES)
    return {file.stem: file for folder in folders for file in sorted(folder.glob("*.yaml"))}


def measure(name: str) -> list[dict[str, Any]]:
    """The rows of a scene; one that says why, if it can't be measured."""
    loaded = load_scene(scene_files()[name])
    scene = load_scene(scene_files()[name], {"duration": min(loaded.duration, LONGEST)})
    precision = WorkPrecision(scene)
    try:
        with Meter() as meter:
            precision.find_starts(_silent)
            precision.find_horizons(_silent)
            reference = precision.make_reference(_silent)
            precision.find_rest(_silent)
            rest = precision.make_resting_reference(_silent)
            settings = preset_settings(scene)
            points = precision.measure(sorted(set(settings.values()), key=str), _silent)
    except ConveyorError as error:
        return [{**dict.fromkeys(COLUMNS, ""), "scene": name, "failure": str(error)}]
    common = {
        "scene": name,
        "rests": rest.reason,
        "reference_doubt": f"{reference.doubt.peak_force:.2g}",
        "cpu": round(meter.cpu),
        "compiling": round(meter.compiling),
    }
    found = {point.setting: foretold(scene, point) for point in points}
    return [
        {**common, "integrator": integrator, "preset": preset, "promised": PRESETS[preset], **_cells(found[setting])}
        for (integrator, preset), setting in settings.items()
    ]


def preset_settings(scene: Scene) -> dict[tuple[str, Preset], Setting]:
    """The steps of every preset with every integrator that may be the default and can run the scene."""
    settings = {}
    for integrator in INTEGRATORS:
        if integrator in compared(scene):
            for preset in PRESETS:
                accuracy = {**explicit(integrator, 1), "per_tick": None, "preset": preset}
                steps = choose_steps(_with(scene, accuracy)).steps
                settings[integrator, preset] = Setting(integrator, steps)
    return settings


def _with(scene: Scene, accuracy: Mapping[str, Any]) -> Scene:
    return scene.model_copy(update={"accuracy": type(scene.accuracy).model_validate(accuracy)})


def _cells(point: Point) -> dict[str, Any]:
    return {
        "steps": point.setting.per_tick,
        "impacts_predicted": _number(point.predicted),
        "impacts": _number(None if point.errors is None else point.errors.peak_force),
        "resting_predicted": _number(point.predicted_resting),
        "resting": _number(point.resting),
        "cost": _number(None if point.cost is None else point.cost.median),
        "failure": point.failure,
    }


def _number(value: float | None) -> str:
    return "" if value is None else f"{value:.3g}"


def _silent(_done: float, _whole: float) -> None:
    pass


def measure_all(names: Sequence[str], processes: int) -> None:
    """Measure scenes, each in the table as soon as it is finished."""
    with (
        ProgressBar("promises", len(names), counted="scenes") as bar,
        ProcessPoolExecutor(processes, get_context("spawn"), max_tasks_per_child=1) as pool,
    ):
        pending = {pool.submit(measure, name): name for name in names}
        bar.update(0)
        for done, finished in enumerate(as_completed(pending), 1):
            rows = [row for row in read() if row["scene"] != pending[finished]]
            keep([*rows, *finished.result()])
            bar.update(done)


def predict_again(rows: Sequence[Mapping[str, Any]]) -> list[dict[str, Any]]:
    """The rows as they were measured, with what is predicted of their settings today."""
    scenes = {name: load_scene(file) for name, file in scene_files().items()}
    renewed = []
    for row in rows:
        point = Point(Setting(row["integrator"], int(row["steps"] or 0)), 0.0, None, None, None, row["failure"])
        found = foretold(scenes[row["scene"]], point) if row["integrator"] else point
        predicted = {
            "impacts_predicted": _number(found.predicted),
            "resting_predicted": _number(found.predicted_resting),
        }
        renewed.append({**row, **predicted})
    return renewed


def read() -> list[dict[str, Any]]:
    """The rows there are."""
    if not TABLE.exists():
        return []
    with TABLE.open(newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


def keep(rows: Sequence[Mapping[str, Any]]) -> None:
    """Write the rows, in the order of the scenes."""
    order = list(scene_files())
    with TABLE.open("w", newline="", encoding="utf-8") as file:
        table = csv.DictWriter(file, COLUMNS, lineterminator="\n")
        table.writeheader()
        table.writerows(sorted(rows, key=lambda row: order.index(row["scene"])))


def page(text: str) -> str:
    """The page with its tables made anew from promises.csv; ValueError without a marker."""
    return with_parts(PAGE, text, {"promises": _promises(read()), "default": _default(read())})


def _promises(rows: Sequence[Mapping[str, str]]) -> str:
    lines = [
        "| scene | preset | steps a tick | impacts: promised | predicted | measured | resting: predicted | measured | |"
    ]
    lines.append("| --- | --- | ---: | ---: | ---: | ---: | ---: | ---: | --- |")
    for row in rows:
        if row["failure"] and not row["integrator"]:
            lines.append(f"| {row['scene']} | | | | | | | | {row['failure']} |")
        elif row["integrator"] == "leapfrog":
            cells = [row["scene"], row["preset"], row["steps"], _percent(row["promised"])]
            cells += [_percent(row["impacts_predicted"]), _percent(row["impacts"] if _touched(row) else "")]
            cells += [_percent(row["resting_predicted"] if row["resting"] else ""), _percent(row["resting"])]
            lines.append(f"| {' | '.join(cells)} | {_verdict(row)} |")
    return "\n".join(lines)


def _verdict(row: Mapping[str, str]) -> str:
    if row["failure"]:
        return row["failure"]
    if not _touched(row) and not row["resting"]:
        return "nothing touches"
    kept = all(not row[key] or float(row[key]) <= float(row["promised"]) for key in ("impacts", "resting"))
    return "kept" if kept else "**not kept**"


def _touched(row: Mapping[str, str]) -> bool:
    """Whether there was a force to err in; bottles on a line in good order do not touch."""
    return bool(row["impacts"]) and float(row["impacts"]) > 0.0


def _percent(value: str) -> str:
    return f"{100.0 * float(value):.2g} %" if value else "-"


def _default(rows: Sequence[Mapping[str, str]]) -> str:
    """Cost with each integrator over that with leapfrog, where both keep the preset's promise."""
    by = {(row["scene"], row["integrator"], row["preset"]): row for row in rows}
    others = INTEGRATORS[1:]
    heads = [f"{other}, {preset}" for preset in ("standard", "fine") for other in others]
    lines = [f"| scene | {' | '.join(heads)} |", f"| --- |{' ---: |' * len(heads)}"]
    for name in dict.fromkeys(row["scene"] for row in rows):
        cells = [
            _ratio(by.get((name, other, preset)), by.get((name, "leapfrog", preset)))
            for preset in ("standard", "fine")
            for other in others
        ]
        if any(cell != "-" for cell in cells):
            lines.append(f"| {name} | {' | '.join(cells)} |")
    return "\n".join(lines)


def _ratio(other: Mapping[str, str] | None, ours: Mapping[str, str] | None) -> str:
    if other is None or ours is None or not ours["cost"] or "not kept" in _verdict(ours):
        return "-"
    if not other["cost"] or "not kept" in _verdict(other):
        return "not kept"
    return f"{float(other['cost']) / float(ours['cost']):.2g}"


@click.command()
@one_line()
@click.argument("scenes", nargs=-1)
@click.option("--jobs", default=2, show_default=True, help="Processes.")
@click.option("--tables", "only_tables", is_flag=True, help="Measure nothing, renew predictions and tables.")
def main(scenes: tuple[str, ...], jobs: int, only_tables: bool) -> None:
    """Measure SCENES (default: all) and renew docs/accuracy.md."""
    SCENES.mkdir(exist_ok=True)
    write(SCENES)
    known = scene_files()
    for name in scenes:
        if name not in known:
            raise click.BadParameter(f"{name} given, expected some of {', '.join(known)}")
    if only_tables:
        keep(predict_again(read()))
    else:
        measure_all(scenes or list(known), jobs)
    PAGE.write_text(page(PAGE.read_text(encoding="utf-8")), encoding="utf-8")


if __name__ == "__main__":
    main()
