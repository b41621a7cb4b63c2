# SPDX-License-Identifier: Apache-2.0
"""Assignment of tags to variables: by a pragma, by the caller, by an address in a Modbus map, or by name."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from difflib import get_close_matches
from itertools import product
from pathlib import Path

from conveyor_sim.control.scan import ALARMS, LineTags
from conveyor_sim.control.st.compile import Compiled
from conveyor_sim.control.st.errors import Position, StructuredTextError
from conveyor_sim.control.st.located import address_of, is_incomplete, overlapping
from conveyor_sim.control.st.types import ELEMENTARY, Array, Member, Structure, Type
from conveyor_sim.control.st.variables import leaves
from conveyor_sim.support.modbus_rows import GONE, WORDS, read_map

_TABLES = {
    ("I", True): "discrete input",
    ("Q", True): "coil",
    ("I", False): "input register",
    ("Q", False): "holding register",
}

_STORED = ("VAR", "VAR_INPUT", "VAR_OUTPUT")
"""Sections of the variables that an instance stores, and that may have an address."""

MOST_INCOMPLETE = 10_000
"""Largest number of variables with an address without a number, elements of arrays included."""

_LISTED = 20
"""Largest number of names in a sentence."""

Addresses = Mapping[tuple[str, int], tuple[str, object]]
"""Tag and type in a Modbus map, by table and address."""


@dataclass(frozen=True)
class TagBinding:
    """Variable with a tag."""

    variable: str
    """Full name: main/speed."""
    tag: str
    type: Type
    is_input: bool
    how: str
    """Source of the assignment: tag, address or name."""


@dataclass(frozen=True)
class TagMapping:
    """All bindings of a program, with the unused variables and commands."""

    bound: tuple[TagBinding, ...]
    variables: tuple[str, ...]
    """Inputs, outputs and located variables without a tag."""
    commands: tuple[str, ...]
    """Commands of the line without a variable."""

    def left_over(self) -> tuple[str, ...]:
        """Return the unused variables and commands, in words."""
        unused = (("no tag for", self.variables), ("commands not set by the program:", self.commands))
        return tuple(f"{words} {_listed(names)}" for words, names in unused if names)

    def __str__(self) -> str:
        lines = [f"{one.variable} {'<-' if one.is_input else '->'} {one.tag} (by {one.how})" for one in self.bound]
        lines += [f"{name}: no tag" for name in self.variables]
        lines += [f"{name}: command not set by the program" for name in self.commands]
        return "\n".join(lines)


def _listed(names: tuple[str, ...]) -> str:
    more = len(names) - _LISTED
    return ", ".join(names[:_LISTED]) + (f" and {more} more" if more > 0 else "")


def read_addresses(path: Path) -> Addresses:
    """Return the tags of a Modbus map (docs/scada.md) by table and address. Raise MapError if it can't be read."""
    return {
        (row.table, row.address): (row.name, "bool" if row.type == "bool" else 16 * WORDS[row.type])
        for row in read_map(path)
        if row.description != GONE
    }


def mapped(compiled: Compiled, tags: LineTags, chosen: Mapping[str, str], addresses: Addresses) -> TagMapping:
    """Return the mapping of a program on a line.

    chosen: tags by variable; they override those in the program. Raise StructuredTextError for an unknown variable or
    tag, an unsuitable type, a wrong direction, or a command with two variables.
    """
    candidates = _few(compiled)
    declared = {one.name: Position(*one.member.at) for one in candidates}
    groups = {one.name: one.group for one in candidates if one.group is not None}

    def place(name: str) -> str:
        """Return file, line and column of a variable; those of the first program for an unknown one."""
        return compiled.files.place(declared.get(name, compiled.programs[0].at))

    for name in chosen:
        if name.lower() not in declared:
            close = next(iter(get_close_matches(name.lower(), declared, 1)), "")
            hint = f"; there is {close}" if close else ""
            listed = _listed(tuple(declared)) or "none"
            raise StructuredTextError(f"{place(close)}: found {name} among the tags, expected one of {listed}{hint}")
    wanted = {name.lower(): tag for name, tag in chosen.items()}
    by_identifier = _by_identifier(tags)
    bound: list[TagBinding] = []
    left: list[str] = []
    for name, member, shared in ((one.name, one.member, one.is_global) for one in candidates):
        where = f"{place(name)}: {member.name}"
        tag, how = wanted.get(name) or member.tag, "tag"
        if not tag and member.address:
            tag, how = _located(where, member, addresses), "address"
        is_outer = member.section in ("VAR_INPUT", "VAR_OUTPUT") or is_incomplete(member.address)
        if not tag and (shared or (is_outer and name.count("/") == 1)) and not member.constant:
            tag, how = by_identifier.get(name.rpartition("/")[2], ""), "name"
        if tag:
            bound.append(_checked(where, name, member, tag, how, tags))
        elif member.address or member.section in ("VAR_INPUT", "VAR_OUTPUT"):
            left.append(name)
    sender: dict[str, str] = {}
    for one in bound:
        other = sender.get(one.tag, one.variable)
        if not one.is_input and groups.get(other, other) != groups.get(one.variable, one.variable):
            both = f"{other} and {one.variable}"
            raise StructuredTextError(f"{place(one.variable)}: {one.tag}: found {both} for it, expected one variable")
        if not one.is_input:
            sender[one.tag] = one.variable
    _require_one_tag(place, bound, groups)
    if not addresses:
        _require_apart(place, candidates, bound)
    tagged = {groups[one.variable] for one in bound if one.variable in groups}
    left = [name for name in left if groups.get(name) not in tagged]
    return TagMapping(tuple(bound), tuple(left), tuple(name for name in tags.commands if name not in sender))


