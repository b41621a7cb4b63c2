# SPDX-License-Identifier: Apache-2.0
"""`plc_link`: the link to a PLC by the protocol of its URL."""

from __future__ import annotations

from collections.abc import Sequence
from urllib.parse import urlsplit

from conveyor_sim.protocols.attach.plc_link import PlcLink, PlcLinkError
from conveyor_sim.protocols.attach.tag_map import MappedTag
from conveyor_sim.support.printable import printable


def plc_link(url: str, mapped: Sequence[MappedTag], user: str = "", password: str = "") -> PlcLink:
    """Return a link for mapped tags. url: "opc.tcp://host:port" or "modbus://host:port"; user: "" for anonymous.

    Raises PlcLinkError for another URL, TagMapError for an invalid place in Modbus, ImportError without the library.
    """
    try:
        parts = urlsplit(url)
        host, port = parts.hostname, parts.port
    except ValueError:
        host = port = None
    if not host or parts.scheme not in ("opc.tcp", "modbus"):
        raise PlcLinkError(f"{printable(url)} given, expected opc.tcp://host:port or modbus://host:port")
    if parts.scheme == "modbus":
        from conveyor_sim.protocols.attach.modbus_link import ModbusLink

        return ModbusLink(host, port or 502, mapped)
    from conveyor_sim.protocols.attach.opcua_link import OpcUaLink

    return OpcUaLink(url, mapped, user, password)
