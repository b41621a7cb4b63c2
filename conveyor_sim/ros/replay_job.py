"""`conveyor-sim replay --publish`: plays a recording to its end, with a progress bar and keys on a terminal."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import ExitStack
from functools import partial
from pathlib import Path

import click
import rclpy

from conveyor_sim.bag.reader import open_bag
from conveyor_sim.ros.context import start_ros
from conveyor_sim.ros.keys import Keys, readable
from conveyor_sim.ros.replay_node import ReplayNode
from conveyor_sim.support.progress import ProgressBar
from conveyor_sim.support.stop_request import StopRequest

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
