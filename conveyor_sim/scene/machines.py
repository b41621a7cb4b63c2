"""Kinds of machine in a scene file."""

from typing import Annotated

from pydantic import Tag

from conveyor_sim.scene.part import one_of
from conveyor_sim.scene.parts.inspection import Inspection
from conveyor_sim.scene.parts.reject import Reject
from conveyor_sim.scene.parts.sink import Sink
from conveyor_sim.scene.parts.source import Source
from conveyor_sim.scene.parts.station import Station

Machine = Annotated[
    Annotated[Source, Tag("(source)")]
    | Annotated[Sink, Tag("(sink)")]
    | Annotated[Station, Tag("(station)")]
    | Annotated[Inspection, Tag("(inspection)")]
    | Annotated[Reject, Tag("(reject)")],
    one_of({kind: f"({kind})" for kind in ("source", "sink", "station", "inspection", "reject")}),
]
