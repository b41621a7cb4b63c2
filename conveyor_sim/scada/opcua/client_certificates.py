"""Checks of client certificates when a secure channel is opened or renewed (OPC 10000-4, 6.1.3)."""

from __future__ import annotations

from datetime import datetime, timezone

from asyncua import ua
from asyncua.common.utils import ServiceError
from cryptography import x509
from cryptography.hazmat.primitives.asymmetric import rsa
from cryptography.hazmat.primitives.serialization import Encoding, PublicFormat

SHORTEST_KEY = 2048
"""bits of an RSA key; the least that the offered security policies allow (OPC 10000-7)."""


def require_usable(certificate: bytes | None) -> None:
    """Raise ServiceError with the status code of OPC 10000-4, 6.1.3, for a DER certificate that must be refused.

    A certificate is refused if it can't be read, is expired or not yet valid, or has no RSA key of `SHORTEST_KEY` bits.
    """
    try:
        loaded = x509.load_der_x509_certificate(certificate or b"")
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
        names = x509.load_der_x509_certificate(certificate).extensions.get_extension_for_class(
            x509.SubjectAlternativeName
        )
    except (ValueError, x509.ExtensionNotFound):
        return frozenset()
    return frozenset(names.value.get_values_for_type(x509.UniformResourceIdentifier))


def public_key(certificate: bytes) -> bytes:
    """Return the public key of a DER certificate (SubjectPublicKeyInfo, DER)."""
    key = x509.load_der_x509_certificate(certificate).public_key()
    return key.public_bytes(Encoding.DER, PublicFormat.SubjectPublicKeyInfo)
