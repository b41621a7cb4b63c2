# SPDX-License-Identifier: Apache-2.0
"""Compiler from a program's text to Python. The code is compiled once and used by all instances."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import CodeType

from conveyor_sim.control.st import tree
from conveyor_sim.control.st.calls import PASSED, CallCompiler
from conveyor_sim.control.st.declarations import Declarations, require_small
from conveyor_sim.control.st.dialect import IEC, Dialect, dialect_of
from conveyor_sim.control.st.errors import Position, SourceError, StructuredTextError
from conveyor_sim.control.st.expressions import Expressions
from conveyor_sim.control.st.located import NOTHING_SHARED, Layout, laid_out
from conveyor_sim.control.st.program_files import Paths, ProgramFiles, Text, digest, joined, read_texts
from conveyor_sim.control.st.statements import CodeLines, Statements
from conveyor_sim.control.st.types import TIME, BlockType, Member, Structure, Type
from conveyor_sim.control.st.work import statements

LOWEST = 2**31
"""Priority of a program without a task: after all others."""

MOST_UNITS = 5000
"""Largest number of programs, functions and blocks in a file."""


@dataclass(frozen=True)
class Scheduled:
    """Instance of a program, with its task."""

    name: str
    type: BlockType
    at: Position
    """Position of the TASK; without one, that of the program in the CONFIGURATION or of its declaration."""
    task: str = ""
    """Task; "": the program runs in every scan."""
    interval: int = 0
    """Interval, ns; 0: every scan."""
    priority: int = LOWEST
    """Priority; 0 comes first."""


@dataclass(frozen=True)
class Compiled:
    """Compiled program."""

    files: ProgramFiles
    code: CodeType
    source: str
    """Python code."""
    positions: tuple[Position | None, ...]
    """Position in the program of line n + 1 of the Python code."""
    programs: tuple[Scheduled, ...]
    """Programs in the order in which they run."""
    globals: BlockType
    digest: str
    """SHA-256 of the text and its dialect. A snapshot fits the same program only."""
    trace: bool
    """True if assignments record the last write of a variable."""
    shared: Mapping[tuple[str, str], int]
    """Number of the memory that a located variable shares with others, by Python class and slot."""
    warnings: tuple[str, ...] = ()
    """Sentences about implicit conversions that may change a value, in the order of the text."""

    @property
    def file(self) -> str:
        """First file of the program."""
        return self.files.names[0]


def compile_files(paths: Paths, trace: bool = False, dialect: str = "") -> Compiled:
    """Compile the program in files or folders. Raise StructuredTextError if one can't be read or is wrong.

    dialect: name in `DIALECTS`; "" for the default of the files' types.
    """
    texts = read_texts(paths)
    return compile_texts(texts, trace, dialect_of([one.file for one in texts], dialect))


def compile_text(text: str, file: str = "program.st", trace: bool = False, dialect: Dialect = IEC) -> Compiled:
    """Compile a program in one text. Raise StructuredTextError if it is wrong.

    trace: True to record the last write of each variable.
    """
    return compile_texts([Text(file, text)], trace, dialect)


def compile_texts(texts: Sequence[Text], trace: bool, dialect: Dialect) -> Compiled:
    """Compile a program in texts. Raise StructuredTextError if it is wrong."""
    file = texts[0].file
    try:
        source, files = joined(texts, dialect)
        try:
            return _compile(source, files, digest(texts, dialect), trace, dialect)
        except SourceError as error:
            raise files.error(error) from None
    except (RecursionError, MemoryError, SyntaxError):  # limits of Python's compiler
        raise StructuredTextError(f"{file}:1:1: found a program nested too deeply, expected a flatter one") from None


def _compile(source: tree.SourceFile, files: ProgramFiles, fingerprint: str, trace: bool, dialect: Dialect) -> Compiled:
    if len(source.units) > MOST_UNITS:
        at, count = source.units[MOST_UNITS].at, len(source.units)
        raise SourceError(at, f"found {count} programs, functions and blocks, expected at most {MOST_UNITS}")
    calls = CallCompiler(trace)
    declared = calls.declarations = Declarations(source, calls, dialect)
    declared.resolve()
    lines = CodeLines()
    for one in source.types:
        declared.named(one.at, one.name)
    units = [(unit, _type_of(unit, declared)) for unit in source.units]
    _require_few(declared, units)
    layout = _layout(source, declared)
    if layout.size:
        lines.add(f"_memory = _Memory({layout.size})")
    for unit, kind in units:
        _unit(unit, kind, declared, lines, calls, layout)
    calls.require_finite()
    for structure in declared.structures:
        _class(lines, structure.python, "_Record", list(structure.members.values()))
    _class(lines, "_Globals", "", list(declared.names.globals.members.values()), layout)
    lines.add("_g = _Globals()")
    programs = {unit.name.lower(): kind for unit, kind in units if unit.kind == "PROGRAM"}
    scheduled = _schedule(source, programs, declared, calls)
    for name, at in declared.names.programs.items():
        kind = programs[name]
        if (count := sum(one.type is kind for one in scheduled)) != 1:
            raise SourceError(at, f"found {kind.name}, which has {count} instances, expected a program with one")
        lines.add(f"{kind.instance} = {kind.python}()")
    python = "\n".join(lines.lines) + "\n"
    for key in (program.name.lower() for program in scheduled):
        shared = declared.names.globals.members.get(key)
        if shared is not None and isinstance(shared.type, Structure):
            conflict = f"found {shared.name}, which has the name of a program"
            raise SourceError(Position(*shared.at), f"{conflict}, expected another: {key}/x would be two variables")
    return Compiled(
        files,
        compile(python, f"<{files.names[0]}>", "exec"),
        python,
        tuple(lines.positions),
        tuple(sorted(scheduled, key=lambda one: one.priority)),
        declared.names.globals,
        fingerprint,
        trace,
        {place: one.group for place, one in layout.places.items()},
        tuple(f"{files.place(at)}: {words}" for at, words in sorted(declared.names.warnings.items())),
    )


def _layout(source: tree.SourceFile, declared: Declarations) -> Layout:
    """Return the memory that located variables share."""
    programs = [f"_P_{one.type.lower()}" for configured in source.configurations for one in configured.instances]
    return laid_out(declared.located, Counter(programs))


def _require_few(declared: Declarations, units: list[tuple[tree.ProgramUnit, BlockType]]) -> None:
    """Raise SourceError for more elements or text than a file may declare in all."""
    shared: list[Type] = [declared.names.globals, *declared.structures]
    elements, characters = sum(one.size for one in shared), sum(one.characters for one in shared)
    for unit, kind in units:
        elements, characters = elements + kind.size, characters + kind.characters
        require_small(elements, characters, unit.at, f" with those of {unit.name}")


def _type_of(unit: tree.ProgramUnit, declared: Declarations) -> BlockType:
    kind = declared.function(unit.name) if unit.kind == "FUNCTION" else declared.named(unit.at, unit.name)
    assert isinstance(kind, BlockType)
    return kind


def _unit(
    unit: tree.ProgramUnit,
    kind: BlockType,
    declared: Declarations,
    lines: CodeLines,
    calls: CallCompiler,
    layout: Layout,
) -> None:
    """Write the class of a unit. Its method `run` is the body; those of actions are named a_NAME."""
    members = [one for one in kind.members.values() if one.section != "VAR_EXTERNAL"]
    _class(lines, kind.python, "", members, layout)
    with lines.inner():
        lines.add("def run(self, now=0):", unit.at)
        made = kind.work if kind.function else sum(one.type.work for one in kind.of("VAR_TEMP"))
        with lines.inner():
            for member in kind.of("VAR_TEMP"):
                lines.add(f"self.{member.slot} = {member.initial}")
        expressions = Expressions(declared.scope(kind), calls)
        Statements(lines, expressions, calls).block(unit.body, unit.at, statements(made))
        for action in unit.actions:
            expressions = Expressions(declared.scope(kind), calls)
            expressions.action = action.name.lower()
            lines.add(f"def a_{expressions.action}(self, now):", action.at)
            Statements(lines, expressions, calls).block(action.body, action.at)
    if kind.function:
        _function(kind, lines)


def _function(kind: BlockType, lines: CodeLines) -> None:
    """Write the Python function of a call: a new frame, arguments in, the body, the result out."""
    passed = kind.of(*PASSED)
    lines.add(f"def _f_{kind.name.lower()}({', '.join(one.slot for one in passed)}):")
    with lines.inner():
        lines.add(f"self = {kind.python}()")
        for one in passed:
            if one.section != "VAR_OUTPUT":
                lines.add(f"self.{one.slot} = {one.slot}")
        lines.add("self.run()")
        for one in passed:
            if one.section == "VAR_OUTPUT":
                lines.add(f"if {one.slot} is not None: {one.slot}.set(self.{one.slot})")
        if kind.result is not None:
            lines.add(f"return self.v_{kind.name.lower()}")


def _class(lines: CodeLines, name: str, base: str, members: list[Member], layout: Layout = NOTHING_SHARED) -> None:
    """Write a class with a slot for each variable, and a descriptor for each one that shares memory."""
    places = {one.slot: place for one in members if (place := layout.places.get((name, one.slot))) is not None}
    memory = "located" if name == "_Globals" and layout.size else ""
    slots = [one.slot for one in members if one.slot not in places] + [memory] * bool(memory)
    lines.add(f"class {name}({base}):")
    with lines.inner():
        lines.add(f"__slots__ = ({''.join(f'{slot!r}, ' for slot in slots)})")
        for slot, place in places.items():
            lines.add(f"{slot} = {place.code}")
        lines.add("def __init__(self):")
        with lines.inner():
            if memory:
                lines.add(f"self.{memory} = _memory")
            for one in members:
                if one.slot not in places or places[one.slot].sets:
                    lines.add(f"self.{one.slot} = {'None' if one.section == 'VAR_IN_OUT' else one.initial}")
            lines.add("pass")


def _schedule(
    source: tree.SourceFile, programs: dict[str, BlockType], declared: Declarations, calls: CallCompiler
) -> list[Scheduled]:
    if len(source.configurations) > 1:
        raise SourceError(source.configurations[1].at, "found a second CONFIGURATION, expected one")
    if not source.configurations:
        if not programs:
            raise SourceError(Position(1, 1), "found no PROGRAM, expected one or more")
        places = {unit.name.lower(): unit.at for unit in source.units if unit.kind == "PROGRAM"}
        return [Scheduled(kind.name, kind, places[key]) for key, kind in programs.items()]
    configuration = source.configurations[0]
    known = Expressions(declared.scope(None), calls)
    tasks: dict[tuple[str, str], tuple[int, int, Position]] = {}
    for task in configuration.tasks:
        if (key := (task.resource, task.name.lower())) in tasks:
            raise SourceError(task.at, f"found {task.name} again, expected another name")
        tasks[key] = _task(task, known)
    scheduled: dict[str, Scheduled] = {}
    elements = characters = 0
    for one in configuration.instances:
        if one.type.lower() not in programs:
            raise SourceError(one.at, f"found {one.type}, expected a PROGRAM: {', '.join(programs) or 'there is none'}")
        own = tasks.get((one.resource, one.task.lower())) or tasks.get(("", one.task.lower()))
        if one.task and own is None:
            names = ", ".join(name for resource, name in tasks if resource in (one.resource, ""))
            raise SourceError(one.at, f"found {one.task}, expected a TASK: {names or 'there is none'}")
        if one.name.lower() in scheduled:
            raise SourceError(one.at, f"found {one.name} again, expected each program once")
        interval, priority, at = own or (0, LOWEST, one.at)
        kind = programs[one.type.lower()]
        elements, characters = elements + kind.size, characters + kind.characters
        require_small(elements, characters, one.at, " in programs")
        scheduled[one.name.lower()] = Scheduled(one.name, kind, at, one.task, interval, priority)
    if not scheduled:
        raise SourceError(configuration.at, "found no program in the CONFIGURATION, expected PROGRAM name : type")
    return list(scheduled.values())


def _task(task: tree.Task, known: Expressions) -> tuple[int, int, Position]:
    """Return interval (ns), priority and position."""
    interval, priority = 0, LOWEST - 1
    for at, name, node in task.fields:
        word = name.upper()
        if word == "INTERVAL":
            interval = known.known(node, "INTERVAL", TIME.kind)
        elif word == "PRIORITY":
            priority = known.known(node, "PRIORITY")
        else:
            raise SourceError(at, f"found {name}, expected INTERVAL or PRIORITY")
    if interval <= 0 or not 0 <= priority < LOWEST:
        raise SourceError(task.at, f"found the TASK {task.name}, expected INTERVAL more than 0 and PRIORITY 0 or more")
    return interval, priority, task.at
