# SPDX-License-Identifier: Apache-2.0
"""Secured connection to a PLC that is an OPC UA server: choice of its endpoint, trust, user."""

from __future__ import annotations

import asyncio
import dataclasses
import logging
from collections.abc import Awaitable, Callable, Sequence
from contextlib import suppress
from typing import TypeVar
from urllib.parse import urlsplit

from asyncua import Client, ua
from asyncua.crypto.security_policies import (
    SecurityPolicy,
    SecurityPolicyAes128Sha256RsaOaep,
    SecurityPolicyAes256Sha256RsaPss,
    SecurityPolicyBasic256Sha256,
    SecurityPolicyNone,
)
from asyncua.crypto.uacrypto import CertProperties
from cryptography import x509
from cryptography.hazmat.primitives.asymmetric import rsa
from cryptography.hazmat.primitives.serialization import load_pem_private_key

from conveyor_sim.protocols.attach.access import PlcAccess
from conveyor_sim.protocols.attach.plc_certificate import PlcCertificate, fingerprint
from conveyor_sim.protocols.attach.plc_link import PATIENCE, PlcLinkError, PlcRefusedError
from conveyor_sim.protocols.opcua.client_certificates import SHORTEST_KEY, require_usable
from conveyor_sim.protocols.server.certificates import (
    CERTIFICATE,
    CertificateError,
    default_folder,
    identity,
    read_certificate,
    read_private,
    trusted_plc,
)
from conveyor_sim.support.printable import SENTENCE, printable

T = TypeVar("T")

PORT = 4840
"""Port of OPC UA servers without another one in their URL."""

_NONE: type[SecurityPolicy] = SecurityPolicyNone
_POLICIES: dict[str, type[SecurityPolicy]] = {
    policy.URI: policy
    for policy in (
        SecurityPolicyNone,
        SecurityPolicyAes128Sha256RsaOaep,
        SecurityPolicyBasic256Sha256,
        SecurityPolicyAes256Sha256RsaPss,
    )
}
"""Security policies by URI, the strongest last. Basic256 and Basic128Rsa15 are broken (OPC 10000-7) and not used."""
_STRENGTH = {uri: place for place, uri in enumerate(_POLICIES)}

_Mode = ua.MessageSecurityMode
_MODES = {"none": _Mode.None_, "sign": _Mode.Sign, "encrypt": _Mode.SignAndEncrypt}
_TOKENS = {
    ua.UserTokenType.Anonymous: "anonymous",
    ua.UserTokenType.UserName: "user name",
    ua.UserTokenType.Certificate: "user certificate",
}

_UNKNOWN = (0, 0)

_OF_CERTIFICATES = ("BadCertificate", "BadSecurityChecks")
_OF_USERS = ("BadUserAccessDenied", "BadIdentityToken", "BadUserSignature")


class PlcClient(Client):
    """Session with one PLC, which must be the server and have the endpoints that it announced without security."""

    def __init__(
        self, url: str, endpoint: ua.EndpointDescription, expected: bytes | None, access: PlcAccess, patience: float
    ) -> None:
        """Prepare a session. expected: certificate of the PLC, DER; None: any."""
        # By default it disconnects from a server that has not answered for a second.
        super().__init__(url, timeout=patience, watchdog_intervall=patience)
        self.name = self.description = "conveyor_sim"
        self._url, self._endpoint, self._expected, self._access = url, endpoint, expected, access

    async def create_session(self) -> ua.CreateSessionResult:
        """Create the session. Raise PlcLinkError if its server or its endpoints are not those announced before.

        An attacker on the network could hide better endpoints there, or show another certificate.
        """
        response = await super().create_session()
        if self._expected is not None and response.ServerCertificate:
            shown = PlcCertificate(self._url, response.ServerCertificate).der
            if shown != self._expected:
                raise PlcRefusedError(
                    f"{self._url}: shows two certificates, expected one: an attacker may change messages"
                )
        known = [each for each in response.ServerEndpoints or () if _fits(each, self._access)]
        if any(_rank(each) > _rank(self._endpoint) for each in known):
            raise PlcRefusedError(f"{self._url}: announces a better endpoint later: an attacker may change messages")
        return response

    def server_policy(self, token_type: ua.UserTokenType) -> ua.UserTokenPolicy:
        """Return the most secure policy for a kind of user. The library would take the first."""
        return user_policy(self._endpoint, token_type)


