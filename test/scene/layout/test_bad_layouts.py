# SPDX-License-Identifier: Apache-2.0
"""Every error in a layout is one line with file, line, field, value and expectation."""

from pathlib import Path
from typing import Any

import pytest
from facts import missing
from scene.layout.written import HEAD, read

from conveyor_sim.errors import SceneError
from conveyor_sim.scene.layout.expand import expand
from conveyor_sim.scene.yaml_lines import Document

HERE = Path(__file__).parent
GOOD = (HERE / "good_layout.yaml").read_text(encoding="utf-8")
CASES = Document((HERE / "bad_layouts.yaml").read_text(encoding="utf-8"), "bad_layouts.yaml").data


def test_the_unchanged_layout_is_accepted() -> None:
    assert list(read(GOOD).belts) == ["old", "table", "lane_z1", "lane_z2", "beyond"]


@pytest.mark.parametrize("case", CASES, ids=[case["id"] for case in CASES])
def test_one_wrong_thing_gets_one_line(case: dict[str, Any]) -> None:
    assert GOOD.count(case["old"]) >= 1, "the change no longer fits good_layout.yaml"
    text = GOOD.replace(case["old"], case["new"], 1)
    lines = (HEAD + text).splitlines()
    line = 1 + next(number for number, content in enumerate(lines) if case.get("line", case["at"]) in content)
    with pytest.raises(SceneError) as error:
        read(text)
    (message,) = str(error.value).splitlines()
    head = f"plant.yaml:{line}: {case['field']}: " if "field" in case else f"plant.yaml:{line}: "
    assert message.startswith(head)
    assert missing(message.removeprefix(head), case["facts"]) == []


def test_a_whole_number_beyond_doubles_is_refused() -> None:
    place = {"start": [0, 0], "heading": 10**400, "path": [{"straight": 1}]}
    (problem,) = expand({"conveyors": {"lane": {**place, "width": 0.1, "material": "chain"}}}).problems
    assert problem.path == ("conveyors", "lane", "heading")
    assert missing(problem.text, ["angle", "rad"]) == []
