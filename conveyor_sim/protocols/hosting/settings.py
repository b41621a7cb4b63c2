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
    """What is asked of all faces, or of one."""

    host: str = HERE
    """Address to listen on."""
    stamps: Stamps = "wall"
    modbus_role: WriterKind | None = None
    """In which Modbus clients write; None: they may not."""
    modbus_map: Path | None = None
    """File that keeps the map of addresses; None: made of the tags, and not kept."""
    mqtt_role: Role | None = None
    """In which hosts command by MQTT; None, viewer: they may not."""
    mqtt_password_file: Path | None = None
    """File of the password for the broker; None: an environment variable."""
    mqtt_ca: Path | None = None
    """File of the certificates by which the broker is known; None: those that this machine trusts."""
    mqtt_primary_host: str = ""
    """Id of the host application without which nothing is sent; empty: none."""
    users: Path | None = None
    """File of those who may do more than read by OPC UA and on the page; None: nobody may."""
    anonymous: bool = True
    """Whether clients that give no name may read there."""
    opcua_certificates: Path | None = None
    """Folder of the server's certificate and key; None: that of this user."""
    opcua_history: Sequence[str] = ()
    """Patterns of the tags whose last values it keeps."""
    web_certificates: Path | None = None
    """Folder of the certificate and key of the page; None: where it needs them, those of the OPC UA face."""
    opcua_limits: OpcUaLimits = LIMITS
    """Limits of one OPC UA client."""
    opcua_quota: Quota = QUOTA
    """Places of the OPC UA connections."""
    modbus_quota: Quota = QUOTA
    """Places of the Modbus connections."""
    web_quota: Quota = QUOTA
    """Places of the pages."""
