# SPDX-License-Identifier: Apache-2.0
"""Access and permissions: the library's defaults allow everything to everybody."""

from __future__ import annotations

import shutil
import stat
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest
from asyncua import Client as AsyncClient
from asyncua import ua
from asyncua.crypto.cert_gen import generate_private_key, generate_self_signed_app_certificate
from cryptography import x509
from cryptography.hazmat.primitives.serialization import Encoding, NoEncryption, PrivateFormat
from protocols.waiting import alone
from warm import run

from conveyor_sim.protocols.server.certificates import CERTIFICATE, KEY, TRUSTED, CertificateError, identity
from conveyor_sim.protocols.server.users import (
    MOST_WRONG,
    PERIOD,
    Logins,
    User,
    UsersError,
    authenticate,
    line_of,
    new_user,
    read_users,
)
from test.protocols.opcua.conftest import PASSWORD, PATIENCE, refused

if TYPE_CHECKING:
    from test.protocols.opcua.conftest import Line, Serve

Codes = ua.StatusCodes
SETPOINT = "belts/zone1/cmd_speed"


def own_certificate(folder: Path, uri: str = "urn:freeopcua:client", name: str = "client") -> str:
    """Make a certificate of a client. Return the parts of a security string that name it."""
    key = generate_private_key()
    made = generate_self_signed_app_certificate(key, name, {}, [x509.UniformResourceIdentifier(uri)], [])
    (folder / f"{name}.der").write_bytes(made.public_bytes(Encoding.DER))
    pem = key.private_bytes(Encoding.PEM, PrivateFormat.PKCS8, NoEncryption())
    (folder / f"{name}.pem").write_bytes(pem)
    return f"{folder}/{name}.der,{folder}/{name}.pem"


@pytest.fixture(scope="module")
def client_files(tmp_path_factory: pytest.TempPathFactory) -> str:
    return own_certificate(tmp_path_factory.mktemp("client"))


@pytest.mark.parametrize("user", ["", "viewer"])
def test_readers_change_nothing(line: Line, user: str) -> None:
    client = line.client(user)
    node = client.get_node(f"ns=2;s={SETPOINT}")
    before = node.read_value()
    with refused(Codes.BadUserAccessDenied):
        node.write_value(0.1)
    with refused(Codes.BadUserAccessDenied):
        node.write_attribute(ua.AttributeIds.AccessLevel, ua.DataValue(ua.Variant(3, ua.VariantType.Byte)))
    with refused(Codes.BadUserAccessDenied):
        client.get_node("ns=2;s=line").call_method("2:acknowledge", "")
    with refused(Codes.BadUserAccessDenied):
        client.get_node("ns=2;s=alarm_states").call_method("2:acknowledge")
    with refused(Codes.BadUserAccessDenied):
        client.nodes.objects.add_variable("ns=2;s=mine", "2:mine", 1.0)
    with refused(Codes.BadUserAccessDenied):
        node.delete()
    line.advance()
    assert line.outcomes() == [] and node.read_value() == before


def test_nobody_changes_the_nodes(line: Line) -> None:
    for user in ("operator", "engineer", "controller", "test"):
        client = line.client(user)
        with refused(Codes.BadUserAccessDenied):
            client.nodes.objects.add_object("ns=2;s=mine", "2:mine")
        with refused(Codes.BadUserAccessDenied):
            client.get_node(f"ns=2;s={SETPOINT}").delete()
        with refused(Codes.BadNotWritable):
            client.nodes.server.get_child("0:ServiceLevel").write_value(ua.Variant(0, ua.VariantType.Byte))


STRANGERS = [
    ("operator", "open sesam"),
    ("operator", ""),
    ("admin", "admin"),
    ("Admin", PASSWORD),
    ("root", ""),
    ("", "x"),
]


