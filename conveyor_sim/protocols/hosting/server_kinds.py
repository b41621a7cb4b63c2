# SPDX-License-Identifier: Apache-2.0
"""Table of all protocol servers: how to make each, and what it exposes."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from importlib.util import find_spec
from typing import TYPE_CHECKING, Any

from conveyor_sim.line.commands.inputs import WriterKind
from conveyor_sim.protocols.hosting.settings import ServerSettings, SharedState
from conveyor_sim.protocols.server.interface import HERE, ProtocolServer, ServerError, require_free
from conveyor_sim.protocols.tags.tag_provider import MODBUS, MQTT, OPCUA, WEB, TagProvider

if TYPE_CHECKING:
    from conveyor_sim.protocols.mqtt.broker import Broker

_HERE = "conveyor_sim.protocols"


@dataclass(frozen=True)
class ServerKind:
    """One protocol."""

    name: str
    """Name of the option of `serve`, which takes a port, for MQTT the URL of a broker."""
    port: int
    """Default port. The standard one may need root."""
    libraries: tuple[str, ...]
    """Python packages that the server needs."""
    module: str
    """Module of the protocol server, which `make` imports."""
    make: Callable[[TagProvider, Any, ServerSettings, SharedState], ProtocolServer]
    """Function that makes a protocol server for the value of its option, not started. Raises ConveyorError."""
    exposes: Callable[[ServerSettings], str]
    """Function that describes the rights of clients, as a phrase for the greeting."""
    by_default: bool = True
    """True if it is served when no protocol is chosen."""
    extra: str = "scada"
    """Extra of this package that installs the libraries."""
    clients: str = ""
    """Clients named in the greeting; empty: all clients that can reach the port."""
    isolated: bool = True
    """True if it runs in a separate process, which finds it in SERVER_KINDS by its name and makes it."""

    @property
    def installed(self) -> bool:
        """True if its libraries are installed."""
        return not self._missing

    @property
    def _missing(self) -> list[str]:
        return [name for name in self.libraries if not _is_here(name)]

    def require(self) -> None:
        """Raise ServerError if a library is missing."""
        if missing := self._missing:
            raise ServerError(f"{self.name}: {missing[0]} is not installed: pip install 'conveyor_sim[{self.extra}]'")

    def require_place(self, place: Any, settings: ServerSettings) -> None:
        """Raise ServerError if it can't serve at a port or URL, before kernels are compiled for it."""
        if self.name == MQTT:
            _broker(place, settings).require_reachable()
        else:
            require_free(self.name, settings.host, place)


def _is_here(library: str) -> bool:
    try:
        return find_spec(library) is not None
    except ModuleNotFoundError:  # its parent package is missing
        return False


def _modbus(source: TagProvider, port: int, settings: ServerSettings, shared: SharedState) -> ProtocolServer:
    from conveyor_sim.protocols.modbus.address_map import keep_map, modbus_map
    from conveyor_sim.protocols.modbus.server import ModbusServer

    tags = source.info.tags
    rows = modbus_map(tags) if settings.modbus_map is None else keep_map(settings.modbus_map, tags)
    quota, holding = settings.modbus_quota, shared.holding
    return ModbusServer(source, rows, settings.modbus_role, settings.host, port, quota, holding=holding)


def _modbus_exposes(settings: ServerSettings) -> str:
    if settings.modbus_role is None:
        return "read everything and write nothing"
    return f"read everything and write as {settings.modbus_role} (Modbus has no users)"


def _opcua(source: TagProvider, port: int, settings: ServerSettings, shared: SharedState) -> ProtocolServer:
    from conveyor_sim.protocols.opcua.server import OpcUaServer

    return OpcUaServer(
        source,
        logins=shared.logins,
        anonymous=settings.anonymous,
        stamps=settings.stamps,
        certificates=settings.opcua_certificates,
        history=settings.opcua_history,
        host=settings.host,
        port=port,
        limits=settings.opcua_limits,
        quota=settings.opcua_quota,
    )


def _mqtt(source: TagProvider, url: str, settings: ServerSettings, shared: SharedState) -> ProtocolServer:
    from conveyor_sim.protocols.mqtt.edge_node import EdgeNode

    broker, writes = _broker(url, settings), _mqtt_writes(settings)
    return EdgeNode(source, broker, writes, settings.stamps, holding=shared.holding, before=shared.counts)


def _broker(url: str, settings: ServerSettings) -> Broker:
    from conveyor_sim.protocols.mqtt.broker import broker_of

    return broker_of(
        url,
        authority=settings.mqtt_ca,
        password_file=settings.mqtt_password_file,
        primary_host=settings.mqtt_primary_host,
    )


def _mqtt_writes(settings: ServerSettings) -> WriterKind | None:
    role = settings.mqtt_role
    return None if role is None or role == "viewer" else role


def _mqtt_exposes(settings: ServerSettings) -> str:
    if _mqtt_writes(settings) is None:
        return "read everything and write nothing"
    return f"read everything and write as {settings.mqtt_role} (Sparkplug commands do not name their users)"


def _web(source: TagProvider, port: int, settings: ServerSettings, shared: SharedState) -> ProtocolServer:
    from conveyor_sim.protocols.server.certificates import server_context
    from conveyor_sim.protocols.tags.line_mirror import LineMirror
    from conveyor_sim.protocols.web.server import WebServer

    if not isinstance(source, LineMirror):
        raise ServerError("web: the line of a test has no page; expected a scene, a recording or a node")
    secured = settings.host != HERE or settings.web_certificates is not None
    return WebServer(
        source,
        logins=shared.logins,
        anonymous=settings.anonymous,
        secured=server_context(settings.web_certificates, settings.opcua_certificates) if secured else None,
        host=settings.host,
        port=port,
        quota=settings.web_quota,
    )


def _foxglove(source: TagProvider, port: int, settings: ServerSettings, shared: SharedState) -> ProtocolServer:
    from conveyor_sim.protocols.foxglove.server import FoxgloveServer
    from conveyor_sim.protocols.tags.line_mirror import LineMirror

    if not isinstance(source, LineMirror):
        raise ServerError("foxglove: the line of a test has no topics, expected a scene, a recording or a node")
    return FoxgloveServer(source, settings.host, port)


def _users_can(settings: ServerSettings) -> str:
    readers = "read everything" if settings.anonymous else "read nothing without a name and password"
    return f"{readers} and write only as one of the users" if settings.users else f"{readers} and write nothing"


SERVER_KINDS: tuple[ServerKind, ...] = (
    ServerKind(OPCUA, 4840, ("asyncua",), f"{_HERE}.opcua.server", _opcua, _users_can),
    ServerKind(MODBUS, 5020, ("pymodbus",), f"{_HERE}.modbus.server", _modbus, _modbus_exposes),
    ServerKind(
        MQTT,
        1883,
        ("paho", "google.protobuf"),
        f"{_HERE}.mqtt.edge_node",
        _mqtt,
        _mqtt_exposes,
        by_default=False,
        extra="mqtt",
        clients="clients that the broker admits",
    ),
    ServerKind(WEB, 8080, ("aiohttp", "cryptography"), f"{_HERE}.web.server", _web, _users_can, by_default=False),
    ServerKind(
        "foxglove",
        8765,
        ("foxglove",),
        f"{_HERE}.foxglove.server",
        _foxglove,
        lambda _: "read everything",
        by_default=False,
        extra="foxglove",
    ),
)
