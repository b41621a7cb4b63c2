# SPDX-License-Identifier: Apache-2.0
"""The command `conveyor-sim`, of `command.py`: Ctrl-C ends it with one line while it is imported, too."""

from conveyor_sim.support.interrupt import while_importing

with while_importing():
    from conveyor_sim.cli.command import main

__all__ = ["main"]
