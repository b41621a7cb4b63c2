"""`Operation`: a row of the line's table of what can be done to it."""

from collections.abc import Callable
from typing import NamedTuple

from conveyor_sim.line.commands.inputs import Input
from conveyor_sim.line.device import ScanContext


class Operation(NamedTuple):
    """What can be done to a line."""

    refusal: Callable[[Input], str]
    """Why it can't be applied as the line stands, "" if it can."""
    apply: Callable[[Input, ScanContext], None]
    """Called only if there is no reason against it."""
