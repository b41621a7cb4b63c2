# SPDX-License-Identifier: Apache-2.0
"""Machines of a scene file: what can wait before them, where they stand, and what is refused in one sentence."""

import math
from typing import Any

import numpy as np
import pytest
from scenes import RADIUS, base, belt, contact, scene, segment

from conveyor_sim.errors import SceneError
from conveyor_sim.scene.check_machines import most_axes
from conveyor_sim.scene.geometry import RailShape, SegmentPiece

HERE = [[1.75, -0.2], [2.0, -0.2], [2.0, 0.2], [1.75, 0.2]]
ELSEWHERE = [[2.5, -0.2], [2.9, -0.2], [2.9, 0.2], [2.5, 0.2]]


def machine(kind: str, **more: Any) -> dict[str, Any]:
    place = {"bottle": "bottle"} if kind == "source" else {"region": HERE}
    start = {} if kind == "sink" else {"position": [2.3, 0.0], "direction": 0.0, "speed": 0.5}
    return {"kind": kind, "rate": 2.0, **place, **start, **more}


def load(it: dict[str, Any], **fields: Any) -> None:
    """A belt of 4 m with a rail across it at 2 m, and one machine beside those in `fields`."""
    machines = {"it": it, **fields.pop("machines", {})}
    scene(
        base=base(0.4),
        contacts=[contact(5e4), contact(5e4, "steel")],
        belts={"one": belt(0.5, (-0.2, -0.2), 4.2, 0.4)},
        rails={"stop": segment((2.0, 0.2), (2.0, -0.2))},
        machines=machines,
        **fields,
    )


JAM = {"between": {"kind": "exponential", "mean": 60.0}, "repair": {"kind": "list", "times": [5.0]}}
ZONE = {"zones": {"queue": {"region": HERE}}}


@pytest.mark.parametrize("kind", ["source", "sink", "station"])
def test_what_all_of_them_may_have(kind: str) -> None:
    more = {"rate_limit": 3.0, "ramp_up": 2.0, "suspend_after": 0.0, "acting_times": {"starting": 1.0}}
    load(machine(kind, **more, failures={"jam": JAM}, planned_stops={"lunch": {"start": 60.0, "duration": 30.0}}))


@pytest.mark.parametrize(
    ("it", "says"),
    [
        (machine("sink", rate_limit=1.0), "machines.it.rate_limit: 1 given, expected at least 2 (1/s), the rate"),
        (
            machine("sink", planned_stops={"lunch": {"start": 0.0, "duration": 30.0, "every": 30.0}}),
            "machines.it.planned_stops.lunch.every: 30 given, expected more than the duration, 30 (s)",
        ),
        (
            machine("sink", failures={"jam": {**JAM, "repair": {"kind": "normal"}}}),
            'machines.it.failures.jam.repair.kind: "normal" given, expected "exponential", "weibull" or "list"',
        ),
        (
            machine("sink", failures={"jam": {**JAM, "repair": {"kind": "weibull", "mean": 5.0, "shape": 0.01}}}),
            "machines.it.failures.jam.repair.shape: 0.01 given, expected a number from 0.1 to 100",
        ),
        (
            machine("sink", failures={"jam": {**JAM, "repair": {"kind": "list", "times": []}}}),
            "machines.it.failures.jam.repair.times: [] given, expected a list of numbers greater than 0, at least one",
        ),
        (machine("sink", failures={"jam": {**JAM, "counted": "work"}}), 'expected "running" or "clock"'),
        (
            machine("sink", start_fill=2, start_zone="nowhere"),
            'machines.it.start_zone: "nowhere" given, expected a name from zones: queue',
        ),
        (machine("sink", start_zone="queue"), 'machines.it.start_zone: "queue" given, expected start_fill beside it'),
        (
            machine("source", bad_every=3, bad_at=[17]),
            "machines.it: both of bad_every and bad_at given, expected at most one of them",
        ),
        (
            machine("source", bad_at=[0]),
            "machines.it.bad_at[0]: 0 given, expected a whole number, 1 or greater",
        ),
        (
            machine("station", sets={"cap": {"to": 1.0, "share": 0.5, "at": [3]}}),
            "machines.it.sets.cap: share and at given, expected at most one of them",
        ),
        (
            machine("station", sets={"bad": {"to": 0.5}}),
            "machines.it.sets.bad: bad set to 0.5 +- 0, expected 0 or 1, and no deviation",
        ),
        (
            machine("station", sets={"cap": {"to": 1.0}}, tests={"cap": {}}),
            "machines.it.tests.cap: neither low nor high given, expected one of them at least",
        ),
        (
            machine("station", sets={"cap": {"to": 1.0}}, tests={"cap": {"low": 2.0, "high": 1.0}}),
            "machines.it.tests.cap.low: 2 given, expected at most 1, as high is",
        ),
        (
            machine("station", tests={"label": {"low": 1.0}}),
            'machines.it.tests.label: no station sets "label", expected bad',
        ),
        (
            machine("station", position=[1.9, 0.0]),
            "machines.it.position: [1.9, 0] given, expected a place outside its region: it would take the bottle again",
        ),
        (
            machine("station", position=[2.03, 0.0]),
            "machines.it.position: [2.03, 0] given, expected at least 0.065 m between a bottle's axis and rail stop",
        ),
        (
            machine("station", region=[[5.0, 0.0], [6.0, 0.0], [6.0, 1.0]]),
            "machines.it.region: lies on no belt, expected a region to which a belt brings bottles",
        ),
        (
            machine("station", region=ELSEWHERE),
            "machines.it.region: overlaps the region of machines.other, expected a region that is its own",
        ),
        (machine("sink", start_fill=50), "machines.it.start_fill: 50 given, expected at most "),
        (machine("sink", start_fill=50, start_zone="queue"), ": zone queue can't hold more"),
    ],
)
def test_what_is_refused_and_why(it: dict[str, Any], says: str) -> None:
    other = machine("station", region=[[2.6, -0.2], [3.0, -0.2], [3.0, 0.2]], position=[3.5, 0.0])
    with pytest.raises(SceneError) as refused:
        load(it, machines={"other": other}, **ZONE)
    assert says in str(refused.value)
    assert str(refused.value).count("\n") == 0


