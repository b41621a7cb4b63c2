# SPDX-License-Identifier: Apache-2.0
"""`PlcAccess`: user and security of a connection to a PLC."""

from __future__ import annotations

from pathlib import Path
from typing import Literal, NamedTuple

Security = Literal["best", "encrypt", "sign", "none"]
"""Protection of messages: signed and encrypted, signed, or none; "best": the most secure that the PLC offers."""


class PlcAccess(NamedTuple):
    """User and security of an OPC UA connection. The other protocols have neither, and accept the defaults only."""

    user: str = ""
    """User name; "" without."""
    password: str = ""
    user_certificate: Path | None = None
    """File of a certificate that identifies the user instead of a name, DER or PEM."""
    user_key: Path | None = None
    """File of the private key of `user_certificate`, PEM."""
    security: Security = "best"
    plain_password: bool = False
    """True to send the password even where others on the network can read it."""
    certificates: Path | None = None
    """Folder of our certificate and of trusted certificates; None: `certificates.default_folder()`."""
    trust: str = ""
    """SHA-256 of the PLC's certificate, which is trusted from now on; "": only certificates trusted before are."""


ANONYMOUS = PlcAccess()
"""No user, and the most secure endpoint."""
