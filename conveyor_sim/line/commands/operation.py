# SPDX-License-Identifier: Apache-2.0
"""`Operation`: row in the line's table of operations."""

from collections.abc import Callable
from typing import NamedTuple

from conveyor_sim.line.commands.inputs import Input
from conveyor_sim.line.device import ScanContext


class Operation(NamedTuple):
    """Operation on a line."""

    refusal: Callable[[Input], str]
    """Returns why an input can't be applied now, "" if it can."""
    apply: Callable[[Input, ScanContext], None]
    """Applies an input that was not refused."""
