# SPDX-License-Identifier: Apache-2.0
"""A scene of any size that is wrong is refused after bounded work: few problems are said, the others counted."""

from __future__ import annotations

import sys
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from types import FrameType

import pytest
from facts import missing

from conveyor_sim.errors import SceneError
from conveyor_sim.scene import load_scene, parse_scene
from conveyor_sim.scene.problem_count import MOST_SAID
from conveyor_sim.scene.yaml_lines import Document

GOOD = (Path(__file__).parent / "good.yaml").read_text(encoding="utf-8")
LISTED, MANY = 50, MOST_SAID + 500
WORK = ("get_close_matches", "_sentence")
"""Functions whose calls are the work of a problem."""


def refusal(text: str) -> tuple[list[str], Counter[str]]:
    """Return the lines of a refusal, and the number of calls of each function of WORK."""
    calls: Counter[str] = Counter()

    def note(frame: FrameType, event: str, argument: object) -> None:
        if event == "call" and frame.f_code.co_name in WORK:
            calls[frame.f_code.co_name] += 1

    sys.setprofile(note)
    try:
        with pytest.raises(SceneError) as caught:
            parse_scene(text, "plant.yaml")
    finally:
        sys.setprofile(None)
    return str(caught.value).splitlines(), calls


def repeated(entry: str, count: int) -> str:
    return "".join(entry.replace("#", str(number)) for number in range(count))


def before(place: str, entry: str, count: int) -> str:
    """Return the good scene with many entries before a place of it."""
    assert GOOD.count(place) == 1
    return GOOD.replace(place, repeated(entry, count) + place)


UNKNOWN: dict[str, Callable[[int], str]] = {
    "top": lambda count: GOOD + repeated("bottle_#: 1\n", count),
    "mapping": lambda count: before("    inner_radius: 1\n", "    inner_radios#: 1\n", count),
    "list": lambda count: before("  - grid:", "  - {type: jar, position: [#, 99], velocty: 1}\n", count),
    "long": lambda count: GOOD + repeated(f"{'k' * 150}#: 1\n", count),
    "names": lambda count: before("  waiting:", "  z#: {region: [[0, 0], [1, 0], [1, 1]], fulat: 1}\n", count),
}


@pytest.mark.parametrize("kind", UNKNOWN)
def test_unknown_keys_are_counted_and_few_are_said(kind: str) -> None:
    lines, calls = refusal(UNKNOWN[kind](MANY))
    assert len(lines) == LISTED + 1
    assert all("no such field" in line for line in lines[:LISTED])
    assert missing(lines[LISTED], ["plant.yaml", f"{MANY - LISTED} more"]) == []
    assert max(calls.values()) <= 2 * MOST_SAID  # each is said once, and passes its parents as it is
    if kind == "long":
        assert calls["get_close_matches"] == 0


def test_twice_as_many_problems_take_no_more_words() -> None:
    _, calls = refusal(UNKNOWN["list"](MANY))
    _, twice = refusal(UNKNOWN["list"](2 * MANY))
    assert calls == twice


def test_the_first_problems_of_the_file_are_listed() -> None:
    lines, _ = refusal(UNKNOWN["list"](MANY))
    numbers = [int(line.split(":")[1]) for line in lines[:LISTED]]
    assert numbers == list(range(numbers[0], numbers[0] + LISTED))


def test_names_that_refer_to_nothing_list_few_of_those_there_are() -> None:
    kinds = "".join(f"  jar{n}: {{radius: 0.03, mass: 0.2, material: glass}}\n" for n in range(300))
    heap = "".join(f"  - {{type: cup{n}, position: [{n}, 99]}}\n" for n in range(60))
    text = GOOD.replace("bottle_types:\n", f"bottle_types:\n{kinds}").replace("  - grid:", heap + "  - grid:")
    lines, _ = refusal(text)
    (line,) = (line for line in lines if '"cup0"' in line)
    assert line.endswith("jar19 and 281 others")


def test_missing_pairs_of_materials_are_not_all_counted() -> None:
    kinds = "".join(f"  jar{n}: {{radius: 0.03, mass: 0.2, material: m{n}}}\n" for n in range(400))
    lines, _ = refusal(GOOD.replace("bottle_types:\n", f"bottle_types:\n{kinds}"))
    assert missing(lines[LISTED], ["plant.yaml", "at least", f"{MOST_SAID + 1 - LISTED} more"]) == []


def test_a_text_of_digits_without_end_is_no_angle() -> None:
    """It would take an hour without a bound on its length."""
    lines, _ = refusal(GOOD.replace("angle: 0 deg", f'angle: "{"1" * 1_000_000}x"', 1))
    assert len(lines) == 1 and "belts.feeder.angle" in lines[0] and "expected an angle" in lines[0]


def test_mappings_taken_in_keep_their_order() -> None:
    text = "a: &a {x: 1, y: 2}\nb: &b {y: 3, z: 4}\nc: {<<: [*a, *b], w: 5}\n"
    assert list(Document(text, "x").data["c"].items()) == [("y", 2), ("z", 4), ("x", 1), ("w", 5)]


def test_tables_are_bounded_together(tmp_path: Path) -> None:
    """11 contacts name one table of 9.9 MB, which is wrong in its second line."""
    (tmp_path / "table.csv").write_text("0.001,1\nbad," + "x" * 9_900_000)
    entry = "  - {between: [glass, m#], table: table.csv, damping: {law: none}}\n"
    (tmp_path / "plant.yaml").write_text(before("base:\n", entry, 12))
    with pytest.raises(SceneError) as caught:
        load_scene(tmp_path / "plant.yaml")
    lines = str(caught.value).splitlines()
    assert ["100 MB together" in line for line in lines] == [False] * 11 + [True]