def test_who_is_not_known_is_not_let_in(line: Line) -> None:
    async def come(name: str, password: str) -> None:
        client = AsyncClient(line.server.address, timeout=PATIENCE, watchdog_intervall=PATIENCE)
        client._username, client._password = name, password
        async with client:
            await client.get_node(f"ns=2;s={SETPOINT}").write_value(0.1)

    for name, password in STRANGERS:
        with pytest.raises(ua.UaStatusCodeError) as caught:
            alone(come(name, password))
        # An empty password is not encrypted by this client.
        expected = Codes.BadUserAccessDenied if password else Codes.BadSecurityModeInsufficient
        assert caught.value.code == expected, name
    line.client()
    line.advance()
    assert line.outcomes() == []


def test_without_anonymous_readers_a_name_is_needed(serve: Serve) -> None:
    line = serve(anonymous=False)
    with refused(Codes.BadIdentityTokenRejected):
        line.client()
    assert line.client("viewer").get_node(f"ns=2;s={SETPOINT}").read_value() is not None


class _Plain(AsyncClient):
    """Client that sends its password as plain text."""

    def _add_user_auth(self, params: Any, username: Any, password: Any) -> None:
        params.UserIdentityToken = ua.UserNameIdentityToken("username", username, password.encode(), None)


class _Again(AsyncClient):
    """Client that replays a password that was encrypted for another session."""

    heard: tuple[bytes, str] | None = None

    def _encrypt_password(self, password: str, policy_uri: str) -> tuple[bytes, str]:
        type(self).heard = type(self).heard or super()._encrypt_password(password, policy_uri)
        return type(self).heard  # type: ignore[return-value]


async def _come(kind: type[AsyncClient], address: str) -> None:
    client = kind(address, timeout=PATIENCE, watchdog_intervall=PATIENCE)
    client.set_user("operator")
    client.set_password(PASSWORD)
    async with client:
        pass


def test_a_password_is_not_taken_in_the_clear(line: Line) -> None:
    with refused(Codes.BadSecurityModeInsufficient):
        alone(_come(_Plain, line.server.address))


def test_a_password_that_was_heard_is_of_no_use(line: Line) -> None:
    alone(_come(_Again, line.server.address))
    with refused(Codes.BadIdentityTokenInvalid):
        alone(_come(_Again, line.server.address))


def test_a_secured_channel_carries_all(line: Line, client_files: str) -> None:
    policies = (
        "Basic256Sha256,SignAndEncrypt",
        "Basic256Sha256,Sign",
        "Aes128Sha256RsaOaep,SignAndEncrypt",
        "Aes256Sha256RsaPss,SignAndEncrypt",
    )
    for value, policy in enumerate(policies, start=1):
        client = line.client("controller", security=f"{policy},{client_files}")
        client.get_node(f"ns=2;s={SETPOINT}").write_value(value / 8)
        line.advance()
        assert line.outcomes() == [("opcua controller", "set", (SETPOINT,), (value / 8,), True)]


@pytest.fixture(scope="module")
def trusting(serve: Serve, tmp_path_factory: pytest.TempPathFactory) -> tuple[Line, str]:
    """Start a server that trusts one certificate; return both."""
    folder = tmp_path_factory.mktemp("trusting")
    identity(folder / "own")
    known = own_certificate(folder, name="known")
    (folder / "own" / TRUSTED / "known.der").write_bytes((folder / "known.der").read_bytes())
    return serve(certificates=folder / "own"), known


def test_only_trusted_certificates_are_let_in_where_there_are_any(trusting: tuple[Line, str], tmp_path: Path) -> None:
    line, known = trusting
    line.client("viewer", security=f"Basic256Sha256,SignAndEncrypt,{known}")
    other = own_certificate(tmp_path, name="other")
    with refused(Codes.BadCertificateUntrusted):
        line.client("viewer", security=f"Basic256Sha256,SignAndEncrypt,{other}")