def _few(compiled: Compiled) -> list[Candidate]:
    """Return the variables that may be tags. Raise StructuredTextError for too many with incomplete addresses."""
    candidates: list[Candidate] = []
    count = 0
    for one in _candidates(compiled):
        count += is_incomplete(one.member.address)
        if count > MOST_INCOMPLETE:
            where = f"{compiled.files.place(Position(*one.member.at))}: {one.member.name}"
            raise StructuredTextError(
                f"{where}: found more than {MOST_INCOMPLETE} variables AT {one.member.address}, expected fewer"
            )
        candidates.append(one)
    return candidates


@dataclass(frozen=True)
class Candidate:
    """A variable that may be a tag, by its full name. group: number of the memory that it shares; None: not shared."""

    name: str
    member: Member
    is_global: bool
    group: int | None


def _candidates(compiled: Compiled) -> Iterator[Candidate]:
    for member in compiled.globals.members.values():
        group = compiled.shared.get((compiled.globals.python, member.slot))
        yield from _of_member(member, member.name.lower(), True, group, True)
    for program in compiled.programs:
        for member in program.type.members.values():
            if member.section != "VAR_EXTERNAL":
                group = compiled.shared.get((program.type.python, member.slot))
                yield from _of_member(member, f"{program.name.lower()}/{member.name.lower()}", False, group, True)


def _inside(kind: Type, name: str) -> Iterator[Candidate]:
    """Yield variables with an address without a number inside a block, a structure or an array of them.

    name: full name of the value.
    """
    if isinstance(kind, Array):
        indices = product(*(range(low, high + 1) for low, high in kind.ranges)) if _has_incomplete(kind) else ()
        for index in indices:
            yield from _inside(kind.element, f"{name}[{','.join(map(str, index))}]")
    elif isinstance(kind, Structure):
        for member in kind.members.values():
            if member.section in _STORED:
                yield from _of_member(member, f"{name}/{member.name.lower()}", False, None)


def _of_member(member: Member, name: str, is_global: bool, group: int | None, top: bool = False) -> Iterator[Candidate]:
    """Yield a variable with an address, and those inside. An array AT %I* is one variable for each element.

    top: True for a variable of a program and a global one, which may have a tag without an address.
    """
    if is_incomplete(member.address):
        for leaf, _, kind in leaves(member.type, name):
            yield Candidate(leaf, replace(member, type=kind), is_global, group)
        return
    if top:
        yield Candidate(name, member, is_global, group)
    yield from _inside(member.type, name)


def _has_incomplete(kind: Type) -> bool:
    while isinstance(kind, Array):
        kind = kind.element
    members = kind.members.values() if isinstance(kind, Structure) else ()
    return any(is_incomplete(one.address) or _has_incomplete(one.type) for one in members if one.section in _STORED)


def _by_identifier(tags: LineTags) -> dict[str, str]:
    """Return tags by their names as variables: belts_zone1_cmd_speed. Ambiguous names have ""."""
    names: dict[str, str] = {}
    for tag in (*tags.signals, *tags.commands):
        name = re.sub(r"\W", "_", tag).lower()
        names[name] = "" if name in names else tag
    return names


