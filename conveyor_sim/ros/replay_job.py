"""`conveyor-sim replay --publish`: plays a recording to its end, with a progress bar and keys on a terminal."""

from __future__ import annotations

import os
import select
import termios
import time
import tty
from collections.abc import Sequence
from contextlib import AbstractContextManager, ExitStack
from functools import partial
from pathlib import Path

import click
import rclpy

from conveyor_sim.bag.reader import open_bag
from conveyor_sim.ros.context import start_ros
from conveyor_sim.ros.replay_node import ReplayNode
from conveyor_sim.support.progress import ProgressBar
from conveyor_sim.support.stop_request import StopRequest

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


TERMINAL = 0  # the standard input
LOOK = 0.1  # longest wait for a key, s of wall time
JUMPS = {"left": -5.0, "right": 5.0}  # s of the recording


def publish_bag(path: Path, rate: float, start: float | None, paused: bool, arguments: Sequence[str]) -> None:
    """Publish a bag over ROS until its end, Ctrl-C, SIGTERM or the key q. arguments: of ROS (`--ros-args ...`).

    Raises ConveyorError if it can't be played back.
    """
    with ExitStack() as stack:
        stop = stack.enter_context(StopRequest())
        bag = stack.enter_context(open_bag(path))
        stack.enter_context(bag.sense())
        start_ros()
        stack.callback(rclpy.shutdown)
        node = ReplayNode(bag, rate, start, paused, stop.request, arguments=arguments)
        stack.callback(node.close)
        if readable(TERMINAL):
            click.echo("space pauses and resumes, left and right seek 5 s, q quits", err=True)
            _watch(node, path, stop, stack.enter_context(Keys(TERMINAL)))
        else:
            stop.wait()
        if node.error is not None:
            raise node.error


def _watch(node: ReplayNode, path: Path, stop: StopRequest, keys: Keys) -> None:
    """Show progress and handle keys until the end or the key q."""
    player = node.player
    with ProgressBar(f"replay {path}", player.span[1], counted="s") as bar:
        while not stop.requested:
            bar.update(player.time)
            for key in keys.read(LOOK):
                if key == "q":
                    return
                node.call(player.toggle if key == "space" else partial(player.jump, JUMPS[key]))
        bar.update(player.time)
