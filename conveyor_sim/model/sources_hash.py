"""Version hash: identifies the sources that decide the bits of a run."""

from functools import lru_cache
from pathlib import Path

from conveyor_sim.engine.compiler.source_hash import source_hash

DECIDE_BITS = (
    "accounts", "effects", "laws", "line", "model", "scene", "simulation.py", "state", "stepping", "timestep",
)  # fmt: skip
"""Packages and modules that decide the bits of a run, beside the engine, which has its own hash."""


@lru_cache(maxsize=1)
def sources_hash() -> str:
    """Return eight hex digits over the statements of these sources."""
    root = Path(__file__).parents[1]
    named = (root / name for name in DECIDE_BITS)
    sources = (source for one in named for source in (one.rglob("*.py") if one.is_dir() else [one]))
    return source_hash(root, sources, 4)
