# SPDX-License-Identifier: Apache-2.0
"""A soft PLC in a separate process, with an OPC UA server as vendors configure it: encrypted endpoints only, users,
a trust list, limits per request, and a host name that does not resolve. Argument: `Settings` as JSON.
"""

from __future__ import annotations

import asyncio
import gc
import json
import logging
import sys
from dataclasses import asdict, dataclass, replace
from datetime import datetime, timedelta, timezone
from pathlib import Path
from tempfile import TemporaryFile
from typing import IO, Any

from cryptography import x509
from cryptography.hazmat.primitives import hashes, serialization
from cryptography.hazmat.primitives.asymmetric import rsa
from cryptography.x509.oid import ExtendedKeyUsageOID, NameOID
from protocols.waiting import until
from testing.plc_servers import OpcUaPlc
from warm import Warm

HOST = "plc-of-a-plant"
"""Host name that it announces."""
URI, NAMESPACE = "urn:plc-of-a-plant:server", "urn:plc;1"
USER, PASSWORD = "line", "open sesame"
ENCRYPTED = ("Basic256Sha256_Sign", "Basic256Sha256_SignAndEncrypt")


@dataclass
class Settings:
    """Configuration of the server."""

    folder: str
    """Holds server.der and server.pem."""
    port: int = 0
    policies: tuple[str, ...] = ENCRYPTED
    namespaces: tuple[str, ...] = (NAMESPACE,)
    most_nodes: int = 0
    """Largest number of nodes per read or write; 0: no limit."""
    users: bool = False
    """True: only users by name or certificate."""
    trusted: tuple[str, ...] = ()
    """Files of client certificates that it trusts; none: all."""
    extra: int = 0
    """Number of further variables."""


def make_certificate(
    folder: Path, name: str, *, days: tuple[int, int] = (-1, 365), uri: str = URI, hosts: tuple[str, ...] = (HOST,)
) -> bytes:
    """Write name.der and name.pem; the certificate. days: begin and end of its validity, from now."""
    key = rsa.generate_private_key(public_exponent=65537, key_size=2048)
    subject = x509.Name([x509.NameAttribute(NameOID.COMMON_NAME, f"{name} of a plant")])
    now = datetime.now(timezone.utc)
    names = [x509.UniformResourceIdentifier(uri), *(x509.DNSName(host) for host in hosts)]
    made = (
        x509.CertificateBuilder()
        .subject_name(subject)
        .issuer_name(subject)
        .public_key(key.public_key())
        .serial_number(x509.random_serial_number())
        .not_valid_before(now + timedelta(days=days[0]))
        .not_valid_after(now + timedelta(days=days[1]))
        .add_extension(x509.SubjectAlternativeName(names), critical=False)
        .add_extension(x509.ExtendedKeyUsage([ExtendedKeyUsageOID.SERVER_AUTH]), critical=False)
        .sign(key, hashes.SHA256())
    )
    der = made.public_bytes(serialization.Encoding.DER)
    (folder / f"{name}.der").write_bytes(der)
    pem = key.private_bytes(serialization.Encoding.PEM, serialization.PrivateFormat.PKCS8, serialization.NoEncryption())
    (folder / f"{name}.pem").write_bytes(pem)
    return der


class VendorPlc(OpcUaPlc):
    """Server of another vendor with the same program."""

    def __init__(self, settings: Settings) -> None:
        super().__init__()
        self._settings = settings

    async def start(self, port: int) -> str:
        from asyncua import Server, ua

        settings = self._settings
        self._server = server = Server(user_manager=_Users(settings) if settings.users else None)
        gc.disable()  # to look through its thousands of nodes for garbage takes as long as to make them
        await server.init()
        server.set_endpoint(f"opc.tcp://127.0.0.1:{port}")
        await server.set_application_uri(URI)
        await server.load_certificate(f"{settings.folder}/server.der")
        await server.load_private_key(f"{settings.folder}/server.pem")
        server.set_security_policy([getattr(ua.SecurityPolicyType, name) for name in settings.policies])
        if settings.users:
            server.set_identity_tokens([ua.X509IdentityToken, ua.UserNameIdentityToken])
        trusted = {Path(path).read_bytes() for path in settings.trusted}
        if trusted:
            server.set_certificate_validator(_trust_list(trusted))
        for uri in settings.namespaces:
            await server.register_namespace(uri)
        index = await server.get_namespace_index(NAMESPACE)
        await self._add_variables(server, index, settings.extra)
        if settings.most_nodes:
            await _limit(server, settings.most_nodes)
        await server.start()
        bound = server.bserver.port
        for endpoint in server.iserver.endpoints:
            endpoint.EndpointUrl = f"opc.tcp://{HOST}:{bound}"
        server.iserver.match_discovery_endpoint_url = server.iserver.match_discovery_source_ip = False
        return f"opc.tcp://127.0.0.1:{bound}"

    async def _add_variables(self, server: Any, index: int, extra: int) -> None:
        from asyncua import ua

        gvl = await server.nodes.objects.add_object(ua.NodeId("GVL", index), ua.QualifiedName("GVL", index))
        types = {"bottles": "UInt16", "tick": "UInt32", "target": "UInt32", "speed": "Float", "full": "Boolean"}
        self._nodes = {}
        for name, kind in types.items():
            first = ua.Variant(False if kind == "Boolean" else 0, ua.VariantType[kind])
            node = await gvl.add_variable(ua.NodeId(f"GVL.{name}", index), ua.QualifiedName(name, index), first)
            if name in ("bottles", "tick"):
                await node.set_writable()
            self._nodes[name] = node
        for number in range(extra):
            name = ua.QualifiedName(f"extra{number}", index)
            await gvl.add_variable(ua.NodeId(f"GVL.extra{number}", index), name, float(number))


