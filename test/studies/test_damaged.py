# SPDX-License-Identifier: Apache-2.0
"""Files of a study that are damaged or of another study: named and made again, or refused in one sentence."""

from __future__ import annotations

import json
import shutil
from pathlib import Path
from typing import Any

import pytest
from accuracy.studies import study as accuracy_study
from click.testing import CliRunner
from facts import stating
from studies.small import Here, setup_of

from conveyor_sim.accuracy.report.files import read_study, write_study
from conveyor_sim.cli import main
from conveyor_sim.errors import ConveyorError, StudyError
from conveyor_sim.studies.results import read_results, write_parquet
from conveyor_sim.studies.row import RunRow
from conveyor_sim.studies.runs import Runs
from conveyor_sim.studies.setup import Setup
from conveyor_sim.studies.sweep import sweep

FIRST = Path("runs") / "point_0_seed_1.json"
Made = tuple[Setup, Path, list[RunRow]]


def made_in(folder: Path, **changes: Any) -> Made:
    """Make a study of four runs."""
    folder.mkdir()
    setup = setup_of(folder, duration=0.1, **changes)
    with Runs(setup, folder / "out", Here()) as runs:
        return setup, folder / "out", sweep(runs, setup)


@pytest.fixture(scope="module")
def one(tmp_path_factory: pytest.TempPathFactory) -> Made:
    return made_in(tmp_path_factory.mktemp("studies") / "one")


@pytest.fixture(scope="module")
def other(tmp_path_factory: pytest.TempPathFactory) -> Made:
    """Another study with runs of the same names."""
    return made_in(tmp_path_factory.mktemp("studies") / "other", overrides={"gravity": 9.7})


def again(made: Made, folder: Path) -> tuple[list[RunRow], list[str], int]:
    """Continue a study in a folder. Return its rows, its messages, and the number of new runs."""
    setup, said, engine = made[0], list[str](), Here()
    with Runs(setup, folder, engine, said.append) as runs:
        return sweep(runs, setup), said, engine.made


def same(rows: list[RunRow], others: list[RunRow]) -> bool:
    return [(row.key, row.status, row.metrics) for row in rows] == [
        (row.key, row.status, row.metrics) for row in others
    ]


def flipped(content: bytes) -> bytes:
    """Return the content with one digit of a number changed."""
    place = content.index(b"stops") + 8
    return content[:place] + bytes([content[place] ^ 1]) + content[place + 1 :]


def without_checksum(folder: Path) -> None:
    """Remove the checksums from the files of a folder, as in folders of older versions."""
    for file in folder.rglob("*.json"):
        data = json.loads(file.read_text())
        file.write_text(json.dumps({key: data[key] for key in data if key not in ("sha256", "made_with", "text")}))


@pytest.mark.parametrize("damage", ["flipped", "cut", "empty", "foreign", "misplaced", "nested", "unsealed", "folder"])
def test_a_damaged_run_is_named_kept_and_made_again(damage: str, one: Made, other: Made, tmp_path: Path) -> None:
    folder = shutil.copytree(one[1], tmp_path / "out")
    file = folder / FIRST
    content = file.read_bytes()
    wrong = {
        "flipped": flipped(content),
        "cut": content[:-1],
        "empty": b"",
        "foreign": (other[1] / FIRST).read_bytes(),
        "misplaced": (folder / "runs" / "point_1_seed_2.json").read_bytes(),
        "nested": b"[" * 100_000,
        "unsealed": content.replace(b"sha256", b"sha257"),
    }
    file.unlink()
    if damage == "folder":
        file.mkdir()
    else:
        file.write_bytes(wrong[damage])
    with pytest.raises(StudyError, match=stating("point_0_seed_1.json", "intact run", "this study")):
        read_results(folder)
    rows, said, count = again(one, folder)
    assert same(rows, one[2]) and count == 1
    (sentence,) = said
    assert sentence.startswith(f"{file}: ") and "point_0_seed_1.json.unusable" in sentence
    if damage != "folder":
        assert (folder / "runs" / "point_0_seed_1.json.unusable").read_bytes() == wrong[damage]
    assert same(list(read_results(folder).rows), one[2])
    assert again(one, folder)[1:] == ([], 0)


@pytest.mark.parametrize("damage", ["cut", "empty", "gone", "flipped", "nested"])
def test_a_damaged_study_json_claims_no_run_of_another_study(
    damage: str, one: Made, other: Made, tmp_path: Path
) -> None:
    """And it is written again where the runs say that they are of this study."""
    folder = shutil.copytree(one[1], tmp_path / "out")
    file = folder / "study.json"
    content = file.read_bytes()
    if damage == "gone":
        file.unlink()
    else:
        file.write_bytes({"cut": content[:100], "empty": b"", "flipped": content.replace(b"engine", b"engime", 1),
                          "nested": b"{" * 10_000}[damage])  # fmt: skip
    before = {path: path.read_bytes() for path in folder.rglob("*.json")}
    with pytest.raises(StudyError, match=stating("runs", "another study", "another folder")):
        again(other, folder)
    assert {path: path.read_bytes() for path in folder.rglob("*.json")} == before
    with pytest.raises(StudyError, match=stating("study.json", "conveyor-sim sweep or optimise")):
        read_results(folder)
    rows, said, count = again(one, folder)
    assert same(rows, one[2]) and count == 0 and len(said) == 1 and str(file) in said[0]
    assert file.read_bytes() == content


