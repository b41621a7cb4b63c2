# SPDX-License-Identifier: Apache-2.0
"""The process of one `VendorDriver`: a library that hangs, crashes or leaks takes neither the line nor its recording.

It imports little, so that a lost PLC is reached again within a second.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from contextlib import suppress
from importlib import import_module
from typing import Any

from conveyor_sim.errors import ConveyorError
from conveyor_sim.protocols.attach.vendor_driver import PlaceError, VendorDriver
from conveyor_sim.support.child_process import die_with_parent, pipes_of_child

DONE, PLACE, FAILED = "done", "place", "failed"
"""First item of an answer: the result follows, the name and reason of a place, or the reason of a failure."""

CONNECT, CLOSE = "connect", "close"


class _Calls:
    def __init__(self) -> None:
        self._driver: VendorDriver | None = None

    def answer(self, what: str, arguments: tuple[Any, ...]) -> tuple[Any, ...]:
        """Return the answer to one request."""
        try:
            return DONE, self._method(what, arguments)(*arguments)
        except PlaceError as error:
            return PLACE, error.name, error.reason
        except ConveyorError as error:
            return FAILED, str(error)
        # After a malformed answer libraries raise exceptions of any kind: struct.error, IndexError, RuntimeError.
        except Exception as error:
            return FAILED, f"{type(error).__name__}: {error}"

    def _method(self, what: str, arguments: tuple[Any, ...]) -> Callable[..., Any]:
        if what == CONNECT:
            return self._connect
        assert self._driver is not None
        method: Callable[..., Any] = getattr(self._driver, what)
        return method

    def _connect(self, module: str, settings: tuple[Any, ...]) -> dict[str, str]:
        driver: VendorDriver = import_module(module).make(*settings)
        self._driver = driver
        return driver.connect()


def main() -> None:
    """Run the process: answer requests (name of a method, arguments) until the parent ends. Argument: its pipe."""
    die_with_parent()
    (pipe,) = pipes_of_child()
    nothing = os.open(os.devnull, os.O_WRONLY)
    for stream in (1, 2):  # libraries print there what the answers say as well
        os.dup2(nothing, stream)
    calls = _Calls()
    with suppress(EOFError, OSError):
        while True:
            what, arguments = pipe.recv()
            pipe.send(calls.answer(what, arguments))
