# SPDX-License-Identifier: Apache-2.0
"""Signals that request the end of a process: the first is handled, the second ends it even if it hangs."""

from __future__ import annotations

import ctypes
import signal
import threading
from collections.abc import Callable, Iterable, Iterator
from contextlib import AbstractContextManager, contextmanager
from types import FrameType
from typing import Any

Handler = Callable[[int, FrameType | None], Any]

SA_RESETHAND = 0x80000000
"""Flag of sigaction(2): the kernel restores the default action when it delivers the signal."""


class _Action(ctypes.Structure):
    """`struct sigaction` of Linux with 64 bits."""

    _fields_ = (
        ("handler", ctypes.c_void_p),
        ("mask", ctypes.c_ubyte * 128),
        ("flags", ctypes.c_uint),
        ("restorer", ctypes.c_void_p),
    )


class HandledOnce(AbstractContextManager["HandledOnce"]):
    """Handler for the first of some signals; the next one, of any of them, has its default action.

    That ends the process by that signal: the exit status that a shell shows is 128 plus its number. Python runs
    handlers only between two instructions of its main thread, so never while that hangs in C. The kernel handles a
    second signal of the same number. In other threads than the main one, this does nothing.
    """

    def __init__(self, numbers: Iterable[int], handler: Handler) -> None:
        """Set the handler until the context ends."""
        self._handler = handler
        self._before: dict[int, tuple[Any, bool]] = {}
        if threading.current_thread() is threading.main_thread():
            for number in numbers:
                once = bool(_action(number).flags & SA_RESETHAND)
                self._before[number] = signal.signal(number, self._first), once
                _reset_when_delivered(number)

    def __exit__(self, *_: object) -> None:
        for number, (handler, once) in self._before.items():
            signal.signal(number, handler)
            if once:
                _reset_when_delivered(number)

    def _first(self, number: int, frame: FrameType | None) -> None:
        for other in self._before:
            signal.signal(other, signal.SIG_DFL)
        self._handler(number, frame)


@contextmanager
def held_back() -> Iterator[None]:
    """Delay Ctrl-C to the end of the context, where it is raised; a second one ends the process at once."""
    struck = False

    def note(_number: int, _frame: FrameType | None) -> None:
        nonlocal struck
        struck = True

    with HandledOnce([signal.SIGINT], note):
        yield
    if struck:
        raise KeyboardInterrupt


def _action(number: int) -> _Action:
    action = _Action()
    ctypes.CDLL(None).sigaction(number, None, ctypes.byref(action))
    return action


def _reset_when_delivered(number: int) -> None:
    action = _action(number)
    action.flags |= SA_RESETHAND
    ctypes.CDLL(None).sigaction(number, ctypes.byref(action), None)
