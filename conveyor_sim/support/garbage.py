# SPDX-License-Identifier: Apache-2.0
"""Control of Python's garbage collection."""

from __future__ import annotations

import gc
from collections.abc import Iterator
from contextlib import contextmanager


@contextmanager
def collected_later() -> Iterator[None]:
    """Collect no garbage within the context, and never look through its objects later.

    This is for code that makes very many permanent objects, such as imports. Repeated collection would take an eighth
    of the time.
    """
    before = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        gc.freeze()
        if before:
            gc.enable()
