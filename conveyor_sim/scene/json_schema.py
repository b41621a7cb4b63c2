# SPDX-License-Identifier: Apache-2.0
"""JSON Schema (draft 2020-12) of scene files, with which editors complete, document and check them."""

import re
from collections.abc import Callable, Iterable
from itertools import combinations
from typing import Any, cast

from pydantic import BaseModel
from pydantic.json_schema import models_json_schema

from conveyor_sim.scene.layout.cells import JOIN, PLACE, WITH_PORTS
from conveyor_sim.scene.layout.choices import NOT_IN_VARIANTS
from conveyor_sim.scene.layout.devices import PLACEABLE, Placeable
from conveyor_sim.scene.layout.parts import Conveyor, SceneLayout
from conveyor_sim.scene.parts.infeed import Infeed
from conveyor_sim.scene.parts.source import Source
from conveyor_sim.scene.quantities import FULL_TURN, example_of
from conveyor_sim.scene.schema import Scene
from conveyor_sim.scene.text_patterns import text_pattern

Node = dict[str, Any]

NAME = "^[A-Za-z][A-Za-z0-9_]*$"
NAME_OR_PORT = r"^[A-Za-z][A-Za-z0-9_]*(\.[A-Za-z][A-Za-z0-9_]*)?$"

_VALUE: Node = {"anyOf": [{"type": "number"}, {"type": "string", "pattern": text_pattern("that of the parameter")}]}
_PATH: Node = {"type": "string", "minLength": 1}


def language_fields(conveyor: Node, fields: Iterable[str]) -> Node:
    """Return the schemas of the fields. conveyor: schema of a conveyor; fields: other fields of a scene."""
    places = {name: conveyor["properties"][name] for name in (*JOIN, *PLACE)}
    cell = _mapping(
        {"use": _described("Cell file.", _PATH), "set": _values("Parameters of the cell."), **places}, ["use"]
    )
    parameter = {
        name: _described(text, _VALUE)
        for name, text in (("default", "Value."), ("min", "Least value."), ("max", "Greatest value."))
    }
    parameter["description"] = _described("Meaning.", {"type": "string"})
    kind = {"bottle": _described("Bottle type of all entries.", _name()), "set": _values("Parameters of the scene.")}
    varied = [*(name for name in fields if name not in NOT_IN_VARIANTS), "parameters", "cells", "format"]
    return {
        "include": _described("Files whose fields are joined to those of this file.", _or_list(_PATH)),
        "parameters": _named(
            "Quantities that texts refer to by name.", {"anyOf": [_VALUE, _mapping(parameter, ["default"])]}
        ),
        "cells": _named("Parts of a line from other files, by name.", cell),
        "ports": _named("Ends of conveyors where a cell is joined.", {"type": "string", "pattern": NAME_OR_PORT}),
        "variants": _named("Fields of the scene that differ, by name.", _mapping({name: {} for name in varied}, [])),
        "formats": _named("Bottle type and parameters, by name.", _mapping(kind, [])),
        "variant": _described("Variant that is simulated. Left out: none.", _name()),
        "format": _described("Format at the start. Left out: none.", _name()),
    }


def _described(description: str, schema: Node) -> Node:
    return {"description": description, **schema}


def _name() -> Node:
    return {"type": "string", "pattern": NAME}


def _or_list(schema: Node) -> Node:
    return {"anyOf": [schema, {"type": "array", "items": schema}]}


def _mapping(properties: Node, required: list[str]) -> Node:
    return {"type": "object", "properties": properties, "required": required, "additionalProperties": False}


def _named(description: str, schema: Node) -> Node:
    return _described(
        description, {"type": "object", "patternProperties": {NAME: schema}, "additionalProperties": False}
    )


def _values(description: str) -> Node:
    return _named(description, _VALUE)


PLACES = tuple(dict.fromkeys(kind.place for kind in PLACEABLE))
"""Parts whose definitions `placed_devices` needs."""

_GIVEN_BY_PLACE = ("speed",)
"""Required fields of a device that have a default along a conveyor."""


def placed_devices(definitions: dict[str, Node]) -> dict[str, dict[str, Node]]:
    """Return the definitions of all devices along conveyors, by the name of the definition of the device."""
    kinds: dict[str, list[Placeable]] = {}
    for kind in PLACEABLE:
        kinds.setdefault(kind.part.__name__, []).append(kind)
    return {
        part: {f"{part}_{_suffix(some)}": _placed(definitions, part, some) for some in _choices(own)}
        for part, own in kinds.items()
    }


def _choices(kinds: list[Placeable]) -> Iterable[tuple[Placeable, ...]]:
    """Yield the places that a device may have together."""
    for count in range(1, len(kinds) + 1):
        yield from combinations(kinds, count)


def _suffix(kinds: tuple[Placeable, ...]) -> str:
    return "_".join(kind.within or "along" for kind in kinds)


def _placed(definitions: dict[str, Node], part: str, kinds: tuple[Placeable, ...]) -> Node:
    device = definitions[part]
    properties, required = dict(device["properties"]), list(device.get("required", []))
    for kind in kinds:
        place = definitions[kind.place.__name__]
        own = {kind.within: place} if kind.within else place["properties"]
        needed = [kind.within] if kind.within else place.get("required", [])
        replaced = {*kind.instead, *own, *_GIVEN_BY_PLACE}
        properties = {name: field for name, field in properties.items() if name not in kind.instead} | own
        required = [*(name for name in required if name not in replaced), *needed]
    return {**device, "properties": properties, "required": required}


