# SPDX-License-Identifier: Apache-2.0
"""`vendor_link`: links by the protocols of PLC vendors, made from a URL.

s7://192.168.0.10/0/1            Siemens: rack and slot (0/1 by default); port 102 by default
eip://192.168.1.5/0              Rockwell: slot (0 by default); port 44818 by default
ads://5.12.82.20.1.1:851?host=192.168.2.7:48898&local=192.168.2.1.1.1
                                 Beckhoff: AMS Net ID and AMS port (851 by default); address (the first four
                                 numbers of the Net ID by default); our AMS Net ID (from our IP address by default)
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from urllib.parse import SplitResult, parse_qsl

from conveyor_sim.protocols.attach.elementary_types import BOOL
from conveyor_sim.protocols.attach.isolated_link import IsolatedLink
from conveyor_sim.protocols.attach.plc_link import PATIENCE, PlcLink, PlcLinkError
from conveyor_sim.protocols.attach.s7_address import S7Address, s7_address
from conveyor_sim.protocols.attach.tag_map import MappedTag, TagMapError
from conveyor_sim.support.printable import printable

FORMS: Mapping[str, str] = {
    "s7": "s7://host/rack/slot",
    "eip": "eip://host/slot",
    "ads": "ads://net-id:port?host=address",
}
"""Form of the URL of each protocol."""

_HERE = "conveyor_sim.protocols.attach"
_NET_ID = re.compile(r"\d{1,3}(\.\d{1,3}){5}")
_EIP_TAG = re.compile(r"(Program:\w+\.)?[A-Za-z_]\w*(\[\d+(,\d+){0,2}\]|\.[A-Za-z_]\w*)*(\.\d{1,2})?", re.ASCII)


def vendor_link(url: str, parts: SplitResult, mapped: Sequence[MappedTag]) -> PlcLink:
    """Return the link for a URL with a scheme of FORMS. Raise PlcLinkError for an invalid URL, TagMapError."""
    make = {"s7": _s7, "eip": _eip, "ads": _ads}[parts.scheme]
    try:
        return make(url, parts, mapped)
    except ValueError as error:
        form = FORMS[parts.scheme]
        raise PlcLinkError(f"{printable(url)} given, expected {form}: {printable(error)}") from None


def _s7(url: str, parts: SplitResult, mapped: Sequence[MappedTag]) -> PlcLink:
    numbers = _numbers(parts, 2) or [0, 1]
    if len(numbers) != 2 or not (numbers[0] < 8 and numbers[1] < 32):
        raise ValueError("rack 0 to 7 and slot 0 to 31")
    addresses = [_s7_address(each) for each in mapped]
    _require_apart([(each, address) for each, address in zip(mapped, addresses, strict=True) if each.is_written])
    return IsolatedLink(url, f"{_HERE}.s7_driver", (parts.hostname, parts.port or 102, *numbers, addresses), mapped)


def _s7_address(mapped: MappedTag) -> S7Address:
    try:
        return s7_address(mapped.tag.name, mapped.theirs)
    except ValueError as error:
        raise TagMapError(f"{mapped.where}: {printable(mapped.theirs)} given, expected {error}") from None


def _require_apart(written: Sequence[tuple[MappedTag, S7Address]]) -> None:
    """Raise TagMapError for a signal whose bits another signal has."""
    taken: dict[tuple[str, int, int], str] = {}
    for each, address in written:
        first = 8 * address.byte + address.bit
        for bit in range(first, first + (1 if address.kind == BOOL else 8 * (address.end - address.byte))):
            other = taken.setdefault((address.area, address.db, bit), each.tag.name)
            if other != each.tag.name:
                text = f"{each.where}: {printable(each.theirs)} given, expected a place that {other} does not have"
                raise TagMapError(text)


def _eip(url: str, parts: SplitResult, mapped: Sequence[MappedTag]) -> PlcLink:
    numbers = _numbers(parts, 1) or [0]
    tags = {}
    for each in mapped:
        tags[each.tag.name] = theirs = each.theirs.strip()
        if not _EIP_TAG.fullmatch(theirs):
            expected = "expected a tag such as Speed, Line.Speed, Speeds[2], Flags.3 or Program:Main.Speed"
            raise TagMapError(f"{each.where}: {printable(theirs)} given, {expected}")
    settings = (parts.hostname, parts.port or 44818, *numbers, PATIENCE, tags)
    return IsolatedLink(url, f"{_HERE}.eip_driver", settings, mapped)


def _ads(url: str, parts: SplitResult, mapped: Sequence[MappedTag]) -> PlcLink:
    options = dict(parse_qsl(parts.query, keep_blank_values=True, strict_parsing=bool(parts.query)))
    net_id, local = parts.hostname or "", options.pop("local", "")
    for address in (net_id, *([local] if local else [])):
        if not _NET_ID.fullmatch(address) or max(map(int, address.split("."))) > 255:
            raise ValueError(f"an AMS Net ID of six numbers from 0 to 255, not {address}")
    host = options.pop("host", ".".join(net_id.split(".")[:4]))
    if options or parts.path.strip("/") or not host:
        raise ValueError("only host and local as options")
    symbols = {each.tag.name: each.theirs.strip() for each in mapped}
    for each in mapped:
        if not each.theirs.isascii() or len(each.theirs) > 255:
            raise TagMapError(f"{each.where}: {printable(each.theirs)} given, expected a symbol such as GVL.Speed")
    settings = (net_id, parts.port or 851, host, local, PATIENCE, symbols)
    return IsolatedLink(url, f"{_HERE}.ads_driver", settings, mapped)


def _numbers(parts: SplitResult, most: int) -> list[int]:
    """Return the numbers of the path. Raise ValueError for anything else."""
    words = [word for word in parts.path.split("/") if word]
    if parts.query or parts.fragment or len(words) > most:
        raise ValueError("nothing after it")
    if not all(word.isascii() and word.isdigit() and int(word) < 256 for word in words):
        raise ValueError("whole numbers from 0 to 255")
    return [int(word) for word in words]
