# SPDX-License-Identifier: Apache-2.0
"""Files of measurements: accepted forms, and one clear error for each damaged one."""

from __future__ import annotations

import math
from pathlib import Path

import pytest
from facts import missing

from conveyor_sim.errors import CalibrationError
from conveyor_sim.studies.calibration.calibrate import calibrate
from conveyor_sim.studies.calibration.read import read_measurements

HEADER = "quantity,material,other,force (N),mass (g)"
ROW = "base_friction,glass,chain,0.52,350"
QUOTED = '"0,52"'
PENDULUM = "quantity,material,other,length (mm),"
VALUES = {"force": 0.52, "mass": 0.35}


def saved(folder: Path, content: str | bytes) -> Path:
    path = folder / "data.csv"
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    return path


@pytest.mark.parametrize(
    "content",
    [
        f"{HEADER}\n{ROW}\n",
        f"{HEADER}\r\n{ROW}\r\n",
        f"{HEADER}\r{ROW}",
        f"\ufeff{HEADER}\n{ROW}\n",
        f"# a comment, with 1 \" quote\n\n{HEADER}\n# another\n,,,,\n{ROW}\n",
        f"{HEADER},,\n{ROW},,\n",
        HEADER.replace("(", "[").replace(")", "]") + f"\n{ROW}\n",
        "Quantity, Material ,OTHER,Force (kN),Mass (kg)\nbase_friction, glass ,chain,0.00052,0.35\n",
        f"{HEADER},drop height (mm),note\n{ROW},,any; text\n",
        "quantity;material;other;force (N);mass (g)\r\nbase_friction;glass;chain;0,52;350\r\n",
        "quantity;material;other;force (N);mass (g)\nbase_friction;glass;chain;0.52;3.5e2\n",
        "\ufeffquantity;material;other;force (N);mass (g);\r\nbase_friction;glass;chain;0,52;350;\r\n;;;;;\r\n",
        "quantity\tmaterial\tother\tforce (N)\tmass (g)\nbase_friction\tglass\tchain\t0,52\t350\n",
        f'"{HEADER.replace(",", chr(34) + "," + chr(34))}"\n{ROW}\n',
        f"{HEADER}\n{ROW}\n".encode("utf-16"),
    ],
    ids=lambda content: repr(content)[:40],
)  # fmt: skip
def test_forms_of_programs_and_countries_are_read(tmp_path: Path, content: str | bytes) -> None:
    (row,) = read_measurements(saved(tmp_path, content))
    assert row.kind == "base_friction" and row.between == ("glass", "chain")
    assert dict(row.values) == pytest.approx(VALUES)


