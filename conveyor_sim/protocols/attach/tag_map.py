"""Which tag of a PLC stands for which of ours: a CSV file with the columns `tag` and `theirs`.

    tag,theirs
    photo_eyes/full1/blocked,ns=4;s=GVL.Full1
    belts/zone1/cmd_speed,ns=4;s=GVL.Speed1
    alarms/jam at the outfeed,ns=4;s=GVL.Jam

Signals are written to the PLC; commands, and alarms that the PLC raises, are read from it. So are values of its own,
such as a state or a counter, under names that begin with `plc/`: conditions of a test may ask for them.

`theirs` is a NodeId of OPC UA, or a place in Modbus: table, address, type, word order ("holding register 12 float32
big").
"""

from __future__ import annotations

import csv
import io
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

from conveyor_sim.errors import ConveyorError
from conveyor_sim.line.commands.refusal import ALARMS
from conveyor_sim.line.tag import COMMANDS, SIGNALS, Tag, count, switch
from conveyor_sim.protocols.tags.handshake import TARGET, TICK
from conveyor_sim.support.files import MB, FileError, read_file
from conveyor_sim.support.printable import printable

COLUMNS = ("tag", "theirs")

OWN = "plc/"
"""What names begin with that stand for values of the PLC's own."""


class TagMapError(ConveyorError):
    """A map that can't be read, or does not fit the line or the PLC: file, line, what was given and expected."""


class Mapped(NamedTuple):
    """One line of it."""

    tag: Tag
    theirs: str
    where: str
    """File and line, for errors."""


class TagMap(NamedTuple):
    """What goes where."""

    written: tuple[Mapped, ...]
    """To the PLC: signals."""
    read: tuple[Mapped, ...]
    """From it: commands and alarms."""
    own: tuple[Mapped, ...]
    """Values of its own, read too."""
    tick: Mapped | None
    """`run/tick`, written behind all signals; None: it is not in the map."""
    target: Mapped | None
    """`run/target_tick`, which the PLC sets once it has scanned; None likewise."""


def read_tag_map(path: Path, tags: Sequence[Tag]) -> TagMap:
    """A map for a line with these tags. Raises TagMapError."""
    try:
        text = read_file(path, MB).decode("utf-8-sig")
        rows = list(csv.reader(io.StringIO(text), strict=True))
    except (FileError, csv.Error) as error:
        raise TagMapError(f"{path}: {error}, expected a CSV file of tags") from error
    except UnicodeDecodeError as error:
        raise TagMapError(f"{path}: is not UTF-8, expected a CSV file of tags") from error
    if not rows or tuple(rows[0]) != COLUMNS:
        given = printable(",".join(rows[0])) if rows else "nothing"
        raise TagMapError(f"{path}: line 1: {given} given, expected {','.join(COLUMNS)}")
    known = {tag.name: tag for tag in tags if tag.role in (*SIGNALS, *COMMANDS)} | _HANDSHAKE
    found: dict[str, Mapped] = {}
    for number, cells in enumerate(rows[1:], start=2):
        if not cells:
            continue
        where = f"{path}: line {number}"
        if len(cells) != len(COLUMNS) or not cells[1]:
            raise TagMapError(f"{where}: {printable(','.join(cells))} given, expected a tag and what it is in the PLC")
        name, theirs = cells
        tag = known.get(name) or _of_the_plc(name)
        if tag is None:
            expected = "expected a signal or command of the line, alarms/<name> or plc/<name>"
            raise TagMapError(f"{where}: {printable(name)} given, {expected} (conveyor-sim tags lists them)")
        if name in found:
            raise TagMapError(f"{where}: {printable(name)} given twice")
        found[name] = Mapped(tag, theirs, where)
    if not found:
        raise TagMapError(f"{path}: names no tag, expected one or more")
    tick, target = found.pop(TICK, None), found.pop(TARGET, None)
    own = tuple(each for name, each in found.items() if name.startswith(OWN))
    written = tuple(each for each in found.values() if each.tag.role in SIGNALS and each not in own)
    read = tuple(each for each in found.values() if each not in (*written, *own))
    return TagMap(written, read, own, tick, target)


def _of_the_plc(name: str) -> Tag | None:
    """What is the PLC's and not the line's: an alarm, or a value of its own."""
    if name.startswith(ALARMS) and name != ALARMS:
        return switch(name, "command", "")
    return count(name, "status", "") if name.startswith(OWN) and name != OWN else None


_HANDSHAKE = {name: count(name, "run", "") for name in (TICK, TARGET)}
