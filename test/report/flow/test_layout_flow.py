# SPDX-License-Identifier: Apache-2.0
"""Flow through conveyors that are laid out by their paths: names of conveyors, and lines of what was written."""

import pytest
from facts import missing

from conveyor_sim.report.flow.flow import flow_of
from conveyor_sim.scene import parse_scene
from conveyor_sim.scene.places import Places

LINE = """\
name: laid
duration: 20
bottle_types: {b: {radius: 33 mm, mass: 350 g, material: glass, base_radius: 30 mm}}
contacts:
  - {between: [glass, glass], stiffness: 50000, friction: 0.1, damping: {law: normal, restitution: 0.4}}
  - {between: [glass, steel], stiffness: 50000, friction: 0.1, damping: {law: normal, restitution: 0.4}}
base: [{between: [glass, chain], friction: 0.3}, {between: [glass, nylon], friction: 0.9}]
drives: {m1: {speed: 0.2}}
conveyors:
  table: {start: [0, 0], heading: 0 deg, path: [{straight: 2.4}], width: 0.6, material: chain, drive: m1}
  lane: {after: table, back: 0.4, path: [{straight: 0.9}, {right: 90 deg, radius: 0.5}, {straight: 1.2}],
    width: 0.09, material: chain, drive: m1, ratio: 2}
  next: {after: lane, gap: 100 mm, plate: nylon, path: [{straight: 2}], width: 0.09, speed: 0.4, material: chain,
     guides: {clearance: 75 mm, material: steel}}
guides:
  funnel: {along: [table, lane], material: steel, left: [[0, 0.28], [1.9, 75 mm/2]],
    right: [[0, -0.28], [1.9, -75 mm/2]]}
infeeds: {f: {bottle: b, along: table, at: 0.1, rate: 1}}
outfeeds: {o: {along: next, at: 0.5, length: 0.1}}
photo_eyes: {e: {along: lane, at: 1.5}}
counters: {c: {along: lane, at: 0.7}}
"""


def found(text: str) -> list[str]:
    """Return the findings of a scene, each with file, line and field."""
    scene = parse_scene(text, "line.yaml")
    return [finding.line(Places(scene)) for finding in flow_of(scene).findings]


def test_a_bottle_passes_conveyors_bends_and_plates() -> None:
    flow = flow_of(parse_scene(LINE))
    (route,) = flow.routes
    assert [stop[-1] for stop in route.stops] == ["f", "o"]
    assert list(dict.fromkeys(stretch.name for stretch in flow.stretches)) == ["table", "lane", "next_plate", "next"]
    lane = next(stretch for stretch in flow.stretches if stretch.name == "lane")
    assert lane.single
    assert lane.rate == pytest.approx(0.4 / 0.066)
    assert flow.findings == ()


@pytest.mark.parametrize(
    ("before", "after", "place", "facts"),
    [
        (", plate: nylon", "", "line.yaml:13: conveyors.next: ", ["100 mm", "30 mm", "lane"]),
        ("-75 mm/2]]}", "-75 mm/2]], open: {left: [[4, 4.2]]}}", "line.yaml:16: guides.funnel.left: ", ["200 mm"]),
        ("{speed: 0.2}", "{speed: 0.2, watchdog: 1}", "line.yaml:8: drives.m1.watchdog: ", ["1 s"]),
    ],
)
def test_a_fault_of_a_layout_is_found_where_it_is_written(
    before: str, after: str, place: str, facts: list[str]
) -> None:
    assert LINE.count(before) == 1
    (finding,) = found(LINE.replace(before, after))
    assert finding.startswith(place)
    assert missing(finding, *facts) == []


SWEPT = """\
name: swept
duration: 20
bottle_types: {b: {radius: 33 mm, mass: 350 g, material: glass, base_radius: 30 mm}}
contacts:
  - {between: [glass, glass], stiffness: 50000, friction: 0.1, damping: {law: normal, restitution: 0.4}}
  - {between: [glass, steel], stiffness: 50000, friction: 0.1, damping: {law: normal, restitution: 0.4}}
base: [{between: [glass, chain], friction: 0.3}, {between: [glass, steel], friction: 0.3}]
conveyors: {lane: {start: [0, 0], heading: 0 deg, path: [{straight: 2}], width: 0.8, material: chain, speed: 0.2}}
plates: {pallet: {kind: straight, start: [-0.9, -0.4], angle: 0, length: 0.9, width: 0.8, material: steel}}
pushers:
  sweep: {from: [-0.85, -0.38], to: [-0.85, 0.38], direction: 0 deg, stroke: 0.8, max_speed: 0.3, acceleration: 1,
    material: steel}
machines:
  pallets: {kind: source, position: [-0.75, -0.3], direction: 0 deg, speed: 0, bottle: b, rate: 1,
    layer: {rows: 5, columns: 5, pitch: 67 mm, pusher: sweep}}
outfeeds: {o: {along: lane, at: 1.5, length: 0.1}}
"""


def test_a_pusher_takes_a_bottle_off_a_plate() -> None:
    flow = flow_of(parse_scene(SWEPT))
    (route,) = flow.routes
    assert [stop[-1] for stop in route.stops] == ["pallets", "o"]
    assert route.seconds == pytest.approx(1.5 / 0.2, rel=0.1)
    assert flow.findings == ()


def test_a_plate_without_a_pusher_holds_a_bottle() -> None:
    moved = SWEPT.replace("from: [-0.85, -0.38], to: [-0.85, 0.38]", "from: [3, -0.38], to: [3, 0.38]")
    (finding, *_) = found(moved)
    assert finding.startswith("line.yaml:14: machines.pallets: ")
    assert missing(finding, "no exit", "pallet") == []