@pytest.mark.parametrize(
    ("content", "facts"),
    [
        ("", ["data.csv", "no rows", "quantity, material, other"]),
        ("\n\n,,\n# only comments\n", ["data.csv", "no rows"]),
        (f"{HEADER}\n", ["data.csv:1", "no measurement"]),
        (ROW, ["data.csv:1", "no header", "quantity, material, other"]),
        ("material,other\nglass,chain\n", ["data.csv:1: quantity", "no such column"]),
        (f"{HEADER},mass (kg)\n{ROW},1\n", ["data.csv:1: mass", "twice"]),
        (f"{HEADER},weigth (N)\n{ROW},1\n", ["data.csv:1: weigth", "no such column"]),
        (HEADER.replace(" (g)", "") + f"\n{ROW}\n", ["data.csv:1: mass", "no unit", "mass (g)"]),
        (HEADER.replace("(g)", "(mm)") + f"\n{ROW}\n", ["data.csv:1: mass", '"mm"', "mass (g)", "a length"]),
        (HEADER.replace("(g)", "(lb)") + f"\n{ROW}\n", ["data.csv:1: mass", '"lb"', "mass (g)", "unknown"]),
        (HEADER.replace("(g)", "(0 g)") + f"\n{ROW}\n", ["data.csv:1: mass", '"0 g"']),
        (HEADER.replace("other", "other (g)") + f"\n{ROW}\n", ["data.csv:1: other", '"g"', "texts"]),
        (f"{HEADER}\n{ROW.replace('350', '')}\n", ["data.csv:2: mass", "missing", "from 0.1 to 1e+06 (g)"]),
        (f"{HEADER}\n{ROW.replace('350', '-350')}\n", ["data.csv:2: mass", "-350 g given", "from 0.1 to 1e+06 (g)"]),
        (f"{HEADER}\n{ROW.replace('350', '0')}\n", ["data.csv:2: mass", "0 g given", "from 0.1 to 1e+06 (g)"]),
        (f"{HEADER}\n{ROW.replace('350', 'nan')}\n", ["data.csv:2: mass", '"nan" given']),
        (f"{HEADER}\n{ROW.replace('350', 'inf')}\n", ["data.csv:2: mass", '"inf" given']),
        (f"{HEADER}\n{ROW.replace('350', '1e999')}\n", ["data.csv:2: mass", "1e999 g given"]),
        (f"{HEADER}\n{ROW.replace('350', '350 g')}\n", ["data.csv:2: mass", '"350 g"', "header"]),
        (f"{HEADER}\n{ROW.replace('350', '0x15E')}\n", ["data.csv:2: mass", '"0x15E"']),
        (f"{HEADER}\n{ROW.replace('0.52', QUOTED)}\n", ["data.csv:2: force", '"0,52"', "semicolons"]),
        (f"{HEADER}\n{ROW.replace('0.52', '0,52')}\n", ["data.csv:2", "6 cells", "5", "semicolons"]),
        (
            "quantity;material;other;force (N);mass (g)\nbase_friction;glass;chain;0,52;350\n"
            "base_friction;glass;chain;0,5;1.350\n",
            ["data.csv:3: mass", '"1.350"', "comma"],
        ),
        (
            "quantity;material;other;force (N);mass (g)\nbase_friction;glass;chain;0.52;350,5\n",
            ["data.csv:2: mass", '"350,5"', "point"],
        ),
        (f"{HEADER}\n{ROW.replace('base_', '')}\n", ["data.csv:2: quantity", '"friction"', "base_friction"]),
        (f"{HEADER}\n{ROW.replace('base_friction', '')}\n", ["data.csv:2: quantity", "missing"]),
        (f"{HEADER}\n{ROW.replace('chain', '')}\n", ["data.csv:2: other", "missing", "name"]),
        (f"{HEADER}\n{ROW.replace('glass', 'Glas 0,5 l')}\n", ["data.csv:2", "6 cells"]),
        (f"{HEADER}\n{ROW.replace('glass', 'Glas 1')}\n", ["data.csv:2: material", '"Glas 1"', "name"]),
        (f"{HEADER},speed (m/s)\n{ROW},0.3\n", ["data.csv:2: speed", '"0.3"', "none", "force or mass"]),
        (f"{HEADER}\ndrop,glass,steel,,\n", ["data.csv:2: drop", "header", "drop_height (mm), rebound_height (mm)"]),
        (f"{HEADER},\n{ROW},5\n", ["data.csv:2", '"5"', "without a name"]),
        (f'{HEADER}\n"{ROW}\n', ["data.csv:2", "can't be read"]),
        (f"{HEADER}\n{ROW}\n".encode().replace(b"glass", b"Gl\xe4ser"), ["data.csv:2", "UTF-8"]),
        (f"{HEADER}\n{ROW}\0\n", ["data.csv", "null characters"]),
        (b"PK\x03\x04\x14\x00\x06\x00", ["data.csv"]),
        (b"\xff\xfeq", ["data.csv:1", "UTF-16"]),
        (f"{HEADER}\n{ROW.replace('0.52', '520')}\n", ["data.csv:2: force", "friction of 151", "units"]),
        (f"{HEADER}\n{ROW.replace('0.52', '0')}\n", ["data.csv:2: force", "0 given"]),
        (
            "quantity,material,other,drop_height (mm),rebound_height (mm)\ndrop,glass,steel,100,121\n",
            ["data.csv:2: rebound_height", "restitution of 1.1", "more than 1"],
        ),
        (
            f"{PENDULUM}angle_before (deg),angle_after (deg)\npendulum,glass,steel,500,30,-20\n",
            ["data.csv:2: angle_after", "not greater than 0"],
        ),
        (
            f"{PENDULUM}angle_before (rad),angle_after (rad)\npendulum,glass,steel,500,30,0.2\n",
            ["data.csv:2: angle_before", "30 rad given", "3.14159"],
        ),
    ],
    ids=lambda value: repr(value)[-40:] if isinstance(value, (str, bytes)) else "",
)  # fmt: skip
def test_damaged_files_are_refused_by_line_and_column(tmp_path: Path, content: str | bytes, facts: list[str]) -> None:
    with pytest.raises(CalibrationError) as caught:
        calibrate(saved(tmp_path, content))
    assert missing(str(caught.value), *facts) == []
    assert len(str(caught.value).splitlines()) == 1


def test_all_problems_of_a_file_are_listed_up_to_a_limit(tmp_path: Path) -> None:
    few = saved(tmp_path, f"{HEADER}\n{ROW}x\n{ROW}\n,,,,1\n")
    with pytest.raises(CalibrationError) as caught:
        calibrate(few)
    assert missing(str(caught.value), "data.csv:2: mass", "data.csv:4: quantity") == []
    many = saved(tmp_path, f"{HEADER}\n" + f"{ROW}x\n" * 50)
    with pytest.raises(CalibrationError) as caught:
        calibrate(many)
    assert len(lines := str(caught.value).splitlines()) == 21
    assert missing(lines[-1], ["30", "more"]) == []


def test_files_that_are_too_large_or_missing_are_refused(tmp_path: Path) -> None:
    with pytest.raises(CalibrationError, match="no such file"):
        calibrate(tmp_path / "missing.csv")
    with pytest.raises(CalibrationError, match="is a folder"):
        calibrate(tmp_path)
    with pytest.raises(CalibrationError, match=r"100001: expected at most 100000 rows|100002: expected at most 100000"):
        calibrate(saved(tmp_path, f"{HEADER}\n" + f"{ROW}\n" * 100_001))
    with pytest.raises(CalibrationError, match="more than the 10"):
        calibrate(saved(tmp_path, b"#" * 11_000_000))


def test_a_file_of_many_rows_is_calibrated(tmp_path: Path) -> None:
    result = calibrate(saved(tmp_path, f"{HEADER}\n" + f"{ROW}\n{ROW.replace('0.52', '0.54')}\n" * 10_000))
    estimate = result.base["glass", "chain"]
    assert math.isclose(estimate.value, 0.53 / (0.35 * 9.81), rel_tol=1e-9)
    assert estimate.low < estimate.value < estimate.high
