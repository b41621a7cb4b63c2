# SPDX-License-Identifier: Apache-2.0
"""`ControllerSource`: reference, parameters and recorded variables of a controller that a run loads."""

from __future__ import annotations

import traceback
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from sysconfig import get_path

from conveyor_sim.control.scan import ControlError, Controller
from conveyor_sim.control.st.load import load
from conveyor_sim.errors import ConveyorError

LIBRARIES = (Path(__file__).parents[1], *(Path(get_path(name)) for name in ("stdlib", "purelib", "platlib")))
"""Folders whose code is not the user's."""


@dataclass(frozen=True)
class ControllerSource:
    """A controller before it is loaded. Each run loads it anew, so a reset takes a changed program."""

    reference: str
    """program.st, library.so, file.py:factory or module:factory."""
    parameters: Mapping[str, object] = field(default_factory=dict)
    """Parameters of the factory or program, by name."""
    record: tuple[str, ...] = ()
    """Patterns of variables that are recorded (`control/recorded.py`)."""

    def load(self) -> Controller:
        """Return the controller. Raises ConveyorError, with file and line for an error in a Python file."""
        try:
            return load(self.reference, self.parameters)
        except ControlError as error:
            raise ConveyorError(str(error)) from error
        except (Exception, SystemExit) as error:  # of the user's Python code
            raise ConveyorError(f"controller {self.reference!r}: {located(error)}") from error


def located(error: BaseException) -> str:
    """Return the type and text of an error of user code, with the last line of that code on the way to the error."""
    frames = traceback.extract_tb(error.__traceback__)
    own = [frame for frame in frames if Path(frame.filename).is_file() and not _is_library(Path(frame.filename))]
    frame = (own or frames)[-1]
    return f"{Path(frame.filename).name}:{frame.lineno}: {type(error).__name__}: {error}"


def _is_library(file: Path) -> bool:
    return any(map(file.is_relative_to, LIBRARIES))
