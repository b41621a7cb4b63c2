"""Which way leads to a PLC: its URL says."""

from __future__ import annotations

from collections.abc import Sequence
from urllib.parse import urlsplit

from conveyor_sim.protocols.attach.link import Link, LinkError
from conveyor_sim.protocols.attach.tag_map import Mapped, TagMap
from conveyor_sim.support.printable import printable


def all_of(tags: TagMap) -> tuple[Mapped, ...]:
    """All that a map names."""
    return (*tags.written, *tags.read, *tags.own, *(each for each in (tags.tick, tags.target) if each is not None))


async def read_answer(link: Link, tags: TagMap) -> tuple[dict[str, float], dict[str, float]]:
    """Return commands and alarms of a PLC by tag, and its own values (plc/<name>). Raise LinkError."""
    names = [each.tag.name for each in (*tags.read, *tags.own)]
    answer = await link.read(names) if names else {}
    own = {each.tag.name: answer.pop(each.tag.name) for each in tags.own}
    return answer, own


def link(url: str, mapped: Sequence[Mapped], user: str = "", password: str = "") -> Link:
    """The way to the tags of a map. url: "opc.tcp://host:port" or "modbus://host:port"; user: "" for anonymous.

    Raises LinkError for another URL, TagMapError for a place in Modbus that can't be, ImportError without the library.
    """
    try:
        parts = urlsplit(url)
        host, port = parts.hostname, parts.port
    except ValueError:
        host = port = None
    if not host or parts.scheme not in ("opc.tcp", "modbus"):
        raise LinkError(f"{printable(url)} given, expected opc.tcp://host:port or modbus://host:port")
    if parts.scheme == "modbus":
        from conveyor_sim.protocols.attach.modbus_link import ModbusLink

        return ModbusLink(host, port or 502, mapped)
    from conveyor_sim.protocols.attach.opcua_link import OpcUaLink

    return OpcUaLink(url, mapped, user, password)
