# SPDX-License-Identifier: Apache-2.0
"""SIGINT for the processes that tests start."""

from __future__ import annotations

import signal


def restore_for_children() -> None:
    """Let the processes that this one starts be interrupted, where this one was started with SIGINT ignored.

    Shells ignore SIGINT for background jobs, and an ignored signal stays ignored in child processes. A signal with
    a handler does not: it has its default action again after an exec. This process itself keeps ignoring SIGINT.
    """
    if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
        signal.signal(signal.SIGINT, _ignore)


def _ignore(number: int, frame: object) -> None:
    """Do nothing."""