def user_policy(endpoint: ua.EndpointDescription, token: ua.UserTokenType) -> ua.UserTokenPolicy:
    """Return the most secure policy of an endpoint for a kind of user. A policy without a URI has the endpoint's."""
    policies = [
        dataclasses.replace(each, SecurityPolicyUri=each.SecurityPolicyUri or endpoint.SecurityPolicyUri)
        for each in endpoint.UserIdentityTokens or ()
        if each.TokenType == token
    ]
    known = [each for each in policies if each.SecurityPolicyUri in _STRENGTH]
    default = ua.UserTokenPolicy(TokenType=token, SecurityPolicyUri=endpoint.SecurityPolicyUri)
    return max(known, key=lambda each: _STRENGTH[each.SecurityPolicyUri], default=default)


async def open_client(
    url: str, access: PlcAccess, say: Callable[[str], object], patience: float | None = None
) -> PlcClient:
    """Return a connected client of the server at a URL, by the most secure endpoint that `access` allows.

    say: takes sentences for the user: the endpoint, and a certificate that is trusted from now on. patience: longest
    time for each request, s of wall time; None: PATIENCE.

    Raise PlcLinkError, CertificateError.
    """
    reached, host, port, endpoints = await _discover(url, access)
    endpoint = choose(url, endpoints, access)
    folder = access.certificates or default_folder()
    secured = endpoint.SecurityMode != _Mode.None_
    address = f"{host}:{port}"
    if not secured and access.security == "best" and trusted_plc(folder, address) is not None:
        raise PlcRefusedError(
            f"{url}: offers no security any more, but its certificate is trusted, expected a secured endpoint "
            "(--security none connects nevertheless)"
        )
    expected = None
    if secured or access.trust or (access.password and _encrypts_password(endpoint)):
        expected = _require_trusted(url, address, endpoint, access, say).der
    client = PlcClient(reached, endpoint, expected, access, patience or PATIENCE)
    if secured:
        own = identity(folder)
        _require_valid(own.certificate, str(folder / CERTIFICATE))
        client.application_uri = own.application_uri
        policy = _POLICIES[endpoint.SecurityPolicyUri]
        await ask(
            url,
            client.set_security(
                policy, own.certificate, CertProperties(own.key, "pem"), None, expected, endpoint.SecurityMode
            ),
        )
    _identify(client, access)
    try:
        await ask(url, client.connect())
    except PlcLinkError as error:
        client.disconnect_socket()
        kind = PlcLinkError if isinstance(error.__cause__, OSError) else PlcRefusedError
        raise kind(f"{error}{_advice(error, access, f'{folder / CERTIFICATE}' if secured else '')}") from error
    except BaseException:
        client.disconnect_socket()
        raise
    name = access.user_certificate.name if access.user_certificate is not None else access.user
    say(f"{url}: connected with {_text(endpoint)}, {_TOKENS[_token(access)]} {printable(name)}".rstrip())
    return client


async def trust_server(url: str, access: PlcAccess, say: Callable[[str], object]) -> None:
    """Trust the certificate that the server at a URL shows, if `access.trust` is its SHA-256. No session is needed.

    say: takes sentences for the user. Raise PlcLinkError, CertificateError.
    """
    _, host, port, endpoints = await _discover(url, access)
    shown = [each for each in endpoints if each.ServerCertificate]
    if not shown:
        raise PlcRefusedError(f"{url}: has no certificate, expected one")
    _require_trusted(url, f"{host}:{port}", max(shown, key=_rank), access, say)


