# SPDX-License-Identifier: Apache-2.0
"""Structured random requests of all OPC UA services: the library's own classes with odd, extreme and missing fields."""

from __future__ import annotations

import math
import random
import uuid
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, fields, is_dataclass
from datetime import datetime, timezone
from enum import Enum, IntFlag
from functools import cache
from typing import Any, get_args, get_origin

from asyncua import ua
from asyncua.ua.ua_binary import get_safe_type_hints

TEXTS = (None, "", "x", "0:1", "1:0", "a:b", "2:line", "\n", "\x1b[2J", "\udcff", "ü" * 300, "x" * 3000, "%s{0}")
URLS = ("opc.tcp://127.0.0.1:4840", "opc.tcp://[::1", "opc.tcp://h:99999/x", "opc.tcp://h:port", "urn:x", "", None)
BYTES = (None, b"", b"\0", b"\xff" * 8, b"\0" * 8, b"x" * 300)
WHOLE = (0, 0, 1, 2, 3, 13, 255, 65535, 2**31 - 1, 2**31, 2**32 - 1, 2**63 - 1, 2**64 - 1, -1, -(2**31), -(2**63))
REAL = (0.0, 1.0, -1.0, 100.0, 1e-300, 1e300, math.inf, -math.inf, math.nan)
TIMES = (
    datetime(1601, 1, 1, tzinfo=timezone.utc),
    datetime(2000, 1, 1, tzinfo=timezone.utc),
    datetime(2030, 6, 1, tzinfo=timezone.utc),
    datetime(9999, 12, 31, tzinfo=timezone.utc),
)
RANGES = {
    "SByte": (-128, 127),
    "Byte": (0, 255),
    "Int16": (-(2**15), 2**15 - 1),
    "UInt16": (0, 2**16 - 1),
    "Int32": (-(2**31), 2**31 - 1),
    "UInt32": (0, 2**32 - 1),
    "Int64": (-(2**63), 2**63 - 1),
    "UInt64": (0, 2**64 - 1),
    "StatusCode": (0, 2**32 - 1),
}
OPERANDS = (ua.LiteralOperand, ua.ElementOperand, ua.SimpleAttributeOperand, ua.AttributeOperand)
STRUCTURES: dict[str, Sequence[type]] = {
    "Filter": (ua.EventFilter, ua.EventFilter, ua.DataChangeFilter, ua.AggregateFilter),
    "FilterOperands": OPERANDS,
    "HistoryReadDetails": (ua.ReadRawModifiedDetails, ua.ReadRawModifiedDetails, ua.ReadEventDetails),
    "UserIdentityToken": (ua.AnonymousIdentityToken, ua.UserNameIdentityToken, ua.X509IdentityToken),
}
"""Contents of extension objects, by the name of the field."""

SERVICES: tuple[type, ...] = tuple(
    getattr(ua, name)
    for name in sorted(vars(ua))
    if name.endswith("Request") and "RequestHeader" in getattr(getattr(ua, name), "__annotations__", ())
)
"""All request types that the library knows, including types that no server of this kind answers."""


@dataclass
class Pool:
    """Values that mean something to the server under attack."""

    nodes: Sequence[ua.NodeId]
    subscriptions: list[int] = field(default_factory=list)
    """Ids and tokens of the attacker and of the victim."""
    items: list[int] = field(default_factory=list)
    sequences: list[int] = field(default_factory=list)
    methods: Sequence[ua.NodeId] = ()


