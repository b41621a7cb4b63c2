"""Executable `plc_node`: a PLC-like controller of the paper's plant, a ROS node of its own, in lockstep.

What it decides is the level control of conveyor_sim/control/level.py, from the count of bottles on the table.
"""

from __future__ import annotations

import sys
from collections.abc import Mapping
from contextlib import closing, suppress
from typing import Any

from conveyor_sim.support.interrupt import while_importing

with while_importing():
    from conveyor_sim.control.level import Count, LevelControl
    from conveyor_sim.control.scan import ControlError, Controller
    from conveyor_sim.errors import ConveyorError
    from conveyor_sim.line.process_image import speed_command
    from conveyor_sim.ros.context import new_node, running_ros
    from conveyor_sim.ros.controller import ControllerRun, Stopped
    from conveyor_sim.ros.declared import Entry, declare_table
    from conveyor_sim.ros.stop_request import StopRequest
    from conveyor_sim.support.printable import printable, printable_lines

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


def run(stop: StopRequest) -> None:
    """Control until the end of the run, or until asked to stop. Raises ConveyorError."""
    node = new_node("plc_node")
    settings = declare_table(node, SETTINGS)
    scanning = declare_table(node, SCANNING)
    controller = ControllerRun(node, lambda line: level_control(line, settings), **scanning, stop=stop)
    with closing(controller), suppress(Stopped):
        controller.run_lockstep()


def level_control(line: Any, settings: Mapping[str, Any]) -> Controller:
    """Level control of a line (conveyor_msgs/Line). Raises ConveyorError if it has not the belts asked for."""
    for belt in (settings["feeder"], settings["table"]):
        if speed_command(belt) not in line.command_names:
            belts = ", ".join(line.belts) or "no belts"
            name = printable(line.scene_name)
            raise ConveyorError(f"belt '{printable(belt)}': not on the line {name}, which has {printable(belts)}")
    speeds = {name: settings[name] for name in ("feeder", "table", "feeder_speed", "table_slow", "table_fast")}
    count = Count(f"belts/{settings['table']}/bottles")
    try:
        return LevelControl(count, high=settings["high_mark"], low=settings["low_mark"], **speeds)
    except ControlError as error:
        raise ConveyorError(f"marks: {error}") from error


def main() -> None:
    """Exits with 0 at the end or after Ctrl-C or SIGTERM, with 1 and one sentence if the controller can't go on."""
    with StopRequest() as stop:
        try:
            with running_ros():
                run(stop)
        except ConveyorError as error:
            sys.exit(f"plc_node: {printable_lines(error)}")


if __name__ == "__main__":
    main()
