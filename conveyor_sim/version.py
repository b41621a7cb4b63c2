"""The version of this package, stated once for Python; package.xml repeats it, and a test compares them."""

from functools import lru_cache
from pathlib import Path

from conveyor_sim.engine.compiler.source_hash import source_hash

__version__ = "0.1.0"

DECIDE_BITS = (
    "accounts", "effects", "laws", "line", "model", "scene", "simulation.py", "state", "stepping", "timestep",
)  # fmt: skip
"""Rooms that decide the bits of a run, beside the engine, which has a hash of its own."""


@lru_cache(maxsize=1)
def sources_hash() -> str:
    """Eight hex digits over what the sources of these rooms do."""
    root = Path(__file__).parent
    rooms = (root / name for name in DECIDE_BITS)
    sources = (source for room in rooms for source in (room.rglob("*.py") if room.is_dir() else [room]))
    return source_hash(root, sources, 4)
