# SPDX-License-Identifier: Apache-2.0
"""Files that a page of docs/cookbook/ shows, and the line that they make."""

from __future__ import annotations

import os
import re
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from conveyor_sim.control.load import load
from conveyor_sim.control.st import StructuredText
from conveyor_sim.testing import Scenario

COOKBOOK = Path(__file__).resolve().parents[1] / "cookbook"
RECIPES = sorted(page for page in COOKBOOK.glob("*.md") if page.stem != "index")
BLOCK = re.compile(r"^```\w*\n(?:# |\(\* )(\S+\.\w+)(?: \*\))?\n(.*?)^```$", re.DOTALL | re.MULTILINE)
"""Block of a page with the name of its file in the first line."""


def write_files(page: Path, folder: Path) -> None:
    """Write the blocks of a page that begin with the name of a file."""
    for name, text in BLOCK.findall(page.read_text(encoding="utf-8")):
        (folder / name).write_text(text, encoding="utf-8")


@contextmanager
def recipe_line(page: Path, folder: Path, overrides: Mapping[str, Any] | None = None) -> Iterator[Scenario]:
    """Write the files of a page to a folder. Yield its line, with the controller that its command `serve` names."""
    write_files(page, folder)
    command = re.search(r"^    conveyor-sim serve (\S+) --controller (\S+)", page.read_text(), re.MULTILINE)
    if command is None:
        raise ValueError(f"{page}: expected a command conveyor-sim serve SCENE --controller CONTROLLER")
    before = Path.cwd()
    os.chdir(folder)
    try:
        program = command[2]
        plant = Scenario(folder / command[1], overrides)
        plant.attach(StructuredText(program) if program.endswith(".st") else load(program))
        yield plant
    finally:
        os.chdir(before)
