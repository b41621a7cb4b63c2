# SPDX-License-Identifier: Apache-2.0
"""Messages of recordings in earlier formats, converted to the present definitions.

Format 1: Line has no tags. Format 2: Line has tags as columns, in place of messages (`Line.tags`). In both, Line has no
field `format`; the hash of its definition identifies them. Up to format 5, Line has no sweeps.
"""

from __future__ import annotations

import json
import math
import re
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from conveyor_sim.bag.messages import encode
from conveyor_sim.bag.messages.typestore import typestore
from conveyor_sim.line.commands.inputs import recorded_input
from conveyor_sim.support.printable import printable

WITHOUT_NUMBER: Mapping[str, int] = {
    "RIHS01_db99db24d0bf89a0508636a0b854cdb9d7569549f82f2f37515b7b9f4160cb4d": 1,
    "RIHS01_06dff1805076da79e8b08eddcb2bb48f9dbe5eb08f9a9a17f6d36bf0b7ee6c8b": 1,
    "RIHS01_38e29b6282282437d3c9f1b73109fe22fa0f4b1456b802a32c3fe5dfbb2b052b": 2,
}
"""Formats by the hash of Line. Later definitions have a field `format`."""


def upgraded(type_name: str, message: Any, format: int) -> Any:
    """Return a decoded message of an older definition as the present one has it. format: that of the recording.

    Fields that it did not have are zero or empty, except those that follow from others.
    """
    store = typestore()
    definition = store.fielddefs[type_name][1]
    recorded = vars(message)
    values = {name: recorded[name] if name in recorded else _zero(*details) for name, details in definition}
    return store.types[type_name](**{**values, **_CONVERTERS[type_name](message, format)})


def _zero(kind: int, details: Any) -> Any:
    """Return the value of a field that was not recorded: 0 or empty."""
    if kind == _BASE:
        return {"string": "", "float64": 0.0}.get(details[0], 0)
    base = details[0][1]
    is_numbers = details[0][0] == _BASE and base[0] != "string"
    return np.zeros(0, dtype=base[0]) if is_numbers else []


def _line(message: Any, format: int) -> dict[str, Any]:
    if format > 2:
        return {}
    return {"format": format, "tags": _signals_as_tags(message) if format == 1 else _columns_as_tags(message)}


def _signals_as_tags(message: Any) -> list[Any]:
    """Return a tag for each signal, with the little that is known of it."""
    return [
        _tag(name=name, kind="number", role="actual", unit=unit, min=math.nan, max=math.nan)
        for name, unit in zip(message.signal_names, message.signal_units, strict=True)
    ]


def _columns_as_tags(message: Any) -> list[Any]:
    columns = {
        "name": message.tag_names,
        "kind": message.tag_kinds,
        "role": message.tag_roles,
        "unit": message.tag_units,
        "unit_code": message.tag_unit_codes,
        "min": message.tag_min.tolist(),
        "max": message.tag_max.tolist(),
        "initial": message.tag_initial.tolist(),
        "nominal": message.tag_nominal.tolist(),
        "texts": message.tag_texts,
        "description": message.tag_descriptions,
        "device": message.tag_devices,
        "device_class": message.tag_classes,
    }
    rows = zip(*columns.values(), strict=True)
    return [_tag(**dict(zip(columns, row, strict=True))) for row in rows]


def _tag(texts: str = "", **fields: Any) -> Any:
    """Return a conveyor_msgs/Tag. texts: of an enumeration, "0 stopped, 4 idle"."""
    store = typestore()
    states = [(int(value), text) for value, text in _STATE.findall(texts)]
    fields["state_values"] = np.array([value for value, _ in states], dtype=np.int32)
    fields["state_texts"] = [text for _, text in states]
    definition = store.fielddefs[_TAG][1]
    return store.types[_TAG](**{name: fields.get(name, _zero(*details)) for name, details in definition})


_STATE = re.compile(r"(-?\d+) (.*?)(?=, -?\d+ |$)")
"""A value of an enumeration and its text in a tag of format 2."""


def _outcome(message: Any, format: int) -> dict[str, Any]:
    """Return the writer and the operation of a result of format 1, which follow from its source."""
    if format > 1:
        return {}
    request = recorded_input(message.source, tuple(message.names), tuple(message.values))
    return {"writer": request.writer, "writer_kind": request.writer_kind, "operation": request.operation}


def _alarm_states(message: Any, format: int) -> dict[str, Any]:
    """Return the causes of each alarm, which were JSON lists."""
    kind = typestore().types[_ALARM_IDS]
    return {"suppressed_by": [kind(ids=_texts(listed)) for listed in message.suppressed_by]}


def _texts(listed: str) -> list[str]:
    """Return the texts of a JSON list. Raise ValueError for anything else."""
    texts = json.loads(listed)
    if not (isinstance(texts, list) and all(isinstance(text, str) for text in texts)):
        raise ValueError(f"suppressed_by: {printable(listed)} given, expected a JSON list of ids")
    return texts


def _signals(message: Any, format: int) -> dict[str, Any]:
    """Return nothing: in signals of format 1 none is forced."""
    return {}


def _counters(message: Any, format: int) -> dict[str, Any]:
    """Return the reference of effectiveness, which was the nominal rate; effectiveness at the set rate is unknown."""
    return {"rate_limit": message.rate, "set_effectiveness": np.full(len(message.name), np.nan)}


_BASE = 1  # rosbags' kind of fields with numbers and texts
_TAG, _ALARM_IDS = "conveyor_msgs/msg/Tag", "conveyor_msgs/msg/AlarmIds"
_CONVERTERS: Mapping[str, Callable[[Any, int], dict[str, Any]]] = {
    encode.LINE: _line,
    encode.OUTCOME: _outcome,
    encode.ALARM_STATES: _alarm_states,
    encode.SIGNALS: _signals,
    encode.COUNTERS: _counters,
}
"""Functions of a message and the format of the recording that return the fields to replace."""

CONVERTED = frozenset(_CONVERTERS)
"""Types whose older definitions `upgraded` converts."""
