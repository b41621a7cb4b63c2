# SPDX-License-Identifier: Apache-2.0
"""`conveyor-sim replay --publish`: plays a recording to its end, with a progress bar and keys on a terminal."""

from __future__ import annotations

import os
import select
import termios
import threading
import time
import tty
from collections.abc import Callable, Sequence
from concurrent.futures import Future
from contextlib import AbstractContextManager, ExitStack
from functools import partial
from pathlib import Path
from typing import Any, TypeVar

import click
import rclpy
from conveyor_msgs.srv import Seek
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.clock import Clock
from rclpy.clock_type import ClockType
from rclpy.context import Context
from rclpy.duration import Duration
from rclpy.publisher import Publisher
from std_srvs.srv import Trigger

from conveyor_sim.bag.reader import Bag, open_bag
from conveyor_sim.bag.recorded_scene import recorded_scene
from conveyor_sim.errors import BagError, ConveyorError, SceneError
from conveyor_sim.ros.answers import settled
from conveyor_sim.ros.clock import ClockPublisher, GraphWatch
from conveyor_sim.ros.context import new_node, start_ros
from conveyor_sim.ros.publishers import message_class, published_hashes
from conveyor_sim.ros.qos_overrides import publisher_qos
from conveyor_sim.ros.service_names import create_service
from conveyor_sim.ros.spinner import Spinner
from conveyor_sim.ros.static_frames import TF_STATIC, publish_frames
from conveyor_sim.run.calls import CallQueue
from conveyor_sim.run.playback import Playback, PlayedMessage, PlayedTopic, Player
from conveyor_sim.support.printable import SENTENCE, printable
from conveyor_sim.support.progress import ProgressBar
from conveyor_sim.support.stop_request import StopRequest

T = TypeVar("T")

CLOCK_RATE = 100.0  # largest number of messages per wall second, as by default in the live node
GRAPH_LOOK = 1.0  # s of wall time between two checks of the ROS graph
LAST_WORDS = 1.0  # longest wait for reliable subscribers to receive the last messages, s of wall time


