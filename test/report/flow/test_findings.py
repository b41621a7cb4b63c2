# SPDX-License-Identifier: Apache-2.0
"""Findings of a check: one fault each in a line that has none without it."""

from pathlib import Path

import pytest
from facts import missing
from scenes import SHIPPED, shipped_name

from conveyor_sim.report.flow.flow import flow_of
from conveyor_sim.scene import load_scene, parse_scene
from conveyor_sim.scene.places import Places

LINE = """\
name: line
duration: 60
bottle_types: {b: {radius: 0.033, mass: 0.35, material: glass, base_radius: 0.03}}
contacts:
  - {between: [glass, glass], stiffness: 50000, friction: 0.1, damping: {law: normal, restitution: 0.4}}
  - {between: [glass, steel], stiffness: 50000, friction: 0.1, damping: {law: normal, restitution: 0.4}}
base: [{between: [glass, chain], friction: 0.3}]
belts:
  first: {kind: straight, start: [0, -0.05], angle: 0, length: 1, width: 0.1, speed: 0.4, material: chain}
  second: {kind: straight, start: [1, -0.05], angle: 0, length: 1, width: 0.1, speed: 0.4, material: chain}
  third: {kind: straight, start: [2, -0.05], angle: 0, length: 1, width: 0.1, speed: 0.4, material: chain}
rails:
  right: {kind: segment, from: [0, -0.04], to: [3, -0.04], material: steel}
  left: {kind: segment, from: [0, 0.04], to: [3, 0.04], material: steel}
infeeds:
  filler: {bottle: b, position: [0.1, 0], direction: 0, speed: 0.4, rate: 2}
outfeeds:
  packer: {region: [[2.9, -0.04], [3, -0.04], [3, 0.04], [2.9, 0.04]]}
counters:
  passed: {from: [1.5, 0.04], to: [1.5, -0.04]}
photo_eyes:
  eye: {from: [0.5, -0.05], to: [0.5, 0.05]}
"""
"""A line without faults, except that its counter is drawn against the direction of travel."""

GOOD = LINE.replace("[1.5, 0.04], to: [1.5, -0.04]", "[1.5, -0.04], to: [1.5, 0.04]")
PLACES = {text.split(":")[0].strip(): number for number, text in enumerate(GOOD.splitlines(), 1)}
"""Line numbers by name."""


def found(text: str) -> list[str]:
    """Return the findings of a scene, each with file, line and field."""
    scene = parse_scene(text, "line.yaml")
    places = Places(scene)
    return [f"{finding.level} {finding.line(places)}" for finding in flow_of(scene).findings]


def changed(*changes: tuple[str, str]) -> str:
    """Return the good line with texts replaced; each must be there once."""
    text = GOOD
    for before, after in changes:
        assert text.count(before) == 1
        text = text.replace(before, after)
    return text


FAULTS = {
    "no exit": (
        [("[[2.9, -0.04], [3, -0.04], [3, 0.04], [2.9, 0.04]]", "[[0, 0.045], [0.1, 0.045], [0.1, 0.05], [0, 0.05]]")],
        "filler", "infeeds.filler", ["no exit", "third", "(3.00, 0.00)"],
    ),
    "stopped": (
        [("third: {kind: straight", "third: {speed_limits: [0, 0], kind: straight"),
         ("[2, -0.05], angle: 0, length: 1, width: 0.1, speed: 0.4", "[2, -0.05], angle: 0, length: 1, width: 0.1")],
        "filler", "infeeds.filler", ["no exit", "stops", "third"],
    ),
    "against": (
        [("[1, -0.05], angle: 0, length: 1, width: 0.1, speed: 0.4",
          "[2, 0.05], angle: 180 deg, length: 1, width: 0.1, speed: 0.4")],
        "second", "belts.second", ["first", "third", "against"],
    ),
    "counter": (
        [("[1.5, -0.04], to: [1.5, 0.04]", "[1.5, 0.04], to: [1.5, -0.04]")],
        "passed", "counters.passed", ["against the direction of travel", "from", "to"],
    ),
    "infeed": (
        [("position: [0.1, 0], direction: 0,", "position: [0.1, 0], direction: 180 deg,")],
        "filler", "infeeds.filler.direction", ["against the direction of travel", "first"],
    ),
    "eye": (
        [("from: [0.5, -0.05], to: [0.5, 0.05]", "from: [0.5, 0.15], to: [0.5, 0.25]")],
        "eye", "photo_eyes.eye", ["on no belt", "(0.50, 0.20)"],
    ),
    "gap": (
        [("left: {kind: segment, from: [0, 0.04], to: [3, 0.04], material: steel}",
          "left: {kind: segment, from: [0, 0.04], to: [0.7, 0.04], material: steel}\n"
          "  more: {kind: segment, from: [0.78, 0.04], to: [3, 0.04], material: steel}")],
        "left", "rails.left", ["80 mm", "66 mm", "left", "(0.70, 0.04)", "bottle_types.b"],
    ),
    "narrow": (
        [("left: {kind: segment, from: [0, 0.04], to: [3, 0.04], material: steel}",
          "left: {kind: polyline, points: [[0, 0.04], [1, 0.04], [1.4, 0.02], [3, 0.02]], material: steel}")],
        "left", "rails.left", ["60 mm", "66 mm", "not fit"],
    ),
    "transfer": (
        [("[1, -0.05], angle: 0, length: 1, width: 0.1", "[1.031, -0.05], angle: 0, length: 0.969, width: 0.1")],
        "second", "belts.second", ["31 mm", "30 mm", "first"],
    ),
    "watchdog": (
        [("first: {kind: straight", "first: {watchdog: 0.5, kind: straight")],
        "first", "belts.first.watchdog", ["0.5 s", "controller"],
    ),
    "column": (
        [("[2, -0.05], angle: 0, length: 1, width: 0.1, speed: 0.4", "[2, -0.3], angle: 0, length: 1, width: 0.6, "
          "speed: 0.1"),
         ("right: {kind: segment, from: [0, -0.04], to: [3, -0.04]", "right: {kind: polyline, points: [[0, -0.04], "
          "[2, -0.04], [2, -0.3], [3, -0.3]]"),
         ("left: {kind: segment, from: [0, 0.04], to: [3, 0.04]", "left: {kind: polyline, points: [[0, 0.04], "
          "[2, 0.04], [2, 0.3], [3, 0.3]]")],
        "filler", "infeeds.filler", ["no scatter", "third", "0.5 mm"],
    ),
}  # fmt: skip
"""Changes of the good line; name of the line of the file, field and facts of the finding."""