def test_stations_that_share_a_region_are_refused_once() -> None:
    with pytest.raises(SceneError) as refused:
        load(machine("station"), machines={"other": machine("station", position=[3.0, 0.0])})
    assert str(refused.value).count("overlaps") == 1


@pytest.mark.parametrize("rows", [1, 2, 5])
@pytest.mark.parametrize("columns", [1, 4, 30])
def test_no_region_is_said_to_hold_less_than_it_does(rows: int, columns: int) -> None:
    """Bottles side by side in rows shifted by a radius: all of them fit, in every shape."""
    width, height = (columns - 1 + 0.5 * (rows > 1)) * 2 * RADIUS, (rows - 1) * math.sqrt(3.0) * RADIUS
    edge = 1e-6
    region = [(-edge, -edge), (width + edge, -edge), (width + edge, height + edge), (-edge, height + edge)]
    most = most_axes(region, [], RADIUS)
    assert rows * columns <= most <= 1.15 * rows * columns + 3


def test_rails_take_away_from_what_a_region_holds() -> None:
    """A lane of single file, 1.3 diameters wide: a bottle a diameter and a bit; its area alone would hold more."""
    length, half = 20 * 2 * RADIUS, 1.3 * RADIUS
    region = [(0.0, -half), (length, -half), (length, half), (0.0, half)]
    sides = [((0.0, -half), (length, -half)), ((0.0, half), (length, half))]
    rails = [RailShape(str(n), "steel", (SegmentPiece(*ends),)) for n, ends in enumerate(sides)]
    inner = [(x, y / half * 0.3 * RADIUS) for x, y in region]
    zigzag = 1 + length / (2 * RADIUS * math.sqrt(1 - 0.3**2))
    assert zigzag <= most_axes(region, rails, RADIUS) <= most_axes(inner, [], RADIUS) + 2
    assert most_axes(region, rails, RADIUS) < 0.6 * most_axes(region, [], RADIUS)
    assert most_axes([(1.0, -0.01), (1.1, -0.01), (1.1, 0.01)], [rails[0]], 1.0) == 0


def test_a_corner_thinner_than_a_cell_still_holds_a_bottle() -> None:
    """Spikes of a millionth of the region's size."""
    spike = [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (1e-6, 1e-6), (1.0, 1e-3), (0.5, 5e-4)]
    assert most_axes(spike, [], 0.7) >= 2
    assert np.isfinite(most_axes([(0.0, 0.0), (1e-8, 0.0), (0.0, 1e-8)], [], RADIUS))
