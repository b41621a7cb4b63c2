# SPDX-License-Identifier: Apache-2.0
"""The examples of docs/placement.md are scenes, and its tables name every kind of device."""

import re
from pathlib import Path

import pytest
from scene.layout.written import read

from conveyor_sim.scene.layout.devices import PLACEABLE

PAGE = (Path(__file__).parents[3] / "docs" / "placement.md").read_text(encoding="utf-8")
EXAMPLES = re.findall(r"^```yaml\n(.+?)^```", PAGE, re.MULTILINE | re.DOTALL)


@pytest.mark.parametrize("example", EXAMPLES)
def test_an_example_of_the_page_is_a_scene(example: str) -> None:
    assert read(example).photo_eyes


def test_the_page_names_every_kind_that_can_be_placed() -> None:
    table = PAGE.partition("## Places by kind")[2].partition("\n\n")[0]
    named = {f"`{name}`" for kind in PLACEABLE for name in (kind.field, kind.kind, kind.within) if name}
    assert {name for name in named if name not in table} == set()
