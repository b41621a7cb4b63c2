# SPDX-License-Identifier: Apache-2.0
"""`Broker`: address of the MQTT broker of a plant, with the user and the names of the line there."""

from __future__ import annotations

import re
import socket
import ssl
from dataclasses import dataclass
from pathlib import Path
from urllib.parse import unquote, urlsplit

from conveyor_sim.protocols.server.interface import ServerError
from conveyor_sim.protocols.server.password_file import read_password
from conveyor_sim.protocols.tags.tag_provider import LineInfo
from conveyor_sim.support.printable import printable

PASSWORD = "CONVEYOR_SIM_MQTT_PASSWORD"
"""Environment variable of the password, if no file is given."""

PATIENCE = 5.0
"""Wall time in which a broker must accept a connection, s."""

EXPECTED = "expected mqtt://HOST, or mqtts:// for TLS, as mqtt://USER@HOST:PORT/GROUP/NODE"

_PORTS = {"mqtt": 1883, "mqtts": 8883}
_ID = re.compile(r"[A-Za-z0-9_.:-]{1,100}")


@dataclass(frozen=True)
class Broker:
    """Address and options of a broker."""

    host: str
    port: int
    secured: bool
    """True for TLS."""
    user: str = ""
    password: str = ""
    authority: Path | None = None
    """File of the certificates that authenticate it; None: those that this machine trusts."""
    group: str = ""
    """Group of the edge node; empty: the line's place, or its name."""
    node: str = ""
    """Edge node; empty: the line's name."""
    primary_host: str = ""
    """ID of the primary host application, without which there are no births; empty: none."""

    @property
    def address(self) -> str:
        """URL of the broker."""
        host = f"[{self.host}]" if ":" in self.host else self.host
        return f"{'mqtts' if self.secured else 'mqtt'}://{host}:{self.port}"

    @property
    def is_here(self) -> bool:
        """True if the broker is on this machine."""
        return self.host in ("localhost", "::1") or self.host.startswith("127.")

    def named(self, info: LineInfo) -> tuple[str, str]:
        """Return the group and edge node of a line."""
        return self.group or info.where.replace("/", ":") or info.name, self.node or info.name

    def context(self) -> ssl.SSLContext:
        """Return the context for TLS. Raises ServerError."""
        try:
            context = ssl.create_default_context(cafile=self.authority)
        except (OSError, ValueError) as error:
            raise ServerError(f"{self.authority}: {_reason(error)}, expected certificates in PEM") from error
        context.minimum_version = ssl.TLSVersion.TLSv1_2
        return context

    def require_reachable(self) -> None:
        """Raise ServerError, with the reason, if the address accepts no connection."""
        try:
            socket.create_connection((self.host, self.port), PATIENCE).close()
        except OSError as error:
            raise ServerError(
                f"{self.address}: can't be reached ({_reason(error)}), expected an MQTT broker that runs there, "
                "such as mosquitto"
            ) from error


def broker_of(
    url: str, *, authority: Path | None = None, password_file: Path | None = None, primary_host: str = ""
) -> Broker:
    """Return the broker at `url`. The other parameters are the fields of `Broker` and the file of its password.

    Raises ServerError.
    """
    prefix = f"mqtt: {printable(url)} given"
    try:
        parts = urlsplit(url)
        port = parts.port
    except ValueError as error:
        raise ServerError(f"{prefix} ({error}), {EXPECTED}") from error
    names = parts.path.strip("/").split("/") if parts.path.strip("/") else []
    if parts.password is not None:
        raise ServerError(
            "mqtt: a password given in the URL, where all users of this machine see it; expected it in the environment "
            f"variable {PASSWORD} or by --mqtt-password-file"
        )
    if parts.scheme not in _PORTS or not parts.hostname or parts.query or parts.fragment or len(names) > 2:
        raise ServerError(f"{prefix}, {EXPECTED}")
    for name in (*names, primary_host or "none"):
        if not _ID.fullmatch(name) or name == "STATE":
            raise ServerError(f"mqtt: {printable(name)} given as a name, expected letters, digits, or any of _ . : -")
    secured = parts.scheme == "mqtts"
    if authority is not None and not secured:
        raise ServerError(f"--mqtt-ca: given with {parts.scheme}://, expected mqtts://")
    user = unquote(parts.username or "")
    if password_file is not None and not user:
        raise ServerError("--mqtt-password-file: given without a user, expected mqtt://USER@HOST")
    password = read_password(password_file, PASSWORD, "the broker") if user else ""
    group, node = (*names, "", "")[:2]
    return Broker(
        parts.hostname,
        _PORTS[parts.scheme] if port is None else port,
        secured,
        user,
        password,
        authority,
        group,
        node,
        primary_host,
    )


def _reason(error: Exception) -> str:
    return str(getattr(error, "strerror", None) or error)
