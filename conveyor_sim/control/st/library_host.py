# SPDX-License-Identifier: Apache-2.0
"""Process of a compiled program. Its last argument is the path of the library.

Requests and answers are lines of JSON on a socket; the output of the program goes to standard error. The process ends
with the socket, and with the process that started it.
"""

from __future__ import annotations

import base64
import ctypes
import json
import os
import sys
from typing import Any

from conveyor_sim.support.child_process import die_with_parent, pipes_of_child

VERSION = 1
_MOST_BYTES = 64_000_000


class _Library:
    """Functions of include/conveyor_sim_plc.h. Raises OSError or AttributeError for a library without them."""

    def __init__(self, path: str) -> None:
        library = ctypes.CDLL(path)
        for name, result, arguments in (
            ("version", ctypes.c_int32, []),
            ("create", ctypes.c_void_p, []),
            ("bind", ctypes.c_int32, [ctypes.c_void_p, ctypes.c_char_p, ctypes.c_int32, ctypes.c_void_p]),
            ("scan", ctypes.c_int32, [ctypes.c_void_p, ctypes.c_int64]),
            ("snapshot", ctypes.c_int64, [ctypes.c_void_p, ctypes.c_void_p, ctypes.c_int64]),
            ("restore", ctypes.c_int32, [ctypes.c_void_p, ctypes.c_char_p, ctypes.c_int64]),
            ("destroy", None, [ctypes.c_void_p]),
        ):
            function = getattr(library, f"plc_{name}")
            function.restype, function.argtypes = result, arguments
            setattr(self, name, function)

    def __getattr__(self, name: str) -> Any:
        """Raise AttributeError. Existing functions are set above."""
        raise AttributeError(name)


class _Host:
    """One instance, and the memory of its variables."""

    def __init__(self, path: str) -> None:
        self._library = _Library(path)
        if (version := self._library.version()) != VERSION:
            raise ValueError(f"found version {version} of the interface, expected {VERSION}")
        self._plc = self._library.create()
        if not self._plc:
            raise ValueError("found no memory for an instance")
        self._ins: list[ctypes.c_double] = []
        self._outs: list[ctypes.c_double] = []

    def bind(self, variables: list[tuple[str, int]]) -> None:
        """Bind variables by name and direction, in the order of the values of each scan."""
        for name, direction in variables:
            place = ctypes.c_double(0.0)
            if self._library.bind(self._plc, name.encode(), direction, ctypes.byref(place)):
                raise ValueError(f"found no {'output' if direction else 'input'} {name}, expected one of the program's")
            (self._outs if direction else self._ins).append(place)

    def scan(self, time_ns: int, values: list[float]) -> list[float]:
        """Execute a scan: inputs in, outputs out."""
        for place, value in zip(self._ins, values, strict=True):
            place.value = value
        if code := self._library.scan(self._plc, time_ns):
            raise ValueError(f"the program has stopped, with code {code}")
        return [place.value for place in self._outs]

    def snapshot(self) -> str:
        """Return the state, in base 64."""
        size = self._library.snapshot(self._plc, None, 0)
        if not 0 <= size <= _MOST_BYTES:
            raise ValueError(f"found a state of {size} bytes, expected 0 to {_MOST_BYTES}")
        state = ctypes.create_string_buffer(max(size, 1))
        self._library.snapshot(self._plc, state, size)
        return base64.b64encode(state.raw[:size]).decode()

    def restore(self, state: str) -> None:
        """Restore a state."""
        content = base64.b64decode(state)
        if self._library.restore(self._plc, content, len(content)):
            raise ValueError("found a state that the program does not accept, expected one of this program")

    def destroy(self) -> None:
        """Destroy the instance."""
        self._library.destroy(self._plc)


def main() -> None:
    """Answer requests until the socket ends."""
    die_with_parent()
    (pipe,) = pipes_of_child()
    requests, answers = (os.fdopen(pipe.fileno(), mode, closefd=False) for mode in "rw")
    host: _Host | None = None
    for line in requests:
        try:
            if host is None:
                host = _Host(sys.argv[-1])
            request = json.loads(line)
            answer = {"answer": getattr(host, request["do"])(*request["with"])}
        except (OSError, AttributeError, ValueError) as error:
            answer = {"error": str(error)}
        answers.write(json.dumps(answer) + "\n")
        answers.flush()
    if host is not None:
        host.destroy()
