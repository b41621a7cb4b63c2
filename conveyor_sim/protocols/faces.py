"""The faces that there are: what serves one asks here."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from importlib.util import find_spec
from typing import Any

from conveyor_sim.line.commands.inputs import WriterKind
from conveyor_sim.protocols.face import HERE, Face, FaceError, Settings, require_free
from conveyor_sim.protocols.shared import Shared
from conveyor_sim.protocols.source import MODBUS, MQTT, OPCUA, WEB, TagSource

_HERE = "conveyor_sim.protocols"


@dataclass(frozen=True)
class Kind:
    """One protocol."""

    name: str
    """Of the option of `serve`, which takes a port; of MQTT the URL of a broker."""
    port: int
    """By default; its usual one may be for root only."""
    libraries: tuple[str, ...]
    """Without which it can't be."""
    module: str
    """Module of the protocol server, which `make` imports."""
    make: Callable[[TagSource, Any, Settings, Shared], Face]
    """A face on what its option takes, not started. Raises ConveyorError."""
    exposes: Callable[[Settings], str]
    """What whoever reaches the port can do, for those who let other machines reach it: a half sentence."""
    by_default: bool = True
    """Whether it is served where none is named."""
    extra: str = "scada"
    """Of this package, that brings the libraries."""
    whoever: str = ""
    """Who can do that, where it is not those who reach its port."""
    isolated: bool = True
    """True if it runs in a separate process, which finds it in FACES by its name and makes it."""

    @property
    def installed(self) -> bool:
        """Whether its libraries are here."""
        return not self._missing

    @property
    def _missing(self) -> list[str]:
        return [name for name in self.libraries if not _is_here(name)]

    def require(self) -> None:
        """Raises FaceError if it can't be here."""
        if missing := self._missing:
            raise FaceError(f"{self.name}: {missing[0]} is not installed: pip install 'conveyor_sim[{self.extra}]'")

    def require_place(self, place: Any, settings: Settings) -> None:
        """Raises FaceError if it can't be on what its option says: before anything has been compiled for it."""
        if self.name == MQTT:
            from conveyor_sim.protocols.mqtt.broker import broker_of

            broker_of(place, settings).require_reachable()
        else:
            require_free(self.name, settings.host, place)


def _is_here(library: str) -> bool:
    try:
        return find_spec(library) is not None
    except ModuleNotFoundError:  # the package that it is in
        return False


def _modbus(source: TagSource, port: int, settings: Settings, shared: Shared) -> Face:
    from conveyor_sim.protocols.modbus.address_map import keep_map, modbus_map
    from conveyor_sim.protocols.modbus.server import ModbusServer

    tags = source.about.tags
    rows = modbus_map(tags) if settings.modbus_map is None else keep_map(settings.modbus_map, tags)
    quota, holding = settings.modbus_quota, shared.holding
    return ModbusServer(source, rows, settings.modbus_role, settings.host, port, quota, holding=holding)


def _modbus_exposes(settings: Settings) -> str:
    if settings.modbus_role is None:
        return "read all, and write nothing"
    return f"read all, and write as {settings.modbus_role}, for Modbus asks nobody who they are"


def _opcua(source: TagSource, port: int, settings: Settings, shared: Shared) -> Face:
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


def _mqtt(source: TagSource, url: str, settings: Settings, shared: Shared) -> Face:
    from conveyor_sim.protocols.mqtt.broker import broker_of
    from conveyor_sim.protocols.mqtt.edge_node import EdgeNode

    broker, writes = broker_of(url, settings), _mqtt_writes(settings)
    return EdgeNode(source, broker, writes, settings.stamps, holding=shared.holding, before=shared.counts)


def _mqtt_writes(settings: Settings) -> WriterKind | None:
    role = settings.mqtt_role
    return None if role is None or role == "viewer" else role


def _mqtt_exposes(settings: Settings) -> str:
    if _mqtt_writes(settings) is None:
        return "read all, and write nothing"
    return f"read all, and write as {settings.mqtt_role}, for commands by Sparkplug say nothing of who gave them"


def _web(source: TagSource, port: int, settings: Settings, shared: Shared) -> Face:
    from conveyor_sim.protocols.view import View
    from conveyor_sim.protocols.web.server import WebServer
    from conveyor_sim.protocols.web.tls import server_context

    if not isinstance(source, View):
        raise FaceError("web: the line of a test has no page, expected a scene, a recording or a node")
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


def _foxglove(source: TagSource, port: int, settings: Settings, shared: Shared) -> Face:
    from conveyor_sim.protocols.foxglove.server import FoxgloveServer
    from conveyor_sim.protocols.view import View

    if not isinstance(source, View):
        raise FaceError("foxglove: the line of a test has no topics, expected a scene, a recording or a node")
    return FoxgloveServer(source, settings.host, port)


def _users_can(settings: Settings) -> str:
    readers = "read all" if settings.anonymous else "read nothing without a name and password"
    return f"{readers}, and write only as one of the users" if settings.users else f"{readers}, and write nothing"


FACES: tuple[Kind, ...] = (
    Kind(OPCUA, 4840, ("asyncua",), f"{_HERE}.opcua.server", _opcua, _users_can),
    Kind(MODBUS, 5020, ("pymodbus",), f"{_HERE}.modbus_server", _modbus, _modbus_exposes),
    Kind(
        MQTT,
        1883,
        ("paho", "google.protobuf"),
        f"{_HERE}.mqtt.edge_node",
        _mqtt,
        _mqtt_exposes,
        by_default=False,
        extra="mqtt",
        whoever="whoever the broker lets in",
    ),
    Kind(WEB, 8080, ("aiohttp",), f"{_HERE}.web.server", _web, _users_can, by_default=False),
    Kind(
        "foxglove",
        8765,
        ("foxglove",),
        f"{_HERE}.foxglove_server",
        _foxglove,
        lambda _: "read all",
        by_default=False,
        extra="foxglove",
    ),
)
