# SPDX-License-Identifier: Apache-2.0
"""Plan of the page: every surface is drawn, every belt named once, plates without a device."""

from physics.test_surfaces import bend, lanes, plate
from scenes import scene

from conveyor_sim.page.head import plan_head


def test_the_plan_has_every_surface_with_its_belt() -> None:
    fields = lanes()
    belts = {"bend": bend("right", material="chain"), **fields["belts"]}
    surfaces = plan_head(scene(**{**fields, "belts": belts, "plates": {"dead": plate()}}))["surfaces"]
    rows = [(one["belt"], one["name"], one["ratio"], one["clockwise"], one["named"]) for one in surfaces]
    assert rows == [
        (0, "bend", 1.0, True, True),
        (1, "comb", 0.5, False, False),
        (1, "comb", 1.0, False, True),
        (1, "comb", 2.0, False, False),
        (None, "", 1.0, False, False),
    ]
