"""Node `conveyor_replay`: publishes a recording like a live node, and serves `pause`, `resume` and `seek`."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Sequence
from concurrent.futures import Future
from typing import Any, TypeVar

from conveyor_msgs.srv import Seek
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.clock import Clock
from rclpy.clock_type import ClockType
from rclpy.context import Context
from rclpy.duration import Duration
from rclpy.publisher import Publisher
from std_srvs.srv import Trigger

from conveyor_sim.bag.reader import Bag
from conveyor_sim.errors import BagError, ConveyorError
from conveyor_sim.ros.clock import ClockPublisher, GraphWatch
from conveyor_sim.ros.context import new_node
from conveyor_sim.ros.publishers import message_class, published_hashes, ros_qos
from conveyor_sim.ros.services import settled
from conveyor_sim.ros.spinner import Spinner
from conveyor_sim.run.calls import CallQueue
from conveyor_sim.run.playback import Playback, PlayedMessage, PlayedTopic, Player
from conveyor_sim.support.printable import printable

T = TypeVar("T")

CLOCK_RATE = 100.0  # largest number of messages per wall second, as by default in the live node
LOOK = 1.0  # s of wall time between two checks of the ROS graph
LAST_WORDS = 1.0  # longest wait for reliable subscribers to receive the last messages, s of wall time


class ReplayNode:
    """The node with its two threads: one spins the executor, one plays."""

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
            clock = ClockPublisher(self._node, CLOCK_RATE)
            self.player = Player(playback, rate, start=start, paused=paused, publish=self._publish, beat=clock.beat)
        except BaseException:
            self._spinner.close()
            self._node.destroy_node()
            raise
        watch = GraphWatch(self._node, clock.topic)
        # A steady clock, because with use_sim_time the clock of the node stands still while paused.
        self._node.create_timer(LOOK, watch.look, clock=Clock(clock_type=ClockType.STEADY_TIME))
        group = ReentrantCallbackGroup()
        self._node.create_service(Trigger, "pause", self._pause, callback_group=group)
        self._node.create_service(Trigger, "resume", self._resume, callback_group=group)
        self._node.create_service(Seek, "seek", self._seek, callback_group=group)
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
            publisher = self._node.create_publisher(kind, topic.name, ros_qos(topic.qos))
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
