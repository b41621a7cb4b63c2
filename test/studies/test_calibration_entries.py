# SPDX-License-Identifier: Apache-2.0
"""Entries that the command prints, and sentences on values that the measurements don't determine."""

from __future__ import annotations

import math
import re
from pathlib import Path

import pytest
from click.testing import CliRunner, Result
from facts import missing
from studies.measurement_file import measurement, write

from conveyor_sim.cli import main
from conveyor_sim.scene import Scene, parse_scene
from conveyor_sim.studies.calibration.friction import GRAVITY, slip_limit
from conveyor_sim.studies.calibration.restitution import restitution
from conveyor_sim.studies.calibration.stiffness import Elastic, elastic

PAIR = {"material": "glass", "other": "steel"}
HEAD = "name: pasted\nduration: 1\nbottle_types: {bottle: {radius: 33 mm, mass: 350 g, material: glass}}\n"


def run(*arguments: object) -> Result:
    return CliRunner().invoke(main, ["calibrate", *map(str, arguments)])


def printed(folder: Path, *rows: dict[str, object]) -> str:
    result = run(write(folder / "data.csv", rows))
    assert result.exit_code == 0, result.output
    return result.stdout


def pasted(text: str) -> Scene:
    return parse_scene(HEAD + text)


def drop(height: float, rebound: float, **more: object) -> dict[str, object]:
    return {"quantity": "drop", **PAIR, "drop_height": height, "rebound_height": rebound, **more}


def press(overlap: float, force: float) -> dict[str, object]:
    return {"quantity": "compression", **PAIR, "overlap": overlap, "force": force}


def hold(force: float, other: str = "chain") -> dict[str, object]:
    return {"quantity": "base_friction", "material": "glass", "other": other, "force": force, "mass": 0.35}


def test_the_example_is_calibrated_and_loads_as_a_scene(tmp_path: Path) -> None:
    example = run("--example")
    assert example.exit_code == 0
    (tmp_path / "example.csv").write_text(example.stdout)
    result = run(tmp_path / "example.csv", "--output", tmp_path / "entries.yaml")
    assert result.exit_code == 0 and result.stdout == ""
    scene = pasted((tmp_path / "entries.yaml").read_text())
    assert {contact.between for contact in scene.contacts} == {("glass", "steel"), ("glass", "glass")}
    assert all(contact.damping.restitution is not None for contact in scene.contacts)
    assert 0.005 < scene.slip_limit < 0.009
    assert scene.base[0].friction == pytest.approx(0.152, abs=0.002)


def test_one_measurement_gives_a_value_without_an_interval(tmp_path: Path) -> None:
    text = printed(tmp_path, hold(0.5))
    assert pasted(text).base[0].friction == pytest.approx(0.5 / (0.35 * GRAVITY), rel=1e-3)
    assert missing(text, ["no interval", "one row"]) == []


def test_repetitions_with_one_bottle_give_no_interval(tmp_path: Path) -> None:
    text = printed(tmp_path, *({**hold(force), "sample": "a"} for force in (0.5, 0.52)))
    assert missing(text, ["no interval", "2 rows of one sample"]) == []


def test_chains_are_calibrated_separately(tmp_path: Path) -> None:
    scene = pasted(printed(tmp_path, hold(0.5), hold(1.0, "rubber"), hold(0.52), hold(1.1, "rubber")))
    assert [base.between[1] for base in scene.base] == ["chain", "rubber"]
    assert scene.base[1].friction == pytest.approx(1.05 / (0.35 * GRAVITY), rel=1e-2)


def test_materials_of_a_contact_may_change_places(tmp_path: Path) -> None:
    swapped = {**drop(0.1, 0.05), "material": "steel", "other": "glass"}
    scene = pasted(printed(tmp_path, *(press(1e-4 * n, 10.0 * n) for n in range(1, 6)), drop(0.1, 0.06), swapped))
    (contact,) = scene.contacts
    assert contact.between == ("glass", "steel") and contact.damping.restitution == pytest.approx(0.741, abs=0.002)


def test_a_contact_without_stiffness_is_a_comment(tmp_path: Path) -> None:
    text = printed(tmp_path, drop(0.1, 0.06), drop(0.1, 0.055), hold(0.5))
    assert pasted(text).contacts == ()
    assert missing(text, ["glass", "steel", "no stiffness", "compression"], "restitution: 0.7") == []


def test_an_interval_of_a_restitution_ends_at_1() -> None:
    rows = [
        measurement(n, "drop", drop_height=1.0, rebound_height=height) for n, height in enumerate((0.99, 0.9, 0.95))
    ]
    assert restitution(rows).value.high == 1.0


