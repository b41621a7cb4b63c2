"""All that changes as a scene runs: its arrays, and their checkpoint in a file."""

from conveyor_sim.state.state import State

__all__ = ["State"]
