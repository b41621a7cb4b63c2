# SPDX-License-Identifier: Apache-2.0
"""Executable `sim_node`: runs the node until Ctrl-C, SIGTERM, or a request to quit."""

from __future__ import annotations

import sys

from conveyor_sim.ros.packages import needing_packages
from conveyor_sim.support.interrupt import while_importing

with while_importing(), needing_packages("sim_node"):
    import rclpy

    from conveyor_sim.errors import ConveyorError
    from conveyor_sim.ros.context import start_ros
    from conveyor_sim.ros.node import SimNode
    from conveyor_sim.support.printable import printable_lines
    from conveyor_sim.support.stop_request import StopRequest


def main() -> None:
    """Exit with 0 after an orderly end, with 1 and one sentence if the node can't start or go on."""
    with StopRequest() as stop:
        try:
            start_ros()
            node = SimNode(on_stop=stop.request)
        except ConveyorError as error:
            sys.exit(f"sim_node: {printable_lines(error)}")
        stop.wait()
        node.close()
        rclpy.shutdown()
    if isinstance(node.error, ConveyorError):
        sys.exit(f"sim_node: {printable_lines(node.error)}")
    if node.error is not None:
        sys.exit(f"sim_node: {type(node.error).__name__}: {node.error}")


if __name__ == "__main__":
    main()