def test_methods_that_contradict_each_other_are_reported(tmp_path: Path) -> None:
    pendulum = {"quantity": "pendulum", **PAIR, "length": 0.5, "angle_before": 0.8}
    swings = [{**pendulum, "angle_after": angle} for angle in (0.3, 0.31, 0.29)]
    drops = [drop(0.1, rebound) for rebound in (0.08, 0.081, 0.079)]
    assert missing(printed(tmp_path, *drops, *swings), ["contradictory", "drop", "pendulum"]) == []
    assert "contradictory" not in printed(tmp_path, *drops)


def test_a_falling_restitution_takes_a_law_that_falls(tmp_path: Path) -> None:
    drops = [drop(height, height * value**2) for height, value in ((0.02, 0.9), (0.1, 0.8), (0.5, 0.7), (1.0, 0.66))]
    linear = [press(1e-4 * n, 10.0 * n) for n in range(1, 6)]
    (contact,) = pasted(printed(tmp_path, *drops, *linear)).contacts
    assert contact.damping.law == "onset" and contact.damping.speed == pytest.approx(1.87, rel=0.01)
    hertz = [press(1e-4 * n, 10.0 * n**1.5) for n in range(1, 6)]
    (contact,) = pasted(printed(tmp_path, *drops, *hertz)).contacts
    assert contact.damping.law == "viscoelastic"
    assert contact.damping.restitution == pytest.approx(0.765, abs=0.002)


def test_forces_that_no_law_fits_become_a_table(tmp_path: Path) -> None:
    curve = [press(1e-4 * n, force) for n, force in enumerate((1.0, 2.0, 4.0, 50.0, 51.0, 52.0, 53.0, 200.0), start=1)]
    cubic = [press(1e-4 * n, 1.0 * n**3) for n in range(1, 9)]
    for rows in (curve, cubic):
        text = printed(tmp_path, *rows, drop(0.1, 0.05), drop(0.1, 0.051))
        (contact,) = pasted(text).contacts
        if contact.table is None:
            assert "free exponent" in text
    assert contact.table is not None and contact.table[-1] == pytest.approx((8e-4, 512.0))
    assert contact.damping.law == "onset"


@pytest.mark.parametrize(
    ("points", "facts"),
    [
        ([(1e-4, 10.0)], ["1 overlaps", "3 or more"]),
        ([(1e-4, 10.0), (2e-4, 20.0)] * 3, ["2 overlaps", "3 or more"]),
        ([(1e-4, 30.0), (2e-4, 20.0), (3e-4, 10.0)], ["don't grow"]),
        ([(1e-4, 10.0), (2e-4, 10.0), (3e-4, 10.0)], ["don't grow"]),
        ([(1e-4, 0.0), (2e-4, 0.0), (3e-4, 0.0)], ["don't grow"]),
    ],
)  # fmt: skip
def test_forces_that_determine_no_stiffness(
    points: list[tuple[float, float]], facts: list[str], tmp_path: Path
) -> None:
    result = run(write(tmp_path / "data.csv", [press(*point) for point in points]))
    assert result.exit_code == 1
    assert missing(result.output, ["glass and steel", "stiffness", *facts]) == []


def test_samples_of_different_stiffness_give_the_interval_of_their_mean() -> None:
    rows = [
        measurement(10 * place + n, "compression", str(place), overlap=1e-5 * n, force=stiffness * 1e-5 * n)
        for place, stiffness in enumerate((1.8e5, 2e5, 2.2e5))
        for n in range(1, 6)
    ]
    law = elastic(rows)
    assert isinstance(law, Elastic) and law.field == "stiffness" and law.value is not None
    assert law.value.value == pytest.approx((1.8 * 2.0 * 2.2) ** (1 / 3) * 1e5, rel=1e-4)
    assert law.value.low < 1.8e5 and law.value.high > 2.2e5
    assert missing(law.value.words, ["3 samples"]) == []


def test_exact_forces_give_the_exact_stiffness() -> None:
    for field, stiffness, exponent in (("stiffness", 2e5, 1.0), ("hertz_stiffness", 3e7, 1.5)):
        overlaps = (1e-5, 3e-5, 6e-5, 1e-4, 2e-4)
        rows = [
            measurement(line, "compression", overlap=overlap, force=stiffness * overlap**exponent)
            for line, overlap in enumerate(overlaps)
        ]
        law = elastic(rows)
        assert isinstance(law, Elastic) and law.field == field and law.value is not None
        assert law.value.value == pytest.approx(stiffness, rel=1e-5)


def test_a_wrong_zero_of_the_overlap_does_not_change_the_stiffness() -> None:
    rows = [measurement(n, "compression", overlap=1e-5 * n - 3e-5, force=3e7 * (1e-5 * n) ** 1.5) for n in range(1, 10)]
    law = elastic(rows)
    assert isinstance(law, Elastic) and law.field == "hertz_stiffness" and law.value is not None
    assert law.value.value == pytest.approx(3e7, rel=1e-4)


