# SPDX-License-Identifier: Apache-2.0
"""`Weihenstephan`: data points of each machine by their names in the Weihenstephan Standards (OPC 40600).

The types of that NodeSet are not used: they depend on two other NodeSets, and on much that a line does not have.
"""

from __future__ import annotations

from collections.abc import Mapping
from datetime import datetime

from asyncua import ua

from conveyor_sim.line.machines.weihenstephan import DATA_POINTS, data_points, names_of
from conveyor_sim.line.tag import Tag
from conveyor_sim.protocols.opcua.nodes import Nodes, node_id
from conveyor_sim.protocols.opcua.values import status_of
from conveyor_sim.protocols.tags.tag_provider import LineSnapshot, TagProvider, TickClock

NAME = "Weihenstephan"
"""Name of the object below a machine."""


class Weihenstephan:
    """Data points of the machines of one tag provider."""

    def __init__(self, source: TagProvider, nodes: Nodes, clock: TickClock) -> None:
        """Add an object for each machine that has data points."""
        self._nodes, self._clock = nodes, clock
        self._tags: Mapping[str, Tag] = {tag.name: tag for tag in source.info.tags}
        self._machines = list(dict.fromkeys(tag.device for tag in source.info.tags if names_of(tag)))
        self._status = int(ua.StatusCodes.Good)
        self._written: dict[str, float] = {}
        initial = {tag.name: tag.initial for tag in source.info.tags}
        for machine in self._machines:
            root = f"{machine}/{NAME}"
            nodes.object(root, NAME, node_id(machine), "Data points of the Weihenstephan Standards.")
            for name, value in data_points(machine, self._tags, initial).items():
                point = DATA_POINTS[name]
                what = f"{point.what} Data point {point.number}."
                nodes.variable(f"{root}/{name}", name, node_id(root), _variant(name, value), what)

    async def follow(self, snapshot: LineSnapshot, heard: datetime, back: bool) -> None:
        """Write the data points that have changed."""
        status, stamp = status_of(snapshot), self._clock.stamp(snapshot.tick, heard)
        if status != self._status or back:
            self._status = status
            self._written.clear()
        for machine in self._machines:
            for name, value in data_points(machine, self._tags, snapshot.values).items():
                path = f"{machine}/{NAME}/{name}"
                if self._written.get(path) != value:
                    self._written[path] = value
                    await self._nodes.write(path, _variant(name, value), stamp, status)


def _variant(name: str, value: float) -> ua.Variant:
    """Return a data point as a Double if it is a speed, as a UInt32 otherwise."""
    if name.endswith("_Spd"):
        return ua.Variant(float(value), ua.VariantType.Double)
    return ua.Variant(int(value), ua.VariantType.UInt32)
