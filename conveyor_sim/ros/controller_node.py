# SPDX-License-Identifier: Apache-2.0
"""Executable `controller_node`: runs a controller, found by its name, beside the node `conveyor_sim`.

    controller_node --ros-args -p controller:=my_line.py:make -p "parameters:='{table: accumulation}'"
    controller_node --ros-args -p controller:=program.st

The simulation must wait (start_paused:=true) for a controller in lockstep. For a free controller (mode:=free), it must
play and output `signals`.
"""

from __future__ import annotations

import sys
from contextlib import closing, suppress
from typing import Any

from conveyor_sim.ros.packages import needing_packages
from conveyor_sim.support.interrupt import while_importing

with while_importing(), needing_packages("controller_node"):
    from conveyor_sim.control.scan import ControlError, Controller, LineTags, bind
    from conveyor_sim.control.st.load import load
    from conveyor_sim.errors import ConveyorError
    from conveyor_sim.line.tag import CONTROLLED
    from conveyor_sim.ros.context import new_node, running_ros
    from conveyor_sim.ros.controller import ControllerRun, Stopped
    from conveyor_sim.ros.parameters import DeclaredParameter, declare_table
    from conveyor_sim.run.controller_parameters import controller_parameters
    from conveyor_sim.support.printable import SENTENCE, printable, printable_lines
    from conveyor_sim.support.stop_request import StopRequest

NAME = "controller"
MODES = ("lockstep", "free")

PARAMETERS = (
    DeclaredParameter("controller", "", "program.st, library.so, module:factory or file.py:factory."),
    DeclaredParameter("parameters", "", "Parameters of the factory or program by name: a YAML mapping, or its file."),
    DeclaredParameter(
        "mode", "lockstep", "lockstep: the simulation waits for every scan; free: it does not.", choices=MODES
    ),
    DeclaredParameter("scan_ticks", 1, "Ticks from one scan to the next.", 1, 10**6),
    DeclaredParameter("run_id", NAME, "Name under which it owns the simulation in lockstep; the same after a restart."),
    DeclaredParameter("released", "", "Devices that others may command in lockstep: patterns, separated by commas."),
)


def run(stop: StopRequest) -> None:
    """Control until the end of the run, or a stop request. Raise ConveyorError."""
    node = new_node(NAME)
    values = declare_table(node, PARAMETERS)
    parameters = controller_parameters(values["parameters"], "parameter parameters")

    def make(line: Any) -> Controller:
        try:
            controller = load(values["controller"], parameters)
            if line is not None:
                tags = {tag.name: tag for tag in line.tags}
                controlled = [name for name in line.command_names if tags[name].role in CONTROLLED]
                signals, commands = (
                    {name: tags[name].kind for name in names} for names in (line.signal_names, controlled)
                )
                limits = {name: (tags[name].min, tags[name].max) for name in commands}
                bind(controller, LineTags(signals, commands, limits))
                for sentence in getattr(controller, "left_over", ()):
                    node.get_logger().info(printable(sentence, SENTENCE))
            return controller
        except ControlError as error:
            raise ConveyorError(str(error)) from error

    make(None)  # reports errors before there is a simulation
    released = [pattern.strip() for pattern in values["released"].split(",") if pattern.strip()]
    controller = ControllerRun(
        node, make, scan_ticks=values["scan_ticks"], run_id=values["run_id"], released=released, stop=stop
    )
    with closing(controller), suppress(Stopped):
        if values["mode"] == "free":
            controller.run_free()
        else:
            controller.run_lockstep()


def main() -> None:
    """Exit with 0 at the end, after Ctrl-C or SIGTERM; with 1 and one sentence if the controller can't go on."""
    with StopRequest() as stop:
        try:
            with running_ros():
                run(stop)
        except ConveyorError as error:
            sys.exit(f"controller_node: {printable_lines(error)}")


if __name__ == "__main__":
    main()