class ReplayNode:
    """Node `conveyor_replay`: publishes a recording like a live node, and serves `pause`, `resume` and `seek`.

    It has two threads: one spins the executor, one plays.
    """

    def __init__(
        self,
        bag: Bag,
        rate: float,
        start: float | None,
        paused: bool,
        on_end: Callable[[], None],
        *,
        context: Context | None = None,
        arguments: Sequence[str] = (),
    ) -> None:
        """rate: recorded seconds per wall second, 0 for as fast as possible. start: s; None: start of the recording.

        on_end: called by any thread when the recording has been played or can't go on; close() must follow.
        Raises ConveyorError if the bag, or all of its topics, can't be played back.
        """
        self.error: Exception | None = None
        self._on_end = on_end
        self._calls = CallQueue("the recording has been played")
        playback = Playback(bag)
        self._spinner = Spinner(context, died=self._die)
        self._node = new_node(
            "conveyor_replay", context=context, namespace=bag.namespace, cli_args=list(arguments) or None
        )
        try:
            self._publishers = self._advertise(bag, playback.topics)
            if all(topic.name.lstrip("/") != TF_STATIC.lstrip("/") for topic in playback.topics):
                self._publish_frames(bag)
            clock = ClockPublisher(self._node, CLOCK_RATE)
            self.player = Player(playback, rate, start=start, paused=paused, publish=self._publish, beat=clock.beat)
        except BaseException:
            self._spinner.close()
            self._node.destroy_node()
            raise
        watch = GraphWatch(self._node, clock.topic)
        # A steady clock, because with use_sim_time the clock of the node stands still while paused.
        self._node.create_timer(GRAPH_LOOK, watch.look, clock=Clock(clock_type=ClockType.STEADY_TIME))
        group = ReentrantCallbackGroup()
        create_service(self._node, Trigger, "pause", self._pause, callback_group=group)
        create_service(self._node, Trigger, "resume", self._resume, callback_group=group)
        create_service(self._node, Seek, "seek", self._seek, callback_group=group)
        self._thread = threading.Thread(target=self._run, name="player", daemon=True)
        self._spinner.start(self._node)
        self._thread.start()

    def close(self) -> None:
        """End between two ticks, and wait until published messages have arrived."""
        self._calls.end()
        self._thread.join()
        end = time.monotonic() + LAST_WORDS
        for publisher in self._publishers.values():
            publisher.wait_for_all_acked(Duration(seconds=max(0.0, end - time.monotonic())))
        self._spinner.close()
        self._node.destroy_node()

    def call(self, function: Callable[[], T]) -> Future[T]:
        """Call `function` between two ticks. The future raises Refused once playing has ended. For any thread."""
        return self._calls.request(function)

    def _advertise(self, bag: Bag, topics: Sequence[PlayedTopic]) -> dict[str, Publisher]:
        """Create a publisher for each topic whose recorded type is installed. Log a warning for each other topic."""
        publishers = {}
        for topic in topics:
            try:
                kind = message_class(topic.type)
            except (ImportError, AttributeError):
                left_out, kind_name = printable(topic.name), printable(topic.type)
                self._node.get_logger().warning(f"{left_out}: left out, {kind_name} is not installed here")
                continue
            publisher = self._node.create_publisher(kind, topic.name, publisher_qos(self._node, topic.name, topic.qos))
            # Bytes are published as recorded. With another definition, they would be garbage.
            if topic.type_hash and topic.type_hash not in published_hashes(self._node, publisher.topic_name):
                self._node.destroy_publisher(publisher)
                self._node.get_logger().warning(
                    f"{topic.name}: left out, the installed {topic.type} has another definition than the recorded one"
                )
                continue
            publishers[topic.name] = publisher
        if not publishers:
            raise BagError(f"{bag.path}: no topic of a type that is installed here, expected at least one")
        return publishers

    def _publish_frames(self, bag: Bag) -> None:
        """Publish the frames of the recorded scene, which recordings of this package don't hold as messages."""
        try:
            scene = recorded_scene(bag.line, f"{bag.path} (recorded scene)")
        except SceneError as error:
            self._node.get_logger().warning(f"no frames on {TF_STATIC}: {printable(error, SENTENCE)}")
        else:
            publish_frames(self._node, scene, str(bag.line.header.frame_id))

    def _publish(self, message: PlayedMessage) -> None:
        if publisher := self._publishers.get(message.topic):
            publisher.publish(message.data)

    def _run(self) -> None:
        try:
            self._loop()
            time.sleep(1.0 / CLOCK_RATE)
            self.player.step(
                time.monotonic()
            )  # publishes the final time, which the rate limit of /clock may have held back
        except Exception as error:
            self._die(error)
        else:
            self._on_end()
        finally:
            self._calls.end()
            self._calls.drain()

    def _loop(self) -> None:
        while not self._calls.ended:
            self._calls.take()
            wait = self.player.step(time.monotonic())
            if self.player.ended and not self.player.paused:
                return
            self._calls.wait(wait)

    def _die(self, error: Exception) -> None:
        self.error = error
        self._on_end()

    async def _pause(self, _: Any, response: Any) -> Any:
        return await self._answer(response, self.player.pause)

    async def _resume(self, _: Any, response: Any) -> Any:
        return await self._answer(response, self.player.resume)

    async def _seek(self, request: Any, response: Any) -> Any:
        return await self._answer(response, lambda: self.player.seek(request.time))

    async def _answer(self, response: Any, function: Callable[[], None]) -> Any:
        try:
            await settled(self._spinner.executor, self.call(function))
        except ConveyorError as error:
            response.message = str(error)
        else:
            response.success = True
            response.message = f"at {self.player.time:g} s"
        return response


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
