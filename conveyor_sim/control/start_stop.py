# SPDX-License-Identifier: Apache-2.0
"""`StartStop`: start, stop, reset and emergency stop of a line by its operator panel."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from conveyor_sim.control.scan import Inputs

CLEAR, ABORTED = 9.0, 9.0
"""Command and state of PackML."""


@dataclass
class StartStop:
    """Control of belts and machines by the panel of `scenarios/panel_line`.

    The start button starts the line after a warning by the horn. A stop button (NC), the position `off` of the selector
    and the emergency stop end it. After an emergency stop the reset button clears the machines, and the start button
    starts the line again.
    """

    belts: Sequence[str]
    """Names of the belts, which have drives."""
    machines: Sequence[str]
    """Names of the machines."""
    packed: str
    """Signal that is displayed as the number of packed bottles."""
    warning: int = 100
    """Duration of the warning before a start, scans."""
    _ready: bool = True
    _runs: bool = False
    _warned: int = 0
    _start: bool = field(default=True)
    _reset: bool = field(default=True)

    def scan(self, inputs: Inputs) -> Mapping[str, float]:
        """Return the commands of one scan."""
        powered = inputs["panel/estop/contact"] != 0.0
        start, reset = inputs["panel/start/contact"] != 0.0, inputs["panel/reset/contact"] != 0.0
        starts, resets = start and not self._start, reset and not self._reset
        self._start, self._reset = start, reset
        self._ready = powered and (self._ready or resets)
        may_run = self._ready and inputs["panel/stop/contact"] != 0.0 and inputs["panel/mode/position"] == 1.0
        if not may_run:
            self._runs, self._warned = False, 0
        elif starts and not self._runs:
            self._warned = 1
        elif self._warned > 0:
            self._warned = self._warned + 1 if self._warned < self.warning else 0
            self._runs = self._warned == 0
        commands = {
            "panel/ready/on": float(self._ready and not self._runs),
            "panel/horn/on": float(self._warned > 0),
            "panel/stack/red": float(not powered),
            "panel/stack/yellow": float(powered and not self._ready),
            "panel/stack/green": float(self._runs),
            "panel/made/write": inputs[self.packed],
        }
        for belt in self.belts:
            commands[f"belts/{belt}/cmd_speed"] = inputs["panel/speed/value"]
            commands[f"belts/{belt}/run"] = float(self._runs)
        for machine in self.machines:
            clears = self._ready and inputs[f"machines/{machine}/state"] == ABORTED
            commands[f"machines/{machine}/cntrl_cmd"] = CLEAR if clears else 0.0
            commands[f"machines/{machine}/run"] = float(self._runs)
        return commands


def panel_line() -> StartStop:
    """Return the controller of `scenarios/panel_line`."""
    return StartStop(("lane",), ("filler", "packer"), packed="machines/packer/taken")
