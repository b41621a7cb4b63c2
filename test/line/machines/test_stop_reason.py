# SPDX-License-Identifier: Apache-2.0
"""Stop reasons of machines and time categories, for every state."""

import pytest

from conveyor_sim.line.machines.packml import PackMLState
from conveyor_sim.line.machines.stop_reason import (
    BLOCKED,
    FAULT,
    FIRST_FAILURE,
    FIRST_PLANNED,
    NONE,
    RUN,
    STARVED,
    category_of,
)

WHERE = [
    ("EXECUTE COMPLETING", NONE, NONE, False, "running"),
    ("EXECUTE COMPLETING", FIRST_FAILURE, NONE, False, "running"),
    ("EXECUTE COMPLETING", RUN, STARVED, False, "starved"),
    ("EXECUTE COMPLETING", NONE, BLOCKED, False, "blocked"),
    ("SUSPENDING SUSPENDED UNSUSPENDING", STARVED, NONE, False, "starved"),
    ("SUSPENDING SUSPENDED UNSUSPENDING", BLOCKED, BLOCKED, False, "blocked"),
    ("SUSPENDING SUSPENDED UNSUSPENDING", 4, NONE, False, "idle"),
    ("HOLDING HELD UNHOLDING", FAULT, NONE, True, "down"),
    ("HOLDING HELD UNHOLDING", 3, NONE, False, "down"),
    ("ABORTING ABORTED CLEARING", 5, NONE, False, "down"),
    ("STOPPING STOPPED", FIRST_PLANNED, NONE, False, "planned"),
    ("STOPPING STOPPED", FIRST_FAILURE, NONE, True, "down"),
    ("STOPPING STOPPED", FIRST_FAILURE, NONE, False, "idle"),
    ("STOPPING STOPPED", RUN, NONE, False, "idle"),
    ("STOPPING STOPPED", 2, NONE, True, "idle"),
    ("RESETTING IDLE STARTING COMPLETE", NONE, NONE, False, "idle"),
]


@pytest.mark.parametrize(("states", "reason", "cause", "failed", "category"), WHERE)
def test_where_the_time_goes(states: str, reason: int, cause: int, failed: bool, category: str) -> None:
    for name in states.split():
        assert category_of(PackMLState[name], reason, cause, failed) == category


def test_every_state_is_in_the_table() -> None:
    assert {name for states, *_ in WHERE for name in states.split()} == {state.name for state in PackMLState}
