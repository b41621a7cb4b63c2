"""Executable `plc_node`: a PLC-like controller of the paper's plant, a ROS node of its own.

Once a scan it hands its setpoints to the node `conveyor_sim` through the service `lockstep` and gets the process image
back. What it decides is in plc_logic.py.
"""

from __future__ import annotations

import sys
import threading
import time
from contextlib import closing, suppress
from typing import Any

import rclpy
from conveyor_msgs.msg import Line
from conveyor_msgs.srv import Lockstep
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions

from conveyor_sim.bag.qos import QOS
from conveyor_sim.errors import ConveyorError
from conveyor_sim.line.process_image import speed_command
from conveyor_sim.ros.declared import Entry, declare_table
from conveyor_sim.ros.plc_logic import PlcMemory, PlcSettings, count_signal, scan
from conveyor_sim.ros.publishers import ros_qos
from conveyor_sim.ros.spinner import Spinner
from conveyor_sim.ros.stop_request import StopRequest
from conveyor_sim.scene import parse_overrides, parse_scene

LOOK = 0.01  # s of wall time between two looks for the simulation
PATIENCE = 1.0  # s of wall time without an answer after which the same request is sent again

SETTINGS = (
    Entry("feeder", "feeder", "Belt that brings bottles to the table."),
    Entry("table", "table", "Belt whose bottles are counted."),
    Entry("high_mark", 45, "Bottles on the table at which the feeder is held.", 1, 10**6),
    Entry("low_mark", 35, "Bottles on the table at which the feeder runs again; above it the table is slow.", 0, 10**6),
    Entry("feeder_speed", 1.0, "m/s.", -10.0, 10.0),
    Entry("table_slow", 0.2, "m/s, with more than low_mark bottles on the table.", -10.0, 10.0),
    Entry("table_fast", 0.3, "m/s, with up to low_mark bottles on the table.", -10.0, 10.0),
)
SCANNING = (
    Entry("scan_ticks", 10, "Ticks from one scan to the next.", 1, 10**6),
    Entry("run_id", "plc_node", "Name under which the controller owns the simulation; the same after a restart."),
)


class Stopped(Exception):
    """The controller was asked to end."""


class PlcNode:
    """Scans until the end of the run, or until `stop` is requested."""

    def __init__(self, stop: StopRequest) -> None:
        """Raises ConveyorError for a parameter that can't be."""
        self._stop = stop
        self._node = Node("plc_node")
        self._settings = PlcSettings(**declare_table(self._node, SETTINGS))
        scanning = declare_table(self._node, SCANNING)
        self._scan_ticks: int = scanning["scan_ticks"]
        self._run_id: str = scanning["run_id"]
        self._line: Any = None
        self._has_line = threading.Event()
        self._node.create_subscription(Line, "line", self._on_line, ros_qos(QOS["line"]))
        self._lockstep = self._node.create_client(Lockstep, "lockstep")
        self._spinner = Spinner()
        self._spinner.start(self._node)

    def close(self) -> None:
        """Leave the domain."""
        self._spinner.close()
        self._node.destroy_node()

    def run(self) -> None:
        """Raises ConveyorError if the line has not the belts asked for, or a scan is refused; Stopped if asked to."""
        log = self._node.get_logger()
        log.info("waiting for the simulation")
        while not (self._has_line.is_set() and self._lockstep.service_is_ready()):
            self._require_going_on()
            time.sleep(LOOK)
        line, tick, last, signals, memory = None, 0, 0, dict[str, float](), PlcMemory()
        while line is None or tick < last:
            if self._line is not line:  # at the start, and after a reset
                line, signals, memory = self._line, {}, PlcMemory()
                self._require_belts(line)
                last = _last_tick(line)
                # Stale by intent: the refusal tells the present tick, which is not 0 if this controller was restarted.
                tick = self._call(0, {}).tick
                log.info(f"controls {line.scene_name} from tick {tick}")
                continue
            setpoints: dict[str, float] = {}
            if signals:
                setpoints, memory = scan(signals, self._settings, memory)
            target = min(tick + self._scan_ticks, last)
            response = self._call(target, setpoints, release=target == last)
            if not response.accepted:
                raise ConveyorError(f"lockstep to tick {target} refused: {response.reason}")
            for outcome in response.outcomes:
                if not outcome.accepted:
                    log.warning(f"{', '.join(outcome.names)} refused: {outcome.reason}")
            tick = response.tick
            signals = dict(zip(line.signal_names, response.signals.values, strict=True))
        log.info(f"ends at tick {tick}")

    def _call(self, target: int, setpoints: dict[str, float], release: bool = False) -> Any:
        """The answer to a request, sent again for as long as there is none: the same request is safe to repeat."""
        request = Lockstep.Request(
            run_id=self._run_id,
            target_tick=target,
            names=list(setpoints),
            values=list(setpoints.values()),
            release=release,
        )
        while True:
            self._require_going_on()
            try:
                response = self._lockstep.call(request, timeout_sec=PATIENCE)
            except TimeoutError:  # as newer distributions tell it; Jazzy returns None
                response = None
            if response is not None:
                return response
            self._node.get_logger().warning(f"no answer to the request for tick {target}; sent again")

    def _require_going_on(self) -> None:
        if self._stop.requested:
            raise Stopped

    def _require_belts(self, line: Any) -> None:
        for belt in (self._settings.feeder, self._settings.table):
            if speed_command(belt) not in line.command_names or count_signal(belt) not in line.signal_names:
                belts = ", ".join(line.belts) or "no belts"
                raise ConveyorError(f"belt {belt!r}: not on the line {line.scene_name}, which has {belts}")

    def _on_line(self, line: Any) -> None:
        self._line = line
        self._has_line.set()


def _last_tick(line: Any) -> int:
    """The tick at which the run ends."""
    scene = parse_scene(line.scene_text, line.scene_name, parse_overrides(line.overrides))
    return scene.duration_ticks


def main() -> None:
    """Exits with 0 at the end or after Ctrl-C or SIGTERM, with 1 and one sentence if the controller can't go on."""
    with StopRequest() as stop:
        rclpy.init(signal_handler_options=SignalHandlerOptions.NO)
        try:
            with closing(PlcNode(stop)) as plc, suppress(Stopped):
                plc.run()
        except ConveyorError as error:
            sys.exit(f"plc_node: {error}")
        finally:
            rclpy.shutdown()


if __name__ == "__main__":
    main()
