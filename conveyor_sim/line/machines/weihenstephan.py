# SPDX-License-Identifier: Apache-2.0
"""A machine's data points of the Weihenstephan Standards, derived from its tags on request.

Values of mode and program are those of OPC 40600. States are those of PackML, with Lack, Tailback and Prepared below
Suspended, and failures below Held. Numbers of data points and values of WS_Cur_State are taken from published programs
of machine builders; the text of the standard was not available.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

from conveyor_sim.line.commands.authority import AUTOMATIC, MAINTENANCE
from conveyor_sim.line.machines.packml import PackMLState
from conveyor_sim.line.machines.stop_reason import BLOCKED, FIRST_PLANNED, STARVED, STOPPED, is_failure
from conveyor_sim.line.tag import Tag


class DataPoint(NamedTuple):
    """Data point of the standard."""

    number: int
    tags: tuple[str, ...]
    """Tags of the machine that the value is derived from, as the last parts of their names. Some may not exist."""
    what: str
    """Description, one sentence for docs/parts/data_points.md."""


DATA_POINTS: Mapping[str, DataPoint] = {
    "WS_Cur_Mode": DataPoint(100, ("mode",), "8 automatic, 2 manual (Maintenance too)."),
    "WS_Cur_Prog": DataPoint(
        200,
        ("mode", "state", "stop_reason"),
        "0 none (Complete), 1 production, 2 start up (Starting), 4 run down (Completing), 32 maintenance, 64 break.",
    ),
    "WS_Cur_State": DataPoint(300, ("state", "stop_reason"), "See below."),
    "WS_Cur_Mach_Spd": DataPoint(401, ("cur_rate",), "Bottles per second."),
    "WS_Set_Mach_Spd": DataPoint(402, ("rate",), "Bottles per second."),
    "WS_Mach_Design_Spd": DataPoint(403, ("rate",), "Nominal rate, bottles per second."),
    "WS_Not_Of_Fail_Code": DataPoint(
        10000, ("fault", "stop_reason"), "Stop reason while the machine has failed, else 0."
    ),
    "WS_Tot_Containers": DataPoint(50005, ("produced", "processed"), "Bottles whose cycle is complete."),
    "WS_Good_Containers": DataPoint(50006, ("good",), "Bottles, of stations."),
}
"""Data points by name."""

BY_HAND, BY_ITSELF = 2, 8
NONE, PRODUCTION, START_UP, RUN_DOWN, MAINTAINED, BREAK = 0, 1, 2, 4, 32, 64
PREPARED, LACK, TAILBACK, EQUIPMENT_FAILURE, EXTERNAL_FAILURE = 4, 8, 16, 1024, 2048

STATES: Mapping[int, int] = {
    PackMLState.STOPPED: 1,
    PackMLState.CLEARING: 1,
    PackMLState.STARTING: 2,
    PackMLState.EXECUTE: 128,
    PackMLState.COMPLETING: 128,
    PackMLState.STOPPING: 256,
    PackMLState.ABORTING: 512,
    PackMLState.ABORTED: 4096,
    PackMLState.IDLE: 32768,
    PackMLState.RESETTING: 32768,
    PackMLState.COMPLETE: 32768,
}
"""WS_Cur_State by PackML state, where that alone determines it. Acting states without a separate value count as the
state they lead to."""

STATE_TEXTS: Mapping[int, str] = {
    1: "Stopped", 2: "Starting", PREPARED: "Prepared", LACK: "Lack", TAILBACK: "Tailback", 128: "Operating",
    256: "Stopping", 512: "Aborting", EQUIPMENT_FAILURE: "Equipment failure", EXTERNAL_FAILURE: "External failure",
    4096: "Emergency stop", 32768: "Idle",
}  # fmt: skip

_HOLDING = (PackMLState.HOLDING, PackMLState.HELD, PackMLState.UNHOLDING)


def data_points(machine: str, tags: Mapping[str, Tag], values: Mapping[str, float]) -> dict[str, float]:
    """Return the data points of one machine that follows PackML ("machines/filler"), by name.

    tags: of its line, by name. values: of signals and commands, by name.
    """
    own = {end: values[name] for end in _ENDS if (name := f"{machine}/{end}") in values}
    mode, state, reason = (int(own[end]) for end in ("mode", "state", "stop_reason"))
    design = tags[f"{machine}/rate"].nominal
    points = {
        "WS_Cur_Mode": BY_ITSELF if mode == AUTOMATIC else BY_HAND,
        "WS_Cur_Prog": program(mode, state, reason),
        "WS_Cur_State": state_of(state, reason),
        "WS_Cur_Mach_Spd": own["cur_rate"],
        "WS_Set_Mach_Spd": own["rate"],
        "WS_Mach_Design_Spd": 0.0 if design is None else design,
        "WS_Not_Of_Fail_Code": reason if own["fault"] and is_failure(reason) else 0,
        "WS_Tot_Containers": next(own[end] for end in DATA_POINTS["WS_Tot_Containers"].tags if end in own),
    }
    return points | ({"WS_Good_Containers": own["good"]} if "good" in own else {})


def program(mode: int, state: int, reason: int) -> int:
    """Return WS_Cur_Prog, from mode, state and stop reason."""
    if mode == MAINTENANCE:
        return MAINTAINED
    if state in STOPPED and reason >= FIRST_PLANNED:
        return BREAK
    return {int(PackMLState.STARTING): START_UP, PackMLState.COMPLETING: RUN_DOWN, PackMLState.COMPLETE: NONE}.get(
        state, PRODUCTION
    )


def state_of(state: int, reason: int) -> int:
    """Return WS_Cur_State, from PackML state and stop reason.

    A machine that a command holds has not failed: an external cause prevents its work.
    """
    if state in STATES:
        return STATES[state]
    if state in _HOLDING:
        return EQUIPMENT_FAILURE if is_failure(reason) else EXTERNAL_FAILURE
    return LACK if reason == STARVED else TAILBACK if reason == BLOCKED else PREPARED


def names_of(tag: Tag) -> tuple[str, ...]:
    """Return the data points that are derived from a tag."""
    machine, _, end = tag.name.rpartition("/")
    if not machine.startswith("machines/") or tag.device_class not in ("source", "sink", "station"):
        return ()
    return tuple(name for name, point in DATA_POINTS.items() if end in point.tags)


_ENDS = frozenset(end for point in DATA_POINTS.values() for end in point.tags)
