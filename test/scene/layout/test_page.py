# SPDX-License-Identifier: Apache-2.0
"""The examples of docs/conveyors.md are scenes."""

import re
from pathlib import Path

import pytest
from scene.layout.written import read

PAGE = Path(__file__).parents[3] / "docs" / "conveyors.md"
EXAMPLES = re.findall(r"^```yaml\n(.+?)^```", PAGE.read_text(encoding="utf-8"), re.MULTILINE | re.DOTALL)


@pytest.mark.parametrize("example", EXAMPLES)
def test_an_example_of_the_page_is_a_scene(example: str) -> None:
    assert read(example).belts
