# SPDX-License-Identifier: Apache-2.0
"""`plc_link`: the link to a PLC by the protocol of its URL."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from importlib.util import find_spec
from urllib.parse import urlsplit

from conveyor_sim.protocols.attach.access import ANONYMOUS, PlcAccess
from conveyor_sim.protocols.attach.plc_link import PlcLink, PlcLinkError
from conveyor_sim.protocols.attach.tag_map import MappedTag
from conveyor_sim.protocols.attach.vendor_links import FORMS, vendor_link
from conveyor_sim.protocols.tags.tag_provider import PLC
from conveyor_sim.support.printable import printable

LIBRARIES: Mapping[str, tuple[str, str]] = {
    "opc.tcp": ("asyncua", "scada"),
    "modbus": ("pymodbus", "scada"),
    "s7": ("snap7", "s7"),
    "eip": ("pylogix", "ethernet_ip"),
    "ads": ("pyads", "ads"),
}
"""Library of each protocol by the scheme of its URL, and the extra of this package that installs it."""


def plc_link(
    url: str,
    mapped: Sequence[MappedTag],
    access: PlcAccess = ANONYMOUS,
    say: Callable[[str], object] = lambda _: None,
) -> PlcLink:
    """Return a link for mapped tags.

    url: "opc.tcp://host:port", "modbus://host:port", or a form of `vendor_links.FORMS`. access: user and security of
    OPC UA. say: takes sentences for the user, such as the security of a new connection.

    Raises PlcLinkError for another URL, or an access that the protocol lacks; TagMapError for an invalid place;
    ImportError without the library.
    """
    refuse_user(url)
    try:
        parts = urlsplit(url)
        host, port = parts.hostname, parts.port
        if host is not None and not (host.isprintable() and host.encode("idna")):
            host = None
    except ValueError:
        host = port = None
    if not host or port == 0 or parts.scheme not in LIBRARIES:
        expected = ", ".join(("opc.tcp://host:port", "modbus://host:port", *FORMS.values()))
        raise PlcLinkError(f"{printable(url)} given, expected one of {expected}")
    if access != ANONYMOUS and parts.scheme != "opc.tcp":
        raise PlcLinkError(f"{parts.scheme}://: given with a user or security, expected neither, or opc.tcp://")
    if parts.scheme in FORMS:
        library, extra = LIBRARIES[parts.scheme]
        if find_spec(library) is None:
            raise ImportError(f"{PLC}: {library} is not installed: pip install 'conveyor_sim[{extra}]'")
        return vendor_link(url, parts, mapped)
    if parts.scheme == "modbus":
        if parts.path.strip("/") or parts.query or parts.fragment:
            raise PlcLinkError(f"{printable(url)} given, expected modbus://host:port and nothing after it")
        from conveyor_sim.protocols.attach.modbus_link import ModbusLink

        return ModbusLink(host, port or 502, mapped)
    from conveyor_sim.protocols.attach.opcua_link import OpcUaLink

    return OpcUaLink(url, mapped, access, say)


def refuse_user(url: str) -> None:
    """Raise PlcLinkError if a URL names a user: messages and recordings have the URL, and must have no password."""
    rest = url.partition("//")[2] or url
    _, sign, place = re.split("[/?#]", rest, maxsplit=1)[0].rpartition("@")
    if sign:
        raise PlcLinkError(f"{printable(place)}: given with a user in the URL, expected none (OPC UA: --user)")
