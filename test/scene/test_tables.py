# SPDX-License-Identifier: Apache-2.0
"""Tables of contacts in CSV files: read with the scene, and not needed to read it again."""

import os
from pathlib import Path

import pytest
from facts import missing, stating

from conveyor_sim.errors import SceneError
from conveyor_sim.scene import load, load_scene, parse_overrides, parse_scene
from conveyor_sim.scene.places import Places

GOOD = (Path(__file__).parent / "good.yaml").read_text(encoding="utf-8")
TEXT = GOOD.replace("stiffness: 10000}", "table: data/glass.csv}")
LINE = 1 + TEXT[: TEXT.index("data/glass.csv")].count("\n")
POINTS = ((0.0, 0.0), (0.001, 5.0), (0.002, 15.5))


def written(folder: Path, content: str | bytes) -> Path:
    """A scene in a folder, with its table."""
    (folder / "data").mkdir(exist_ok=True)
    data = content if isinstance(content, bytes) else content.encode()
    (folder / "data" / "glass.csv").write_bytes(data)
    path = folder / "plant.yaml"
    path.write_text(TEXT, encoding="utf-8")
    return path


@pytest.mark.parametrize(
    "content",
    [
        "0,0\n0.001,5\n0.002,15.5\n",
        "overlap (m),force (N)\n0,0\n0.001,5\n0.002,15.5",
        b"\xef\xbb\xbfoverlap,force\r\n 0 , 0 \r\n\r\n1e-3,5\r\n2e-3,15.5\r\n",
    ],
    ids=["bare", "header", "spreadsheet"],
)
def test_points_are_read_beside_the_scene(content: str | bytes, tmp_path: Path) -> None:
    assert load_scene(written(tmp_path, content)).contacts[1].table == POINTS


@pytest.mark.parametrize(
    ("content", "says"),
    [
        ("0,0.O\n0.001,5\n", 'line 1 of it is "0,0.O"'),
        ("0,0\n0.001," + "5" * 200_000, "line 2 of it can't be read"),
    ],
    ids=["typing error in the first row", "endless cell"],
)
def test_a_row_that_can_not_be_read_is_named(content: str, says: str, tmp_path: Path) -> None:
    """A first row that holds a number is no header."""
    with pytest.raises(SceneError) as caught:
        load_scene(written(tmp_path, content))
    assert says in str(caught.value)


def test_a_table_that_starts_above_zero_is_kept_as_it_is(tmp_path: Path) -> None:
    """Its first point (0, 0) is filled in where the columns are built."""
    assert load_scene(written(tmp_path, "0.001,5\n0.002,15.5")).contacts[1].table == POINTS[1:]


def test_points_can_stand_in_the_scene() -> None:
    text = GOOD.replace("stiffness: 10000}", "table: [[0, 0], [0.001, 5], [2.0e-3, 15.5]]}")
    scene = parse_scene(text)
    assert scene.contacts[1].table == POINTS
    assert scene.overrides_text == ""


def test_what_is_recorded_gives_the_scene_without_the_file(tmp_path: Path) -> None:
    """A recording holds the text and the overrides; a replay reads them elsewhere, with the file gone."""
    path = written(tmp_path, "0,0\n0.001,5\n0.002,15.5\n")
    scene = load_scene(path, {"seed": 3})
    (tmp_path / "data" / "glass.csv").unlink()
    again = parse_scene(scene.source_text, "a recording", parse_overrides(scene.overrides_text))
    assert again == scene
    assert again.overrides_text == scene.overrides_text
    assert again.seed == 3


def test_a_table_can_be_an_override(tmp_path: Path) -> None:
    """Paths in overrides are taken from the scene's folder, too."""
    path = written(tmp_path, "0.001,5\n")
    path.write_text(GOOD, encoding="utf-8")
    contacts = [
        {"between": ["glass", "glass"], "stiffness": 5000},
        {"between": ["glass", "steel"], "table": "data/glass.csv"},
    ]
    scene = load_scene(path, {"contacts": contacts})
    assert scene.contacts[1].table == ((0.001, 5.0),)
    assert parse_scene(scene.source_text, overrides=parse_overrides(scene.overrides_text)) == scene


def test_lines_stay_those_of_the_scene(tmp_path: Path) -> None:
    """Reading a table does not turn the contacts into overrides."""
    places = Places(load_scene(written(tmp_path, "0.001,5\n"), {"seed": 3}))
    assert places.line_of(("contacts", 1, "table")) == LINE
    assert places.line_of(("seed",)) is None
    assert places.unwritten(("seed",)) == "override"
    assert places.unwritten(("gravity",)) == "default"
    assert places.of(("seed",)).endswith("plant.yaml (override)")


COLUMNS = ["two numbers", "overlap", "force", "(m, N)"]


