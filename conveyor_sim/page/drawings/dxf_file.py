# SPDX-License-Identifier: Apache-2.0
"""DXF files opened for reading, with errors in one sentence."""

from __future__ import annotations

import re
from importlib.util import find_spec
from io import StringIO
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from conveyor_sim.errors import ConveyorError
from conveyor_sim.support.files import MB, read_file

if TYPE_CHECKING:
    from ezdxf.document import Drawing

MOST_BYTES: Final = 64 * MB
MOST_ENTITIES: Final = 200_000
"""Largest number of entities; ezdxf reads some 30 000 a second."""

UNITS: Final = {
    "mm": 1e-3,
    "cm": 1e-2,
    "dm": 1e-1,
    "m": 1.0,
    "in": 0.0254,
    "ft": 0.3048,
    "yd": 0.9144,
}
"""Units of drawings, in m."""
_INSUNITS: Final = {1: "in", 2: "ft", 4: "mm", 5: "cm", 6: "m", 10: "yd", 14: "dm"}
_BINARY: Final = b"AutoCAD Binary DXF\r\n\x1a\x00"
_ENTITY: Final = re.compile(rb"^[ \t]*0[ \t]*\r?\n", re.MULTILINE)


def require_ezdxf(what: str) -> None:
    """Raise ConveyorError if ezdxf is not installed. what: subject of the sentence."""
    if find_spec("ezdxf") is None:
        raise ConveyorError(f"{what} needs ezdxf, which is not installed: pip install 'conveyor_sim[cad]'")


def open_dxf(path: Path, folder: Path | None = None) -> Drawing:
    """Read a DXF file. folder: as for `read_file`. Raise ConveyorError, and FileError if the file can't be read."""
    require_ezdxf(f"{path}: a DXF file")
    return parse_dxf(path, read_file(path, MOST_BYTES, folder))


def parse_dxf(path: Path, content: bytes) -> Drawing:
    """Parse the content of a DXF file. Raise ConveyorError."""
    if content.startswith(_BINARY):
        raise ConveyorError(f"{path}: a binary DXF file, expected a DXF file in ASCII")
    if re.match(rb"AC10\d\d", content):
        raise ConveyorError(f"{path}: a DWG file, expected a DXF file: save the drawing as DXF")
    if b"SECTION" not in content[:10_000] or b"\0" in content:
        raise ConveyorError(f"{path}: not a DXF file, expected one")
    count = sum(1 for _ in _ENTITY.finditer(content))
    if count > MOST_ENTITIES:
        raise ConveyorError(f"{path}: has {count} entities, expected at most {MOST_ENTITIES}")
    return _parsed(path, content)


def _parsed(path: Path, content: bytes) -> Drawing:
    from ezdxf import filemanagement
    from ezdxf.lldxf.const import DXFError

    end = [line.strip() for line in content.rstrip().rsplit(b"\n", 1)]
    if end[-1] != b"EOF":
        raise ConveyorError(f"{path}: ends early, expected a DXF file that ends with EOF")
    try:
        # The header names the code page of texts; ezdxf reads it from the first lines of the file.
        info = filemanagement.dxf_stream_info(StringIO(content[:100_000].decode("ascii", "replace")))
        text = content.decode(info.encoding, "surrogateescape")
        return filemanagement.read(StringIO(text, newline=None))
    except (DXFError, ValueError, KeyError, IndexError, TypeError, AttributeError, RecursionError) as error:
        reason = " ".join(str(error).split()) or type(error).__name__
        raise ConveyorError(f"{path}: can't be read as DXF ({reason[:200]})") from None


def metres_per_unit(path: Path, document: Any, unit: str | None) -> tuple[str, float]:
    """Return the unit of a drawing and its size in m. unit: replaces that of the file.

    Raise ConveyorError if neither is known.
    """
    if unit is not None:
        return unit, UNITS[unit]
    code = document.header.get("$INSUNITS", 0) if document.dxfversion > "AC1009" else 0
    name = _INSUNITS.get(code)
    if name is None:
        said = "no unit" if not code else f"the unit {code}"
        raise ConveyorError(f"{path}: $INSUNITS names {said}, expected --unit with one of {', '.join(UNITS)}")
    return name, UNITS[name]
