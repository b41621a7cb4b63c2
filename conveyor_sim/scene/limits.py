# SPDX-License-Identifier: Apache-2.0
"""Limits of loads in a scene file. A load beyond a limit is an event (topic `damage_events`)."""

from conveyor_sim.scene.part import Part
from conveyor_sim.scene.types import Positive, quantity


class Limits(Part):
    """Largest loads of bottles. The effect of each given limit is evaluated in every step."""

    scuffing_work: Positive | None = quantity(
        "Sliding work at the wall of a bottle since it entered.", "J", default=None
    )
    crushing_force: Positive | None = quantity(
        "Sum of the normal forces that act on a bottle at once.", "N", default=None
    )
    opposed_force: Positive | None = quantity(
        "Squeeze of a bottle between two contacts that oppose each other: the smaller force, times |cos| of the "
        "angle between them.",
        "N",
        default=None,
    )
    impact_speed: Positive | None = quantity(
        "Relative normal speed just before a contact closes; glass is rated by it.", "m/s", default=None
    )
    impact_force: Positive | None = quantity("Normal force of any one contact.", "N", default=None)
    tipping: Positive | None = quantity(
        "Index of tipping: at 1, a lasting load tips the bottle. For types with `contact_height` and `gravity_height`.",
        "1",
        default=None,
    )
    clogging_time: Positive | None = quantity(
        "Longest time for which an outfeed removes no bottle although one waits on a running belt.", "s", default=None
    )