@pytest.mark.parametrize(
    ("content", "facts"),
    [
        ("0,0\n0.001,x\n", [*COLUMNS, "line 2", '"0.001,x"']),
        ("0,0\n0.001\n", [*COLUMNS, "line 2", '"0.001"']),
        ("0,0,0\n1,1,1\n", [*COLUMNS, "line 1", '"0,0,0"']),
        ("overlap,force\n", [*COLUMNS, "none"]),
        ("", [*COLUMNS, "none"]),
        (b"\xff\xfe", ["CSV file", "UTF-8"]),
    ],
    ids=["word", "one column", "three columns", "header only", "empty", "not text"],
)
def test_what_is_wrong_in_the_file_is_told_at_the_scenes_line(
    content: str | bytes, facts: list[str], tmp_path: Path
) -> None:
    path = written(tmp_path, content)
    with pytest.raises(SceneError) as error:
        load_scene(path)
    assert str(error.value).startswith(f"{path}:{LINE}: contacts[1].table: ")
    assert missing(str(error.value), ['"data/glass.csv"', *facts]) == []


def test_numbers_that_make_no_table_are_told_as_for_points(tmp_path: Path) -> None:
    with pytest.raises(SceneError, match=stating("contacts[1].table", "point 2", "[0.001, 20]", "[0.001, 10]")):
        load_scene(written(tmp_path, "0.001,10\n0.001,20\n"))
    with pytest.raises(SceneError, match=stating("contacts[1].table", "path", "CSV file")):
        load_scene(written(tmp_path, "0.001,inf\n"))


def test_a_file_that_is_not_there(tmp_path: Path) -> None:
    path = written(tmp_path, "")
    (tmp_path / "data" / "glass.csv").unlink()
    with pytest.raises(SceneError, match=stating('"data/glass.csv"', "CSV file", str(tmp_path), "no such file")):
        load_scene(path)
    (tmp_path / "data" / "glass.csv").mkdir()
    with pytest.raises(SceneError, match="is a folder"):
        load_scene(path)


def naming(folder: Path, path: str) -> Path:
    """A scene in a folder `scenes` that names a table by a path."""
    (folder / "scenes").mkdir(exist_ok=True)
    scene = folder / "scenes" / "plant.yaml"
    scene.write_text(TEXT.replace("data/glass.csv", path), encoding="utf-8")
    return scene


def test_a_table_that_is_no_regular_file_is_refused_at_once(tmp_path: Path) -> None:
    """A pipe without a writer, a device without end, a link to itself, a file that is too large."""
    scene = naming(tmp_path, "table")
    table = tmp_path / "scenes" / "table"
    os.mkfifo(tmp_path / "scenes" / "pipe")
    with (tmp_path / "scenes" / "huge").open("wb") as stream:
        stream.truncate(10**12)
    for target, facts in (
        ("pipe", ["named pipe", "regular file"]),
        ("huge", ["1000000 MB", "10 MB"]),
        ("table", ["Too many levels of symbolic links"]),
    ):
        table.symlink_to(tmp_path / "scenes" / target)
        with pytest.raises(SceneError) as error:
            load_scene(scene)
        assert missing(str(error.value), ['"table"', "CSV file", str(tmp_path / "scenes"), *facts]) == []
        table.unlink()
    with pytest.raises(SceneError, match=stating("CSV file", "device", "regular file")):
        load_scene(naming(tmp_path, "/dev/zero"), outside_tables=True)


def test_a_table_lies_below_the_scene_unless_asked_for(tmp_path: Path) -> None:
    """By `..`, as an absolute path, or by a link."""
    (tmp_path / "law.csv").write_text("0.001,5\n")
    (tmp_path / "scenes" / "inner").mkdir(parents=True)
    (tmp_path / "scenes" / "inner" / "law.csv").write_text("0.002,5\n")
    (tmp_path / "scenes" / "out").symlink_to(tmp_path / "law.csv")
    (tmp_path / "scenes" / "in").symlink_to(tmp_path / "scenes" / "inner")
    for path in ("../law.csv", str(tmp_path / "law.csv"), "out"):
        scene = naming(tmp_path, path)
        with pytest.raises(SceneError) as error:
            load_scene(scene)
        assert missing(str(error.value), ["contacts[1].table", "out of the scene's folder", "--outside-tables"]) == []
        assert load_scene(scene, outside_tables=True).contacts[1].table == ((0.001, 5.0),)
    for path in ("in/law.csv", "inner/../in/law.csv", str(tmp_path / "scenes" / "inner" / "law.csv")):
        assert load_scene(naming(tmp_path, path)).contacts[1].table == ((0.002, 5.0),)


def test_nothing_of_a_file_outside_is_quoted(tmp_path: Path) -> None:
    (tmp_path / "passwords").write_text("secret:x:0:0\nsecret:y:1:1\n")
    for asked in (False, True):
        with pytest.raises(SceneError) as error:
            load_scene(naming(tmp_path, "../passwords"), outside_tables=asked)
        assert "secret" not in str(error.value)
    assert missing(str(error.value), [*COLUMNS, "line 2"]) == []


def test_tables_that_no_recording_could_hold_are_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """They are kept with the scene as YAML, whose length is limited as that of a scene is."""
    path = written(tmp_path, "".join(f"{n}e-6,{n}\n" for n in range(1, 1001)))
    load_scene(path)
    monkeypatch.setattr(load, "LONGEST_TEXT", 10_000)
    with pytest.raises(SceneError, match=stating("tables", "overrides", "at most", "0.01 MB")):
        load_scene(path)
