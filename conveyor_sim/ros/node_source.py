# SPDX-License-Identifier: Apache-2.0
"""`NodeSource`: a line that a node simulates, as a tag source, by the topics of the node."""

from __future__ import annotations

import threading
import time
from collections import deque
from collections.abc import Callable
from contextlib import AbstractContextManager
from functools import partial
from typing import Any

from conveyor_msgs.srv import Operate
from rclpy.context import Context
from rclpy.task import Future
from simulation_interfaces import srv
from std_srvs.srv import Trigger

from conveyor_sim.bag.messages.encode import LINE
from conveyor_sim.bag.messages.topics import TOPICS
from conveyor_sim.columns.events import Event
from conveyor_sim.errors import ConveyorError
from conveyor_sim.line.commands.inputs import Input
from conveyor_sim.protocols.tags.line_mirror import DRAWING_TOPICS, STATE_TOPICS, LineMirror, LineMirrorError, decoded
from conveyor_sim.protocols.tags.tag_provider import MOST_WAITING, Control
from conveyor_sim.ros.context import new_node, one_sentence, start_ros
from conveyor_sim.ros.direct import Aside, WaitSet, take_message
from conveyor_sim.ros.publishers import message_class, require_same_definition, ros_qos
from conveyor_sim.ros.service_names import of_simulation
from conveyor_sim.ros.spinner import Spinner
from conveyor_sim.support.printable import SENTENCE, printable

LOOK = 1.0
"""Time between two checks that the node is alive, s of wall time."""

SILENCE = 5.0
"""Time without an answer after which the shown line is stale, s of wall time."""


