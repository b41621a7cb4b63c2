"""`ServerSettings` of all protocol servers."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from conveyor_sim.line.commands.inputs import WriterKind
from conveyor_sim.protocols.opcua.limits import LIMITS, OpcUaLimits
from conveyor_sim.protocols.server.interface import HERE, Stamps
from conveyor_sim.protocols.server.quotas import QUOTA, Quota
from conveyor_sim.protocols.server.users import Role


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
    """True if clients without a user may read there."""
    opcua_certificates: Path | None = None
    """Folder of the OPC UA server's certificate and key; None: the default folder of the operating system's user."""
    opcua_history: Sequence[str] = ()
    """Patterns of the tags whose latest values OPC UA keeps as history."""
    web_certificates: Path | None = None
    """Folder of the certificate and key of the page; None: those of the OPC UA server, where the page needs any."""
    opcua_limits: OpcUaLimits = LIMITS
    """Limits of one OPC UA client."""
    opcua_quota: Quota = QUOTA
    """Quota of the OPC UA connections."""
    modbus_quota: Quota = QUOTA
    """Quota of the Modbus connections."""
    web_quota: Quota = QUOTA
    """Quota of the connections of pages."""