def test_certificate_and_key_are_made_once_and_are_nobody_elses(tmp_path: Path) -> None:
    folder = tmp_path / "own"
    first = identity(folder)
    assert stat.S_IMODE(folder.stat().st_mode) == 0o700 and stat.S_IMODE((folder / KEY).stat().st_mode) == 0o600
    assert identity(folder) == first and first.application_uri.endswith(":conveyor_sim")
    folder.chmod(0o755)
    with pytest.raises(CertificateError, match="expected a folder that only this user can read"):
        identity(folder)
    folder.chmod(0o700)
    (folder / CERTIFICATE).write_bytes(b"none")
    with pytest.raises(CertificateError, match="expected a certificate"):
        identity(folder)


def test_a_full_disk_leaves_no_part_of_a_certificate(tmp_path: Path) -> None:
    """By a limit of the size of files, which the system keeps as it does that of the disk."""
    code = (
        "import resource, signal, sys; from pathlib import Path; "
        "from conveyor_sim.protocols.server.certificates import identity; "
        "signal.signal(signal.SIGXFSZ, signal.SIG_IGN); resource.setrlimit(resource.RLIMIT_FSIZE, (0, 0)); "
        "identity(Path(sys.argv[1]))"
    )
    done = subprocess.run([sys.executable, "-c", code, str(tmp_path)], capture_output=True, text=True)
    assert done.returncode != 0 and "CertificateError" in done.stderr
    assert not [file for file in tmp_path.iterdir() if file.is_file()]


@pytest.mark.skipif(shutil.which("openssl") is None, reason="openssl is not installed: apt-get install openssl")
def test_the_certificate_is_one_that_openssl_takes(certificates: Path) -> None:
    identity(certificates)
    command = ["openssl", "x509", "-inform", "DER", "-noout", "-text", "-in", str(certificates / CERTIFICATE)]
    text = subprocess.run(command, capture_output=True, text=True, check=True).stdout
    for expected in ("URI:urn:", "DNS:localhost", "IP Address:127.0.0.1", "TLS Web Server Authentication"):
        assert expected in text


def test_users_come_from_a_file(tmp_path: Path) -> None:
    path = tmp_path / "users.txt"
    user = new_user("operator", "geheim")
    path.write_text(f"# those of the night shift\n\n{line_of('jo', user)}\n")
    users = read_users(path)
    assert users == {"jo": user} and "geheim" not in path.read_text()
    assert authenticate(users, "jo", "geheim") == user
    assert authenticate(users, "jo", "Geheim") is None
    assert authenticate(users, "al", "geheim") is None


@pytest.mark.parametrize(
    ("line", "expected"),
    [
        ("jo:operator", "expected name:role:scrypt:salt:hash"),
        ("jo:admin:scrypt:AAAA:AAAA", "role admin given, expected one of viewer, operator"),
        ("jo:operator:scrypt:AAAA:AAAA", "salt and hash of jo can't be read"),
        ("jo:operator:md5:AAAA:AAAA", "expected name:role:scrypt"),
        ("j o:operator:scrypt:AAAA:AAAA", "expected name:role:scrypt"),
    ],
)
def test_a_line_that_can_not_be_is_named(tmp_path: Path, line: str, expected: str) -> None:
    path = tmp_path / "users.txt"
    path.write_text(f"\n{line}\n")
    with pytest.raises(UsersError, match=f"users.txt: line 2: .*{expected}"):
        read_users(path)


def test_a_user_can_not_be_given_twice(tmp_path: Path) -> None:
    line = line_of("jo", new_user("viewer", "x"))
    (tmp_path / "users.txt").write_text(f"{line}\n{line}\n")
    with pytest.raises(UsersError, match="line 2: jo given twice"):
        read_users(tmp_path / "users.txt")


