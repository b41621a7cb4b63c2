# SPDX-License-Identifier: Apache-2.0
"""Version hashes: identify the sources that decide the bits of a run."""

from functools import lru_cache
from pathlib import Path

from conveyor_sim.engine.compiler.source_hash import source_hash

DECIDE_BITS = ("line", "physics", "scene", "simulation.py")
"""Packages and modules that decide the bits of a run, beside the engine, which has its own hash."""


@lru_cache(maxsize=1)
def sources_hash() -> str:
    """Return eight hex digits over the statements of these sources."""
    root = Path(__file__).parents[1]
    named = (root / name for name in DECIDE_BITS)
    sources = (source for one in named for source in (one.rglob("*.py") if one.is_dir() else [one]))
    return source_hash(root, sources, 4)


def version_hashes() -> tuple[str, str]:
    """Return the hashes of the engine and of the other sources that decide bits."""
    from conveyor_sim.engine.compiler.compile import ENGINE_HASH  # loads the compiler

    return ENGINE_HASH, sources_hash()