def _located(where: str, member: Member, addresses: Addresses) -> str:
    if member.address.startswith("%M") or is_incomplete(member.address):
        return ""
    address = address_of(Position(*member.at), member.address)
    table = _TABLES[address.area, address.size == "X"]
    if (row := addresses.get((table, address.number))) is None:
        return ""
    tag, there = row
    if there != ("bool" if address.size == "X" else address.bits):
        expected = "one bit" if there == "bool" else f"{there} bits"
        raise StructuredTextError(
            f"{where}: found {member.address} for {tag}, expected {expected} at {table} {address.number}"
        )
    return tag


def _require_one_tag(place: Callable[[str], str], bound: list[TagBinding], groups: Mapping[str, int]) -> None:
    """Raise StructuredTextError for two tags of variables that share memory. place: of a variable, by its name."""
    tags: dict[int, TagBinding] = {}
    for one in bound:
        if one.variable in groups and (other := tags.setdefault(groups[one.variable], one)).tag != one.tag:
            both = f"{one.tag} for {one.variable}, and {other.tag} for {other.variable}"
            raise StructuredTextError(
                f"{place(one.variable)}: found {both}, expected one tag, because they share memory"
            )


def _require_apart(place: Callable[[str], str], candidates: Iterable[Candidate], bound: list[TagBinding]) -> None:
    """Raise StructuredTextError for variables of %I or %Q that a PLC would overlap. Used without a Modbus map.

    place: of a variable, by its name.
    """
    tagged = {one.variable for one in bound}
    spans = []
    for one in candidates:
        address = one.member.address
        if address and not address.startswith("%M") and not is_incomplete(address):
            located = address_of(Position(*one.member.at), address)
            start = located.number * located.bits
            spans.append((located.area, start, start + located.bits, one))
    for group in overlapping(spans):
        own = {one.group if one.group is not None else one.name for one in group}
        free = [one for one in group if one.name not in tagged]
        if len(own) > 1 and free:
            other = next(one for one in group if one is not free[0])
            both = f"{free[0].name} at {free[0].member.address}, {other.name} at {other.member.address}"
            expected = "a tag for each or other addresses: bits and registers are two memories"
            raise StructuredTextError(f"{place(free[0].name)}: found {both}, expected {expected}")


def _checked(where: str, name: str, member: Member, tag: str, how: str, tags: LineTags) -> TagBinding:
    inward = member.section == "VAR_INPUT" or member.address.startswith("%I")
    outward = member.section == "VAR_OUTPUT" or member.address.startswith("%Q")
    is_alarm = tag.startswith(ALARMS) and not inward
    if is_alarm:
        kind, is_input = "bool", False
    elif tag in tags.signals:
        kind, is_input = tags.signals[tag], True
    elif tag in tags.commands:
        kind, is_input = tags.commands[tag], False
    else:
        first = tag.split("/")[0] + "/"
        alike = [one for one in (*tags.signals, *tags.commands) if one.startswith(first)]
        listed = f"one of {', '.join(alike[:_LISTED])}" if alike else f"a tag of this line, which has no {first}"
        raise StructuredTextError(f"{where}: found {tag}, expected {listed}")
    if (is_input and outward) or (inward and not is_input):
        direction = "a command" if outward else "a signal"
        raise StructuredTextError(f"{where}: found {tag}, expected {direction}")
    if member.constant:
        raise StructuredTextError(f"{where}: found a CONSTANT for {tag}, expected a variable")
    if not _suits(member.type, kind):
        wanted = {"bool": "BOOL", "number": "REAL or LREAL (TIME for seconds)"}.get(kind, "an integer type")
        raise StructuredTextError(f"{where}: found {member.type.name} for {tag}, a {kind}, expected {wanted}")
    return TagBinding(name, tag, member.type, is_input, how)


def _suits(kind: Type, tag: str) -> bool:
    """Return True if a variable can hold a tag's values.

    tag: kind of the tag, "" if not known.
    """
    base = kind.base
    if base.name not in ELEMENTARY and base.kind != "enum":
        return False
    allowed = {
        "bool": ("bool",),
        "number": ("real", "time"),
        "count": ("int", "real"),
        "enumeration": ("int", "enum", "bits"),
        "": ("bool", "int", "real", "bits", "enum", "time"),
    }
    return base.kind in allowed[tag]
