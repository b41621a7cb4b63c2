# SPDX-License-Identifier: Apache-2.0
"""Certificate and key of the servers: made on first use, in a folder that only this user can read. TLS of the page."""

from __future__ import annotations

import os
import socket
import ssl
import stat
from datetime import datetime, timedelta, timezone
from ipaddress import ip_address
from pathlib import Path
from tempfile import NamedTemporaryFile
from typing import NamedTuple
from urllib.parse import quote

from cryptography import x509
from cryptography.hazmat.primitives import hashes, serialization
from cryptography.hazmat.primitives.asymmetric import rsa
from cryptography.x509.oid import ExtendedKeyUsageOID, NameOID

from conveyor_sim.errors import ConveyorError
from conveyor_sim.protocols.server.interface import ServerError
from conveyor_sim.support.file_lock import locked
from conveyor_sim.support.files import MB, FileError, read_file, write_file

CERTIFICATE, KEY, TRUSTED, PLCS = "certificate.der", "key.pem", "trusted", "plcs"
"""Names in the folder. TRUSTED: folder of clients' certificates; if it holds any, all others are refused. PLCS: folder
of trusted certificates of PLCs that are servers, one per address.
"""

YEARS = 10

_PATIENCE = 30.0
"""Wall time to wait for another process that makes the certificate, s."""


class CertificateError(ConveyorError):
    """Error: a certificate or key can't be made or read."""


class Identity(NamedTuple):
    """Certificate and private key of the server."""

    certificate: bytes
    """DER."""
    key: bytes
    """PEM."""
    application_uri: str
    """Application URI of the certificate."""
    trusted: frozenset[bytes]
    """Accepted certificates of clients, DER; empty: all are accepted."""


def default_folder() -> Path:
    """Return `conveyor_sim/opcua` in the folder for data of this user ($XDG_DATA_HOME, else ~/.local/share)."""
    return Path(os.environ.get("XDG_DATA_HOME") or Path.home() / ".local" / "share") / "conveyor_sim" / "opcua"


def identity(folder: Path) -> Identity:
    """Return the certificate and key in a folder; make them if they are missing. Raises CertificateError."""
    try:
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        if (mode := stat.S_IMODE(folder.stat().st_mode)) & 0o077 or folder.stat().st_uid != os.geteuid():
            raise CertificateError(
                f"{folder}: mode {mode:o} given, expected a folder that only this user can read (chmod 700)"
            )
        (folder / TRUSTED).mkdir(mode=0o700, exist_ok=True)
        if not (folder / KEY).exists():
            with locked(folder, _PATIENCE):  # the servers of a line start at the same time
                if not (folder / KEY).exists():
                    _make(folder)
        trusted = frozenset(read_certificate(path) for path in sorted((folder / TRUSTED).iterdir()) if path.is_file())
    except OSError as error:
        where = error.filename or folder
        raise CertificateError(f"{where}: {error.strerror}, expected a folder for certificates") from error
    certificate = read_certificate(folder / CERTIFICATE)
    names = x509.load_der_x509_certificate(certificate).extensions
    try:
        (uri,) = names.get_extension_for_class(x509.SubjectAlternativeName).value.get_values_for_type(
            x509.UniformResourceIdentifier
        )
    except (x509.ExtensionNotFound, ValueError) as error:
        raise CertificateError(
            f"{folder / CERTIFICATE}: no application URI, expected one as subject alternative name"
        ) from error
    return Identity(certificate, read_private(folder / KEY), uri, trusted)


