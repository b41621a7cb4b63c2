# SPDX-License-Identifier: Apache-2.0
"""Foreign forms: files that are no Structured Text."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import PurePath

from conveyor_sim.control.st.errors import StructuredTextError

FILES: Mapping[str, str] = {
    **dict.fromkeys(
        (".tcpou", ".tcdut", ".tcgvl", ".tcio"), "XML of TwinCAT; copy declaration and body into a .st file"
    ),
    ".xml": "PLCopen XML or another XML; export the units as text",
    **dict.fromkeys((".awl", ".il"), "an instruction list (AWL, IL); write it as Structured Text"),
    **dict.fromkeys((".project", ".library", ".pro", ".lib"), "a project of CODESYS; export the units as text"),
    ".zap": "an archive of TIA Portal; generate external sources (.scl)",
}
"""Forms of files that are refused, by file type, with the way to text."""


def refused_file(path: PurePath) -> None:
    """Raise StructuredTextError for a file of a known type that is no text in Structured Text."""
    if (form := FILES.get(path.suffix.lower())) is not None:
        raise StructuredTextError(f"{path}: found {form}")
