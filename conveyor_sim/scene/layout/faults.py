# SPDX-License-Identifier: Apache-2.0
"""Faults of a layout while it is expanded."""

from conveyor_sim.scene.problems import Path, Problem


class LayoutFault(Exception):
    """A fault of one conveyor, guide or device. Its expansion ends; that of the others goes on."""

    def __init__(self, path: Path, text: str) -> None:
        """Store the place and the words that follow it."""
        super().__init__(text)
        self.problem = Problem(path, text)