def _make(folder: Path) -> None:
    key = rsa.generate_private_key(public_exponent=65537, key_size=2048)
    host = socket.gethostname() or "localhost"
    name = x509.Name([x509.NameAttribute(NameOID.COMMON_NAME, f"conveyor_sim@{host}"[:64])])
    now = datetime.now(timezone.utc)
    names: list[x509.GeneralName] = [
        x509.UniformResourceIdentifier(f"urn:{host}:conveyor_sim"),
        *(x509.DNSName(known) for known in dict.fromkeys((host, "localhost"))),
        x509.IPAddress(ip_address("127.0.0.1")),
    ]
    # OPC 10000-6, 6.2.2: certificate of an application. asyncua.crypto.cert_gen was considered: its certificates are
    # those of an authority (CA:TRUE), which browsers and users should not trust for a server.
    certificate = (
        x509.CertificateBuilder()
        .subject_name(name)
        .issuer_name(name)
        .public_key(key.public_key())
        .serial_number(x509.random_serial_number())
        .not_valid_before(now - timedelta(days=1))
        .not_valid_after(now + timedelta(days=365 * YEARS))
        .add_extension(x509.SubjectAlternativeName(names), critical=False)
        .add_extension(x509.BasicConstraints(ca=False, path_length=None), critical=True)
        .add_extension(
            x509.KeyUsage(
                digital_signature=True,
                content_commitment=True,
                key_encipherment=True,
                data_encipherment=True,
                key_agreement=False,
                key_cert_sign=True,
                crl_sign=False,
                encipher_only=False,
                decipher_only=False,
            ),
            critical=True,
        )
        .add_extension(
            x509.ExtendedKeyUsage([ExtendedKeyUsageOID.SERVER_AUTH, ExtendedKeyUsageOID.CLIENT_AUTH]), critical=False
        )
        .add_extension(x509.SubjectKeyIdentifier.from_public_key(key.public_key()), critical=False)
        .sign(key, hashes.SHA256())
    )
    pem = key.private_bytes(serialization.Encoding.PEM, serialization.PrivateFormat.PKCS8, serialization.NoEncryption())
    # The key comes last: if it is missing, both are made again.
    _write(folder / CERTIFICATE, certificate.public_bytes(serialization.Encoding.DER))
    _write(folder / KEY, pem)


def _write(path: Path, content: bytes) -> None:
    try:
        write_file(path, content, mode=0o600)
    except FileError as error:
        raise CertificateError(f"{path}: {error}, expected a folder for certificates") from error


def read_private(path: Path) -> bytes:
    """Return the content of a file with a certificate or key. Raise CertificateError."""
    try:
        return read_file(path, MB)
    except FileError as error:
        raise CertificateError(f"{path}: {error}, expected a certificate or key") from error


def read_certificate(path: Path) -> bytes:
    """Return the certificate in a file (DER or PEM) as DER. Raise CertificateError."""
    content = read_private(path)
    try:
        certificate = (
            x509.load_pem_x509_certificate(content)
            if b"-----BEGIN" in content
            else x509.load_der_x509_certificate(content)
        )
    except ValueError as error:
        raise CertificateError(f"{path}: can't be read, expected a certificate (DER or PEM)") from error
    return certificate.public_bytes(serialization.Encoding.DER)


def trusted_plc(folder: Path, address: str) -> bytes | None:
    """Return the certificate (DER) that is trusted for a PLC at an address (host:port); None without one.

    Raise CertificateError.
    """
    path = _plc(folder, address)
    return read_certificate(path) if path.exists() else None


def trust_plc(folder: Path, address: str, certificate: bytes) -> None:
    """Trust a certificate (DER) for a PLC at an address (host:port), instead of the one before.

    folder: exists already. Raise CertificateError.
    """
    path = _plc(folder, address)
    try:
        path.parent.mkdir(mode=0o700, exist_ok=True)
    except OSError as error:
        raise CertificateError(f"{path.parent}: {error.strerror}, expected a folder for certificates") from error
    _write(path, certificate)


def _plc(folder: Path, address: str) -> Path:
    host, _, port = address.rpartition(":")
    return folder / PLCS / f"{quote(host, safe='')}_{port}.der"


CHAIN = "certificate.pem"
"""Name of the file beside KEY: certificate signed by an authority, and the certificates that lead to it."""


def server_context(folder: Path | None, of_opcua: Path | None) -> ssl.SSLContext:
    """Return a context for TLS. folder: contains CHAIN and KEY; None: the certificate that the OPC UA server makes, in
    `of_opcua` if given.

    Raises ServerError if it can't be read, CertificateError.
    """
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
    context.minimum_version = ssl.TLSVersion.TLSv1_2
    if folder is not None:
        _load(context, folder / CHAIN, folder / KEY)
        return context
    own_folder = of_opcua or default_folder()
    own = identity(own_folder)
    # The standard library reads certificates from named files only.
    with NamedTemporaryFile("w", suffix=".pem") as chain:
        chain.write(ssl.DER_cert_to_PEM_cert(own.certificate))
        chain.flush()
        _load(context, Path(chain.name), own_folder / KEY)
    return context


def _load(context: ssl.SSLContext, chain: Path, key: Path) -> None:
    for path in (chain, key):
        if not os.access(path, os.R_OK) or not path.is_file():
            raise ServerError(f"{path}: can't be read, expected a certificate and its key: {CHAIN} and {KEY}")
    try:
        context.load_cert_chain(chain, key, password=lambda: "")  # instead of asking at the terminal
    except (OSError, ValueError) as error:
        raise ServerError(f"{chain}: {error}, expected a certificate in PEM, and its key in {key.name}") from error