class NodeSource(LineMirror, AbstractContextManager["NodeSource"]):
    """Subscribes until close(). The node may start, end and restart meanwhile."""

    controls: frozenset[Control] = frozenset({"pause", "resume", "step", "reset"})

    def __init__(self, say: Callable[[str], object], namespace: str = "", drawn: bool = False) -> None:
        """say: called with a sentence for the user, by a thread of this source. namespace: namespace of the node.
        drawn: True if a page shows the line, for which the node publishes more topics.

        Raises ConveyorError if ROS can't start.
        """
        super().__init__()
        self._say = say
        self._closing = False
        self._context = Context()
        start_ros(self._context)
        self._node = new_node("conveyor_serve", context=self._context, namespace=namespace or None)
        self._spinner = Spinner(self._context)
        with one_sentence():
            self._topics = {
                name: self._node.create_subscription(
                    message_class(TOPICS[name].type),
                    name,
                    lambda _: None,
                    ros_qos(TOPICS[name].qos),
                    callback_group=Aside(),
                    raw=True,
                )
                for name in (*STATE_TOPICS, *(DRAWING_TOPICS if drawn else ()))
            }
            self._alive_client = self._node.create_client(srv.GetSimulationState, of_simulation("get_simulation_state"))
            self._operate = self._node.create_client(Operate, of_simulation("operate"))
            self._services: dict[str, Any] = {
                "pause": self._node.create_client(Trigger, of_simulation("pause")),
                "resume": self._node.create_client(Trigger, of_simulation("resume")),
                "step": self._node.create_client(srv.StepSimulation, of_simulation("step_simulation")),
                "reset": self._node.create_client(srv.ResetSimulation, of_simulation("reset_simulation")),
            }
        self._lock = threading.Lock()
        self._asked: dict[Future, Any] = {}  # requests without an answer, with their clients
        self._refusals: deque[Event] = deque(maxlen=MOST_WAITING)
        self._alive = self._heard = 0.0  # s of wall time
        self._sign: Future | None = None
        self._mismatch = ""  # reason why messages of the node can't be read
        self._why = ""  # reason why the line can't be shown although the node runs
        self._reported = ""
        self._waiting = WaitSet(self._context, subscriptions=list(self._topics.values()))
        self._spinner.start(self._node)
        self._thread = threading.Thread(target=self._listen, name="node", daemon=True)
        self._thread.start()

    def give(self, command: Input) -> str:
        """Send an input to the node, which applies it as the next tick begins. Return why it was not sent, or "".

        Refusals by the node are events.
        """
        if reason := self._objection(command):
            return reason

        def answered(future: Future) -> None:
            answer = self._answer(future)
            if answer is not None and not answer.accepted:
                name = command.names[0] if command.names else command.operation
                value = command.values[0] if command.values else 0.0
                self._refusals.append(Event(int(answer.tick), "command_refused", name, -1, value, answer.reason))
                self._waiting.wake()

        request = Operate.Request(
            writer=command.writer,
            writer_kind=command.writer_kind,
            operation=command.operation,
            names=command.names,
            values=[float(value) for value in command.values],
            texts=command.texts,
        )
        return self._ask(self._operate, request, answered)

    def control(self, what: Control, value: float, by: str) -> str:
        """Request an action of the run. by: name of the user. Return why it is refused, or ""."""
        if what not in self.controls:
            return f"{what}: expected one of {', '.join(sorted(self.controls))} of a node"
        if reason := self.snapshot.lost:
            return reason
        if what == "step" and not (1.0 <= value < 2**32 and float(value).is_integer()):
            return f"step: {value:g} given, expected a whole number of ticks of at least 1"
        client = self._services[what]

        def answered(future: Future) -> None:
            answer = self._answer(future)
            if answer is None:
                return
            if isinstance(answer, Trigger.Response):
                reason = "" if answer.success else answer.message
            else:
                reason = answer.result.error_message
            self._say(f"{what}, requested by {by}" + (f", refused: {reason}" if reason else ""))

        request = client.srv_type.Request()
        if what == "step":
            request.steps = int(value)
        return self._ask(client, request, answered)

    def close(self) -> None:
        """End the subscriptions and the node."""
        self._closing = True
        self._waiting.wake()
        self._thread.join()
        self._waiting.close()
        self._spinner.close()
        self._node.destroy_node()
        self._context.shutdown()

    def __exit__(self, *_: object) -> None:
        self.close()

    def _ask(self, client: Any, request: Any, answered: Callable[[Future], None]) -> str:
        with self._lock:
            if len(self._asked) >= MOST_WAITING:
                return f"{MOST_WAITING} inputs wait for the node already"
            future = client.call_async(request)
            self._asked[future] = client
        future.add_done_callback(answered)
        return ""

    def _answer(self, future: Future) -> Any:
        """Return the answer; None if there will be none."""
        with self._lock:
            self._asked.pop(future, None)
        return None if future.cancelled() or future.exception() else future.result()

    def _listen(self) -> None:
        looked = 0.0
        while not self._closing:
            self._waiting.wait(LOOK / 2)
            now = time.monotonic()
            try:
                if self._take_all():
                    self._heard, self._why = now, ""
                    self.show()
            except Exception as error:  # messages of a node of another version may have any content
                text = str(error) if isinstance(error, ConveyorError) else f"{type(error).__name__}: {error}"
                self._why = printable(text, SENTENCE)
            if now > looked + LOOK:
                looked = now
                self._look(now)
            if self._why:
                self._lose(self._why)

    def _take_all(self) -> bool:
        """Take the messages that have come. Return True if there were any. Raise LineMirrorError."""
        came, strange = False, None
        for name, subscription in self._topics.items():
            taken = []
            while (message := take_message(subscription)) is not None:
                taken.append(message[0])
            if name == "line" and taken:
                self._compare_definitions()
            if self._mismatch:
                continue
            for data in taken if name == "events" else taken[-1:]:
                came = True
                self.pass_on(name, data)
                decode = partial(decoded, name, data)
                if name in DRAWING_TOPICS:
                    self.keep(name, decode)
                    continue
                try:
                    self.take(name, decode())
                except LineMirrorError as error:
                    strange = error
        while self._refusals:
            self.add(self._refusals.popleft())
        if self._mismatch:
            raise LineMirrorError(self._mismatch)
        if strange is not None:
            raise strange
        return came

    def _compare_definitions(self) -> None:
        """Note a node with other definitions of messages, whose messages can't be read."""
        try:
            require_same_definition(self._node, self._topics["line"].topic_name, LINE)
        except ConveyorError as error:
            if not self._mismatch:
                self._say(str(error))  # even while the client still waits for a first line
            self._mismatch = self._reported = str(error)
        else:
            if self._mismatch:
                self._mismatch = self._why = ""

    def _look(self, now: float) -> None:
        """Check that the node still runs."""
        if (sign := self._sign) is not None:
            if sign.done():
                self._alive = now
            else:
                self._alive_client.remove_pending_request(sign)
        self._sign = None
        self._compare_definitions()
        if self._mismatch:
            self._lose(self._mismatch)
            return
        if not self._alive_client.service_is_ready():
            self._lose("no node is there that simulates a line, or its run has not begun")
            return
        self._sign = self._alive_client.call_async(srv.GetSimulationState.Request())
        if now > max(self._alive, self._heard) + SILENCE:
            self._lose(f"nothing was heard of the node for {SILENCE:g} s")
        elif self.snapshot.lost and not self._why and now < self._alive + LOOK:
            self.show()  # the simulation stands still, without new messages

    def _lose(self, reason: str) -> None:
        if self._reported != reason and not self.snapshot.lost:
            self._say(reason)
        self._reported = reason
        self.lose(reason)
        with self._lock:
            asked, self._asked = self._asked, {}
        for future, client in asked.items():
            client.remove_pending_request(future)
