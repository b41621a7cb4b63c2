# SPDX-License-Identifier: Apache-2.0
"""Star wheels in checks: a lone bottle passes them, and wrong phases are found."""

import math
from typing import Any

import pytest
from scenes import scene

from conveyor_sim.report.flow.flow import flow_of
from conveyor_sim.report.flow.wheel_findings import wrong_phases
from conveyor_sim.report.flow.wheels_as_belts import with_wheels_as_belts
from conveyor_sim.scene.schema import Scene

SPEED = 1.0
RADIUS, POCKETS = 0.3, 12
STEEL = {"material": "steel"}


def line(**star: Any) -> Scene:
    """Return a line with two wheels, whose bottles leave on a conveyor in the direction in which they came."""
    wheel = {"pockets": POCKETS, "pitch_radius": RADIUS, "pocket_radius": 0.034, "axis": "star", **STEEL}
    guided = {**wheel, "carry": math.pi / 2, "guide": STEEL}
    contact = {"stiffness": 2e4}
    conveyor = {"width": 0.1, "material": "chain", "speed": SPEED}
    return scene(
        bottle_types={"bottle": {"radius": 0.033, "mass": 0.5, "material": "pet"}},
        contacts=[{"between": ["pet", "pet"], **contact}, {"between": ["pet", "steel"], **contact}],
        base=[{"between": ["pet", "chain"], "friction": 0.3}],
        axes={"star": {"rate": SPEED / (2.0 * math.pi * RADIUS)}},
        conveyors={
            "infeed": {"start": [0.0, 0.0], "path": [{"straight": 1.0}], **conveyor},
            "discharge": {"start": [1.0 + 2.0 * RADIUS, 2.0 * RADIUS], "path": [{"straight": 1.0}], **conveyor},
        },
        stars={
            "in": {**guided, "along": "infeed", "at": "end", "side": "left"},
            "out": {**guided, "after": "in", **star},
        },
        infeeds={"filler": {"along": "infeed", "at": 0.1, "bottle": "bottle", "rate": 3.0}},
        outfeeds={"packer": {"along": "discharge", "at": "end", "length": 0.1}},
    )


def test_lone_bottle_passes_two_wheels() -> None:
    """It needs the time of the path at the speed of belts and pockets."""
    flow = flow_of(line())
    (route,) = flow.routes
    (leg,) = route.legs
    assert [flow.surfaces[index].name for index in dict.fromkeys(leg.carriers.tolist()) if index >= 0] == [
        "infeed",
        "in (star)",
        "out (star)",
        "discharge",
    ]
    assert leg.times[-1] == pytest.approx((0.9 + math.pi * RADIUS + 0.9) / SPEED, rel=0.03)
    assert not [finding for finding in flow.findings if finding.path[0] == "stars"]


def test_wheels_are_replaced_in_traces_only() -> None:
    """The scene itself keeps its wheels; its surrogate has none."""
    whole = line()
    assert len(with_wheels_as_belts(whole).belts) == len(whole.belts) + 2
    assert not with_wheels_as_belts(whole).stars and len(whole.stars) == 2


def test_wrong_phase_is_found_with_its_distance() -> None:
    """A wheel 0.1 rad late is 30 mm late; one that is a pocket later fits."""
    fitting = math.pi / 2
    assert not list(wrong_phases(line(phase=fitting + 2.0 * math.pi / POCKETS)))
    (finding,) = wrong_phases(line(phase=fitting + 0.1))
    assert finding.path == ("stars", "out", "phase")
    assert finding.text == "its pockets are 30 mm too late for the bottles of stars.in: a phase of 0 rad fits"


@pytest.mark.parametrize("rate", [0.0, 0.5])
def test_a_wheel_passes_one_bottle_per_pocket(rate: float) -> None:
    """A wheel that stands at the start is estimated at its largest rate."""
    turning = line()
    axis = turning.axes["star"].model_copy(update={"rate": rate, "rate_limit": 0.5})
    flow = flow_of(turning.model_copy(update={"axes": {"star": axis}}))
    (wheel,) = [stretch for stretch in flow.stretches if stretch.name == "in (star)"]
    assert wheel.rate == pytest.approx(0.5 * POCKETS)
    assert wheel.capacity == pytest.approx(POCKETS / 4, rel=0.15)
