"""The version of this package, stated once for Python; package.xml repeats it, and a test compares them."""

import hashlib
from functools import lru_cache
from pathlib import Path

__version__ = "0.1.0"


@lru_cache(maxsize=1)
def sources_hash() -> str:
    """Eight hex digits over what decides a run outside the engine: scene, effects, model, state and line."""
    root = Path(__file__).parent
    digest = hashlib.blake2b(digest_size=4)
    for source in sorted(
        [*root.glob("*.py"), *root.glob("scene/*.py"), *root.glob("effects/*.py"), *root.glob("line/*.py")]
    ):
        digest.update(source.relative_to(root).as_posix().encode() + b"\0" + source.read_bytes() + b"\0")
    return digest.hexdigest()
