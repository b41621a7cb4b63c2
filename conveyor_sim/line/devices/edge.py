# SPDX-License-Identifier: Apache-2.0
"""Rising edges of switches between two scans."""

from dataclasses import dataclass


@dataclass
class RisingEdge:
    """Detector of rising edges."""

    on: bool = False

    def rises(self, value: float) -> bool:
        """Return True if the switch is on now and was off before."""
        before, self.on = self.on, value != 0.0
        return self.on and not before
