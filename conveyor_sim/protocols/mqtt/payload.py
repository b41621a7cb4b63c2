"""Payload of Sparkplug B: messages with the field numbers of the specification (3.0, 6.4), and data types.

Only the parts that a line needs are here. A metric of another kind (data set, template, file) decodes without a value.
"""

from __future__ import annotations

from typing import Any

from google.protobuf import descriptor_pb2, descriptor_pool, message_factory
from google.protobuf.message import DecodeError

INT32, INT64, DOUBLE, BOOLEAN, STRING = 3, 4, 10, 11, 12
"""Data types."""

BAD, GOOD, STALE = 0, 192, 500
"""Values of property QUALITY."""

QUALITY = "Quality"
"""Key of the property with the quality of a value; without it, the quality is good."""

_FIELDS: dict[str, str] = {
    "Payload": "timestamp=1:uint64 metrics=2:Metric* seq=3:uint64 uuid=4:string body=5:bytes",
    "Metric": "name=1:string alias=2:uint64 timestamp=3:uint64 datatype=4:uint32 is_historical=5:bool "
    "is_transient=6:bool is_null=7:bool metadata=8:MetaData properties=9:PropertySet int_value=10:uint32 "
    "long_value=11:uint64 float_value=12:float double_value=13:double boolean_value=14:bool string_value=15:string",
    "MetaData": "description=8:string",
    "PropertySet": "keys=1:string* values=2:PropertyValue*",
    "PropertyValue": "type=1:uint32 is_null=2:bool int_value=3:uint32 long_value=4:uint64 float_value=5:float "
    "double_value=6:double boolean_value=7:bool string_value=8:string",
}
"""Fields by message: name, number and type; * for repeated ones. Fields that end in `_value` exclude each other."""

_PACKAGE = "conveyor_sim.sparkplug"


def _messages() -> dict[str, Any]:
    """Return the class of each message."""
    file = descriptor_pb2.FileDescriptorProto(name="sparkplug_b.proto", package=_PACKAGE, syntax="proto2")
    for message, fields in _FIELDS.items():
        described = file.message_type.add(name=message)
        for field in fields.split():
            name, _, rest = field.partition("=")
            number, _, kind = rest.partition(":")
            added = described.field.add(name=name, number=int(number))
            added.label = added.LABEL_REPEATED if kind.endswith("*") else added.LABEL_OPTIONAL
            kind = kind.rstrip("*")
            if kind in _FIELDS:
                added.type, added.type_name = added.TYPE_MESSAGE, f".{_PACKAGE}.{kind}"
            else:
                added.type = getattr(added, f"TYPE_{kind.upper()}")
            if name.endswith("_value"):
                if not described.oneof_decl:
                    described.oneof_decl.add(name="value")
                added.oneof_index = 0
    pool = descriptor_pool.DescriptorPool()  # a separate pool, because another package may use these names
    pool.Add(file)
    return {name: message_factory.GetMessageClass(pool.FindMessageTypeByName(f"{_PACKAGE}.{name}")) for name in _FIELDS}


Payload: Any = _messages()["Payload"]
"""Class of a payload."""

_VALUES = {INT32: "int_value", INT64: "long_value", DOUBLE: "double_value", BOOLEAN: "boolean_value"}
_BITS = {INT32: 2**32, INT64: 2**64}


def decoded(data: bytes) -> Any:
    """Return a decoded payload. Raises ValueError if it is malformed."""
    try:
        return Payload.FromString(data)
    except (DecodeError, UnicodeDecodeError) as error:
        raise ValueError(f"{len(data)} bytes that are no payload of Sparkplug B") from error


def add_metric(payload: Any, name: str, kind: int, value: float | str | None, stamp: int) -> Any:
    """Add a metric to a payload and return it. kind: data type; value: None for no value; stamp: ms since 1970, UTC.

    The data type is stated in data messages as well, where it is optional, because some hosts need it.
    """
    metric = payload.metrics.add(name=name, timestamp=stamp, datatype=kind)
    if value is None:
        metric.is_null = True
    else:
        _put(metric, kind, value)
    return metric


def add_property(metric: Any, key: str, kind: int, value: float | str) -> None:
    """Add a property to a metric."""
    metric.properties.keys.append(key)
    _put(metric.properties.values.add(type=kind), kind, value)


def whole(field: str, value: int) -> int:
    """Return the value of an integer field, in which negative numbers are two's complements."""
    bits = 2**32 if field == "int_value" else 2**64
    return value - bits if value >= bits // 2 else value


def _put(owner: Any, kind: int, value: float | str) -> None:
    if kind in _BITS:
        value = int(value) % _BITS[kind]
    setattr(owner, _VALUES.get(kind, "string_value"), bool(value) if kind == BOOLEAN else value)