def creep(speeds: tuple[float, ...], ratios: tuple[float, ...], other: str = "steel") -> list[dict[str, object]]:
    return [
        {"quantity": "slip_limit", "material": "glass", "other": other, "speed": speed, "mass": 0.35,
         "force": ratio * 0.35 * GRAVITY}
        for speed, ratio in zip(speeds, ratios, strict=True)
    ]  # fmt: skip


def test_a_chain_that_never_creeps_has_only_an_upper_limit(tmp_path: Path) -> None:
    """The usual result for a real chain: friction is full at the lowest speed as well."""
    rows = creep((0.001, 0.003, 0.01, 0.03, 0.1), (0.151, 0.149, 0.15, 0.152, 0.148))
    text = printed(tmp_path, *rows)
    assert missing(text, ["slip_limit", "below", "1 mm/s"]) == []
    assert "\nslip_limit:" not in text
    assert pasted(text).base[0].friction == pytest.approx(0.15, abs=0.001)


def test_forces_in_proportion_to_the_speed_determine_no_limit(tmp_path: Path) -> None:
    result = run(
        write(tmp_path / "data.csv", creep((0.001, 0.002, 0.003, 0.004, 0.005), (0.0151, 0.029, 0.046, 0.06, 0.0745)))
    )
    assert result.exit_code == 1
    assert missing(result.output, ["slip_limit", "5 mm/s", "higher speeds"]) == []


def test_few_speeds_determine_no_limit() -> None:
    rows = [measurement(n, "slip_limit", speed=0.01, force=0.5, mass=0.35) for n in range(5)]
    assert slip_limit(rows).limit is None and missing(slip_limit(rows).remark, ["5 rows", "1 speeds"]) == []


def test_two_chains_share_a_slip_limit(tmp_path: Path) -> None:
    speeds = (0.001, 0.002, 0.004, 0.006, 0.02, 0.1)
    shape = [min(speed / 0.01, 1.0) * (2.0 - min(speed / 0.01, 1.0)) for speed in speeds]
    rows = [
        *creep(speeds, tuple(0.1 * part + 0.001 * (-1) ** n for n, part in enumerate(shape)), "chain"),
        *creep(speeds, tuple(0.3 * part - 0.001 * (-1) ** n for n, part in enumerate(shape)), "rubber"),
    ]
    scene = pasted(printed(tmp_path, *rows))
    assert scene.slip_limit == pytest.approx(0.01, rel=0.1)
    assert [base.friction for base in scene.base] == pytest.approx([0.1, 0.3], rel=0.03)


def test_a_vibration_is_an_entry_of_a_conveyor(tmp_path: Path) -> None:
    rows: list[dict[str, object]] = [
        {
            "quantity": "vibration",
            "material": "",
            "other": "chain",
            "acceleration": acceleration,
            "frequency": 25.0,
            "direction": angle,
        }
        for acceleration, angle in ((2.0, 0.02), (2.1, math.pi - 0.01), (1.9, 0.01))
    ]
    text = printed(tmp_path, *rows)
    assert {line[0] for line in text.splitlines()} == {"#"}
    (entry,) = re.findall(r"^# (vibration: \{.*\})$", text, re.MULTILINE)
    belt = (
        f"{{start: [0, 0], heading: 0 deg, path: [{{straight: 1}}], width: 0.1, material: chain, speed: 0.1, {entry}}}"
    )
    (found,) = pasted(
        f"conveyors: {{line: {belt}}}\nbase: [{{between: [glass, chain], friction: 0.1}}]\n"
    ).belts.values()
    assert found.vibration is not None
    assert found.vibration.amplitude == pytest.approx(2.0 / (2.0 * math.pi * 25.0) ** 2, rel=1e-2)
    assert found.vibration.direction == pytest.approx(0.007, abs=0.001)


def test_a_bottle_has_no_place_in_a_row_of_vibration(tmp_path: Path) -> None:
    row = {"quantity": "vibration", **PAIR, "acceleration": 2.0, "frequency": 25.0, "direction": 0.0}
    result = run(write(tmp_path / "data.csv", [row]))
    assert result.exit_code == 1 and missing(result.output, ["data.csv:2: material", "none"]) == []


def test_texts_of_a_file_stay_in_comments(tmp_path: Path) -> None:
    lines = "a\nslip_limit: 99"
    path = write(tmp_path / f"{lines}.csv", [{**press(1e-4, 10.0), "sample": lines}, drop(0.1, 0.05), hold(0.5)])
    result = run(path)
    assert result.exit_code == 0, result.output
    assert missing(result.stdout, ["a\\nslip_limit: 99"]) == []
    assert pasted(result.stdout).slip_limit == pasted("").slip_limit


def test_options_are_checked(tmp_path: Path) -> None:
    for arguments in ((), ("data.csv", "--example")):
        result = run(*arguments)
        assert result.exit_code == 1 and missing(result.output, ["DATA", "--example"]) == []
    result = run("--example", "--output", tmp_path)
    assert result.exit_code == 1 and "is a folder" in result.output
