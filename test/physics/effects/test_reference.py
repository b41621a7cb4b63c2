# SPDX-License-Identifier: Apache-2.0
"""The list of effects in the docs is what the declarations say, and its example runs."""

import re
from pathlib import Path

import numpy as np

from conveyor_sim import Simulation, load_scene

ROOT = Path(__file__).parents[3]
DOCS = ROOT / "docs" / "effects.md"
EXAMPLE = ROOT / "examples" / "effects.yaml"


def test_scene_in_the_docs_is_the_example() -> None:
    assert re.findall(r"```yaml\n(.*?)```", DOCS.read_text(encoding="utf-8"), re.DOTALL) == [EXAMPLE.read_text()]


def test_example_has_the_effects_that_it_shows() -> None:
    simulation = Simulation(load_scene(EXAMPLE), threads=1)
    on = {choice.name for choice in simulation.model.effects if choice.on}
    assert on >= {"hertz", "tsuji_damping", "contact_friction", "tangential_spring", "ring_base", "rotation"}
    assert not on & {"linear", "paper_damping", "contact_arrays", "peaks"}
    simulation.advance(100)
    # A ring that straddles the belts is drawn forward more by the fast one on its left: it turns clockwise.
    assert simulation.counts.present > 1
    assert np.all(simulation.bottles().omega[:-1] < -0.01)
