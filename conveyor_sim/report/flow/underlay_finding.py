"""Finding of an underlay that can't be shown."""

from __future__ import annotations

from collections.abc import Iterator

from conveyor_sim.page.drawings.underlay import shown_underlay
from conveyor_sim.report.flow.finding import Finding
from conveyor_sim.scene.schema import Scene


def hidden_underlay(scene: Scene) -> Iterator[Finding]:
    """Yield a finding for an underlay that can't be shown."""
    shown = shown_underlay(scene)
    if isinstance(shown, str):
        yield Finding(("underlay", "file"), shown)
