# SPDX-License-Identifier: Apache-2.0
"""Declarations: types, and the variables of units with their initial values."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

from conveyor_sim.control.st import tree
from conveyor_sim.control.st.actions import require_apart
from conveyor_sim.control.st.blocks import CODESYS, STANDARD
from conveyor_sim.control.st.dates import in_dialect
from conveyor_sim.control.st.dialect import Dialect
from conveyor_sim.control.st.errors import Position, SourceError
from conveyor_sim.control.st.expressions import Expressions
from conveyor_sim.control.st.foreign import advice
from conveyor_sim.control.st.initial_values import initial_value
from conveyor_sim.control.st.located import Located, address_of, incomplete, is_incomplete, require_fit
from conveyor_sim.control.st.scope import Names, Scope
from conveyor_sim.control.st.sections import INCOMPLETE, LOCATED, OUTSIDE, meaning
from conveyor_sim.control.st.tia_blocks import BLOCKS
from conveyor_sim.control.st.types import (
    ELEMENTARY,
    MOST_CHARACTERS,
    Array,
    BlockType,
    Enumeration,
    Member,
    OpenArray,
    String,
    Structure,
    Subrange,
    Type,
)

if TYPE_CHECKING:
    from collections.abc import Iterable

MOST_ELEMENTS = 1_000_000
"""Largest number of elementary variables in an array, a structure or a block."""

MOST_TEXT = 16_000_000
"""Sum of the declared lengths of all texts in a file, in characters: at most 64 MB of memory."""

MOST_LEVELS = 100
"""Largest depth of nested structures and blocks."""

MOST_CONSTANTS = 50
"""Largest chain of global variables whose initial values use each other."""


class Declarations:
    """Declarations of one file. Names are resolved at their first use, so the order in the file is free."""

    def __init__(self, source: tree.SourceFile, calls: Any, dialect: Dialect) -> None:
        """Register all names of a file.

        calls: as `Expressions` takes it.
        """
        blocks = {**STANDARD, **(CODESYS if dialect.standard_names else BLOCKS if dialect.tia_sources else {})}
        self.names = Names(dialect, types={name.lower(): block for name, block in blocks.items()})
        self.structures: list[Structure] = []
        """Declared structures, each after those it contains."""
        self.located: list[Located] = []
        """Variables with addresses."""
        self._calls = calls
        self._pending: dict[str, tree.TypeDeclaration | tree.ProgramUnit] = {}
        self._functions: dict[str, tree.ProgramUnit] = {}
        self._open: list[str] = []
        self._levels: dict[str, int] = {}
        everything: list[tree.TypeDeclaration | tree.ProgramUnit] = [*source.types, *source.units]
        for declared in everything:
            where: dict[str, Any] = self._pending
            if isinstance(declared, tree.ProgramUnit) and declared.kind == "FUNCTION":
                where = self._functions
            key = declared.name.lower()
            taken = key in self._pending or key in self._functions or key in self.names.types
            if taken or declared.name.upper() in ELEMENTARY:
                raise SourceError(declared.at, f"found {declared.name} again, expected a name that is not taken")
            where[key] = declared
        self._globals = self._by_name(
            (*source.globals, *(one for config in source.configurations for one in config.globals))
        )
        self.names.read = self._read
        self._enumerations = [one for one in source.types if isinstance(one.type, tree.EnumType)]

    def resolve(self) -> None:
        """Resolve enumerations and global variables, whose values may call functions. Raise SourceError."""
        for one in self._enumerations:
            self.named(one.at, one.name)
        order = list(self._globals)
        for key in order:
            self._read(key)
        members = self.names.globals.members
        for key in order:
            members[key] = members.pop(key)

    def _by_name(self, sections: Iterable[tree.VariableSection]) -> dict[str, tree.VariableSection]:
        """Return global variables by name, each in a separate section."""
        single: dict[str, tree.VariableSection] = {}
        for section in sections:
            for declared in section.declarations:
                if declared.name.lower() in single:
                    raise SourceError(declared.at, f"found {declared.name} again, expected another name")
                single[declared.name.lower()] = replace(section, declarations=(declared,))
        return single

    def _read(self, key: str) -> None:
        """Declare a global variable, if there is one of that name and it is not declared yet."""
        if (section := self._globals.pop(key, None)) is not None:
            if len(self.names.reading) == MOST_CONSTANTS:
                at, chain = section.declarations[0].at, f"found {MOST_CONSTANTS} initial values that use each other"
                raise SourceError(at, f"{chain}, expected a shorter chain")
            self.names.reading.add(key)
            self._members(self.names.globals, (section,), OUTSIDE)
            self.names.reading.remove(key)

    def scope(self, unit: BlockType | None) -> Scope:
        """Return the names of a unit."""
        return Scope(self.names, unit)

    def named(self, at: Position, name: str) -> Type:
        """Return the type of a name. Raise SourceError."""
        if known := ELEMENTARY.get(name.upper()):
            return in_dialect(known, self.names.dialect)
        if known := self.names.types.get(name.lower()):
            return known
        declared = self._pending.get(name.lower())
        if declared is None:
            raise SourceError(at, f"found {name}, expected {advice(name) or 'a type'}")
        key = name.lower()
        if key in self._open:
            raise SourceError(at, f"found {name} inside of itself, expected another type")
        self._open.append(key)
        try:
            kind = self._unit(declared) if isinstance(declared, tree.ProgramUnit) else self._declared(declared)
        finally:
            self._open.pop()
        self.names.types[key] = kind
        return kind

    def function(self, name: str) -> BlockType | None:
        """Return a function of the file; None if it has none of that name."""
        key = name.lower()
        if key in self._functions and key not in self.names.functions:
            if key in self._open:
                raise SourceError(self._functions[key].at, f"found a call of {name} in its own declaration")
            self._open.append(key)
            self.names.functions[key] = self._unit(self._functions[key])
            self._open.pop()
        return self.names.functions.get(key)

    def type(self, spec: tree.TypeSpec, name: str = "") -> Type:
        """Return the type of a specification.

        name: of the declared type, if there is one.
        """
        outside = Expressions(self.scope(None), self._calls)
        return self._type(spec, outside, name)

    def _type(self, spec: tree.TypeSpec, known: Expressions, name: str = "") -> Type:
        if isinstance(spec, tree.NamedType):
            if spec.prefix:
                known.scope.require_prefix(spec.at, spec.prefix, spec.name)
            kind = self.named(spec.at, spec.name)
            if spec.length is None:
                return kind
            length = known.known(spec.length, "the length of a text")
            if not isinstance(kind, String) or not 1 <= length <= MOST_CHARACTERS:
                wrong = f"found {spec.name}[{length}]"
                raise SourceError(spec.at, f"{wrong}, expected STRING or WSTRING of 1 to {MOST_CHARACTERS}")
            start = repr(eval(kind.start)[:length]) if kind.start else ""
            return replace(kind, name=f"{kind.name}[{length}]", high=length, start=start)
        if isinstance(spec, tree.SubrangeType):
            return self._subrange(spec, known)
        if isinstance(spec, tree.ArrayType):
            return self._array(spec, known)
        if isinstance(spec, tree.EnumType):
            return self._enumeration(spec, known, name)
        assert isinstance(spec, tree.StructureType)
        written = name or f"structure_{spec.at.line}_{spec.at.column}"
        kind = Structure(written, "structure", python=f"_S_{written.lower()}")
        for field in spec.fields:
            self._add(kind, field, "VAR", (), known)
        self._bound(kind, spec.at)
        self.structures.append(kind)
        return kind

    def _subrange(self, spec: tree.SubrangeType, known: Expressions) -> Type:
        of = self.named(spec.at, spec.name)
        if isinstance(of, String):
            raise SourceError(spec.at, f"found {spec.name}(..), expected {spec.name}[length]")
        low, high = known.known(spec.low, "a subrange"), known.known(spec.high, "a subrange")
        if of.kind != "int" or isinstance(of, Subrange) or not of.low <= low <= high <= of.high:
            raise SourceError(spec.at, f"found {spec.name} ({low}..{high}), expected a rising range of an integer type")
        return Subrange(f"{of.name} ({low}..{high})", "int", low, high, of=of)

    def _array(self, spec: tree.ArrayType, known: Expressions) -> Type:
        ranges, elements = [], 1
        for low_node, high_node in spec.ranges:
            low, high = known.known(low_node, "an array's bound"), known.known(high_node, "an array's bound")
            if low > high:
                raise SourceError(spec.at, f"found the range {low}..{high}, expected a rising one")
            elements *= high - low + 1
            require_small(elements, 0, spec.at)
            ranges.append((low, high))
        element = self._type(spec.element, known)
        _require_closed(element, spec.element.at, "an ARRAY")
        if spec.dimensions:
            shown = ", ".join("*" * spec.dimensions)
            return OpenArray(f"ARRAY [{shown}] OF {element.name}", "array", element=element, dimensions=spec.dimensions)
        require_small(elements * element.size, elements * element.characters, spec.at)
        shown = ", ".join(f"{low}..{high}" for low, high in ranges)
        return Array(f"ARRAY [{shown}] OF {element.name}", "array", ranges=tuple(ranges), element=element)

    def _bound(self, kind: Structure, at: Position) -> None:
        """Check the size of a type, and store its number of levels, once its members are known."""
        own = [one.type for one in kind.members.values() if one.section not in ("VAR_IN_OUT", "VAR_EXTERNAL")]
        require_small(kind.size, kind.characters, at)
        self._levels[kind.python] = levels = 1 + max(map(self._levels_of, own), default=0)
        if levels > MOST_LEVELS:
            raise SourceError(at, f"found {levels} types nested in each other, expected at most {MOST_LEVELS}")

    def _levels_of(self, kind: Type) -> int:
        """Return the depth of nested structures and blocks."""
        while isinstance(kind, Array):
            kind = kind.element
        return self._levels.get(kind.python, 1) if isinstance(kind, Structure) else 0

    def _enumeration(self, spec: tree.EnumType, known: Expressions, name: str) -> Type:
        base = self.named(spec.at, spec.base) if spec.base else ELEMENTARY["INT"]
        if base.kind not in ("int", "bits"):
            raise SourceError(spec.at, f"found {base.name}, expected an integer type or a bit string")
        values: list[tuple[str, int]] = []
        taken: set[str] = set()
        for at, word, node in spec.values:
            value = known.known(node, word) if node is not None else values[-1][1] + 1 if values else 0
            if word.lower() in taken:
                raise SourceError(at, f"found {word} again, expected each value once")
            if not base.low <= value <= base.high:
                raise SourceError(at, f"found {value} for {word}, expected {base.name}, {base.low} to {base.high}")
            values.append((word, value))
            taken.add(word.lower())
        written = name or f"enumeration_{spec.at.line}_{spec.at.column}"
        kind = Enumeration(written, "enum", base.low, base.high, values=tuple(values))
        for word, _ in values:
            self.names.values.setdefault(word.lower(), []).append(kind)
        return kind

    def _declared(self, declared: tree.TypeDeclaration) -> Type:
        known = Expressions(self.scope(None), self._calls)
        kind = self._type(declared.type, known, declared.name)
        _require_closed(kind, declared.type.at, "a TYPE")
        if declared.initial is None:
            return kind
        return replace(kind, start=initial_value(declared.initial, kind, known))

    def _unit(self, unit: tree.ProgramUnit) -> BlockType:
        prefix = {"FUNCTION": "_F_", "FUNCTION_BLOCK": "_B_", "PROGRAM": "_P_"}[unit.kind]
        result = self.type(unit.result) if unit.result is not None else None
        if unit.result is not None and result is not None:
            _require_closed(result, unit.result.at, "a result")
        kind = BlockType(
            unit.name,
            "block",
            python=prefix + unit.name.lower(),
            function=unit.kind == "FUNCTION",
            result=result,
            actions=frozenset(one.name.lower() for one in unit.actions),
        )
        self._members(kind, unit.sections, unit.kind)
        require_apart(unit, kind)
        if result is not None:
            name = unit.name.lower()
            if name in kind.members:
                raise SourceError(unit.at, f"found a variable {unit.name} in the function of that name")
            kind.members[name] = Member(unit.name, result, result.initial, "RESULT")
        for member in kind.members.values():
            passing = member.section == "VAR_IN_OUT" or member.name.lower() in kind.statics
            if kind.function and isinstance(member.type, BlockType) and not passing:
                at = Position(*member.at)
                raise SourceError(at, f"found {member.name}, a block, in a function, expected it in a block or program")
        self._bound(kind, unit.at)
        return kind

    def _members(self, kind: BlockType, sections: Iterable[tree.VariableSection], unit: str) -> None:
        """Add the variables of a unit.

        unit: its kind, as in `sections.py`.
        """
        known = Expressions(self.scope(None if kind is self.names.globals else kind), self._calls)
        open_: dict[int, tuple[tree.VariableDeclaration, tree.VariableSection, tuple[str, ...]]] = {}
        constants: dict[str, int] = {}
        for section in sections:
            static = section.section == "VAR_STAT"
            if static:
                self.names.dialect.require("static_variables", section.at, "VAR_STAT", "another section")
            qualifiers = meaning(replace(section, section="VAR") if static else section, unit)
            for declared in section.declarations:
                if section.section == "VAR" and "CONSTANT" in qualifiers:
                    constants.setdefault(declared.name.lower(), len(open_))
                open_[len(open_)] = declared, section, qualifiers
        order = list(open_.values())

        def declare(number: int) -> None:
            if (one := open_.pop(number, None)) is not None:
                declared, section, qualifiers = one
                add = self._add_static if section.section == "VAR_STAT" else self._add
                add(kind, declared, section.section, qualifiers, known)

        known.scope.late = lambda key: declare(constants.get(key, -1))
        for number in range(len(order)):
            declare(number)
        known.scope.late = None
        if constants:
            for declared, *_ in order:
                kind.members[declared.name.lower()] = kind.members.pop(declared.name.lower())

    def _add_static(
        self,
        kind: BlockType,
        declared: tree.VariableDeclaration,
        section: str,
        qualifiers: tuple[str, ...],
        known: Expressions,
    ) -> None:
        """Add a variable of VAR_STAT as a global one with the name of the unit before its name."""
        key, shared = declared.name.lower(), self.names.globals
        if key in kind.members:
            raise SourceError(declared.at, f"found {declared.name} again, expected another name")
        name = f"{kind.name}.{declared.name}"
        python = f"s_{len(shared.members)}"
        self._add(shared, replace(declared, name=name), "VAR_GLOBAL", qualifiers, known, python)
        kind.statics[key] = name.lower()
        member = shared.members[name.lower()]
        kind.members[key] = replace(member, name=declared.name, section="VAR_EXTERNAL", address="", tag="")

    def _add(
        self,
        kind: Structure,
        declared: tree.VariableDeclaration,
        section: str,
        qualifiers: tuple[str, ...],
        known: Expressions,
        python: str = "",
    ) -> None:
        key = declared.name.lower()
        if key in kind.members:
            raise SourceError(declared.at, f"found {declared.name} again, expected another name")
        declared = self._with_arguments(declared)
        unit = OUTSIDE if kind is self.names.globals else "PROGRAM" if kind.python.startswith("_P_") else ""
        if is_incomplete(declared.address) and not declared.tag:
            own = unit or ("FUNCTION_BLOCK" if kind.python.startswith("_B_") else "")
            if section not in INCOMPLETE.get(own, ()):
                where = "VAR, VAR_INPUT, VAR_OUTPUT of a PROGRAM or FUNCTION_BLOCK, or VAR_GLOBAL"
                raise SourceError(declared.at, f"found {declared.address} in {section}, expected it in {where}")
        elif (declared.tag or declared.address) and section not in LOCATED.get(unit, ()):
            written = declared.address or f"{{tag: {declared.tag}}}"
            where = f"{', '.join(LOCATED[unit])} of a PROGRAM" if unit else "a PROGRAM or VAR_GLOBAL only"
            raise SourceError(declared.at, f"found {written}, expected it in {where}")
        type_ = self._type(declared.type, known)
        if section != "VAR_IN_OUT" and not (section == "VAR_INPUT" and isinstance(kind, BlockType) and kind.function):
            _require_closed(type_, declared.type.at, section)
        if isinstance(type_, BlockType) and (type_.function or type_.python.startswith("_P_")):
            raise SourceError(declared.at, f"found {type_.name}, expected a type or a function block")
        constant = "CONSTANT" in qualifiers and section != "VAR_INPUT"  # of an input the caller's value counts
        code, value = type_.initial, None
        if declared.initial is not None:
            if section in ("VAR_IN_OUT", "VAR_EXTERNAL"):
                raise SourceError(declared.initial.at, f"found an initial value in {section}, expected none")
            code = initial_value(declared.initial, type_, known)
            if constant and type_.kind not in ("array", "structure", "block"):
                value = eval(code)
        elif constant and section != "VAR_EXTERNAL":
            raise SourceError(declared.at, f"found CONSTANT {declared.name} without a value, expected := and one")
        if section == "VAR_EXTERNAL":
            shared = self.names.globals.members.get(key)
            if shared is None or shared.type != type_:
                there = "none of that name" if shared is None else shared.type.name
                raise SourceError(declared.at, f"found {declared.name} : {type_.name}, {there} in VAR_GLOBAL")
        kind.members[key] = member = Member(
            declared.name,
            type_,
            code,
            section,
            constant,
            "RETAIN" in qualifiers,
            "NON_RETAIN" in qualifiers,
            value,
            declared.address,
            declared.tag,
            "CONSTANT" in qualifiers and section == "VAR_INPUT",
            python,
            declared.at,
        )
        if is_incomplete(declared.address):
            require_fit(declared.at, declared.name, type_, incomplete(declared.address), constant)
        elif declared.address:
            address = address_of(declared.at, declared.address, self.names.dialect.byte_addresses)
            require_fit(declared.at, declared.name, type_, address, constant)
            initial = declared.initial is not None or bool(type_.start)
            self.located.append(Located(kind.python, member, address, initial))

    def _with_arguments(self, declared: tree.VariableDeclaration) -> tree.VariableDeclaration:
        """Return a declaration with the arguments of its block or structure, TON (PT := T#1s), as initial values."""
        spec = declared.type
        if not isinstance(spec, tree.EnumType) or not spec.prefixed:
            return declared
        kind = self.named(spec.at, spec.base)
        if not isinstance(kind, Structure):
            return declared
        expected = f"{declared.name} : {spec.base} := ( and the values"
        self.names.dialect.require("instance_arguments", spec.at, f"arguments of {spec.base}", expected)
        if declared.initial is not None:
            raise SourceError(declared.initial.at, f"found a second initial value of {declared.name}, expected one")
        fields = []
        for at, name, value in spec.values:
            if value is None:
                raise SourceError(at, f"found {name}, expected {name} := and a value")
            fields.append((at, name, value))
        return replace(
            declared,
            type=tree.NamedType(spec.at, spec.base),
            initial=tree.InitialStructure(spec.at, tuple(fields)),
        )


def _require_closed(kind: Type, at: Position, where: str) -> None:
    """Raise SourceError for ARRAY [*] in a place where no call gives it bounds."""
    if isinstance(kind, OpenArray):
        expected = "expected it in VAR_IN_OUT, or in VAR_INPUT of a FUNCTION"
        raise SourceError(at, f"found {kind.name} in {where}, {expected}")


def require_small(elements: int, characters: int, at: Position, of: str = "") -> None:
    """Raise SourceError for more elements or more text than MOST_ELEMENTS and MOST_TEXT. of: owner, for the message."""
    if elements > MOST_ELEMENTS:
        raise SourceError(at, f"found {elements} elements{of}, expected at most {MOST_ELEMENTS}")
    if characters > MOST_TEXT:
        raise SourceError(at, f"found texts of {characters} characters in all{of}, expected at most {MOST_TEXT}")
