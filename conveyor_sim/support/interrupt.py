# SPDX-License-Identifier: Apache-2.0
"""Ctrl-C ends a command with one line and the exit status of shells, never with a traceback.

Import this before anything heavy, so that it also holds during those imports.
"""

from __future__ import annotations

import os
import signal
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType

from conveyor_sim.support.garbage import collected_later

STATUS = 130
"""Exit status of shells: 128 plus the number of SIGINT."""
AGAIN = 0.05
"""Wall time after which a lost interrupt is repeated, s."""


@contextmanager
def while_importing() -> Iterator[None]:
    """End at once on Ctrl-C: there is nothing to clean up yet, and half-imported modules may swallow a
    KeyboardInterrupt.
    """
    if threading.current_thread() is not threading.main_thread():
        yield  # signals are only the main thread's to handle
        return
    before = signal.signal(signal.SIGINT, _end)
    try:
        with collected_later():
            yield
    finally:
        signal.signal(signal.SIGINT, before)


@contextmanager
def one_line() -> Iterator[None]:
    """End the program in order on Ctrl-C, files closed and children ended; a second Ctrl-C ends it at once.

    Raises SystemExit.
    """
    before, lost, struck = sys.unraisablehook, False, False

    def strike(number: int, frame: FrameType | None) -> None:
        # Libraries that are called in the midst of their own C code make another error of a KeyboardInterrupt.
        nonlocal struck
        struck = True
        signal.default_int_handler(number, frame)

    def not_lost(unraisable: sys.UnraisableHookArgs) -> None:
        # Where Python can't raise, in the compiler's callbacks for one, it comes again a little later.
        nonlocal lost
        if unraisable.exc_type is KeyboardInterrupt:
            lost = True
            signal.signal(signal.SIGALRM, signal.default_int_handler)
            signal.setitimer(signal.ITIMER_REAL, AGAIN)
        else:
            before(unraisable)

    sys.unraisablehook = not_lost
    by_default = signal.getsignal(signal.SIGINT) is signal.default_int_handler
    watched = by_default and threading.current_thread() is threading.main_thread()
    if watched:
        signal.signal(signal.SIGINT, strike)
    try:
        yield
    except (KeyboardInterrupt, Exception) as error:
        if not (lost or struck or isinstance(error, KeyboardInterrupt)):
            raise
        # A callback that was broken off makes others fail: still the same interrupt.
        signal.signal(signal.SIGINT, signal.SIG_DFL)
        print("interrupted", file=sys.stderr)
        raise SystemExit(STATUS) from None
    finally:
        if watched and signal.getsignal(signal.SIGINT) is strike:
            signal.signal(signal.SIGINT, signal.default_int_handler)
        if lost:
            signal.setitimer(signal.ITIMER_REAL, 0.0)
        sys.unraisablehook = before


def _end(_number: int, _frame: FrameType | None) -> None:
    os.write(2, b"interrupted\n")
    os._exit(STATUS)
