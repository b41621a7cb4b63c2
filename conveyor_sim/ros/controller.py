# SPDX-License-Identifier: Apache-2.0
"""`ControllerRun`: a controller (conveyor_sim/control) as a ROS node beside a simulation, in lockstep or free.

In lockstep, every scan is one call of the service `lockstep`: commands in, process image out. The first scan is at the
tick at which the controller joins, 0 for a run that waits at its start. The run is then the same as in one process.
Free, the controller scans the `signals` that arrive and publishes `commands`, like a PLC in real time.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Mapping, Sequence, Set
from typing import Any

from conveyor_msgs.msg import Alarm, Commands, Line, Signals
from conveyor_msgs.msg import Variables as Message
from conveyor_msgs.srv import Lockstep
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from rclpy.node import Node
from rclpy.publisher import Publisher
from rclpy.serialization import deserialize_message

from conveyor_sim.bag.messages.encode import LINE
from conveyor_sim.bag.messages.qos import ANSWERS
from conveyor_sim.bag.messages.topics import TOPICS
from conveyor_sim.control.recorded import RecordedVariables
from conveyor_sim.control.scan import (
    ALARMS,
    ControlError,
    Controller,
    Inputs,
    declared_alarms,
)
from conveyor_sim.errors import ConveyorError
from conveyor_sim.ros.clock import to_time
from conveyor_sim.ros.direct import Aside, WaitSet, send_request, take_response
from conveyor_sim.ros.publishers import require_same_definition, ros_qos
from conveyor_sim.ros.qos_overrides import publisher_qos, subscription_qos
from conveyor_sim.ros.sent_inputs import alarm_messages
from conveyor_sim.ros.service_names import of_simulation
from conveyor_sim.ros.spinner import Spinner
from conveyor_sim.run.alarm_changes import AlarmChanges
from conveyor_sim.scene import parse_again, parse_overrides
from conveyor_sim.support.printable import SENTENCE, printable
from conveyor_sim.support.stop_request import StopRequest


class LockstepClient:
    """Client for one thread."""

    def __init__(self, node: Node) -> None:
        self._client = node.create_client(
            Lockstep, of_simulation("lockstep"), qos_profile=ros_qos(ANSWERS), callback_group=Aside()
        )
        self._waiting = WaitSet(node.context, clients=[self._client])

    def close(self) -> None:
        """Release the client."""
        self._waiting.close()

    def is_ready(self) -> bool:
        """Return True if the service is available."""
        ready: bool = self._client.service_is_ready()
        return ready

    def send(self, request: Any) -> int:
        """Send a request. Return the number of its answer."""
        return send_request(self._client, request)

    def response(self, numbers: Set[int], seconds: float) -> Any:
        """Return the answer to a request with one of these numbers; None if none comes within `seconds`."""
        until = time.monotonic() + seconds
        while (left := until - time.monotonic()) > 0.0:
            self._waiting.wait(left)
            while (taken := take_response(self._client)) is not None:
                number, response = taken
                if number in numbers:
                    return response
        return None


class AlarmPublisher:
    """Publishes all alarms of a controller: one status per alarm, ERROR while it stands and OK otherwise.

    The topic is latched, so that late subscribers see present and past alarms.
    """

    def __init__(self, node: Node) -> None:
        self._publisher = node.create_publisher(
            DiagnosticArray, "alarms", publisher_qos(node, "alarms", TOPICS["alarms"].qos)
        )
        self._source = node.get_name()
        self._published: dict[str, bool] = {}

    def publish(self, alarms: Mapping[str, bool], stamp_ns: int) -> None:
        """Publish the alarms of a scan, by text, if one has changed. stamp_ns: simulated time of the scan."""
        if alarms == self._published:
            return
        self._published = dict(alarms)
        message = DiagnosticArray()
        message.header.stamp = to_time(stamp_ns)
        message.status = [
            DiagnosticStatus(
                level=DiagnosticStatus.ERROR if stands else DiagnosticStatus.OK,
                name=text,
                message="stands" if stands else "",
                hardware_id=self._source,
            )
            for text, stands in alarms.items()
        ]
        self._publisher.publish(message)


class VariablePublisher:
    """Publishes variables. The publisher is created at the first scan with variables."""

    def __init__(self, node: Node) -> None:
        self._node = node
        self._publisher: Publisher | None = None

    def publish(self, names: Sequence[str], values: Sequence[float], tick: int, stamp_ns: int) -> None:
        """Publish the values after the scan at a tick. stamp_ns: simulated time of the scan."""
        if not names:
            return
        if self._publisher is None:
            self._publisher = self._node.create_publisher(
                Message, "variables", publisher_qos(self._node, "variables", TOPICS["variables"].qos)
            )
        message = Message(tick=tick, name=list(names), value=list(values))
        message.header.stamp = to_time(stamp_ns)
        self._publisher.publish(message)


LOOK = 0.01  # s of wall time between two searches for the simulation
STOP_LOOK = 0.1  # s of wall time between two checks for a stop request while it waits for an answer
PATIENCE = 1.0  # s of wall time without an answer after which the same request is sent again

Make = Callable[[Any], Controller]
"""Makes a controller for the line of a message (conveyor_msgs/Line). Raises ConveyorError or ControlError."""


class Stopped(Exception):
    """Raised when the controller must end."""


class Scanner:
    """A controller on the line of one run: values in the order of the line in, commands and alarms out.

    Alarms and variables are published as well.
    """

    def __init__(self, controller: Controller, line: Any, alarms: AlarmPublisher, variables: VariablePublisher) -> None:
        """line: conveyor_msgs/Line."""
        self._controller = controller
        self._names: Sequence[str] = line.signal_names
        self._tick_ns: int = line.tick_ns
        self._alarms = alarms
        self._variables = variables
        self._changes = AlarmChanges()
        try:
            self._declared = declared_alarms(controller)
            self._recorded = RecordedVariables(controller)
        except ControlError as error:
            raise ConveyorError(str(error)) from error

    def take_declared(self) -> list[Alarm]:
        """Return the declared alarms as messages at the first call, and none later."""
        declared, self._declared = self._declared, ()
        return alarm_messages(declared)

    def scan(self, values: Sequence[float], tick: int, ticks: int) -> dict[str, float]:
        """Return the commands, and the alarms that come or go, of the scan at a tick. ticks: ticks to the next scan.

        Raises ConveyorError.
        """
        signals = dict(zip(self._names, values, strict=True))
        try:
            answer = self._controller.scan(
                Inputs(signals, tick * self._tick_ns * 1e-9, tick, ticks * self._tick_ns * 1e-9)
            )
            commands = self._changes.with_commands(answer)
        except ControlError as error:
            raise ConveyorError(f"scan at tick {tick}: {error}") from error
        stamp_ns = max(1, tick * self._tick_ns)
        self._alarms.publish(_alarms(answer), stamp_ns)
        self._variables.publish(self._recorded.names, self._recorded.values(), tick, stamp_ns)
        return commands


class ControllerRun:
    """A node that finds the line of a simulation, and lets a controller scan until the end."""

    def __init__(
        self,
        node: Node,
        make: Make,
        *,
        scan_ticks: int,
        run_id: str,
        released: Sequence[str] = (),
        stop: StopRequest,
    ) -> None:
        """make: called at the start, and after every reset of the simulation.

        scan_ticks: ticks from one scan to the next. run_id: name of the owner in lockstep. released: patterns of the
        devices that it does not own.
        """
        self._node = node
        self._make = make
        self._scan_ticks = scan_ticks
        self._run_id = run_id
        self._released = list(released)
        self._stop = stop
        self._error: Exception | None = None
        self._line: Any = None
        self._has_line = threading.Event()
        self._alarms = AlarmPublisher(node)
        self._variables = VariablePublisher(node)
        lines = node.create_subscription(
            Line, "line", self._on_line, subscription_qos(node, "line", TOPICS["line"].qos), raw=True
        )
        self._line_topic = lines.topic_name
        self._lockstep = LockstepClient(node)
        self._spinner = Spinner(died=self._died)
        self._spinner.start(node)

    def close(self) -> None:
        """Leave the domain."""
        self._lockstep.close()
        self._spinner.close()
        self._node.destroy_node()

    def run_lockstep(self) -> None:
        """Scan to the end of the run. Raise ConveyorError if a scan is refused, Stopped after a stop request."""
        log = self._node.get_logger()
        self._find(self._lockstep.is_ready)
        line, tick, last, values = None, 0, 0, list[float]()
        refusals = set[str]()
        while line is None or tick < last:
            if self._line is not line:  # at the start, and after a reset
                line = self._line
                # Stale on purpose: the refusal has the present tick, which is not 0 if this controller was restarted.
                present = self._call(line, 0, {})
                if self._left(line, present):
                    continue
                scanner = self._scanner(line)
                last = _last_tick(line)
                tick, values = present.tick, present.signals.values
                log.info(f"controls {printable(line.scene_name)} from tick {tick}")
                continue
            target = min(tick + self._scan_ticks, last)
            commands = scanner.scan(values, tick, target - tick)
            response = self._call(line, target, commands, scanner.take_declared(), release=target == last)
            if not response.accepted and self._left(line, response):
                line = None
                continue
            if not response.accepted:
                raise ConveyorError(f"lockstep to tick {target} refused: {response.reason}")
            before, refusals = refusals, {_refusal(outcome) for outcome in response.outcomes if not outcome.accepted}
            for refusal in sorted(refusals - before):  # refused at every scan while an operator controls a device
                log.warning(refusal)
            tick, values = response.tick, response.signals.values
        log.info(f"ends at tick {tick}")

    def run_free(self) -> None:
        """Scan the signals that arrive until a stop request. Raise ConveyorError if a scan fails."""
        self._find(lambda: True)
        free = _FreeScans(self._node, self._scan_ticks, self._scanner, lambda: self._line)
        self._node.create_subscription(
            Signals, "signals", free.on_signals, subscription_qos(self._node, "signals", TOPICS["signals"].qos)
        )
        self._node.get_logger().info(f"controls {printable(self._line.scene_name)} as its signals arrive")
        self._stop.wait()
        if self._error is not None:
            raise self._error

    def _find(self, ready: Callable[[], bool]) -> None:
        self._node.get_logger().info("waiting for the simulation")
        while not (self._has_line.is_set() and ready()):
            self._require_going_on()
            require_same_definition(self._node, self._line_topic, LINE)
            time.sleep(LOOK)

    def _scanner(self, line: Any) -> Scanner:
        return Scanner(self._make(line), line, self._alarms, self._variables)

    def _left(self, line: Any, response: Any) -> bool:
        """Return True if the simulation is in another run than that of `line`, once the new line has come."""
        if response.sim_run_id == line.run_id:
            return False
        while self._line is line:
            self._require_going_on()
            time.sleep(LOOK)
        return True

    def _call(
        self,
        line: Any,
        target: int,
        commands: Mapping[str, float],
        declared: Sequence[Alarm] = (),
        release: bool = False,
    ) -> Any:
        """Return the answer to a request in the run of a line. The request is repeated until there is an answer.

        Repetition is safe, because a request has its run and tick.
        """
        request = Lockstep.Request(
            run_id=self._run_id,
            target_tick=target,
            names=list(commands),
            values=list(commands.values()),
            release=release,
            sim_run_id=line.run_id,
            released=self._released,
            alarms=declared,
        )
        numbers = set()
        while True:
            numbers.add(self._lockstep.send(request))
            until = time.monotonic() + PATIENCE
            while time.monotonic() < until:
                self._require_going_on()
                response = self._lockstep.response(numbers, STOP_LOOK)
                if response is not None:
                    return response
            self._node.get_logger().warning(f"no answer to the request for tick {target}; sent again")

    def _require_going_on(self) -> None:
        if self._error is not None:
            raise self._error
        if self._stop.requested:
            raise Stopped

    def _on_line(self, data: bytes) -> None:
        require_same_definition(self._node, self._line_topic, LINE)
        self._line = deserialize_message(data, Line)
        self._has_line.set()

    def _died(self, error: Exception) -> None:
        self._error = error
        self._stop.request()


class _FreeScans:
    """Scans signals as they arrive, every `scan_ticks` ticks or less often."""

    def __init__(self, node: Node, scan_ticks: int, scanner: Callable[[Any], Scanner], line: Callable[[], Any]) -> None:
        self._commands = node.create_publisher(
            Commands, "commands", publisher_qos(node, "commands", TOPICS["commands"].qos)
        )
        self._scan_ticks = scan_ticks
        self._make = scanner
        self._present = line
        self._line: Any = None
        self._scanner: Scanner | None = None
        self._last: int | None = None

    def on_signals(self, message: Any) -> None:
        """Scan one process image."""
        line = self._present()
        if self._scanner is None or line is not self._line or (self._last is not None and message.tick < self._last):
            self._line, self._last, self._scanner = line, None, self._make(line)
        ticks = self._scan_ticks if self._last is None else message.tick - self._last
        if ticks < self._scan_ticks or len(message.values) != len(line.signal_names):
            return
        self._last = message.tick
        commands = self._scanner.scan(message.values, message.tick, ticks)
        declared = self._scanner.take_declared()
        if commands or declared:
            names, values = list(commands), list(commands.values())
            answer = Commands(tick=message.tick, names=names, values=values, alarms=declared)
            answer.header = message.header
            self._commands.publish(answer)


def _alarms(answer: Mapping[str, float]) -> dict[str, bool]:
    """Return the alarms of an answer by text."""
    return {name.removeprefix(ALARMS): value != 0.0 for name, value in answer.items() if name.startswith(ALARMS)}


def _refusal(outcome: Any) -> str:
    return f"{printable(', '.join(outcome.names))} refused: {printable(outcome.reason, SENTENCE)}"


def _last_tick(line: Any) -> int:
    """Return the tick at which the run ends."""
    scene = parse_again(line.scene_text, line.scene_name, parse_overrides(line.overrides))
    return scene.duration_ticks
