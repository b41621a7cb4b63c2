# SPDX-License-Identifier: Apache-2.0
"""Every error in a scene is reported in one line with file, line, field, value and expectation."""

import os
from pathlib import Path
from typing import Any

import pytest
from facts import missing

from conveyor_sim.errors import SceneError
from conveyor_sim.scene import load_scene, parse_scene, yaml_lines
from conveyor_sim.support.resources import scene_path

HERE = Path(__file__).parent
GOOD = (HERE / "good.yaml").read_text(encoding="utf-8")
CASES = yaml_lines.Document((HERE / "bad_scenes.yaml").read_text(encoding="utf-8"), "bad_scenes.yaml").data


@pytest.mark.parametrize("case", CASES, ids=[case["id"] for case in CASES])
def test_one_wrong_thing_gets_one_line(case: dict[str, Any]) -> None:
    assert GOOD.count(case["old"]) >= 1, "the change no longer fits good.yaml"
    text = GOOD.replace(case["old"], case["new"], 1)
    line = 1 + next(number for number, content in enumerate(text.splitlines()) if case["at"] in content)
    with pytest.raises(SceneError) as error:
        parse_scene(text, "plant.yaml")
    (message,) = str(error.value).splitlines()
    head = f"plant.yaml:{line}: {case['field']}: " if "field" in case else f"plant.yaml:{line}: "
    assert message.startswith(head)
    assert missing(message.removeprefix(head), [*case.get("value", "").splitlines(), *case["facts"]]) == []


def test_the_unchanged_scene_is_accepted() -> None:
    parse_scene(GOOD)


def test_all_problems_are_listed_in_the_order_of_lines() -> None:
    text = GOOD.replace("duration: 1.0", "duration: -1").replace("mass: 0.2", "mass: -1").replace("rows: 2", "rows: 0")
    with pytest.raises(SceneError) as error:
        parse_scene(text, "plant.yaml")
    assert [line.split(" given")[0] for line in str(error.value).splitlines()] == [
        "plant.yaml:2: duration: -1",
        "plant.yaml:10: bottle_types.jar.mass: -1",
        "plant.yaml:33: bottles[1].grid.rows: 0",
    ]


def test_no_more_than_fifty_problems_are_listed() -> None:
    heap = "".join("  - {type: jar, position: [0.4, 0.4]}\n" for _ in range(60))
    with pytest.raises(SceneError) as error:
        parse_scene(GOOD.replace("  - grid:", heap + "  - grid:"), "plant.yaml")
    lines = str(error.value).splitlines()
    assert len(lines) == 51
    assert lines[0].startswith("plant.yaml:33: bottles[1].position: [0.4, 0.4] given")
    assert missing(lines[50], ["plant.yaml", "10 more"]) == []


def test_long_values_are_cut_short() -> None:
    with pytest.raises(SceneError) as error:
        parse_scene(GOOD.replace("name: good", f"name: {'x' * 200}"), "plant.yaml")
    assert str(error.value).startswith('plant.yaml:1: name: "xxx')
    assert "x ... given, expected a name" in str(error.value)
    assert len(str(error.value)) < 200


def test_missing_file(tmp_path: Path) -> None:
    path = tmp_path / "nothing.yaml"
    with pytest.raises(SceneError) as error:
        load_scene(path)
    assert str(error.value).startswith(f"{path}: ")
    assert missing(str(error.value), ["no such file", "scene file"]) == []


def test_folder(tmp_path: Path) -> None:
    with pytest.raises(SceneError) as error:
        load_scene(tmp_path)
    assert missing(str(error.value), [str(tmp_path), "folder", "scene file"]) == []


