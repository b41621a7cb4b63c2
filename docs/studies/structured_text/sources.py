# SPDX-License-Identifier: Apache-2.0
"""Public repositories of PLC code, at the commits that the study compiles."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path, PurePath

import oscat
import rust
import strucpp
from units import Part, Unit, files, reached, with_needs


@dataclass(frozen=True)
class Source:
    """Repository, or a part of one, with the units that the study compiles."""

    key: str
    repository: str
    commit: str
    title: str
    """Contents, in words."""
    dialect: str
    units: Callable[[Path], Iterator[Unit]]
    checkout: str = ""
    """Name of the checkout of a second commit of a repository."""

    @property
    def folder(self) -> str:
        """Name of the checkout."""
        return self.checkout or self.repository.partition("/")[2]


_CDATA = re.compile(r"<(Declaration|ST)>\s*<!\[CDATA\[(.*?)\]\]>", re.DOTALL)
_OBJECT = re.compile(r"<(POU|Method|Property|Action|Get|Set|DUT|GVL|Itf)\b[^>]*?(?:Name=\"([^\"]*)\")?[^>]*>")
_KIND = re.compile(r"\b(FUNCTION_BLOCK|FUNCTION|PROGRAM|INTERFACE)\b", re.IGNORECASE)
_BR_PROGRAM = re.compile(r"\bPROGRAM\s+_(?:CYCLIC|INIT|EXIT)\b", re.IGNORECASE)


def _each(*suffixes: str, below: str = "") -> Callable[[Path], Iterator[Unit]]:
    """Return the units of files, each alone."""

    def units(folder: Path) -> Iterator[Unit]:
        for part in files(folder, suffixes):
            if re.search(below, part.name):
                yield Unit(part.name, (part,))

    return units


def _whole(*suffixes: str) -> Callable[[Path], Iterator[Unit]]:
    """Return the one unit of a folder: all files."""

    def units(folder: Path) -> Iterator[Unit]:
        parts = files(folder, suffixes)
        yield Unit(f"{len(parts)} files", tuple(parts))

    return units


def _oscat(folder: Path) -> Iterator[Unit]:
    """Yield the exports of OSCAT, each with those that it needs, and with the lists of global variables."""
    lists = oscat.global_lists(folder)
    yield from (unit for unit in with_needs([*files(folder, (".exp",)), lists]) if unit.name != lists.name)


def _oscat_texts(folder: Path) -> Iterator[Unit]:
    """Yield the units of OSCAT that STruC++ extracted from a binary library, with its lists of global variables."""
    return with_needs(files(folder / "tests" / "st-validation" / "oscat" / "lib", (".st",)))


def _twincat(folder: Path) -> Iterator[Unit]:
    """Yield the objects of TwinCAT, without their XML."""
    parts = [Part(part.name, _text_of(part.text)) for part in files(folder, (".tcpou", ".tcdut", ".tcgvl", ".tcio"))]
    return with_needs(parts)


def _text_of(xml: str) -> str:
    """Return declarations and bodies of an object, with the ends that the XML leaves out."""
    made, ends = [], []
    marks = sorted([*_CDATA.finditer(xml), *_OBJECT.finditer(xml)], key=lambda match: match.start())
    method = ""
    for mark in marks:
        if mark.re is _OBJECT:
            if method:
                made.append(method)
            method = {"Method": "END_METHOD", "Property": "END_PROPERTY", "Action": "END_ACTION"}.get(mark[1], "")
            if mark[1] == "Action":
                made.append(f"ACTION {mark[2]}:")
            continue
        made.append(mark[2])
        if mark[1] == "Declaration" and not ends and (kind := _KIND.search(Part("", mark[2]).code)) is not None:
            ends.append(f"END_{kind[1].upper()}")
    return "\n".join([*made, method, *ends])


def _automation_studio(folder: Path) -> Iterator[Unit]:
    """Yield the programs of B&R, each a folder with the files outside of programs that it needs."""
    parts = files(folder, (".st", ".typ", ".var", ".fun"))
    programs = sorted({PurePath(part.name).parent for part in parts if _BR_PROGRAM.search(part.text)})
    inside = {program: [part for part in parts if PurePath(part.name).parent == program] for program in programs}
    own = {part.name for several in inside.values() for part in several}
    others = [part for part in parts if part.name not in own]
    for program in programs:
        yield Unit(str(program), reached(inside[program], others))


SOURCES: tuple[Source, ...] = (
    Source("oscat", "simsum/oscat", "ccc5f45", "OSCAT, CODESYS 2.3 exports", "codesys", _oscat),
    Source(
        "oscat values",
        "simsum/oscat",
        "ccc5f45",
        "calls of OSCAT with values from closed forms",
        "codesys",
        oscat.valued,
    ),
    Source("ironplc", "ironplc/ironplc", "755a3174", "end-to-end programs with values", "codesys", rust.ironplc),
    Source(
        "ironplc files",
        "ironplc/ironplc",
        "755a3174",
        "test resources",
        "codesys",
        _each(".st", below="resources/test/"),
    ),
    Source(
        "standard functions",
        "PLC-lang/StandardFunctions",
        "3b24657",
        "tests with values that run once",
        "iec",
        rust.standard_functions,
    ),
    Source(
        "strucpp",
        "Autonomy-Logic/STruCpp",
        "fb7980f",
        "validation tests",
        "codesys",
        lambda folder: strucpp.units(folder, "others"),
    ),
    Source(
        "strucpp oscat",
        "Autonomy-Logic/STruCpp",
        "fb7980f",
        "OSCAT tests with values",
        "codesys",
        lambda folder: strucpp.units(folder, "oscat"),
    ),
    Source(
        "strucpp library",
        "Autonomy-Logic/STruCpp",
        "1015203",
        "OSCAT Basic 335, extracted from a library of CODESYS",
        "codesys",
        _oscat_texts,
        "STruCpp-1015203",
    ),
    Source("iec-checker", "jubnzv/iec-checker", "d3e5dae", "test files", "codesys", _each(".st")),
    Source(
        "conveyors", "yatharthMogra/Mini-Conveyors-Automation", "5b36263", "a conveyor cell", "codesys", _whole(".st")
    ),
    Source("scl", "panasewicz/PLC_SCL_Motion_Control_Example", "d8636f4", "SCL of TIA Portal", "tia", _each(".scl")),
    Source("machine", "jetntk-1031/NAEUL004", "037e579e", "programs of a B&R machine", "codesys", _automation_studio),
    Source(
        "station", "pennisiandrea/pickup-station", "38373bc", "programs of a B&R station", "codesys", _automation_studio
    ),
    Source("tcopen", "TcOpenGroup/TcOpen", "0d4d935a", "TwinCAT objects, XML stripped", "twincat", _twincat),
    Source("struckig", "stefanbesler/struckig", "0bc321d", "TwinCAT objects, XML stripped", "twincat", _twincat),
    Source(
        "packml demo", "FlorianSiBeckhoff/PackML_Demo", "1e8aeeb", "TwinCAT objects, XML stripped", "twincat", _twincat
    ),
    Source(
        "packml sample",
        "shawnbgit/tc3-packml-sample-01",
        "55886a4",
        "TwinCAT objects, XML stripped",
        "twincat",
        _twincat,
    ),
    Source(
        "simple packml",
        "benhar-dev/tc3-object-simple-packml",
        "a8793a1",
        "TwinCAT objects, XML stripped",
        "twincat",
        _twincat,
    ),
)
