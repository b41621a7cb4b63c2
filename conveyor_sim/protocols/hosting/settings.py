# SPDX-License-Identifier: Apache-2.0
"""`ServerSettings` of all protocol servers, with limits and quotas from `--limit NAME=VALUE`."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

from conveyor_sim.line.commands.inputs import WriterKind
from conveyor_sim.protocols.opcua.limits import LIMITS, OpcUaLimits
from conveyor_sim.protocols.server.interface import HERE, ServerError, Stamps
from conveyor_sim.protocols.server.quotas import QUOTA, Quota
from conveyor_sim.protocols.server.users import LoginService, Role
from conveyor_sim.protocols.tags.control_mode import HoldingService
from conveyor_sim.support.printable import printable


@dataclass(frozen=True)
class SharedState:
    """State that a protocol server uses and its parent keeps, so that it survives a restart."""

    logins: LoginService
    """Logins, common to all protocol servers."""
    holding: HoldingService
    """Holder of the line among the clients of one protocol."""
    counts: tuple[int, int] = (0, 0)
    """Requests that were passed on, and that were refused, before the protocol server was restarted."""


@dataclass(frozen=True)
class ServerSettings:
    """Settings of all protocol servers."""

    host: str = HERE
    """Address to listen on."""
    stamps: Stamps = "wall"
    modbus_role: WriterKind | None = None
    """Role in which Modbus clients write; None: they may not write."""
    modbus_map: Path | None = None
    """File that stores the map of addresses; None: the map is derived from the tags and not stored."""
    mqtt_role: Role | None = None
    """Role in which hosts command by MQTT; None, viewer: they may not."""
    mqtt_password_file: Path | None = None
    """File of the password for the broker; None: an environment variable."""
    mqtt_ca: Path | None = None
    """File of the certificates that authenticate the broker; None: those that this machine trusts."""
    mqtt_primary_host: str = ""
    """ID of the primary host application, without which nothing is sent; empty: none."""
    users: Path | None = None
    """File of the users of OPC UA and of the page; None: there are no users, and clients can only read."""
    anonymous: bool = True
    """True if clients without a user may read over OPC UA and on the page."""
    opcua_certificates: Path | None = None
    """Folder of the OPC UA server's certificate and key; None: the default folder of the operating system's user."""
    opcua_history: Sequence[str] = ()
    """Patterns of the tags whose latest values OPC UA keeps as history."""
    web_certificates: Path | None = None
    """Folder of the certificate and key of the page. None: if the page needs them, those of the OPC UA server."""
    opcua_limits: OpcUaLimits = LIMITS
    """Limits of one OPC UA client."""
    opcua_quota: Quota = QUOTA
    """Quota of the OPC UA connections."""
    modbus_quota: Quota = QUOTA
    """Quota of the Modbus connections."""
    web_quota: Quota = QUOTA
    """Quota of the connections of pages."""


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
