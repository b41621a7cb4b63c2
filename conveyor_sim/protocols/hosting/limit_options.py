"""Limits and quotas of the protocol servers from `--limit NAME=VALUE`."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import asdict, replace
from typing import Any

from conveyor_sim.protocols.hosting.settings import ServerSettings
from conveyor_sim.protocols.server.interface import ServerError
from conveyor_sim.support.printable import printable

_FIELDS: Mapping[str, tuple[str, ...]] = {
    "opcua": ("opcua_limits", "opcua_quota"),
    "modbus": ("modbus_quota",),
    "web": ("web_quota",),
}
"""Fields of `ServerSettings` by protocol."""

_UNUSED = ("modbus.connections_per_user",)
"""Modbus has no users."""

_LARGEST = 1_000_000_000


def limit_names() -> list[str]:
    """Return all names in the order of their declaration: "opcua.nodes_per_read"."""
    settings = ServerSettings()
    names = [
        f"{protocol}.{name}"
        for protocol, fields in _FIELDS.items()
        for field in fields
        for name in asdict(getattr(settings, field))
    ]
    return [name for name in names if name not in _UNUSED]


def limit_settings(options: Iterable[str]) -> dict[str, Any]:
    """Return the fields of `ServerSettings` that options such as "opcua.connections=32" change.

    Raises ServerError for an unknown name, a value that is no integer from 1 to 1 000 000 000, and a name given twice.
    """
    settings: dict[str, Any] = {}
    names, seen = limit_names(), set()
    for option in options:
        name, _, text = option.partition("=")
        if name not in names:
            raise ServerError(f"--limit: {printable(name)} given, expected one of {', '.join(names)}")
        if name in seen:
            raise ServerError(f"--limit: {name} given twice, expected once")
        seen.add(name)
        if not (text.isascii() and text.isdigit()) or len(text) > 10 or not 1 <= int(text) <= _LARGEST:
            raise ServerError(f"--limit: {name}={printable(text)} given, expected an integer from 1 to {_LARGEST}")
        protocol, _, key = name.partition(".")
        for field in _FIELDS[protocol]:
            present = settings.get(field, getattr(ServerSettings(), field))
            if key in asdict(present):
                settings[field] = replace(present, **{key: int(text)})
    return settings
