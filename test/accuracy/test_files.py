# SPDX-License-Identifier: Apache-2.0
"""Files of studies: a written study is read back equal; damage is reported with the file and the expectation."""

from __future__ import annotations

import csv
import json
import math
import random
import resource
import struct
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from accuracy.studies import errors, point, study
from facts import stating

from conveyor_sim.accuracy.report.files import STUDY, read_study, write_study
from conveyor_sim.accuracy.report.pareto import front
from conveyor_sim.accuracy.results import AccuracyStudy, Cost
from conveyor_sim.errors import ConveyorError
from conveyor_sim.support.checked_json import with_checksum


def bare() -> AccuracyStudy:
    """A study that found nothing."""
    return replace(
        study(),
        orders=(),
        horizons=(),
        points=(),
        samples=(),
        comparisons=(),
        ensemble_reference=None,
        stiffness=(),
        skipped=(),
        answer=None,
        rest=None,
    )


def table(path: Path) -> list[dict[str, str]]:
    with path.open(newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


def test_what_is_read_is_what_was_written(tmp_path: Path) -> None:
    for written in (study(), bare()):
        write_study(written, tmp_path)
        assert read_study(tmp_path / STUDY) == written
        assert repr(read_study(tmp_path / STUDY)) == repr(written)  # 1 and 1.0 are equal, but print otherwise


def test_every_number_comes_back_to_the_bit(tmp_path: Path) -> None:
    rng = random.Random(1)
    numbers = [value for (value,) in struct.iter_unpack("<d", rng.randbytes(8 * 3000)) if not math.isnan(value)]
    numbers += [0.0, -0.0, math.inf, -math.inf, 5e-324, 1.7976931348623157e308, 1e22, 0.1]
    rows = tuple(replace(point("rk4", 100), cost=Cost(number, -number, 1.0 / 3.0)) for number in numbers)
    write_study(replace(bare(), points=rows), tmp_path)
    found = [row.cost for row in read_study(tmp_path / STUDY).points]
    assert repr(found) == repr([row.cost for row in rows])


def test_undefined_numbers_come_back(tmp_path: Path) -> None:
    write_study(replace(bare(), points=(replace(point("rk4", 100), errors=errors(math.nan)),)), tmp_path)
    (found,) = read_study(tmp_path / STUDY).points
    assert found.errors is not None and math.isnan(found.errors.peak_force)


def test_the_json_is_json_for_everybody(tmp_path: Path) -> None:
    write_study(study(), tmp_path)

    def refuse(constant: str) -> None:
        raise AssertionError(f"{constant} is no JSON")

    json.loads((tmp_path / STUDY).read_text(encoding="utf-8"), parse_constant=refuse)


def test_equal_studies_give_equal_bytes_and_no_other_files(tmp_path: Path) -> None:
    one, other = write_study(study(), tmp_path / "deep" / "one"), write_study(study(), tmp_path / "other")
    assert [path.read_bytes() for path in one] == [path.read_bytes() for path in other]
    assert sorted(one) == sorted((tmp_path / "deep" / "one").iterdir())
    assert {path.name for path in one} == {
        STUDY,
        "points.csv",
        "orders.csv",
        "horizons.csv",
        "resting.csv",
        "comparisons.csv",
        "stiffness.csv",
    }
    assert [path.name for path in write_study(bare(), tmp_path / "bare")] == [STUDY]


def test_csv_of_points_says_what_the_rows_say(tmp_path: Path) -> None:
    written = study()
    write_study(written, tmp_path)
    rows = table(tmp_path / "points.csv")
    assert len(rows) == len(written.points)
    best = front(written.points)
    for row, of in zip(rows, written.points, strict=True):
        assert (row["integrator"], int(row["per_tick"])) == (of.setting.integrator, of.setting.per_tick)
        assert float(row["dt_s"]) == of.dt
        assert row["failure"] == of.failure
        assert row["cost_s_per_s"] == ("" if of.cost is None else repr(of.cost.median))
        assert row["peak_force_error"] == ("" if of.errors is None else repr(of.errors.peak_force))
        assert row["front"] == str(of in best)
    assert [row["own"] for row in rows].count("True") == 1
    assert [row["recommended"] for row in rows].count("True") == 1


def test_csv_of_the_other_rows_is_complete(tmp_path: Path) -> None:
    written = study()
    write_study(written, tmp_path)
    assert [float(row["error"]) for row in table(tmp_path / "orders.csv")] == [
        error for order in written.orders for error in order.errors
    ]
    assert [float(row["by_nudge_s"]) for row in table(tmp_path / "horizons.csv")] == [0.37, 0.18, math.inf]
    rows = table(tmp_path / "comparisons.csv")
    assert [(row["observable"], row["verdict"], float(row["low"])) for row in rows] == [
        (row.observable, row.verdict, row.low) for row in written.comparisons
    ]
    rows = table(tmp_path / "stiffness.csv")
    assert [(float(row["factor"]), row["observable"], float(row["mean"])) for row in rows] == [
        (row.factor, name, mean) for row in written.stiffness for name, (mean, _) in row.observables.items()
    ]


@pytest.mark.parametrize("share", [0.0, 0.1, 0.5, 0.9, 0.999])
def test_a_file_that_was_cut_short_is_told(tmp_path: Path, share: float) -> None:
    file = write_study(study(), tmp_path)[0]
    content = file.read_text(encoding="utf-8")
    file.write_text(content[: int(share * (len(content) - 3))], encoding="utf-8")
    with pytest.raises(ConveyorError, match=r"study\.json: line \d+: .*intact study\.json"):
        read_study(file)


def edit_cost(data: Any) -> None:
    data["points"][3]["cost"]["median"] = "much"


def edit_steps(data: Any) -> None:
    data["points"][0]["setting"]["per_tick"] = 50.5


def drop_field(data: Any) -> None:
    del data["reference"]["doubt"]["impulse"]


def add_field(data: Any) -> None:
    data["answer"]["colour"] = "red"


def nullify(data: Any) -> None:
    data["orders"] = None


def lengthen(data: Any) -> None:
    data["stiffness"][0]["observables"]["spacing"] = [1.0, 2.0, 3.0]


def flag(data: Any) -> None:
    data["answer"]["accepted"] = 1


@pytest.mark.parametrize(
    ("edit", "message"),
    [
        (edit_cost, 'points[3].cost.median: found "much", expected a number'),
        (edit_steps, "points[0].setting.per_tick: found 50.5, expected a whole number"),
        (drop_field, "reference.doubt: found no field impulse, expected the fields position_rms, position_max, "),
        (add_field, "answer: found the field colour, expected the fields setting, dt, error, "),
        (nullify, "orders: found null, expected a list"),
        (lengthen, "stiffness[0].observables.spacing: found [1.0, 2.0, 3.0], expected a list of 2"),
        (flag, "answer.accepted: found 1, expected true or false"),
    ],
)
def test_a_file_that_was_edited_badly_is_told(tmp_path: Path, edit: Callable[[Any], None], message: str) -> None:
    file = write_study(study(), tmp_path)[0]
    data = json.loads(file.read_text(encoding="utf-8"))
    del data["sha256"]
    edit(data)
    file.write_bytes(with_checksum(data))
    with pytest.raises(ConveyorError) as raised:
        read_study(file)
    assert str(raised.value).startswith(f"{file}: {message}")


def test_files_that_are_no_studies_are_told(tmp_path: Path) -> None:
    (tmp_path / "list").write_text("[1, 2]")
    (tmp_path / "bytes").write_bytes(b"\xff\xfe\x00")
    for name, message in (
        ("list", r"list: is no mapping of fields, expected an intact study\.json of a study"),
        ("bytes", r"bytes: is no text in UTF-8, expected an intact study\.json of a study"),
        ("nothing", r"nothing: no such file, expected an intact study\.json of a study"),
    ):
        with pytest.raises(ConveyorError, match=message):
            read_study(tmp_path / name)


def test_a_folder_that_is_a_file_is_told(tmp_path: Path) -> None:
    (tmp_path / "taken").write_text("")
    with pytest.raises(ConveyorError, match=stating("taken/study.json", "can't be written", "folder")):
        write_study(study(), tmp_path / "taken")


def test_a_write_that_fails_leaves_the_file_that_was_there(tmp_path: Path) -> None:
    write_study(study(), tmp_path)
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (100, before[1]))
    try:
        with pytest.raises(ConveyorError, match=stating("study.json", "can't be written", "File too large")):
            write_study(bare(), tmp_path)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
    assert read_study(tmp_path / STUDY) == study()


def test_every_flipped_bit_and_cut_is_found(tmp_path: Path) -> None:
    file = write_study(bare(), tmp_path)[0]
    content = file.read_bytes()
    for place in range(len(content)):
        damaged = bytearray(content)
        damaged[place] ^= 1 << place % 8
        for wrong in (bytes(damaged), content[:place]):
            file.write_bytes(wrong)
            with pytest.raises(ConveyorError, match=r"study\.json: .*expected (an intact|the) "):
                read_study(file)


def test_a_file_of_an_older_version_is_read_and_said_to_be_unverified(tmp_path: Path) -> None:
    file = write_study(study(), tmp_path)[0]
    said: list[str] = []
    assert read_study(file, said.append) == study() and not said
    data = json.loads(file.read_text(encoding="utf-8"))
    del data["sha256"]
    file.write_text(json.dumps(data), encoding="utf-8")
    assert read_study(file, said.append) == study()
    (sentence,) = said
    assert sentence.startswith(f"{file}: ") and "can't be verified" in sentence
