"""JSON Schema of the fields of a scene file that composition replaces: parameters, files, cells, variants, formats."""

from collections.abc import Iterable
from typing import Any

from conveyor_sim.scene.layout.cells import JOIN, PLACE
from conveyor_sim.scene.layout.choices import NOT_IN_VARIANTS
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