async def _discover(url: str, access: PlcAccess) -> tuple[str, str, int, list[ua.EndpointDescription]]:
    """Return the URL with its port, host, port, and the endpoints that the server offers. Raise PlcLinkError."""
    for name in ("client", "crypto", "common", "uaprotocol"):
        logging.getLogger(f"asyncua.{name}").setLevel(logging.CRITICAL + 1)  # PlcLinkError reports the same
    if access.trust:
        fingerprint(access.trust)  # a typing error is reported before anything else
    parts = urlsplit(url)
    reached = url if parts.port else parts._replace(netloc=f"{parts.netloc}:{PORT}").geturl()
    client = Client(reached, timeout=PATIENCE)
    endpoints = await ask(url, client.connect_and_get_server_endpoints())
    return reached, parts.hostname or "", parts.port or PORT, list(endpoints or ())


def _require_trusted(
    url: str, address: str, endpoint: ua.EndpointDescription, access: PlcAccess, say: Callable[[str], object]
) -> PlcCertificate:
    """Return the certificate of an endpoint. Raise PlcLinkError unless it is valid and trusted."""
    folder = access.certificates or default_folder()
    identity(folder)  # makes the folder, and our certificate
    certificate = PlcCertificate(url, endpoint.ServerCertificate)
    certificate.require_usable()
    if certificate.require_trusted(folder, address, endpoint.Server.ApplicationUri or "", access):
        say(f"{url}: its certificate is trusted from now on ({certificate.described})")
        say(f"{url}: let it trust our certificate in turn: {folder / CERTIFICATE}")
    return certificate


async def ask(url: str, request: Awaitable[T], patience: float | None = None) -> T:
    """Return the answer to a request. Raise PlcLinkError if there is none in time, or if it is malformed.

    patience: as for `open_client`.
    """
    try:
        return await asyncio.wait_for(request, 2.0 * (patience or PATIENCE))
    except PlcLinkError:
        raise
    except (OSError, asyncio.TimeoutError, ua.UaError) as error:
        text = "does not answer in time" if isinstance(error, asyncio.TimeoutError) else printable(error)
        raise PlcLinkError(f"{url}: {text or type(error).__name__}") from error
    except Exception as error:  # malformed answers raise any kind while they are decoded
        raise PlcLinkError(f"{url}: answers in a form that can't be read ({type(error).__name__})") from error


async def close_client(url: str, client: Client) -> None:
    """Disconnect. A server that does not answer is left without it."""
    with suppress(PlcLinkError):
        await ask(url, client.disconnect())
    with suppress(Exception):  # without a connection
        client.disconnect_socket()


def choose(url: str, endpoints: Sequence[ua.EndpointDescription], access: PlcAccess) -> ua.EndpointDescription:
    """Return the most secure endpoint that `access` allows. Raise PlcLinkError without one, with those that there are.

    The password is sent only if the channel or the password itself is encrypted, or if `access` asks for it.
    """
    known = [each for each in endpoints or () if _rank(each) > _UNKNOWN]
    usable = [each for each in known if _fits(each, access)]
    if not usable:
        offered = "; ".join(
            f"{_text(each)} for {', '.join(_TOKENS.get(t.TokenType, 'others') for t in each.UserIdentityTokens or ())}"
            for each in known
        )
        wanted = _TOKENS[_token(access)] + ("" if access.security == "best" else f" with --security {access.security}")
        raise PlcRefusedError(
            f"{url}: has no endpoint for {wanted}, offered: {printable(offered, SENTENCE) or 'none that is known'}"
        )
    best = max(usable, key=_rank)
    safe = best.SecurityMode == _Mode.SignAndEncrypt or _encrypts_password(best)
    if access.password and not safe and not access.plain_password:
        raise PlcRefusedError(
            f"{url}: offers {_text(best)} only, where others on the network can read the password, expected an "
            "encrypted endpoint (--plain-password sends it nevertheless)"
        )
    return best


