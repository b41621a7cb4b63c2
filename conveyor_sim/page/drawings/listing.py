# SPDX-License-Identifier: Apache-2.0
"""Lists of skipped entities."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator, Sequence

from conveyor_sim.page.drawings.entities import EntityRef
from conveyor_sim.support.printable import printable

_HANDLES = 8
"""Largest number of handles on one line."""


def skipped_lines(skipped: Sequence[tuple[EntityRef, str]]) -> Iterator[str]:
    """Yield one line for each type, layer and reason, with the handles of the entities."""
    groups: dict[tuple[str, str, str], list[str]] = defaultdict(list)
    for source, reason in skipped:
        groups[source.entity, source.layer, reason].append(source.handle)
    for (entity, layer, reason), handles in groups.items():
        more = f" and {len(handles) - _HANDLES} more" if len(handles) > _HANDLES else ""
        shown = ", ".join(handles[:_HANDLES])
        yield f"skipped {entity} on layer {printable(layer)} ({shown}{more}): {printable(reason)}"
