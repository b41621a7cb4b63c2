"""Signals that ask a process to end: the first is handled, a second one ends it, whatever hangs."""

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
"""Flag of sigaction(2): the kernel itself puts the default action back as it delivers the signal."""


class _Action(ctypes.Structure):
    """`struct sigaction` of Linux with 64 bits."""

    _fields_ = (
        ("handler", ctypes.c_void_p),
        ("mask", ctypes.c_ubyte * 128),
        ("flags", ctypes.c_uint),
        ("restorer", ctypes.c_void_p),
    )


class HandledOnce(AbstractContextManager["HandledOnce"]):
    """Calls a handler for the first of some signals; the next one, of whatever number, has its default action.

    That ends the process by that signal: 128 + its number is the exit status that a shell shows. Python runs handlers
    only between two instructions of its main thread, and one that hangs in C never gets there; so a second signal of
    the same number is left to the kernel. For the main thread: does nothing in others.
    """

    def __init__(self, numbers: Iterable[int], handler: Handler) -> None:
        """The handlers of before are back when the context ends."""
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
    """Ctrl-C waits until what is inside is done and is raised then; a second one ends the process at once."""
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
