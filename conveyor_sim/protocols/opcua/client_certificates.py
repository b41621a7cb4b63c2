# SPDX-License-Identifier: Apache-2.0
"""Checks of client certificates when a secure channel is opened or renewed (OPC 10000-4, 6.1.3)."""

from __future__ import annotations

from datetime import datetime, timezone

from asyncua import ua
from asyncua.common.utils import ServiceError
from asyncua.crypto.uacrypto import x509_from_der
from cryptography import x509
from cryptography.hazmat.primitives.asymmetric import rsa
from cryptography.hazmat.primitives.serialization import Encoding, PublicFormat

SHORTEST_KEY = 2048
"""bits of an RSA key; the least that the offered security policies allow (OPC 10000-7)."""


def require_usable(certificate: bytes | None) -> None:
    """Raise ServiceError with the status code of OPC 10000-4, 6.1.3, for a DER certificate that must be refused.

    A certificate is refused if it can't be read, is expired or not yet valid, or has no RSA key of `SHORTEST_KEY` bits.
    Certificates of its issuers may follow it (OPC 10000-6, 6.2.6); they are not used.
    """
    try:
        loaded = _first(certificate or b"")
        key = loaded.public_key()
    except (ValueError, TypeError, x509.UnsupportedGeneralNameType) as error:
        raise ServiceError(ua.StatusCodes.BadCertificateInvalid) from error
    if not isinstance(key, rsa.RSAPublicKey) or key.key_size < SHORTEST_KEY:
        raise ServiceError(ua.StatusCodes.BadCertificatePolicyCheckFailed)
    if not loaded.not_valid_before_utc <= datetime.now(timezone.utc) <= loaded.not_valid_after_utc:
        raise ServiceError(ua.StatusCodes.BadCertificateTimeInvalid)


def application_uris(certificate: bytes) -> frozenset[str]:
    """Return the application URIs that a DER certificate states."""
    try:
        names = _first(certificate).extensions.get_extension_for_class(x509.SubjectAlternativeName)
    except (ValueError, x509.ExtensionNotFound):
        return frozenset()
    return frozenset(names.value.get_values_for_type(x509.UniformResourceIdentifier))


def public_key(certificate: bytes) -> bytes:
    """Return the public key of a DER certificate (SubjectPublicKeyInfo, DER)."""
    key = _first(certificate).public_key()
    return key.public_bytes(Encoding.DER, PublicFormat.SubjectPublicKeyInfo)


def without_issuers(certificates: bytes) -> bytes:
    """Return the first certificate of a DER chain, which is the application's."""
    return _first(certificates).public_bytes(Encoding.DER)


def _first(certificates: bytes) -> x509.Certificate:
    """Load the first certificate of a DER chain. Raise ValueError."""
    try:
        loaded = x509_from_der(certificates)
    except IndexError as error:  # a length that is cut
        raise ValueError("expected a DER certificate") from error
    if loaded is None:
        raise ValueError("expected a DER certificate")
    return loaded
