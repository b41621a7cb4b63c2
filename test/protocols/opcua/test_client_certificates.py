# SPDX-License-Identifier: Apache-2.0
"""Certificates of clients that no server may accept, whether it has a list of trusted ones or not."""

from __future__ import annotations

from datetime import datetime, timedelta, timezone
from pathlib import Path
from typing import TYPE_CHECKING

import pytest
from asyncua import Client, ua
from asyncua.common.utils import ServiceError
from asyncua.crypto.security_policies import SecurityPolicyBasic256Sha256
from cryptography import x509
from cryptography.hazmat.primitives import hashes
from cryptography.hazmat.primitives.asymmetric import rsa
from cryptography.hazmat.primitives.serialization import Encoding, NoEncryption, PrivateFormat
from cryptography.x509.oid import NameOID
from protocols.waiting import alone

from conveyor_sim.protocols.opcua.client_certificates import require_usable
from conveyor_sim.protocols.server.certificates import TRUSTED, identity
from test.protocols.opcua.conftest import PASSWORD, PATIENCE, refused

if TYPE_CHECKING:
    from test.protocols.opcua.conftest import Line, Serve

Codes = ua.StatusCodes

CASES: dict[str, tuple[int, int, int, int]] = {
    "expired": (2048, -40, -1, Codes.BadCertificateTimeInvalid),
    "expired a minute ago": (2048, -40, 0, Codes.BadCertificateTimeInvalid),
    "not yet valid": (2048, 1, 40, Codes.BadCertificateTimeInvalid),
    "short": (1024, -1, 40, Codes.BadCertificatePolicyCheckFailed),
    "shorter by little": (2040, -1, 40, Codes.BadCertificatePolicyCheckFailed),
    "good": (2048, -1, 40, Codes.Good),
    "long": (3072, -1, 40, Codes.Good),
}
"""Bits of the key; first and last day of validity, from today on; status code."""


def made(folder: Path, bits: int, first: int, last: int) -> str:
    """Make a self-signed certificate and its key. Return the parts of a security string that name them."""
    key = rsa.generate_private_key(public_exponent=65537, key_size=bits)
    name = x509.Name([x509.NameAttribute(NameOID.COMMON_NAME, "client")])
    now = datetime.now(timezone.utc) - timedelta(minutes=1)
    certificate = (
        x509.CertificateBuilder()
        .subject_name(name)
        .issuer_name(name)
        .public_key(key.public_key())
        .serial_number(x509.random_serial_number())
        .not_valid_before(now + timedelta(days=first))
        .not_valid_after(now + timedelta(days=last))
        .add_extension(x509.SubjectAlternativeName([x509.UniformResourceIdentifier("urn:freeopcua:client")]), False)
        .sign(key, hashes.SHA256())
    )
    folder.mkdir(exist_ok=True)
    (folder / "client.der").write_bytes(certificate.public_bytes(Encoding.DER))
    (folder / "client.pem").write_bytes(key.private_bytes(Encoding.PEM, PrivateFormat.PKCS8, NoEncryption()))
    return f"{folder}/client.der,{folder}/client.pem"


@pytest.fixture(scope="module")
def files(tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    folder = tmp_path_factory.mktemp("clients")
    return {name: made(folder / str(number), *case[:3]) for number, (name, case) in enumerate(CASES.items())}


@pytest.fixture(scope="module")
def trusting(serve: Serve, files: dict[str, str], tmp_path_factory: pytest.TempPathFactory) -> Line:
    """Start a server that trusts all of them."""
    own = tmp_path_factory.mktemp("trusting") / "own"
    identity(own)
    for number, pair in enumerate(files.values()):
        (own / TRUSTED / f"{number}.der").write_bytes(Path(pair.split(",")[0]).read_bytes())
    return serve(certificates=own)


def connect(line: Line, files: dict[str, str], mode: str) -> None:
    for name, (*_, code) in CASES.items():
        security = f"Basic256Sha256,{mode},{files[name]}"
        if code == Codes.Good:
            assert line.client("viewer", security=security).get_node("ns=2;s=run/tick").read_value() is not None
        else:
            with refused(code):
                line.client("viewer", security=security)


@pytest.mark.parametrize("mode", ["Sign", "SignAndEncrypt"])
def test_expired_early_and_short_certificates_are_refused(line: Line, files: dict[str, str], mode: str) -> None:
    connect(line, files, mode)


def test_trust_does_not_make_up_for_that(trusting: Line, files: dict[str, str]) -> None:
    connect(trusting, files, "SignAndEncrypt")


@pytest.mark.parametrize("name", ["good", "expired"])
def test_certificates_of_issuers_may_follow(trusting: Line, files: dict[str, str], name: str) -> None:
    """The first certificate counts, also for the list of trusted ones."""
    leaf, key = files[name].split(",")

    async def connect() -> None:
        client = Client(trusting.server.address, timeout=PATIENCE, watchdog_intervall=PATIENCE)
        client.set_user("viewer")
        client.set_password(PASSWORD)
        await client.set_security(
            SecurityPolicyBasic256Sha256, leaf, key, certificate_chain=[files["long"].split(",")[0]]
        )
        async with client:
            assert await client.get_node("ns=2;s=run/tick").read_value() is not None

    if name == "good":
        alone(connect())
    else:
        with refused(Codes.BadCertificateTimeInvalid):
            alone(connect())


@pytest.mark.parametrize("certificate", [b"", b"0", b"0\x82", b"0\x82\x01\x00" + b"0" * 300, b"\x31\x03" * 40])
def test_what_is_no_certificate_is_refused(certificate: bytes) -> None:
    with pytest.raises(ServiceError) as refusal:
        require_usable(certificate)
    assert refusal.value.code == Codes.BadCertificateInvalid
