"""Checks of control authority against the latest snapshot, for immediate answers; the line checks again at the tick."""

from __future__ import annotations

from collections.abc import Mapping

from conveyor_sim.line.commands.authority import AUTOMATIC, IN_CONTROL, MODES, PEOPLE, covers
from conveyor_sim.line.commands.inputs import SET, Input, WriterKind
from conveyor_sim.line.commands.receipt import Receipt, Refusal
from conveyor_sim.line.machines.packml import stops
from conveyor_sim.line.run_state import ENDED, REPLAYING, STOPPED
from conveyor_sim.line.tag import Tag
from conveyor_sim.protocols.tags.tag_provider import Control, TagProvider

TAKES_NO_INPUT = (ENDED, STOPPED, REPLAYING)
"""States of a run in which inputs never take effect."""

MAY_CONTROL: tuple[WriterKind, ...] = ("operator", "engineer", "test")
"""Roles that may control a run: pause, resume and so on."""


CONTROL_RANGES: Mapping[Control, tuple[float, float]] = {"step": (1.0, 2.0**32 - 1.0), "speed": (0.0, 1e6)}
"""Valid values by request: number of ticks; factor of real time, 0 for as fast as possible."""


def is_mode(tag: Tag) -> bool:
    """Return True if a tag is the control mode of a device. An authorised client changes the mode by writing it."""
    return bool(tag.device) and tag.name == f"{tag.device}/mode"


def objection(source: TagProvider, command: Tag, value: float, kind: WriterKind, writer: str) -> str:
    """Return why a command of a writer would be refused in the latest state of the line; "" if it would not."""
    snapshot, device = source.snapshot, command.device
    if kind in PEOPLE and stops(command.name, value):
        return ""
    mode = int(snapshot.values.get(f"{device}/mode", AUTOMATIC))
    if kind not in IN_CONTROL[mode]:
        return f"{device}: is in {MODES[mode]}"
    if kind != "controller" or snapshot.owner in ("", writer):
        return ""
    if any(covers(pattern, device, source.info.where) for pattern in snapshot.released):
        return ""
    return f"{device}: the line is owned by controller {snapshot.owner}"


def refused_for_good(source: TagProvider, receipt: Receipt, request: Input) -> Refusal | None:
    """Return why the line would refuse an input in every state; None if it might accept it.

    If its writer may use the operation, such an input is still passed on, and the line records the refusal.
    Commands (SET) are not passed on.
    """
    refusal = receipt.refusal(request)
    # An input with commands is not passed on, because the line might accept a part of it.
    if refusal is not None and refusal.cause != "operation" and request.operation != SET:
        source.give(request)
    return refusal
