# SPDX-License-Identifier: Apache-2.0
"""Share of bottles that step with integrator impulses on the shipped lines: python docs/studies/stepped.py [NAME ...].

Every line runs LINE_TIME with `accuracy: fast` in place of its own setting, as it starts, and with its controller
where it has one. Results go to stepped.csv and, from there, into docs/accuracy.md. Scenes that refuse impulses have the
reason in place of a share.
"""

from __future__ import annotations

import csv
import sys
from collections.abc import Iterator
from pathlib import Path

from page_parts import with_parts

from conveyor_sim.control.load import load
from conveyor_sim.errors import SceneError
from conveyor_sim.testing import Scenario

ROOT = Path(__file__).resolve().parents[2]
PAGE = ROOT / "docs" / "accuracy.md"
RESULTS = Path(__file__).with_suffix(".csv")
FIELDS = ("scene", "controller", "bottles", "stepped", "reason")
LINE_TIME = 60.0
"""Simulated time of a run, s."""

SCENES = sorted([*ROOT.glob("config/*.yaml"), *ROOT.glob("config/scenarios/*.yaml"), *ROOT.glob("examples/*.yaml")])
SCENES.append(ROOT / "examples/pasteuriser/pasteuriser_line.yaml")
CONTROLLERS = {
    "brewery": "conveyor_sim/control/brewery.py:brewery",
    "pasteuriser_line": "examples/pasteuriser/pasteuriser_line.py:controller",
    "small_packaging": "examples/small_packaging.py:controller",
}
"""By scene, from the root of the project."""


def measure(scene: Path) -> dict[str, str]:
    """Return the row of a scene."""
    name, row = scene.stem, dict.fromkeys(FIELDS, "")
    row["scene"] = str(scene.relative_to(ROOT))
    try:
        line = Scenario(scene, {"accuracy": "fast", "duration": 2.0 * LINE_TIME})
    except SceneError as error:
        return {**row, "reason": str(error).splitlines()[0].partition(": ")[2]}
    if name in CONTROLLERS:
        line.attach(load(str(ROOT / CONTROLLERS[name])))
        row["controller"] = CONTROLLERS[name].partition(":")[0]
    if name == "brewery":
        line.panel.press("start")
    line.run_for(LINE_TIME)
    share = line.simulation.integration.asleep_share
    row["bottles"] = str(line.simulation.counts.present)
    if share is None:
        (sleep,) = (effect for effect in line.simulation.model.effects if effect.name == "sleeping")
        return {**row, "stepped": "1", "reason": sleep.why}
    return {**row, "stepped": f"{1.0 - share:.3f}"}


def stored() -> Iterator[dict[str, str]]:
    """Yield the stored rows."""
    if RESULTS.exists():
        with RESULTS.open(newline="", encoding="utf-8") as file:
            yield from csv.DictReader(file)


def table() -> str:
    """Return the table of the page."""
    lines = ["| scene | bottles at the end | stepped | |", "|---|---:|---:|---|"]
    for row in stored():
        share = f"{100.0 * float(row['stepped']):.3g} %" if row["stepped"] else ""
        note = row["reason"] or ("with its controller" if row["controller"] else "")
        lines.append(f"| `{row['scene']}` | {row['bottles']} | {share} | {note} |")
    return "\n".join(lines)


def page(text: str) -> str:
    """Return the text of docs/accuracy.md with the present table."""
    return with_parts(PAGE, text, {"stepped": table()})


def main() -> None:
    """Measure the named scenes, or all, and write the results."""
    rows = {row["scene"]: row for row in stored()}
    for scene in SCENES:
        if not sys.argv[1:] or scene.stem in sys.argv[1:]:
            row = measure(scene)
            rows[row["scene"]] = row
            print(row, flush=True)
    with RESULTS.open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, FIELDS, lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows[key] for key in sorted(rows))
    PAGE.write_text(page(PAGE.read_text(encoding="utf-8")), encoding="utf-8")


if __name__ == "__main__":
    main()