def test_a_good_line_has_no_findings() -> None:
    assert found(GOOD) == []


@pytest.mark.parametrize("name", FAULTS)
def test_a_fault_is_found_at_its_place(name: str) -> None:
    changes, line, field, facts = FAULTS[name]
    findings = [text for text in found(changed(*changes)) if f" {field}: " in text]
    assert len(findings) == 1
    assert findings[0].startswith(f"warning line.yaml:{PLACES[line]}: {field}: ")
    assert missing(findings[0], *facts) == []


@pytest.mark.parametrize(
    "changes",
    [
        pytest.param([("[1, -0.05], angle: 0, length: 1, width: 0.1",
                     "[1.029, -0.05], angle: 0, length: 0.971, width: 0.1")], id="transfer of less than half a base"),
        pytest.param([("left: {kind: segment, from: [0, 0.04], to: [3, 0.04], material: steel}",
                       "left: {kind: segment, from: [0, 0.04], to: [0.7, 0.04], material: steel}\n"
                       "  more: {kind: segment, from: [0.76, 0.04], to: [3, 0.04], material: steel}")],
                     id="gap that no bottle fits through"),
        pytest.param([*FAULTS["column"][0], ("rate: 2}", "rate: 2, lateral_jitter: 0.001}")], id="scatter"),
        pytest.param([("speed: 0.4, rate: 2}", "speed: 0.4, rate: 2}\ngates:\n  stop: {kind: slide, material: steel, "
                       "from: [1.2, -0.039], to: [1.2, 0.039], direction: 90 deg, stroke: 0.1, max_speed: 0.5, "
                       "acceleration: 10}")], id="closed gate"),
        pytest.param([("length: 1, width: 0.1, speed: 0.4, material: chain}\n  third",
                       "length: 1, width: 0.1, material: chain}\n  third")], id="belt that a controller starts"),
    ],
)  # fmt: skip
def test_what_is_meant_so_is_no_finding(changes: list[tuple[str, str]]) -> None:
    assert found(changed(*changes)) == []


def test_belts_that_run_backwards_are_named() -> None:
    text = changed(("[1, -0.05], angle: 0, length: 1, width: 0.1, speed: 0.4",
                    "[2, 0.05], angle: 180 deg, length: 1, width: 0.1, speed: -0.4"))  # fmt: skip
    (note,) = found(text)
    assert note.startswith(f"note line.yaml:{PLACES['second']}: belts.second.speed: ")


def test_a_belt_of_a_drive_that_runs_backwards_is_named_at_the_drive() -> None:
    text = "drives: {m: {speed: -0.4}}\n" + changed(("[1, -0.05], angle: 0, length: 1, width: 0.1, speed: 0.4",
           "[2, 0.05], angle: 180 deg, length: 1, width: 0.1, drive: m"))  # fmt: skip
    (note,) = found(text)
    assert note.startswith("note line.yaml:1: drives.m.speed: ")
    assert missing(note, "second") == []


def test_a_gap_at_a_reject_is_meant() -> None:
    gap = FAULTS["gap"][0]
    reject = ("outfeeds:", "machines: {out: {kind: reject, region: [[0.71, -0.04], [0.77, -0.04], [0.77, 0.04], "
              "[0.71, 0.04]]}}\noutfeeds:")  # fmt: skip
    assert found(changed(*gap, reject)) == []


@pytest.mark.parametrize("path", SHIPPED, ids=shipped_name)
def test_shipped_scenes_have_no_faults(path: Path) -> None:
    assert [finding.path for finding in flow_of(load_scene(path)).findings if finding.level == "warning"] == []


def test_a_belt_that_was_moved_out_of_the_plant_is_noticed() -> None:
    finding, counter = found(changed(("start: [1, -0.05]", "start: [11, -0.05]")))
    assert counter.startswith(f"warning line.yaml:{PLACES['passed']}: counters.passed: ")
    assert finding.startswith(f"warning line.yaml:{PLACES['filler']}: infeeds.filler: ")
    assert missing(finding, "no exit", "first", "(1.00, 0.00)") == []
