# SPDX-License-Identifier: Apache-2.0
"""State of a run: running, paused, ended, ...

It belongs to the simulation, not to the line: no signal, state hash or comparison of a replay contains it.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace

from conveyor_sim.line.tag import Tag, choice

RUNNING, PAUSED, LOCKSTEP, ENDED, STOPPED, REPLAYING = range(1, 7)

STATES: Mapping[int, str] = {
    RUNNING: "running",
    PAUSED: "paused",
    LOCKSTEP: "lockstep",
    ENDED: "ended",
    STOPPED: "stopped",
    REPLAYING: "replaying",
}
"""running: time advances by itself; paused: time stands still, and can go on; lockstep: a controller advances it;
ended: the duration of the scene has passed; stopped: the run can't go on, with the reason; replaying: a recording is
played back."""

RUN = "run"
"""Device name and class of the run's tags."""

RUN_TAGS: tuple[Tag, ...] = tuple(
    replace(tag, device=RUN, device_class=RUN)
    for tag in (choice(f"{RUN}/state", "run", "State of the run, as in topic run_state.", STATES, PAUSED),)
)


@dataclass(frozen=True)
class RunState:
    """State of a run in topic `run_state`."""

    state: int
    """One of STATES."""
    reason: str = ""
    """Reason for a stop, or owner of the lockstep."""

    @property
    def text(self) -> str:
        """State as a word."""
        return STATES[self.state]
