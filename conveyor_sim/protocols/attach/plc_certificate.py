# SPDX-License-Identifier: Apache-2.0
"""`PlcCertificate`: certificate of a PLC that is an OPC UA server, and trust in it.

A certificate is trusted for one address (host and port), as SSH trusts the keys of hosts. An unknown certificate, and
one that differs from the trusted one, are refused.
"""

from __future__ import annotations

import shlex
from datetime import datetime, timezone
from pathlib import Path

from cryptography import x509
from cryptography.hazmat.primitives import hashes
from cryptography.hazmat.primitives.asymmetric import rsa

from conveyor_sim.protocols.attach.access import PlcAccess
from conveyor_sim.protocols.attach.plc_link import PlcRefusedError
from conveyor_sim.protocols.opcua.client_certificates import SHORTEST_KEY, application_uris, without_issuers
from conveyor_sim.protocols.server.certificates import trust_plc, trusted_plc
from conveyor_sim.support.printable import SENTENCE, printable

_FINGERPRINT = 64
"""Number of hexadecimal digits of a SHA-256."""


def fingerprint(text: str) -> str:
    """Return a SHA-256 in hexadecimal digits, in one form. Raise PlcRefusedError for another text."""
    digits = text.replace(":", "").replace(" ", "").lower()
    if len(digits) != _FINGERPRINT or set(digits) - set("0123456789abcdef"):
        raise PlcRefusedError(
            f"--trust: {printable(text)} given, expected a SHA-256 of {_FINGERPRINT} hexadecimal digits"
        )
    return digits


class PlcCertificate:
    """Certificate that a PLC shows."""

    def __init__(self, url: str, certificates: bytes | None) -> None:
        """Read the first certificate of a DER chain. Raise PlcRefusedError if it can't be read."""
        self._url = url
        try:
            self.der = without_issuers(certificates or b"")
            """The certificate, DER."""
            self._loaded = x509.load_der_x509_certificate(self.der)
            self._key = self._loaded.public_key()
            self.uris = application_uris(self.der)
            """Application URIs that it states."""
        except Exception as error:  # x509 raises many kinds for malformed fields
            given = "can't be read" if certificates else "is missing"
            raise PlcRefusedError(f"{url}: the certificate of the PLC {given}, expected one in DER") from error

    @property
    def sha256(self) -> str:
        """Fingerprint that `--trust` takes, in hexadecimal digits."""
        return self._loaded.fingerprint(hashes.SHA256()).hex()

    @property
    def described(self) -> str:
        """Subject, period and fingerprints in words. The thumbprint is the SHA-1 that engineering tools show."""
        begin, end = self._loaded.not_valid_before_utc, self._loaded.not_valid_after_utc
        return (
            f"subject {printable(self._loaded.subject.rfc4514_string())}, valid from {begin:%Y-%m-%d} to "
            f"{end:%Y-%m-%d}, thumbprint {self._loaded.fingerprint(hashes.SHA1()).hex()}, SHA-256 {self.sha256}"
        )

    def require_usable(self) -> None:
        """Raise PlcRefusedError if it is expired or not yet valid, or if its key is too short or of another kind."""
        now = datetime.now(timezone.utc)
        begin, end = self._loaded.not_valid_before_utc, self._loaded.not_valid_after_utc
        if not begin <= now <= end:
            state = f"is not valid before {begin:%Y-%m-%d}" if now < begin else f"expired on {end:%Y-%m-%d}"
            raise PlcRefusedError(
                f"{self._url}: the certificate of the PLC {state}, today is {now:%Y-%m-%d} here, expected a valid one: "
                f"set the clocks, or renew the certificate in the PLC ({self.described})"
            )
        if not isinstance(self._key, rsa.RSAPublicKey) or self._key.key_size < SHORTEST_KEY:
            size = f"a key of {self._key.key_size} bits" if isinstance(self._key, rsa.RSAPublicKey) else "another key"
            raise PlcRefusedError(
                f"{self._url}: the certificate of the PLC has {size}, expected RSA of {SHORTEST_KEY} bits or more "
                f"({self.described})"
            )

    def doubts(self, host: str, application_uri: str) -> str:
        """Return differences between the certificate and what the PLC states, in words; "" without.

        host: host of its URL. application_uri: as the PLC's endpoint states it.
        """
        try:
            names = self._loaded.extensions.get_extension_for_class(x509.SubjectAlternativeName).value
            known = [*names.get_values_for_type(x509.DNSName), *map(str, names.get_values_for_type(x509.IPAddress))]
        except (ValueError, x509.ExtensionNotFound):
            known = []
        doubts = []
        if host.lower() not in (name.lower() for name in known):
            doubts.append(f"it is made out to {printable(', '.join(known)) or 'no host'}, not to {printable(host)}")
        if application_uri not in self.uris:
            stated = printable(", ".join(sorted(self.uris))) or "no application URI"
            doubts.append(f"it states {stated}, but the PLC is {printable(application_uri)}")
        return "".join(f"; {doubt}" for doubt in doubts)

    def require_trusted(self, folder: Path, address: str, application_uri: str, access: PlcAccess) -> bool:
        """Raise PlcRefusedError unless the certificate is trusted for an address, or `access` trusts it now.

        address: host:port. Return True if it is trusted from now on. Raise CertificateError if the folder can't be read
        or written.
        """
        known = trusted_plc(folder, address)
        if access.trust:
            if fingerprint(access.trust) != self.sha256:
                raise PlcRefusedError(
                    f"{self._url}: --trust {fingerprint(access.trust)} given, but the PLC shows another certificate "
                    f"({self.described})"
                )
            trust_plc(folder, address, self.der)
        if access.trust or known == self.der:
            return known != self.der
        doubts = self.doubts(address.rpartition(":")[0], application_uri)
        command = ["conveyor-sim", "attach", self._url, "--trust", self.sha256]
        if access.certificates is not None:
            command += ["--opcua-certificates", str(access.certificates)]
        before = "" if known is None else f"; trusted so far: {PlcCertificate(self._url, known).described}"
        state = "is not trusted yet" if known is None else "has changed"
        reason = "" if known is None else " if it was renewed on purpose"
        raise PlcRefusedError(
            printable(
                f"{self._url}: the certificate of the PLC {state}: {self.described}{doubts}{before}. Compare it with "
                f"the one that the PLC's engineering tool shows, then trust it{reason}: {shlex.join(command)}",
                2 * SENTENCE,
            )
        )
