# SPDX-License-Identifier: Apache-2.0
"""All kernels that a run may need are compiled before it begins."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

CODE = """
from scenes import NO_FLOOR, bottle, scene
from conveyor_sim import Simulation
from conveyor_sim.engine.sensors.regions import list_inside
from conveyor_sim.run.compilation import compile_kernels

region = [[0.2, -1.0], [0.3, -1.0], [0.3, 1.0]]
parts = {{"part": {{"region": region{more}}}}}
compile_kernels(scene(bottles=[bottle(0.0, 0.0)], {part}=parts, **NO_FLOOR))
print(len(list_inside.signatures))
"""


@pytest.mark.parametrize(("part", "more"), [("machines", ', "kind": "reject"'), ("zones", ""), ("outfeeds", "")])
def test_whatever_looks_into_a_region_compiles_nothing_in_the_middle_of_a_run(part: str, more: str) -> None:
    """A reject looks when it is fired, a zone when somebody reads its signals."""
    code = CODE.format(part=part, more=more)
    run = subprocess.run(
        [sys.executable, "-c", code], cwd=Path(__file__).parents[1], capture_output=True, text=True, check=False
    )
    assert run.stdout.strip() == "1", run.stderr
