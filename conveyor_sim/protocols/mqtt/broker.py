"""`Broker`: where the MQTT broker of a plant is, as whom the line comes there, and what it is called there."""

from __future__ import annotations

import os
import re
import socket
import ssl
from dataclasses import dataclass
from pathlib import Path
from urllib.parse import unquote, urlsplit

from conveyor_sim.protocols.server.interface import ServerError
from conveyor_sim.protocols.tags.tag_provider import LineInfo
from conveyor_sim.support.files import MB, FileError, read_file
from conveyor_sim.support.printable import printable

PASSWORD = "CONVEYOR_SIM_MQTT_PASSWORD"
"""The environment variable that the password is read from where no file is named."""

PATIENCE = 5.0
"""s of wall time that a broker has to accept a connection."""

EXPECTED = "expected mqtt://HOST, or mqtts:// for TLS, as mqtt://USER@HOST:PORT/GROUP/NODE"

_PORTS = {"mqtt": 1883, "mqtts": 8883}
_ID = re.compile(r"[A-Za-z0-9_.:-]{1,100}")


@dataclass(frozen=True)
class Broker:
    """One of them."""

    host: str
    port: int
    secured: bool
    """By TLS."""
    user: str = ""
    password: str = ""
    authority: Path | None = None
    """File of the certificates by which it is known; None: those that this machine trusts."""
    group: str = ""
    """Group of the edge node; empty: the line's place, or its name."""
    node: str = ""
    """Edge node; empty: the line's name."""
    primary_host: str = ""
    """The host application without which there are no births; empty: none."""

    @property
    def address(self) -> str:
        """As people write it."""
        host = f"[{self.host}]" if ":" in self.host else self.host
        return f"{'mqtts' if self.secured else 'mqtt'}://{host}:{self.port}"

    @property
    def is_here(self) -> bool:
        """Whether what is sent there stays on this machine."""
        return self.host in ("localhost", "::1") or self.host.startswith("127.")

    def named(self, about: LineInfo) -> tuple[str, str]:
        """Group and edge node of a line."""
        return self.group or about.where.replace("/", ":") or about.name, self.node or about.name

    def context(self) -> ssl.SSLContext:
        """What TLS goes by. Raises ServerError."""
        try:
            context = ssl.create_default_context(cafile=self.authority)
        except (OSError, ValueError) as error:
            raise ServerError(f"{self.authority}: {_reason(error)}, expected certificates in PEM") from error
        context.minimum_version = ssl.TLSVersion.TLSv1_2
        return context

    def require_reachable(self) -> None:
        """Raises ServerError, with the reason, if nothing can be connected to there."""
        try:
            socket.create_connection((self.host, self.port), PATIENCE).close()
        except OSError as error:
            raise ServerError(
                f"{self.address}: can't be reached ({_reason(error)}), expected an MQTT broker"
            ) from error


def broker_of(
    url: str, *, authority: Path | None = None, password_file: Path | None = None, primary_host: str = ""
) -> Broker:
    """Return the broker at `url`. The other parameters are the fields of `Broker` and the file of its password.

    Raises ServerError.
    """
    given = f"mqtt: {printable(url)} given"
    try:
        parts = urlsplit(url)
        port = parts.port
    except ValueError as error:
        raise ServerError(f"{given} ({error}), {EXPECTED}") from error
    names = parts.path.strip("/").split("/") if parts.path.strip("/") else []
    if parts.password is not None:
        raise ServerError(
            "mqtt: a password given in the URL, where all users of this machine see it; expected it in the environment "
            f"variable {PASSWORD} or by --mqtt-password-file"
        )
    if parts.scheme not in _PORTS or not parts.hostname or parts.query or parts.fragment or len(names) > 2:
        raise ServerError(f"{given}, {EXPECTED}")
    for name in (*names, primary_host or "none"):
        if not _ID.fullmatch(name) or name == "STATE":
            raise ServerError(f"mqtt: {printable(name)} given as a name, expected letters, digits, or any of _ . : -")
    secured = parts.scheme == "mqtts"
    if authority is not None and not secured:
        raise ServerError(f"--mqtt-ca: given with {parts.scheme}://, expected mqtts://")
    user = unquote(parts.username or "")
    if password_file is not None and not user:
        raise ServerError("--mqtt-password-file: given without a user, expected mqtt://USER@HOST")
    password = _password(password_file) if user else ""
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


def _password(path: Path | None) -> str:
    if path is None:
        return os.environ.get(PASSWORD, "")
    try:
        return read_file(path, MB).decode().partition("\n")[0].rstrip("\r")
    except FileError as error:
        raise ServerError(f"{path}: {error}, expected a file with the password of the broker") from error
    except UnicodeDecodeError as error:
        raise ServerError(f"{path}: is not UTF-8, expected a file with the password of the broker") from error


def _reason(error: Exception) -> str:
    return str(getattr(error, "strerror", None) or error)
