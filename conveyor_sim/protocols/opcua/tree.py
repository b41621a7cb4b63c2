# SPDX-License-Identifier: Apache-2.0
"""Nodes of a line: its place in the plant, devices by their classes, and a variable for each tag."""

from __future__ import annotations

from asyncua import ua

from conveyor_sim.line.run_state import RUN
from conveyor_sim.line.tag import COMMANDS, SIGNALS, Tag
from conveyor_sim.protocols.opcua.nodes import INDEX, LINE, READ, READ_AND_WRITE, Nodes, node_id, nothing
from conveyor_sim.protocols.opcua.values import as_variant, counted_in_a_day, range_of, unit_of
from conveyor_sim.protocols.tags.control_mode import is_mode
from conveyor_sim.protocols.tags.handshake import TARGET
from conveyor_sim.protocols.tags.tag_provider import LineInfo

WRITTEN_BY, WRITTEN_AT = "written_by", "written_at"
"""Properties of a command: writer of the value in force, and time of its first write."""

VALUE_AS_TEXT = "ValueAsText"
"""Property of an enumeration whose values are not 0, 1, 2, ..."""

RUN_VARIABLES: dict[str, tuple[ua.VariantType, str]] = {
    "tick": (ua.VariantType.Int64, "Ticks since the start."),
    "time": (ua.VariantType.Double, "Simulated time, s."),
    "date_time": (ua.VariantType.DateTime, "Simulated time as a date, from the start_time of the scene."),
    "reason": (ua.VariantType.String, "Reason for a stop, or owner of the lockstep."),
    "lost": (ua.VariantType.String, "Reason why no newer values arrive; empty: they do."),
}
"""Variables of the run, beside its state."""


def add_line(nodes: Nodes, info: LineInfo) -> None:
    """Add all variables of a line, with the objects that hold them."""
    parent = ua.NodeId(ua.ObjectIds.ObjectsFolder)
    parts = [part for part in info.where.split("/") if part]
    for depth, part in enumerate(parts[:-1], start=1):
        parent = nodes.folder(f"where/{'/'.join(parts[:depth])}", part, parent)
    nodes.object(LINE, parts[-1] if parts else info.name, parent, f"The line {info.name}.")
    counted = counted_in_a_day(info.tags)
    for tag in info.tags:
        if is_shown(tag):
            _add_tag(nodes, tag, counted)
    run = node_id(RUN) if RUN in nodes else nodes.object(RUN, RUN, node_id(LINE), "The simulation itself.")
    for name, (kind, description) in RUN_VARIABLES.items():
        nodes.variable(f"{RUN}/{name}", name, run, ua.Variant(nothing(kind), kind), description)
    first = ua.Variant(0, ua.VariantType.Int64)
    text = "Target tick of a line in lockstep. It takes effect together with all writes since the previous target."
    nodes.variable(TARGET, TARGET.rpartition("/")[2], run, first, text, access=READ_AND_WRITE)


def is_shown(tag: Tag) -> bool:
    """Return True if a tag has a variable; faults have none, a method injects them."""
    return tag.role in (*SIGNALS, *COMMANDS, "run")


def has_text(tag: Tag) -> bool:
    """Return True if the text of a tag's value has a separate variable."""
    return tag.kind == "enumeration" and list(tag.texts) != list(range(len(tag.texts)))


def _add_tag(nodes: Nodes, tag: Tag, counted: float) -> None:
    path = tag.name.split("/")
    parent = node_id(LINE)
    for depth in range(1, len(path)):
        name = "/".join(path[:depth])
        of_device = f"{tag.device}: a {tag.device_class}." if name == tag.device else name
        parent = node_id(name) if name in nodes else nodes.object(name, path[depth - 1], parent, of_device)
    writes = tag.role in COMMANDS
    variable = nodes.variable(
        tag.name,
        path[-1],
        parent,
        as_variant(tag, tag.initial),
        tag.description,
        _type_id(tag),
        READ_AND_WRITE if writes or is_mode(tag) else READ,
    )
    extension, texts = ua.VariantType.ExtensionObject, ua.VariantType.LocalizedText
    if tag.kind in ("number", "count"):
        nodes.property(f"{tag.name}/EURange", variable, range_of(tag, counted), ua.ObjectIds.Range, extension)
        nodes.property(f"{tag.name}/EngineeringUnits", variable, unit_of(tag), ua.ObjectIds.EUInformation, extension)
    elif tag.kind == "enumeration" and not has_text(tag):
        strings = [ua.LocalizedText(text) for text in tag.texts.values()]
        nodes.property(f"{tag.name}/EnumStrings", variable, strings, ua.ObjectIds.LocalizedText, texts)
    elif tag.kind == "enumeration":
        values = [ua.EnumValueType(value, ua.LocalizedText(text)) for value, text in sorted(tag.texts.items())]
        nodes.property(f"{tag.name}/EnumValues", variable, values, ua.ObjectIds.EnumValueType, extension)
        text = ua.LocalizedText(tag.texts.get(int(tag.initial), ""))
        nodes.property(f"{tag.name}/{VALUE_AS_TEXT}", variable, text, ua.ObjectIds.LocalizedText, texts)
    if writes:
        for name, kind in ((WRITTEN_BY, ua.VariantType.String), (WRITTEN_AT, ua.VariantType.DateTime)):
            nodes.property(f"{tag.name}/{name}", variable, nothing(kind), kind.value, kind, INDEX)


def _type_id(tag: Tag) -> int:
    if tag.kind in ("number", "count"):
        return int(ua.ObjectIds.AnalogUnitRangeType)
    if tag.kind == "enumeration":
        return int(ua.ObjectIds.MultiStateValueDiscreteType if has_text(tag) else ua.ObjectIds.MultiStateDiscreteType)
    return int(ua.ObjectIds.BaseDataVariableType)