class Requests:
    """Draws requests."""

    def __init__(self, rng: random.Random, pool: Pool, *, longest: int = 4) -> None:
        """longest: elements of an array, in most cases."""
        self._rng, self._pool, self._longest = rng, pool, longest

    def draw(self, kind: type) -> Any:
        """Return a request of a type with the type's default header."""
        request = kind()
        for name, hint in _fields(kind):
            if name not in ("TypeId", "RequestHeader"):
                setattr(request, name, self._value(hint, name, 0))
        return request

    def _value(self, kind: Any, name: str, depth: int) -> Any:
        rng = self._rng
        if get_origin(kind) is list:
            return self._list(get_args(kind)[0], name, depth)
        options = [each for each in get_args(kind) if each is not type(None)]
        if options:  # optional
            return None if rng.random() < 0.3 else self._value(options[0], name, depth)
        if (special := self._special(name)) is not None and kind is not ua.NodeId:
            return special
        for base, make in self._makers().items():
            if isinstance(kind, type) and issubclass(kind, base):
                return make(kind, name, depth)
        if is_dataclass(kind) and isinstance(kind, type) and depth < 8:
            made = kind()
            for inner, hint in _fields(kind):
                if inner != "Encoding":
                    setattr(made, inner, self._value(hint, inner, depth + 1))
            return made
        return kind() if isinstance(kind, type) else None

    def _makers(self) -> dict[type, Callable[[Any, str, int], Any]]:
        rng = self._rng
        return {
            ua.Variant: lambda *_: self.variant(),
            ua.ExtensionObject: lambda _, name, depth: self._structure(name, depth),
            ua.StatusCode: lambda *_: ua.StatusCode(rng.choice([0, 1, 2**31, 0x80010000, 2**32 - 1])),
            ua.NodeId: lambda _, name, __: self._node(name),
            IntFlag: lambda kind, *_: kind(rng.choice([0, 1, *kind])),
            Enum: lambda kind, *_: rng.choice(list(kind)),
            bool: lambda *_: rng.random() < 0.5,
            float: lambda *_: rng.choice(REAL),
            int: lambda kind, *_: self._whole(kind),
            str: lambda _, name, __: rng.choice(URLS if "Url" in name else TEXTS),
            bytes: lambda *_: rng.choice(BYTES),
            datetime: lambda *_: rng.choice(TIMES),
            uuid.UUID: lambda *_: uuid.UUID(int=rng.getrandbits(128)),
        }

    def _list(self, kind: Any, name: str, depth: int) -> Any:
        chance = self._rng.random()
        if chance < 0.06:
            return None
        count = self._rng.randrange(self._longest) if chance < 0.97 or depth > 1 else self._rng.choice([100, 2000])
        return [self._value(kind, name, depth) for _ in range(count)]

    def _special(self, name: str) -> int | None:
        pool, rng = self._pool, self._rng
        known = {
            "SubscriptionId": pool.subscriptions,
            "SubscriptionIds": pool.subscriptions,
            "MonitoredItemId": pool.items,
            "MonitoredItemIds": pool.items,
            "SequenceNumber": pool.sequences,
            "RetransmitSequenceNumber": pool.sequences,
        }.get(name)
        if known and rng.random() < 0.85:
            return rng.choice(known)
        if name == "AttributeId" and rng.random() < 0.8:
            return int(rng.choice([ua.AttributeIds.Value, ua.AttributeIds.EventNotifier, *ua.AttributeIds]))
        return None

    def _node(self, name: str) -> ua.NodeId:
        pool, rng = self._pool, self._rng
        if name == "MethodId" and pool.methods and rng.random() < 0.8:
            return rng.choice(pool.methods)
        if rng.random() < 0.8:
            return rng.choice(pool.nodes)
        return rng.choice(
            [
                ua.NodeId(),
                ua.NodeId(2**32 - 1, 65535),
                ua.NodeId("nowhere", 2),
                ua.NodeId("", 2),
                ua.NodeId(b"\0" * 20, 1, ua.NodeIdType.ByteString),
                ua.NodeId(uuid.UUID(int=rng.getrandbits(128)), 3),
                ua.NodeId(ua.ObjectIds.Server),
            ]
        )

    def _whole(self, kind: type) -> int:
        least, most = next((RANGES[each.__name__] for each in kind.__mro__ if each.__name__ in RANGES), (0, 255))
        return min(max(self._rng.choice(WHOLE), least), most)

    def _structure(self, name: str, depth: int) -> Any:
        chance = self._rng.random()
        if chance < 0.1:
            return None
        if chance < 0.2:
            return ua.ExtensionObject(self._rng.choice([ua.NodeId(1, 77), ua.NodeId(321)]), b"\1\2\3")
        kinds = STRUCTURES.get(name, (ua.Argument, ua.LiteralOperand, ua.EventFilter))
        return self._value(self._rng.choice(kinds), name, depth + 1) if depth < 6 else None

    def variant(self) -> ua.Variant:
        """Return a variant of any type, with values of the victim's ids among them."""
        rng, kinds = self._rng, ua.VariantType
        kind = rng.choice([kinds.UInt32, kinds.String, kinds.Double, *kinds])
        if kind is kinds.UInt32 and self._pool.subscriptions and rng.random() < 0.6:
            return ua.Variant(rng.choice(self._pool.subscriptions + self._pool.items), kind)
        simple: dict[ua.VariantType, Callable[[], Any]] = {
            kinds.Null: lambda: None,
            kinds.Boolean: lambda: rng.random() < 0.5,
            kinds.Float: lambda: rng.choice([0.0, 1.5, math.nan, math.inf]),
            kinds.Double: lambda: rng.choice(REAL),
            kinds.String: lambda: rng.choice([*TEXTS, "belts/zone1", "belts/zone1/trip"]),
            kinds.DateTime: lambda: rng.choice(TIMES),
            kinds.Guid: lambda: uuid.UUID(int=rng.getrandbits(128)),
            kinds.ByteString: lambda: rng.choice(BYTES),
            kinds.XmlElement: lambda: ua.XmlElement("<x/>"),
            kinds.NodeId: lambda: self._node(""),
            kinds.ExpandedNodeId: lambda: ua.ExpandedNodeId(1, 2),
            kinds.StatusCode: lambda: ua.StatusCode(rng.choice([0, 2**31])),
            kinds.QualifiedName: lambda: ua.QualifiedName("x", 2),
            kinds.LocalizedText: lambda: ua.LocalizedText("x", "en"),
            kinds.ExtensionObject: lambda: ua.Argument(),
            kinds.DataValue: ua.DataValue,
            kinds.Variant: lambda: ua.Variant(1, kinds.Int32),
            kinds.DiagnosticInfo: ua.DiagnosticInfo,
        }
        make = simple.get(kind) or (lambda: self._whole(getattr(ua, kind.name)))
        if rng.random() < 0.2:
            return ua.Variant([make() for _ in range(rng.randrange(4))], kind, is_array=True)
        return ua.Variant(make(), kind)


@cache
def _fields(kind: type) -> tuple[tuple[str, Any], ...]:
    hints = get_safe_type_hints(kind, {"ua": ua})
    return tuple((each.name, hints[each.name]) for each in fields(kind))  # type: ignore[arg-type]
