"""What a run is doing: for clients that must tell a line that stands from one that is not simulated.

It is about the simulation, not of the line: it is in no signal, no state hash and no comparison of a replay.
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
"""running: time passes by itself; paused: it stands, and can go on; lockstep: a controller advances it; ended: the
duration of the scene has passed; stopped: it can't go on, with the reason; replaying: a recording is played back."""

RUN = "run"
"""Device, and class of device, of tags about the run."""

RUN_TAGS: tuple[Tag, ...] = tuple(
    replace(tag, device=RUN, device_class=RUN)
    for tag in (choice(f"{RUN}/state", "run", "What the simulation is doing, as in topic run_state.", STATES, PAUSED),)
)


@dataclass(frozen=True)
class RunState:
    """What topic `run_state` shows."""

    state: int
    """One of STATES."""
    reason: str = ""
    """Why it is stopped, or whose lockstep it is."""

    @property
    def text(self) -> str:
        """The state as a word."""
        return STATES[self.state]
