"""`Keys`: keys of a terminal, as they are pressed."""

from __future__ import annotations

import os
import select
import termios
import time
import tty
from contextlib import AbstractContextManager

NAMES = {b" ": "space", b"q": "q", b"\x1b[C": "right", b"\x1b[D": "left", b"\x1bOC": "right", b"\x1bOD": "left"}
"""Names of the used keys by their codes (ECMA-48; arrows have two forms)."""


class Keys(AbstractContextManager["Keys"]):
    """Reads a terminal without echo and without waiting for the end of a line, until the context ends."""

    def __init__(self, terminal: int) -> None:
        """terminal: file descriptor."""
        self._terminal = terminal
        self._before = termios.tcgetattr(terminal)
        self._typed = b""
        tty.setcbreak(terminal)  # Ctrl-C still interrupts

    def read(self, patience: float) -> list[str]:
        """Return the names of the keys pressed so far, after at most `patience` (s). Other keys are dropped."""
        if not select.select([self._terminal], [], [], patience)[0]:
            self._typed = b""
            return []
        typed = os.read(self._terminal, 1024)
        if not typed:  # the terminal is gone
            time.sleep(patience)
        self._typed += typed
        pressed = []
        while self._typed and not _begins_a_key(self._typed):
            code = next((code for code in NAMES if self._typed.startswith(code)), self._typed[:1])
            self._typed = self._typed[len(code) :]
            if code in NAMES:
                pressed.append(NAMES[code])
        return pressed

    def __exit__(self, *_: object) -> None:
        termios.tcsetattr(self._terminal, termios.TCSADRAIN, self._before)


def _begins_a_key(typed: bytes) -> bool:
    """Return True if the code of the key is not complete."""
    return any(code != typed and code.startswith(typed) for code in NAMES)


def readable(terminal: int) -> bool:
    """Return True for a terminal that this process may read. A job in the background would be stopped."""
    if not os.isatty(terminal):
        return False
    try:
        return os.tcgetpgrp(terminal) == os.getpgrp()
    except OSError:  # not the terminal of our session, so there are no jobs
        return True
