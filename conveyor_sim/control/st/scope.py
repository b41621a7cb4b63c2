# SPDX-License-Identifier: Apache-2.0
"""Meaning of names in a unit: local variables, global ones, constants, values of enumerations."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from difflib import get_close_matches

from conveyor_sim.control.st import tree
from conveyor_sim.control.st.dialect import Dialect
from conveyor_sim.control.st.errors import Position, SourceError
from conveyor_sim.control.st.foreign import advice
from conveyor_sim.control.st.types import BlockType, Enumeration, Member, OpenArray, Type
from conveyor_sim.control.st.values import Place, Value, constant


@dataclass(frozen=True)
class Thing:
    """Meaning of a name that is no variable, in words."""

    what: str


@dataclass
class Names:
    """Names known in all units of a file, in small letters. They grow as the file is read."""

    dialect: Dialect
    warnings: dict[Position, str] = field(default_factory=dict)
    """Implicit conversions that may change a value, by position."""
    types: dict[str, Type] = field(default_factory=dict)
    """Derived types, blocks and programs."""
    functions: dict[str, BlockType] = field(default_factory=dict)
    globals: BlockType = field(default_factory=lambda: BlockType("VAR_GLOBAL", "block", python="_Globals"))
    values: dict[str, list[Enumeration]] = field(default_factory=dict)
    """Enumerations that have a value of a name."""
    programs: dict[str, Position] = field(default_factory=dict)
    """First use of the only instance of a program in another unit, by name in small letters."""
    reading: set[str] = field(default_factory=set)
    """Global variables that are being declared."""
    read: Callable[[str], None] = lambda key: None
    """Declares the global variable of a name, if it follows later in the file."""

    def global_(self, key: str) -> Member | None:
        """Return a global variable; None if there is none of that name."""
        if key not in self.globals.members:
            self.read(key)
        return self.globals.members.get(key)


class Scope:
    """Names of one unit, or those outside all units if `unit` is None."""

    def __init__(self, names: Names, unit: BlockType | None) -> None:
        self.names = names
        self.unit = unit
        self.late: Callable[[str], None] | None = None
        """Declares the constant of a name, if it follows later in the unit that is being declared."""

    def own(self, key: str) -> Member | None:
        """Return a variable of the unit by its name in small letters; None if it has none of that name."""
        if self.unit is None:
            return None
        if self.late is not None and key not in self.unit.members:
            self.late(key)
        return self.unit.members.get(key)

    def require_prefix(self, at: Position, prefix: str, name: str) -> None:
        """Raise SourceError if a name may not stand for a variable list or a library before another one."""
        if self._is_known(prefix):
            raise SourceError(at, f"found {prefix}.{name}, expected {name}, or the name of a library before it")
        self.names.dialect.require("prefixes", at, f"{prefix}.{name}", name)

    def unprefixed(self, node: tree.Expression) -> tree.Expression:
        """Return an expression without a variable list or a library at its front: x for GVL.x. Raise SourceError."""
        if isinstance(node, tree.MemberAccess) and isinstance(node.base, tree.Name):
            base, name = node.base.name, node.name
            if not self._is_known(base) and (self.names.dialect.prefixes or self.names.global_(name.lower())):
                self.require_prefix(node.at, base, name)
                return tree.Name(node.at, name, qualified=True)
        return node

    def _is_known(self, name: str) -> bool:
        key = name.lower()
        if self.own(key) is not None:
            return True
        names = self.names
        return names.global_(key) is not None or key in names.values or key in names.functions or key in names.types

    def find(self, node: tree.Name) -> Place | Thing:
        """Return the variable or other meaning of a name. Raise SourceError for an unknown name."""
        at, name = node.at, node.name
        key = name.lower()
        if self.unit is not None and not node.qualified and (member := self.own(key)):
            if member.section == "VAR_EXTERNAL":
                place = self._global(at, self.unit.statics.get(key, key), name)
                return replace(place, fixed=place.fixed or f"{name}, a CONSTANT") if member.constant else place
            return place_of(at, "self", member, self.names.dialect)
        if self.names.global_(key) is not None:
            return self._global(at, key, name)
        if (program := self._program(at, key)) is not None:
            return program
        for known, what in self._others():
            if key in known:
                return Thing(what)
        if key in self.names.reading:
            raise SourceError(at, f"found {name} in its own declaration, expected another value")
        if expected := advice(name):
            raise SourceError(at, f"found {name}, expected {expected}")
        close = get_close_matches(key, [one for known, _ in self._others(True) for one in known], 1)
        hint = f"; there is {self._written(close[0])}" if close else ""
        raise SourceError(at, f"found {name}, which is not declared, expected a variable{hint}")

    def _program(self, at: Position, key: str) -> Place | None:
        """Return the only instance of a program; None if the dialect has no access to it."""
        kind = self.names.types.get(key)
        if not isinstance(kind, BlockType) or not kind.is_program or not self.names.dialect.program_variables:
            return None
        self.names.programs.setdefault(key, at)
        return Place(at, kind, kind.instance, fixed=f"{kind.name}, a program", root=f"({kind.instance}, '')")

    def value(self, node: tree.Name) -> Value:
        """Return the value of a name. Raise SourceError."""
        at, name = node.at, node.name
        key = name.lower()
        own = not node.qualified and self.own(key) is not None
        if not own and (kinds := self.names.values.get(key)) and self.names.global_(key) is None:
            if len(kinds) > 1:
                listed = " or ".join(f"{kind.name}#{name}" for kind in kinds)
                raise SourceError(at, f"found {name}, which several types have, expected {listed}")
            return constant(at, kinds[0], kinds[0].value(name))
        named = self.find(node)
        if isinstance(named, Thing):
            raise SourceError(at, f"found {name}, {named.what}, expected a value")
        return named

    def has_variable(self, name: str) -> bool:
        """Return True if a name is that of a variable here."""
        key = name.lower()
        return (self.unit is not None and key in self.unit.members) or self.names.global_(key) is not None

    def enumeration(self, name: str, qualified: bool = False) -> Enumeration | None:
        """Return the enumeration of a name, unless a variable hides it.

        qualified: True after the name of a library.
        """
        kind = self.names.types.get(name.lower())
        hidden = not qualified and self.unit is not None and name.lower() in self.unit.members
        return kind if isinstance(kind, Enumeration) and not hidden else None

    def _global(self, at: Position, key: str, name: str) -> Place:
        member = self.names.global_(key)
        if member is None:
            raise SourceError(at, f"found {name}, expected a variable of VAR_GLOBAL of that name")
        return place_of(at, "_g", member, self.names.dialect)

    def _others(self, everything: bool = False) -> list[tuple[Mapping[str, object], str]]:
        own = self.unit.members if self.unit is not None else {}
        variables: list[tuple[Mapping[str, object], str]] = [(own, ""), (self.names.globals.members, "")]
        return [
            *(variables if everything else []),
            (self.names.values, "a value of an enumeration"),
            (self.names.functions, "a function"),
            (self.names.types, "a type"),
        ]

    def _written(self, key: str) -> str:
        own = self.unit.members if self.unit is not None else {}
        member = own.get(key) or self.names.globals.members.get(key)
        return member.name if member else key


def place_of(at: Position, owner: str, member: Member, dialect: Dialect) -> Place:
    """Return a variable of an object, in the unit that it belongs to."""
    slot = member.slot
    if member.section == "VAR_IN_OUT" or isinstance(member.type, OpenArray):
        reference = f"{owner}.{slot}"
        return Place(
            at,
            member.type,
            f"{reference}.get()",
            write=lambda new: f"{reference}.set({new})",
            reference=reference,
            fixed="" if member.section == "VAR_IN_OUT" else f"{member.name}, an input",
            root=f"{reference}.root",
        )
    code = f"{owner}.{slot}"
    fixed, lacks = f"{member.name}, a CONSTANT" if member.constant else "", ""
    if member.section == "VAR_INPUT" and (member.read_only or not dialect.written_inputs):
        fixed, lacks = f"{member.name}, an input", "" if member.read_only else "written_inputs"
    elif member.address.startswith("%I"):
        fixed = f"{member.name}, an input at {member.address}"
    known = member.value
    return Place(
        at,
        member.type,
        code if known is None else constant(at, member.type, known).code,
        known,
        write=lambda new: f"{code} = {new}",
        reference=f"_Attribute({owner}, {slot!r})",
        fixed=fixed,
        lacks=lacks,
        root=f"({owner}, {slot!r})",
    )
