# SPDX-License-Identifier: Apache-2.0
"""The name by which a browser asks for a server of this machine: Host (RFC 9110, 7.2) and Origin (RFC 6454, 7)."""

from __future__ import annotations

import re
from collections.abc import Sequence
from ipaddress import AddressValueError, IPv6Address
from typing import NamedTuple
from urllib.parse import urlsplit

DEFAULT_PORTS = {"http": 80, "https": 443}
"""Default ports by scheme, which browsers omit."""

OWN_NAMES = ("127.0.0.1", "localhost", "[::1]")
"""Names of this machine, for itself."""

_AUTHORITY = re.compile(r"(\[[0-9A-Fa-f:.]+\]|[A-Za-z0-9._-]+)(?::([0-9]{0,5}))?")
_LONGEST = 300


class Authority(NamedTuple):
    """Name and port of a server in canonical form."""

    name: str
    """Lower case, without a final dot; an IPv6 address is in brackets, in its shortest form."""
    port: int


def authority(text: str, scheme: str) -> Authority | None:
    """Return the server that a Host header names; None for an invalid one. A missing port is the scheme's default."""
    match = _AUTHORITY.fullmatch(text) if len(text) <= _LONGEST else None
    if match is None:
        return None
    name, port = match[1].lower().removesuffix("."), int(match[2]) if match[2] else DEFAULT_PORTS[scheme]
    if name.startswith("["):
        try:
            name = f"[{IPv6Address(name[1:-1]).compressed}]"
        except AddressValueError:
            return None
    return Authority(name, port) if name and port <= 65535 else None


def is_own(hosts: Sequence[str], scheme: str) -> bool:
    """Return True if a request asks for this machine. hosts: all its Host headers, of which there must be one.

    Any port is accepted, because a tunnel has another one than the server. A foreign page whose DNS name leads here
    (DNS rebinding) sends its own name.
    """
    asked = authority(hosts[0], scheme) if len(hosts) == 1 else None
    return asked is not None and asked.name in OWN_NAMES


def is_same_origin(origins: Sequence[str], hosts: Sequence[str], scheme: str) -> bool:
    """Return True if a request comes from a page of the same server. origins, hosts: headers, one each."""
    if len(origins) != 1 or len(hosts) != 1:
        return False
    try:
        origin = urlsplit(origins[0])
    except ValueError:
        return False
    if origin.scheme != scheme or origin.path or origin.query or origin.fragment:
        return False
    asked = authority(hosts[0], scheme)
    return asked is not None and authority(origin.netloc, scheme) == asked
