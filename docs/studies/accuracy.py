# SPDX-License-Identifier: Apache-2.0
"""The numbers behind docs/accuracy.md: runs the real command on the scenes below and renews the page's tables.

    make accuracy                                   # all scenes, up to 5 min of two processors each
    make accuracy ARGS="funnel two_bottles"         # some of them
    make accuracy ARGS=--tables                     # measures nothing: tables and pictures anew, from docs/accuracy/

Each scene's study, CSV files and pictures are kept in docs/accuracy/<scene>/.
"""

from __future__ import annotations

import shutil
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

from conveyor_sim.support.interrupt import one_line, while_importing

with while_importing():
    import click
    from page_parts import with_parts

    from conveyor_sim.accuracy.figures.draw import plot_accuracy
    from conveyor_sim.accuracy.report.answer import find_answer
    from conveyor_sim.accuracy.report.apply import line
    from conveyor_sim.accuracy.report.files import STUDY, read_study
    from conveyor_sim.accuracy.report.forecast import foretold
    from conveyor_sim.accuracy.report.lines import three_lines
    from conveyor_sim.accuracy.report.tables import markdown
    from conveyor_sim.accuracy.results import AccuracyStudy
    from conveyor_sim.physics.timestep.presets import table
    from conveyor_sim.scene import load_scene

ROOT = Path(__file__).resolve().parents[2]
PAGE = ROOT / "docs" / "accuracy.md"
FOLDER = ROOT / "docs" / "accuracy"

TRUE, SOFTER = "stiffness: 100000000 ", "stiffness: 10000000  "

SCENES = (
    "paper_plant",
    "accumulation_table",
    "turntable",
    "glass_line",
    "glass_line_1e7",
    "funnel",
    "two_bottles",
)
TABLES = "tables.md"
KEPT = ("*.csv", "study.json", "pareto.png", "stiffness.png", "scene.yaml", TABLES)


def scene_file(name: str) -> Path:
    """Return the scene's file; glass of a tenth of the stiffness is derived from glass_line."""
    if name != "glass_line_1e7":
        return Path("config") / f"{name}.yaml"
    file = Path("docs") / "accuracy" / name / "scene.yaml"
    text = (ROOT / "config" / "glass_line.yaml").read_text(encoding="utf-8")
    changed = text.replace(TRUE, SOFTER).replace("name: glass_line\n", "name: glass_line_1e7\n")
    (ROOT / file).parent.mkdir(parents=True, exist_ok=True)
    (ROOT / file).write_text(changed, encoding="utf-8")
    return file


def make(name: str) -> None:
    """Run the command on a scene, anew, and keep what it wrote, less the pictures that are drawings twice over."""
    folder = FOLDER / name
    shutil.rmtree(folder, ignore_errors=True)
    command = str(Path(sys.executable).with_name("conveyor-sim"))
    subprocess.run([command, "accuracy", str(scene_file(name)), "--out", str(folder)], cwd=ROOT, check=True)
    keep_only_what_the_page_shows(folder)


def draw(name: str) -> None:
    """Draw a study's pictures again, with what is predicted now."""
    folder = FOLDER / name
    plot_accuracy(of_today(name), folder)
    keep_only_what_the_page_shows(folder)


def keep_only_what_the_page_shows(folder: Path) -> None:
    for file in folder.iterdir():
        if not any(file.match(pattern) for pattern in KEPT):
            file.unlink()


def page(text: str) -> str:
    """Return the page with its tables renewed from the studies in docs/accuracy/. Raise ValueError without a marker."""
    studies = {name: of_today(name) for name in studied()}
    parts = {"presets": table(), "answers": answers(studies)}
    parts |= {name: section(name) for name in studies}
    return with_parts(PAGE, text, parts)


def section(name: str) -> str:
    """Return the figure, and the place of all tables."""
    return f"![What accuracy costs on {name}](accuracy/{name}/pareto.png)\n\n[All tables](accuracy/{name}/{TABLES})"


def tables() -> dict[Path, str]:
    """Return the page of tables of each study."""
    pages = {name: markdown(of_today(name)).replace("### ", "## ") for name in studied()}
    return {FOLDER / name / TABLES: f"# The study of {name}\n\n{page}" for name, page in pages.items()}


def studied() -> list[str]:
    """Return the scenes with a stored study."""
    return [name for name in SCENES if (FOLDER / name / STUDY).exists()]


def of_today(name: str) -> AccuracyStudy:
    """Return a study with present predictions and the resulting answer, which are computed, not measured."""
    study, scene = read_study(FOLDER / name / STUDY, print), load_scene(ROOT / scene_file(name))
    points = tuple(foretold(scene, point) for point in study.points)
    answer = find_answer(points, study.reference, study.comparisons, study.tolerance, study.rest)
    return replace(study, points=points, answer=answer)


def answers(studies: dict[str, AccuracyStudy]) -> str:
    """Return the first three lines of each scene's answer, and the setting."""
    parts = []
    for name, study in studies.items():
        setting = "none" if study.answer is None else f"`{line(study.answer.setting)}`"
        parts.append("\n".join([f"**{name}**", "", *(f"- {text}" for text in (*three_lines(study), setting))]))
    machines = sorted({study.machine for study in studies.values()})
    return "\n\n".join([*parts, f"Measured on {'; '.join(machines)}."])


@click.command()
@one_line()
@click.argument("scenes", nargs=-1, type=click.Choice(SCENES))
@click.option("--tables", "only_tables", is_flag=True, help="Measure nothing, renew the tables.")
def main(scenes: tuple[str, ...], only_tables: bool) -> None:
    """Study SCENES (default: all) and renew docs/accuracy.md."""
    for name in () if only_tables else scenes or SCENES:
        make(name)
    for name in studied() if only_tables else ():
        draw(name)
    for path, text in tables().items():
        path.write_text(text, encoding="utf-8")
    PAGE.write_text(page(PAGE.read_text(encoding="utf-8")), encoding="utf-8")


if __name__ == "__main__":
    main()