def test_a_user_is_added_and_changed_by_a_command(tmp_path: Path) -> None:
    path = tmp_path / "users.txt"
    command = ["-c", "from conveyor_sim.cli import main; main()", "user", str(path)]
    for name, role, password in (("jo", "operator", "one"), ("al", "viewer", "two"), ("jo", "engineer", "three")):
        done = run([*command, name, "--role", role, "--password", password])
        assert done.returncode == 0 and password not in done.stdout
    users = read_users(path)
    assert {name: user.role for name, user in users.items()} == {"jo": "engineer", "al": "viewer"}
    assert authenticate(users, "jo", "three") and not authenticate(users, "jo", "one")
    assert stat.S_IMODE(path.stat().st_mode) == 0o600
    wrong = run([*command, "a:b", "--password", "x"])
    assert wrong.returncode == 1 and "name: a:b given, expected 1 to 40 letters" in wrong.stderr


def test_who_guesses_passwords_is_not_listened_to_for_a_minute() -> None:
    logins = Logins({"jo": new_user("operator", "geheim"), "al": new_user("viewer", "offen")})
    for guess in range(MOST_WRONG):
        assert logins.enter("jo", f"guess {guess}", "10.0.0.7", 100.0 + guess) is None
    assert logins.enter("jo", "geheim", "10.0.0.7", 110.0) is None
    assert logins.enter("jo", "geheim", "10.0.0.8", 110.0)  # from elsewhere
    assert logins.enter("al", "offen", "10.0.0.7", 110.0)  # somebody else
    assert logins.enter("jo", "geheim", "10.0.0.7", 100.5 + PERIOD)
    assert logins.enter("jo", "wrong", "10.0.0.7", 161.0) is None
    assert logins.enter("jo", "geheim", "10.0.0.7", 162.0)


def test_a_client_that_guesses_is_shut_out(serve: Serve, users: dict[str, User]) -> None:
    line = serve(users={"operator": users["operator"]})
    for guess in range(MOST_WRONG):
        with refused(Codes.BadUserAccessDenied):
            line.client("operator", password=f"guess {guess}")
    with refused(Codes.BadUserAccessDenied):
        line.client("operator")
    assert line.client().get_node(f"ns=2;s={SETPOINT}").read_value() is not None


async def _steal(address: str, tokens: Sequence[ua.NodeId]) -> None:
    """Take over the session of another user by its token, and write in that user's name."""
    setpoint = ua.WriteValue(ua.NodeId(SETPOINT, 2), ua.AttributeIds.Value, None, ua.DataValue(ua.Variant(0.5)))
    for token in tokens:
        thief = AsyncClient(address, timeout=PATIENCE, watchdog_intervall=PATIENCE)
        await thief.connect_socket()
        try:
            await thief.send_hello()
            await thief.open_secure_channel()
            thief.uaclient.session.restore_authentication_token(token)
            wrong = ua.ActivateSessionParameters()
            wrong.UserIdentityToken = ua.UserNameIdentityToken("username", "controller", b"guessed", None)
            with pytest.raises(ua.UaStatusCodeError):
                await thief.uaclient.session.activate_session(wrong)
            with pytest.raises(ua.UaStatusCodeError):
                await thief.uaclient.session.write(ua.WriteParameters([setpoint]))
        finally:
            thief.disconnect_socket()


def test_a_session_can_not_be_taken_over(line: Line, client_files: str) -> None:
    """By a token that was guessed, or that was overheard."""
    controller = line.client("controller", security=f"Basic256Sha256,Sign,{client_files}")
    plain = line.client("controller")
    known = [each.aio_obj.uaclient.session.authentication_token for each in (controller, plain)]
    guessed = [ua.NodeId(1000 + number) for number in range(0, 60, 5)]
    alone(_steal(line.server.address, [*known, *guessed]))
    line.advance()
    assert line.outcomes() == []
    controller.get_node(f"ns=2;s={SETPOINT}").write_value(0.25)  # it is still theirs
    line.advance()
    assert [row[3] for row in line.outcomes()] == [(0.25,)]
    assert all(token.NodeIdType is ua.NodeIdType.ByteString for token in known)


def test_trusted_certificates_are_asked_for_on_every_channel(trusting: tuple[Line, str]) -> None:
    with refused(Codes.BadSecurityModeInsufficient):
        trusting[0].client()
