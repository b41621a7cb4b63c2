# SPDX-License-Identifier: Apache-2.0
"""Settings of accuracy measured on the pages of docs/cookbook/: python docs/studies/cookbook_settings.py [NAME ...].

With each setting in the scene of a page, its tests run, and its line is timed while it works. A page counts as
unaffected by a setting if all its tests pass. Results go to docs/cookbook/settings.csv and, from there, into the index.
"""

from __future__ import annotations

import csv
import re
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

from cookbook_pages import COOKBOOK, RECIPES, recipe_line, write_files
from page_parts import with_parts

from conveyor_sim.errors import SceneError

RESULTS = COOKBOOK / "settings.csv"
INDEX = COOKBOOK / "index.md"
SETTINGS = ("draft", "standard", "fast")
FIELDS = ("page", "setting", "steps", "tests", "passed", "cpu")
SETTLE, TIMED = 20.0, 10.0
"""Simulated times before and during the timing, s."""


def changed(page: Path, setting: str, folder: Path) -> Path:
    """Write a copy of a page whose scene has another setting. Return it."""
    copy = folder / page.name
    copy.write_text(re.sub(r"^accuracy: .*$", f"accuracy: {setting}", page.read_text(), count=1, flags=re.MULTILINE))
    return copy


def measure(page: Path, setting: str) -> dict[str, object]:
    """Return the row of a page and a setting. A setting that the scene refuses has no steps."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        copy = changed(page, setting, folder)
        write_files(copy, folder)
        try:
            with recipe_line(copy, folder) as plant:
                plant.run_for(SETTLE)
                start = time.process_time()
                plant.run_for(TIMED)
                cpu = (time.process_time() - start) / TIMED
                steps = plant.simulation.model.steps_per_tick
        except SceneError:
            return {"page": page.stem, "setting": setting, "steps": "", "tests": "", "passed": "", "cpu": ""}
        (test,) = folder.glob("test_*.py")
        words = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", test.name]
        said = subprocess.run(words, cwd=folder, capture_output=True, text=True, check=False).stdout
        passed, failed = (sum(map(int, re.findall(rf"(\d+) {word}", said))) for word in ("passed", "failed"))
    return {
        "page": page.stem,
        "setting": setting,
        "steps": steps,
        "tests": passed + failed,
        "passed": passed,
        "cpu": f"{cpu:.3f}",
    }


def stored() -> Iterator[dict[str, str]]:
    """Yield the stored rows."""
    if RESULTS.exists():
        with RESULTS.open(newline="") as file:
            yield from csv.DictReader(file)


def table() -> str:
    """Return the table of the index."""
    lines = ["| page | " + " | ".join(f"`{name}`" for name in SETTINGS) + " |", "|---|" + "---|" * len(SETTINGS)]
    rows = {(row["page"], row["setting"]): row for row in stored()}
    for page in RECIPES:
        cells = []
        for setting in SETTINGS:
            row = rows.get((page.stem, setting))
            if row is None:
                cells.append("not measured")
            elif not row["steps"]:
                cells.append("refused")
            else:
                cells.append(f"{row['passed']} of {row['tests']} tests, {row['steps']} steps, {row['cpu']} s")
        lines.append(f"| [{page.stem}]({page.name}) | " + " | ".join(cells) + " |")
    return "\n".join(lines)


def page() -> str:
    """Return the index with the present table."""
    return with_parts(INDEX, INDEX.read_text(encoding="utf-8"), {"settings": table()})


def main() -> None:
    """Measure the named pages, or all, and write the results."""
    rows: dict[tuple[str, str], dict[str, object]] = {(row["page"], row["setting"]): dict(row) for row in stored()}
    for recipe in RECIPES:
        if not sys.argv[1:] or recipe.stem in sys.argv[1:]:
            for setting in SETTINGS:
                rows[recipe.stem, setting] = measure(recipe, setting)
                print(rows[recipe.stem, setting], flush=True)
    with RESULTS.open("w", newline="") as file:
        writer = csv.DictWriter(file, FIELDS, lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows[key] for key in sorted(rows))
    INDEX.write_text(page(), encoding="utf-8")


if __name__ == "__main__":
    main()