DIALECT = "https://json-schema.org/draft/2020-12/schema"


def scene_schema() -> Node:
    """Return the JSON Schema of scene files. It holds for cell files, too."""
    models: tuple[type[BaseModel], ...] = (Scene, SceneLayout, *PLACES)
    _, both = models_json_schema([(model, "validation") for model in models], by_alias=True)
    definitions: dict[str, Node] = both["$defs"]
    texts: dict[str, Node] = {}
    for model in definitions.values():
        for name, field in model.get("properties", {}).items():
            model["properties"][name] = _field(field, texts)
            if name in WITH_PORTS:
                model["properties"][name] = _with_ports(model["properties"][name])
    for part in (Infeed, Source):
        definitions[part.__name__]["required"].remove("bottle")  # a format may give it
    scene, layout = definitions.pop(Scene.__name__), definitions.pop(SceneLayout.__name__)
    fields = {**scene["properties"], **layout["properties"]}
    language = language_fields(definitions[Conveyor.__name__], fields)
    placed = placed_devices(definitions)
    for place in PLACES:
        del definitions[place.__name__]
    everything = {**scene, "properties": {**fields, **language}, "$defs": definitions}
    choices = {f"#/$defs/{name}": [f"#/$defs/{one}" for one in (*ways, name)] for name, ways in placed.items()}
    closed: Node = _each(_each(everything, lambda node: _with_choices(node, choices)), _closed)
    for more in (*placed.values(), texts):
        closed["$defs"] |= _each(more, _closed)
    # Other files may hold the fields that a scene needs.
    required = [closed.pop("required"), ["include"], ["ports"]]
    title = "Scene of conveyor-sim"
    return {"$schema": DIALECT, **closed, "title": title, "anyOf": [{"required": names} for names in required]}


def _with_choices(node: Node, choices: dict[str, list[str]]) -> Node:
    """Return a reference as a choice of references."""
    if node.get("$ref") not in choices:
        return node
    other = {key: value for key, value in node.items() if key != "$ref"}
    return {**other, "anyOf": [{"$ref": name} for name in choices[node["$ref"]]]}


def _with_ports(schema: Node) -> Node:
    """Return the schema of a name of a conveyor, or several, which takes a port of a cell in place of each."""

    def change(node: Node) -> Node:
        return {**node, "pattern": NAME_OR_PORT} if "pattern" in node else node

    return cast(Node, _each(schema, change))


def _field(field: Node, texts: dict[str, Node]) -> Node:
    """Return the schema of a field, with its unit in the description, and with texts beside its numbers."""
    kept = {key: value for key, value in field.items() if key not in ("unit", "title", "description", "default")}
    unit, description = field.get("unit", ""), field.get("description", "")
    shown = f"{description} ({unit})" if unit not in ("", "1") else description
    default = {"default": field["default"]} if isinstance(field.get("default"), (str, int, float)) else {}
    return {"description": shown, **default, **(_with_texts(kept, unit.split(", "), texts) if unit else kept)}


def _with_texts(schema: Node, units: list[str], texts: dict[str, Node]) -> Node:
    """Return a schema that takes texts of quantities wherever it takes numbers.

    units: several for the items of the innermost lists. texts: definitions by name, which grow.
    """
    if schema.get("type") in ("number", "integer"):
        (unit,) = units
        name = "text_in_" + (re.sub(r"\W+", "_", unit).strip("_") or "any")
        example = example_of(unit)
        texts[name] = {"type": "string", "pattern": text_pattern(unit), **({"examples": [example]} if example else {})}
        turn = {"minimum": -FULL_TURN, "maximum": FULL_TURN} if unit == "rad" else {}
        return {"anyOf": [{**turn, **schema}, {"$ref": f"#/$defs/{name}"}]}
    changed = dict(schema)
    for key in ("anyOf", "oneOf"):
        if key in schema:
            changed[key] = [_with_texts(item, units, texts) for item in schema[key]]
    if "prefixItems" in schema:
        own = [[unit] for unit in units] if len(units) > 1 else [units] * len(schema["prefixItems"])
        changed["prefixItems"] = [
            _with_texts(item, its, texts) for item, its in zip(schema["prefixItems"], own, strict=True)
        ]
    for key in ("items", "additionalProperties"):
        if isinstance(schema.get(key), dict):
            changed[key] = _with_texts(schema[key], units, texts)
    if "patternProperties" in schema:
        items = schema["patternProperties"].items()
        changed["patternProperties"] = {name: _with_texts(item, units, texts) for name, item in items}
    return changed


def _each(node: Any, change: Callable[[Node], Node]) -> Any:
    """Return a schema with all mappings in it changed, the inner ones first."""
    if isinstance(node, dict):
        return change({key: _each(value, change) for key, value in node.items()})
    return [_each(item, change) for item in node] if isinstance(node, list) else node


def _closed(node: Node) -> Node:
    """Return a mapping with names of ECMAScript's anchors, and without names that no pattern allows."""
    if isinstance(node.get("pattern"), str):
        node["pattern"] = _anchored(node["pattern"])
    if "patternProperties" in node:
        node["patternProperties"] = {_anchored(name): value for name, value in node["patternProperties"].items()}
        node.setdefault("additionalProperties", False)
    return node


def _anchored(pattern: str) -> str:
    return re.sub(r"\\z$", "$", re.sub(r"^\\A", "^", pattern))
