# SPDX-License-Identifier: Apache-2.0
"""Controller of small_packaging.yaml: a full lane stops the comb, a full table the infeeds; bad bottles are rejected.

conveyor-sim run examples/small_packaging.yaml --controller examples/small_packaging.py:controller
"""

from collections.abc import Mapping

from conveyor_sim.control.blocks import COVERED
from conveyor_sim.control.level import Count, LevelControl
from conveyor_sim.control.reject import TrackedReject
from conveyor_sim.control.scan import Controller, Inputs, together


class StopBehind:
    """Stop of the comb while bottles stand in the lane behind it."""

    def __init__(self) -> None:
        """Start with a free lane."""
        self._covered = COVERED(1.0, 0.5)  # s

    def scan(self, inputs: Inputs) -> Mapping[str, float]:
        """Return the speed of the comb, m/s."""
        stands = self._covered(inputs.on("photo_eyes/backed_up/blocked"), inputs.time)
        return {"drives/comb/cmd_speed": 0.0 if stands else 0.35}


def controller() -> Controller:
    """Return the controllers of comb, infeeds and reject as one."""
    level = LevelControl(
        level=Count("belts/table/bottles"),
        feeder="drives/feed",
        table="drives/table",
        low=100,
        high=150,
        feeder_speed=0.25,
        table_slow=0.12,
        table_fast=0.15,
    )
    reject = TrackedReject(
        belt="drives/line",
        inspection="machines/camera/bad",
        seen="machines/camera/bad_time",
        fire="machines/reject/fire",
        distance=0.8,  # m along the lane, from the camera to the middle of the rejecter
        stroke=0.03,
        pulses_per_metre=2000.0,
    )
    return together(StopBehind(), level, reject)