def _encrypts_password(endpoint: ua.EndpointDescription) -> bool:
    return user_policy(endpoint, ua.UserTokenType.UserName).SecurityPolicyUri != _NONE.URI


def _token(access: PlcAccess) -> ua.UserTokenType:
    if access.user_certificate is not None:
        return ua.UserTokenType.Certificate
    return ua.UserTokenType.UserName if access.user else ua.UserTokenType.Anonymous


def _fits(endpoint: ua.EndpointDescription, access: PlcAccess) -> bool:
    """Return True if an endpoint has the security and accepts the kind of user of `access`."""
    if _rank(endpoint) == _UNKNOWN or access.security not in ("best", _name(endpoint.SecurityMode)):
        return False
    return _token(access) in {token.TokenType for token in endpoint.UserIdentityTokens or ()}


def _rank(endpoint: ua.EndpointDescription) -> tuple[int, int]:
    """Return numbers that are larger for more security; `_UNKNOWN` for an endpoint that can't be used."""
    mode, policy = endpoint.SecurityMode, endpoint.SecurityPolicyUri
    if mode not in _MODES.values() or policy not in _POLICIES or (mode == _Mode.None_) != (policy == _NONE.URI):
        return _UNKNOWN
    return int(mode), _STRENGTH[policy]


def _name(mode: ua.MessageSecurityMode) -> str:
    return next(name for name, each in _MODES.items() if each == mode)


def _text(endpoint: ua.EndpointDescription) -> str:
    if endpoint.SecurityMode == _Mode.None_:
        return "no security"
    return f"{endpoint.SecurityPolicyUri.partition('#')[2]} {endpoint.SecurityMode.name}"


def _identify(client: PlcClient, access: PlcAccess) -> None:
    """Prepare the user. Raise CertificateError for a certificate of a user that can't be used."""
    if access.user_certificate is None:
        if access.user:
            client.set_user(access.user)
            client.set_password(access.password)
        return
    if access.user_key is None:
        raise CertificateError(f"{access.user_certificate}: given without its key, expected --user-key")
    der = read_certificate(access.user_certificate)
    _require_valid(der, str(access.user_certificate))
    client.user_certificate = x509.load_der_x509_certificate(der)
    try:
        key = load_pem_private_key(read_private(access.user_key), None)
    except (ValueError, TypeError) as error:
        raise CertificateError(
            f"{access.user_key}: can't be read, expected a private key in PEM, not encrypted"
        ) from error
    if not isinstance(key, rsa.RSAPrivateKey) or key.public_key() != client.user_certificate.public_key():
        raise CertificateError(f"{access.user_key}: expected the RSA key of {access.user_certificate}")
    client.user_private_key = key


def _require_valid(der: bytes, where: str) -> None:
    """Raise CertificateError for a certificate of ours that PLCs must refuse."""
    try:
        require_usable(der)
    except Exception as error:
        loaded = x509.load_der_x509_certificate(der)
        raise CertificateError(
            f"{where}: valid from {loaded.not_valid_before_utc:%Y-%m-%d} to {loaded.not_valid_after_utc:%Y-%m-%d}, "
            f"expected a certificate that is valid today, with an RSA key of {SHORTEST_KEY} bits or more"
        ) from error


def _advice(error: PlcLinkError, access: PlcAccess, certificate: str) -> str:
    """Return what to do about a refused session. certificate: file of ours; "" without security."""
    text, cause = str(error), error.__cause__
    if any(code in text for code in _OF_USERS):
        return f"; it refuses {'this user or password' if access.user else _TOKENS[_token(access)]}"
    if certificate and (any(code in text for code in _OF_CERTIFICATES) or isinstance(cause, OSError)):
        return f"; it may refuse our certificate: let the PLC trust {certificate}"
    return ""