@pytest.mark.parametrize("name", ["study.json", "units.json"])
def test_a_file_of_another_study_is_not_taken_for_its_own(name: str, one: Made, other: Made, tmp_path: Path) -> None:
    folder = shutil.copytree(one[1], tmp_path / "out")
    shutil.copy(other[1] / name, folder / name)
    with pytest.raises(StudyError, match="expected"):
        read_results(folder)
    if name == "study.json":
        with pytest.raises(StudyError, match="made with another study"):
            again(one, folder)
    else:
        assert again(one, folder)[1] and read_results(folder).units == read_results(one[1]).units
        assert (folder / f"{name}.unusable").read_bytes() == (other[1] / name).read_bytes()


def test_the_text_for_people_is_not_read_back(one: Made, tmp_path: Path) -> None:
    folder = shutil.copytree(one[1], tmp_path / "out")
    (folder / "study.yaml").write_text("name: mine\nseeds: 9\n")
    assert read_results(folder).study == one[0].source
    again(one, folder)
    assert (folder / "study.yaml").read_text() == one[0].source


def test_a_damaged_warm_start_is_made_again(tmp_path: Path) -> None:
    changes = {
        "parameters": {"speed": {"controller": "speed", "values": [0.5, 0.3]}},
        "controller": "code.py:Feeder",
        "settings": {"speed": 0.5},
        "warm_start": 0.1,
    }
    made = made_in(tmp_path / "one", **changes)
    folder = made[1]
    start = folder / "warm_starts" / "seed_1.npz"
    content = start.read_bytes()
    for file, wrong in ((start, content[:-100]), (start.with_suffix(".json"), b"{}"), (start, None)):
        (folder / FIRST).unlink()
        if wrong is None:
            start.with_name("seed_2.npz").rename(start)  # intact, of another seed
        else:
            file.write_bytes(wrong)
        rows, said, _ = again(made, folder)
        assert same(rows, made[2]) and any(sentence.startswith(f"{file}: ") for sentence in said)
        assert start.read_bytes()[:4] == content[:4]


def test_a_folder_without_checksums_is_read_and_said_to_be_unverified(one: Made, tmp_path: Path) -> None:
    """No run is added to it: its version is another."""
    folder = shutil.copytree(one[1], tmp_path / "out")
    without_checksum(folder)
    found = read_results(folder)
    assert not found.verified and read_results(one[1]).verified
    assert same(list(found.rows), one[2])
    said = CliRunner().invoke(main, ["study", str(folder), "--no-pictures"])
    assert said.exit_code == 0 and "can't be verified" in said.stderr
    assert said.stdout == CliRunner().invoke(main, ["study", str(one[1]), "--no-pictures"]).stdout
    with pytest.raises(StudyError, match="expected another folder"):
        again(one, folder)
    shutil.copy(one[1] / FIRST, folder / FIRST)  # a mixture is none of both
    with pytest.raises(StudyError, match=stating("study.json", "checksum")):
        read_results(folder)


def test_types_are_checked_without_checksums_too(one: Made, tmp_path: Path) -> None:
    folder = shutil.copytree(one[1], tmp_path / "out")
    without_checksum(folder)
    data = json.loads((folder / FIRST).read_text())
    for name, value in (("point", "0"), ("metrics", {"stops": "many"}), ("status", "odd"), ("dt", 1e999), ("seed", -1),
                        ("parameters", []), ("bag", None), ("error", 7), ("wall", True)):  # fmt: skip
        (folder / FIRST).write_text(json.dumps({**data, name: value}))
        with pytest.raises(StudyError, match=rf"point_0_seed_1\.json: {name}.*, expected"):
            read_results(folder)


def test_a_damaged_table_is_refused(one: Made, tmp_path: Path) -> None:
    pytest.importorskip("pyarrow")
    from pyarrow import parquet

    path = write_parquet(read_results(one[1]), tmp_path / "results.parquet")
    assert same(list(read_results(path).rows), one[2])
    table = parquet.read_table(path)
    stops = table.schema.get_field_index("stops")
    wrong = table.set_column(stops, table.schema.field(stops), [[7.0] * 4])
    parquet.write_table(wrong, path)
    with pytest.raises(StudyError, match=stating("results.parquet", "checksum")):
        read_results(path)
    content = path.read_bytes()
    for length in (0, 4, len(content) // 2, len(content) - 1):
        path.write_bytes(content[:length])
        with pytest.raises(StudyError, match=r"results\.parquet: "):
            read_results(path)


def test_two_kinds_of_study_do_not_share_a_folder(one: Made, tmp_path: Path) -> None:
    """A `study.json` of each is refused by the other, and stays."""
    write_study(accuracy_study(), tmp_path)
    before = (tmp_path / "study.json").read_bytes()
    with pytest.raises(StudyError, match=stating("conveyor-sim accuracy", "same name")):
        again(one, tmp_path)
    with pytest.raises(StudyError, match=stating("conveyor-sim accuracy", "same name")):
        read_results(tmp_path)
    (tmp_path / "study.json").write_bytes(before[:500])  # damaged, so its kind is not known; it is kept aside
    again(one, tmp_path)
    assert (tmp_path / "study.json.unusable").read_bytes() == before[:500]
    with pytest.raises(ConveyorError, match="all of it: found"):
        read_study(one[1] / "study.json")
    (tmp_path / "origin.json").write_text("{}")
    with pytest.raises(StudyError, match=stating(str(tmp_path), "study of conveyor-sim accuracy")):
        again(one, tmp_path)
