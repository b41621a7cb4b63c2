# SPDX-License-Identifier: Apache-2.0
"""State of a run: its arrays, and their checkpoint in a file."""

from conveyor_sim.physics.state.state import State

__all__ = ["State"]
