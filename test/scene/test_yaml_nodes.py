"""libyaml reads what ruamel reads, or is not asked."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import pytest
from scene.yaml_trees import MOST, outcome

from conveyor_sim.scene import parse_scene, yaml_nodes
from conveyor_sim.scene.yaml_nodes import TooManyError, compose, compose_in_full

ROOT = Path(__file__).parents[2]

FILES = sorted([*ROOT.glob("config/**/*.yaml"), *ROOT.glob("test/**/*.yaml"), *ROOT.glob("examples/**/*.yaml")])
IN_PAGES = [
    pytest.param(text, id=f"{page.name}-{number}")
    for page in [ROOT / "README.md", *sorted(ROOT.glob("docs/**/*.md"))]
    for number, text in enumerate(re.findall(r"```yaml\n(.*?)```", page.read_text(encoding="utf-8"), re.DOTALL))
]
READ_OTHERWISE = {
    "key in quotes": '[a, "a":b]',
    "end of a document": "~\n...\n...\n",
    "empty value": "<<: \n",
    "block": ">-\n#   --.\n#     '--__\n",
    "colon in a name": "&a:1",
    "tab": "a:\t1\nb: {c:\t2}\n",
    "line end of YAML 1.1": "a: b\x85c: d\u2028e\n",
    "byte order mark": "\ufeffa: 1\n",
    "directive": "%YAML 1.1\n---\na: yes\n",
    "tag": "a: !!str 1\nb: !other 2\n",
    "name given twice": "[&a 1, &a 2, *a]",
    "two documents": "a: 1\n---\nb: 2\n",
    "no such alias": "a: *b\n",
    "no YAML": "a: [1, 2\n",
}

PLAIN = (
    "1", "-1", "+1", "1.0", "1.", ".5", "1e3", "1.5e-3", "-.inf", ".NaN", "0x1F", "0o17", "017", "1_000", "1:30",
    "2001-12-14", "true", "True", "yes", "on", "n", "null", "~", "=", "é", "µm", "😀", "a b", "a#b", "-a", "a:b",
)  # fmt: skip


@pytest.mark.parametrize("file", FILES, ids=lambda file: file.relative_to(ROOT).as_posix())
def test_a_file_is_the_same(file: Path) -> None:
    text = file.read_text(encoding="utf-8")
    assert outcome(compose, text) == outcome(compose_in_full, text)


@pytest.mark.parametrize("text", IN_PAGES)
def test_a_text_of_the_pages_is_the_same(text: str) -> None:
    assert outcome(compose, text) == outcome(compose_in_full, text)


@pytest.mark.filterwarnings("ignore::ruamel.yaml.error.ReusedAnchorWarning")
@pytest.mark.parametrize("text", READ_OTHERWISE.values(), ids=READ_OTHERWISE)
def test_what_libyaml_reads_otherwise_is_left_to_ruamel(text: str) -> None:
    assert outcome(compose, text) == outcome(compose_in_full, text)


@pytest.mark.parametrize("value", PLAIN)
def test_a_value_is_that_of_yaml_1_2(value: str) -> None:
    text = f"{{plain: [{value}], quoted: '{value}'}}\n"
    assert outcome(compose, text) == outcome(compose_in_full, text)


def test_shipped_scenes_need_no_other_reader(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delattr(yaml_nodes, "compose_in_full")
    files = sorted(ROOT.glob("config/**/*.yaml"))
    assert len(files) > 10
    for file in files:
        assert compose(file.read_text(encoding="utf-8"), MOST) is not None


def test_without_libyaml_a_scene_is_the_same(monkeypatch: pytest.MonkeyPatch) -> None:
    text = (ROOT / "config" / "funnel.yaml").read_text(encoding="utf-8") + "# read only here\n"
    scene = parse_scene(text)
    monkeypatch.setattr(yaml_nodes, "_LIBYAML", None)
    assert parse_scene(f"{text}\n").model_dump() == scene.model_dump()


@pytest.mark.parametrize("read", [compose, compose_in_full])
def test_no_more_values_are_read_than_asked_for(read: Any) -> None:
    text = "a: [1, 2, 3, &b 4]\nc: *b\n"
    assert read(text, 9) is not None
    with pytest.raises(TooManyError) as error:
        read(text, 8)
    assert error.value.line == 2
