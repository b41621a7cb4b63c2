# SPDX-License-Identifier: Apache-2.0
"""The line of validation/two_machines.py as studies want it, with 4 s between failures and 1 s to repair."""

from __future__ import annotations

import sys
from pathlib import Path

from conveyor_sim.scene import Scene

sys.path.append(str(Path(__file__).parent.parent))

from validation import two_machines as theory

MACHINE = theory.Machine(between_failures=4.0, to_repair=1.0)


def two_machines(length: float) -> Scene:
    """length: of the conveyor, m."""
    return theory.line(length, MACHINE, MACHINE, seed=0)


def closed_form(length: float) -> float:
    """Efficiency of a line of that length, by continuous flow."""
    return theory.conveyor_efficiency(MACHINE, MACHINE, theory.RATE, theory.holds(length), theory.transport(length))
