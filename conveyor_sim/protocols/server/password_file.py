# SPDX-License-Identifier: Apache-2.0
"""Passwords that no command line shows: in a file, else in an environment variable."""

from __future__ import annotations

import os
from pathlib import Path

from conveyor_sim.protocols.server.interface import ServerError
from conveyor_sim.support.files import MB, FileError, read_file


def read_password(path: Path | None, variable: str, purpose: str) -> str:
    """Return the first line of a file; without a file, the value of an environment variable, "" if it is not set.

    purpose: what the password is for, for errors. Raise ServerError if the file can't be read.
    """
    if path is None:
        return os.environ.get(variable, "")
    try:
        return read_file(path, MB).decode().partition("\n")[0].rstrip("\r")
    except FileError as error:
        raise ServerError(f"{path}: {error}, expected a file with the password of {purpose}") from error
    except UnicodeDecodeError as error:
        raise ServerError(f"{path}: is not UTF-8, expected a file with the password of {purpose}") from error
