# SPDX-License-Identifier: Apache-2.0
"""A controller whose command is refused after half a second, which ends a run."""

from collections.abc import Mapping
from typing import Any


class Refused:
    """Controller that gives an unknown command at tick 50, and an alarm before."""

    def scan(self, inputs: Any) -> Mapping[str, float]:
        """Return a valid command and an alarm at first, later a command that the line does not have."""
        if inputs.tick < 50:
            return {"belts/zone1/cmd_speed": 0.25, "alarms/early": float(inputs.tick % 20 > 10)}
        return {"belts/nowhere/cmd_speed": 0.25}


def refused() -> Refused:
    """Build the controller."""
    return Refused()
