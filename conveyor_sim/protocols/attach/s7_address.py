# SPDX-License-Identifier: Apache-2.0
"""Places in a Siemens PLC: "DB1.DBD4 REAL", "M0.3 BOOL", "QW2 INT"."""

from __future__ import annotations

import re
from typing import NamedTuple

from conveyor_sim.protocols.attach.elementary_types import BOOL, CODES, size

_FORM = re.compile(
    r"%?(?:DB(?P<db>\d{1,5})\.DB(?P<width>[XBWD])|(?P<area>[MIEQA])(?P<letter>[XBWD]?))"
    r"(?P<byte>\d{1,5})(?:\.(?P<bit>[0-7]))?(?:\s*:\s*|\s+)(?P<type>[A-Z]+)",
    re.IGNORECASE,
)
_AREAS = {"M": "MK", "I": "PE", "E": "PE", "Q": "PA", "A": "PA"}
_WIDTHS = {"B": (1,), "W": (2,), "D": (4, 8)}
_MOST_BYTE = 65535
EXPECTED = 'such as "DB1.DBX0.0 BOOL", "DB1.DBW2 INT", "DB1.DBD4 REAL", "DB1.DBD8 LREAL", "M10.0 BOOL"'


class S7Address(NamedTuple):
    """Place of one tag."""

    name: str
    """Tag of the line."""
    area: str
    """DB: data block, MK: bit memory, PE: inputs, PA: outputs."""
    db: int
    """Number of the data block; 0 in other areas."""
    byte: int
    """First byte."""
    bit: int
    """Bit of a BOOL, from 0; 0 for other types."""
    kind: str
    """Elementary type."""

    @property
    def end(self) -> int:
        """Byte after its last one."""
        return self.byte + size(self.kind)


def s7_address(name: str, theirs: str) -> S7Address:
    """Return the place of a tag. Raise ValueError with what is wrong with it and what is expected."""
    match = _FORM.fullmatch(theirs.strip())
    kind = match["type"].upper() if match else ""
    if match is None or kind not in CODES:
        raise ValueError(EXPECTED)
    letter = (match["width"] or match["letter"] or "X").upper()
    byte, bit = int(match["byte"]), match["bit"]
    problem = ""
    if kind == BOOL and (letter != "X" or bit is None):
        problem = "BOOL is a bit, and has a byte and a bit"
    elif kind != BOOL and bit not in (None, "0"):
        problem = f"{kind} begins with bit 0 of a byte"
    elif kind != BOOL and letter == "X" and bit is None:
        problem = f"the address has neither a width nor a bit for {kind}"
    elif kind != BOOL and letter != "X" and (bit is not None or size(kind) not in _WIDTHS[letter]):
        problem = f"{kind} has {size(kind)} bytes"
    elif byte + size(kind) > _MOST_BYTE + 1:
        problem = f"its last byte is above {_MOST_BYTE}"
    elif match["db"] is not None and not 1 <= int(match["db"]) <= _MOST_BYTE:
        problem = f"the number of a data block is 1 to {_MOST_BYTE}"
    if problem:
        raise ValueError(f"{EXPECTED}: {problem}")
    area = "DB" if match["db"] is not None else _AREAS[match["area"].upper()]
    return S7Address(name, area, int(match["db"] or 0), byte, int(bit or 0), kind)
