# SPDX-License-Identifier: Apache-2.0
"""Texts are read by YAML 1.2: as ruamel.yaml reads them, a parser of that version."""

from __future__ import annotations

import json
import math
import re
from pathlib import Path
from typing import Any

import pytest
import yaml
from ruamel.yaml import YAML
from ruamel.yaml.error import YAMLError

from conveyor_sim.errors import SceneError
from conveyor_sim.scene import parse_scene, yaml_lines
from conveyor_sim.scene.yaml_lines import Document

ROOT = Path(__file__).parents[2]

FILES = sorted([*ROOT.glob("config/**/*.yaml"), *ROOT.glob("test/**/*.yaml"), *ROOT.glob("examples/**/*.yaml")])
IN_PAGES = [
    pytest.param(text, id=f"{page.name}-{number}")
    for page in [ROOT / "README.md", *sorted(ROOT.glob("docs/**/*.md"))]
    for number, text in enumerate(re.findall(r"```yaml\n(.*?)```", page.read_text(encoding="utf-8"), re.DOTALL))
]
STRUCTURES = (
    "a: >-\n  one\n  two\nb: |\n  one\n  two\n",
    "a: &x {b: 1}\nc: {<<: *x, d: 2}\ne: *x\n",
    "a: [&x 1, &x 2, *x]\n",
    "a:\nb: ''\nc: ~\n",
    "a: !!str 1\nb: !!int '2'\nc: !!float 3\n",
    "\ufeffa: 1\n",
    "? a\n: 1\n",
    "---\na: 1\n...\n",
)
PLAIN = (
    "1", "-1", "+1", "1.0", "1.", ".5", "1e3", "1.5e-3", "-.inf", ".NaN", "0x1F", "0o17", "0b11", "017", "1_000",
    "1:30", "12:30", "true", "True", "yes", "on", "n", "null", "~", "é", "µm", "😀", "a b", "a#b", "-a", "a:b", "_1",
    "-_1", "1_0.5", ".5e3", "1e", "0x", "+0x1F",
)  # fmt: skip


def by_ruamel(text: str) -> Any:
    return YAML(typ="safe", pure=True).load(text)


def check(text: str) -> None:
    """Check that both readers return the same data, or that both refuse the text."""
    try:
        data = Document(text, "scene.yaml").data
    except SceneError:
        with pytest.raises(YAMLError):
            by_ruamel(text)
        return
    assert json.dumps(data, sort_keys=True) == json.dumps(by_ruamel(text), sort_keys=True)  # NaN equals NaN


@pytest.mark.parametrize("file", FILES, ids=lambda file: file.relative_to(ROOT).as_posix())
def test_a_file_is_read_by_yaml_1_2(file: Path) -> None:
    check(file.read_text(encoding="utf-8"))


@pytest.mark.parametrize("text", IN_PAGES)
def test_a_text_of_the_pages_is_read_by_yaml_1_2(text: str) -> None:
    check(text)


@pytest.mark.filterwarnings("ignore::ruamel.yaml.error.ReusedAnchorWarning")
@pytest.mark.parametrize("text", STRUCTURES)
def test_a_structure_is_that_of_yaml_1_2(text: str) -> None:
    assert Document(text, "scene.yaml").data == by_ruamel(text)


@pytest.mark.parametrize("value", PLAIN)
def test_a_value_is_that_of_yaml_1_2(value: str) -> None:
    text = f"{{plain: [{value}], quoted: '{value}'}}\n"
    (plain,), (expected,) = (data["plain"] for data in (Document(text, "scene.yaml").data, by_ruamel(text)))
    assert type(plain) is type(expected)
    assert plain == expected or (math.isnan(plain) and math.isnan(expected))
    assert Document(text, "scene.yaml").data["quoted"] == value


def test_lines_are_those_of_keys_and_entries() -> None:
    document = Document("a:\n  - 1\n  - {b: 2}\n\nc: [1,\n    2]\n", "scene.yaml")
    paths = [("a",), ("a", 0), ("a", 1, "b"), ("c", 1), ("c", 1, "no", "such")]
    assert [document.line_of(path) for path in paths] == [1, 2, 3, 6, 6]


def test_without_libyaml_a_scene_is_the_same(monkeypatch: pytest.MonkeyPatch) -> None:
    text = (ROOT / "config" / "funnel.yaml").read_text(encoding="utf-8") + "# read only here\n"
    scene = parse_scene(text)
    monkeypatch.setattr(yaml_lines, "_LOADER", yaml.SafeLoader)
    assert parse_scene(f"{text}\n").model_dump() == scene.model_dump()


def test_no_more_values_are_read_than_allowed(monkeypatch: pytest.MonkeyPatch) -> None:
    text = "a: [1, 2, 3, &b 4]\nc: *b\n"
    monkeypatch.setattr(yaml_lines, "_LARGEST", 9)
    assert Document(text, "scene.yaml").data == {"a": [1, 2, 3, 4], "c": 4}
    monkeypatch.setattr(yaml_lines, "_LARGEST", 8)
    with pytest.raises(SceneError, match=r"^scene\.yaml:2: too many values"):
        Document(text, "scene.yaml")
