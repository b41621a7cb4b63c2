# SPDX-License-Identifier: Apache-2.0
"""Stop reasons of machines, and time categories that follow from them."""

from collections.abc import Mapping

from conveyor_sim.line.machines.efficiency import Category
from conveyor_sim.line.machines.packml import Command, PackMLState
from conveyor_sim.scene.parts.machine import MOST_STOPS, PackmlPart

NONE, RUN, STARVED, BLOCKED, FAULT = 0, 1, 20, 21, 30
FIRST_FAILURE = 100
FIRST_PLANNED = FIRST_FAILURE + MOST_STOPS

COMMANDED: Mapping[int, int] = {
    Command.STOP: 2, Command.HOLD: 3, Command.SUSPEND: 4, Command.ABORT: 5, Command.COMPLETE: 6,
}  # fmt: skip
"""Stop reason by command."""

BY_HAND = 10
"""Added to the reason of a command, and to RUN, if a person sent it and not a controller."""

_COMMANDS = {
    RUN: "command run", 2: "command Stop", 3: "command Hold", 4: "command Suspend", 5: "command Abort",
    6: "command Complete",
}  # fmt: skip

_TEXTS = {
    NONE: "none",
    **_COMMANDS,
    **{reason + BY_HAND: f"{text} by hand" for reason, text in _COMMANDS.items()},
    STARVED: "starved",
    BLOCKED: "blocked",
    FAULT: "fault stop",
}

_S = PackMLState

WAITING = frozenset({_S.SUSPENDED, _S.SUSPENDING, _S.UNSUSPENDING})
FAILED = frozenset({_S.HOLDING, _S.HELD, _S.UNHOLDING, _S.ABORTING, _S.ABORTED, _S.CLEARING})
STOPPED = frozenset({_S.STOPPING, _S.STOPPED})
WORKING = frozenset({_S.EXECUTE, _S.COMPLETING})


def reason_texts(part: PackmlPart) -> dict[int, str]:
    """Return the texts of a machine's stop reasons, with its failures and planned stops by name."""
    failures = {FIRST_FAILURE + index: f"failure {name}" for index, name in enumerate(part.failures)}
    planned = {FIRST_PLANNED + index: f"planned stop {name}" for index, name in enumerate(part.planned_stops)}
    return {**_TEXTS, **failures, **planned}


def is_failure(reason: int) -> bool:
    """Return True if the reason is the fault `stop` or a failure of the machine."""
    return reason == FAULT or FIRST_FAILURE <= reason < FIRST_PLANNED


def category_of(state: int, reason: int, cause: int, failed: bool) -> Category:
    """Return the time category of a machine.

    cause: STARVED or BLOCKED if it waits in this tick, else NONE. failed: True until it is repaired. Waiting in Execute
    counts from its first tick on, before the machine is Suspended.
    """
    if state in WORKING:
        return "starved" if cause == STARVED else "blocked" if cause == BLOCKED else "running"
    if state in WAITING:
        return "starved" if reason == STARVED else "blocked" if reason == BLOCKED else "idle"
    if state in FAILED:
        return "down"
    if state in STOPPED:
        return "planned" if reason >= FIRST_PLANNED else "down" if failed and is_failure(reason) else "idle"
    return "idle"