class _Users:
    def __init__(self, settings: Settings) -> None:
        self._certificate = (Path(settings.folder) / "user.der").read_bytes()

    def get_user(self, server: Any, username: Any = None, password: Any = None, certificate: Any = None) -> Any:
        from asyncua.crypto.permission_rules import User, UserRole

        known = (username, password) == (USER, PASSWORD) or (username is None and certificate == self._certificate)
        return User(role=UserRole.User) if known else None


def _trust_list(trusted: set[bytes]) -> Any:
    from asyncua import ua
    from asyncua.common.utils import ServiceError

    async def validate(certificate: x509.Certificate, _: Any) -> None:
        if certificate.public_bytes(serialization.Encoding.DER) not in trusted:
            raise ServiceError(ua.StatusCodes.BadCertificateUntrusted)

    return validate


async def _limit(server: Any, most: int) -> None:
    """Refuse more nodes per request, as the limits that it states allow."""
    from asyncua import ua
    from asyncua.common.utils import ServiceError
    from asyncua.server.internal_session import InternalSession

    ids = ua.ObjectIds
    for node in (
        ids.Server_ServerCapabilities_OperationLimits_MaxNodesPerRead,
        ids.Server_ServerCapabilities_OperationLimits_MaxNodesPerWrite,
        ids.Server_ServerCapabilities_OperationLimits_MaxNodesPerBrowse,
    ):
        await server.get_node(ua.NodeId(node)).write_value(ua.Variant(most, ua.VariantType.UInt32))
    for name, items in (("read", "NodesToRead"), ("write", "NodesToWrite"), ("browse", "NodesToBrowse")):
        setattr(InternalSession, name, _limited(getattr(InternalSession, name), items, most, ServiceError))


def _limited(method: Any, items: str, most: int, error: Any) -> Any:
    from asyncua import ua

    async def limited(self: Any, parameters: Any) -> Any:
        if self.external and len(getattr(parameters, items)) > most:
            raise error(ua.StatusCodes.BadTooManyOperations)
        return await method(self, parameters)

    return limited


class VendorServer:
    """The process, which a test ends and starts again at the same address."""

    def __init__(self, settings: Settings) -> None:
        self.settings = settings
        self.url = ""
        self.start()

    def start(self) -> None:
        command = ["-m", "testing.vendor_plc", json.dumps(asdict(self.settings))]
        with TemporaryFile("w+") as out, TemporaryFile("w+") as errors:
            self._process = Warm(command, out, errors, cwd=Path(__file__).parents[1])
            until(lambda: _text(out).endswith("\n") or self._process.poll() is not None, "the server")
            self.url = _text(out).strip()
            assert self.url.startswith("opc.tcp://"), _text(errors)
        self.settings = replace(self.settings, port=int(self.url.rpartition(":")[2]))

    def kill(self) -> None:
        self._process.kill()
        self._process.wait()


def _text(file: IO[str]) -> str:
    file.seek(0)
    return file.read()


async def _main(settings: Settings) -> None:
    logging.disable()
    plc = VendorPlc(settings)
    print(await plc.start(settings.port), flush=True)
    await plc.scan()
    await asyncio.Event().wait()


if __name__ == "__main__":
    asyncio.run(_main(Settings(**json.loads(sys.argv[1]))))