def test_file_below_a_file(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    path = tmp_path / "file" / "scene.yaml"
    with pytest.raises(SceneError) as error:
        load_scene(path)
    assert missing(str(error.value), [str(path), "Not a directory", "scene file"]) == []


@pytest.mark.parametrize("content", [b"", b"# only a comment\n", b"---\n"])
def test_empty_file(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "empty.yaml"
    path.write_bytes(content)
    with pytest.raises(SceneError, match=r"empty\.yaml"):
        load_scene(path)


def test_not_utf_8(tmp_path: Path) -> None:
    path = tmp_path / "latin.yaml"
    path.write_bytes("name: a\ndescription: Zuführung\n".encode("latin-1"))
    with pytest.raises(SceneError) as error:
        load_scene(path)
    assert str(error.value).startswith(f"{path}:2: ")
    assert missing(str(error.value), ["not", "UTF-8", "scene file"]) == []


MANDATORY = ["mapping", "name", "duration", "bottle_types"]


@pytest.mark.parametrize(
    ("text", "line", "facts"),
    [
        ("- 1\n", 1, ["[1]", *MANDATORY]),
        ("hello\n", 1, ['"hello"', *MANDATORY]),
        ("a: 1\n---\nb: 2\n", 2, ["not valid YAML", "single document"]),
        ("a: \x01\n", 1, ["not valid YAML", "control character"]),
        ("a: &a [*a]\n", 1, ["nested too deeply"]),
        ("[" * 5000, 1, ["not valid YAML", "maximum nesting depth"]),
        ("- " * 5000, 1, ["nested too deeply"]),
        ("é: µµµ\n\n# ééé\nb: \x01\n\n\n", 4, ["not valid YAML", "control character"]),
        ("a: 1\nb: \ud800\n", 2, ["not valid YAML", "half of a character"]),
        ("a: *nowhere\n", 1, ["not valid YAML", "undefined alias", "'nowhere'"]),
    ],
)
def test_what_is_no_scene_at_all(text: str, line: int, facts: list[str]) -> None:
    with pytest.raises(SceneError) as error:
        parse_scene(text, "plant.yaml")
    assert str(error.value).startswith(f"plant.yaml:{line}: ")
    assert missing(str(error.value), facts) == []


def test_aliases_that_multiply_are_stopped() -> None:
    levels = ["a0: &a0 [1, 1, 1, 1, 1, 1, 1, 1, 1, 1]"]
    levels += [f"a{n}: &a{n} [{', '.join([f'*a{n - 1}'] * 10)}]" for n in range(1, 12)]
    with pytest.raises(SceneError, match="too many values"):
        parse_scene("\n".join(levels))


def test_a_scene_that_is_no_regular_file_is_refused_at_once(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe")
    with (tmp_path / "huge").open("wb") as stream:
        stream.truncate(10**8)
    for path, facts in (
        (tmp_path / "pipe", ["named pipe", "regular file"]),
        (Path("/dev/zero"), ["device", "regular file"]),
        (tmp_path / "huge", ["100 MB", "8 MB"]),
        (tmp_path / ("x" * 300), ["File name too long"]),
    ):
        with pytest.raises(SceneError) as error:
            load_scene(path)
        assert str(error.value).startswith(f"{path}: ")
        assert missing(str(error.value), [*facts, "scene file"]) == []


def test_a_name_of_a_scene_may_be_anything(tmp_path: Path) -> None:
    """Paths that are no regular files are left to the reader, which reports their kind."""
    os.mkfifo(tmp_path / "pipe")
    assert scene_path(tmp_path / "pipe") == tmp_path / "pipe"
    for name in ("x" * 5000, "~nobody-of-this-name/scene.yaml", "a\0b", ""):
        with pytest.raises(SceneError, match="no such scene file"):
            scene_path(name)


def test_a_text_of_too_many_values_is_refused_before_all_of_it_is_in_memory(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(yaml_lines, "_LARGEST", 1000)
    with pytest.raises(SceneError, match=r"^plant\.yaml:1: too many values"):
        parse_scene(f"[{'a,' * 1000}", "plant.yaml")  # that it is not closed is not seen any more


@pytest.mark.parametrize("number", ["0x" + "f" * 20_000, "9" * 100_000, "0x" + "f" * 300])
def test_a_number_beyond_all_bounds_is_cut_in_its_sentence(number: str) -> None:
    with pytest.raises(SceneError) as error:
        parse_scene(f"seed: {number}", "plant.yaml")
    assert str(error.value).startswith("plant.yaml:1: ")
    assert missing(str(error.value), ["can't be read", f"{number[:56]} ..."]) == []


def test_a_name_of_a_field_that_goes_on_and_on_is_cut() -> None:
    with pytest.raises(SceneError) as error:
        parse_scene(GOOD + f"? {'x' * 50_000}\n: 1\n", "plant.yaml")
    (line,) = str(error.value).splitlines()
    assert f" {'x' * 199}…: " in line
    assert len(line) < 600


@pytest.mark.parametrize("value", ["!!float", "!!int", "!!bool maybe", "!!timestamp x", "!!binary =", "!!null 1"])
def test_a_tag_that_does_not_fit_its_value_is_refused(value: str) -> None:
    with pytest.raises(SceneError, match=r"^plant\.yaml:1: "):
        parse_scene(f"seed: {value}", "plant.yaml")
