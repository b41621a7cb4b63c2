# SPDX-License-Identifier: Apache-2.0
"""A line as the client of a PLC whose OPC UA server offers encrypted endpoints only, in a separate process."""

from __future__ import annotations

import asyncio
import csv
import struct
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner
from facts import missing, stating
from protocols.waiting import alone
from testing.conftest import LINE
from testing.faulty_proxy import FaultyProxy
from testing.plc_servers import ALARM, OWN, write_map
from testing.soft_plc import BOTTLES, SETPOINT
from testing.test_plc_server import SECONDS, FreeRunning, Twin

pytest.importorskip("asyncua", reason="asyncua is not installed: pip install conveyor-sim[scada]")

from testing.vendor_plc import HOST, NAMESPACE, PASSWORD, URI, USER, Settings, VendorServer, make_certificate

from conveyor_sim.bag.replay import replay
from conveyor_sim.cli import main
from conveyor_sim.control.scan import ControlError
from conveyor_sim.protocols.attach import opcua_client, opcua_requests
from conveyor_sim.protocols.attach.access import PlcAccess, Security
from conveyor_sim.protocols.attach.links import plc_link
from conveyor_sim.protocols.attach.opcua_client import choose, trust_server
from conveyor_sim.protocols.attach.plc_certificate import PlcCertificate
from conveyor_sim.protocols.attach.plc_link import PlcLinkError, PlcRefusedError
from conveyor_sim.protocols.attach.tag_map import TagMapError, read_tag_map
from conveyor_sim.protocols.hosting.server_thread import ServerThread
from conveyor_sim.protocols.server.certificates import CERTIFICATE, PLCS, CertificateError, identity, trust_plc
from conveyor_sim.testing import Scenario

THEIRS = {BOTTLES: "bottles", SETPOINT: "speed", ALARM: "full", "run/tick": "tick", "run/target_tick": "target"}
PLACES = {
    ours: f"nsu={NAMESPACE.replace(';', '%3B')};s=GVL.{theirs}" for ours, theirs in {**THEIRS, OWN: "target"}.items()
}
"""Places by the URI of the namespace, in which ";" is escaped."""


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Keys and certificates of the server and of a user; `own`: those of the line, and those that it trusts."""
    folder = tmp_path_factory.mktemp("secured")
    for name in ("server", "user"):
        make_certificate(folder, name)
    identity(folder / "own")
    return folder


@pytest.fixture(scope="module")
def tags(folder: Path) -> Path:
    return write_map(folder / "tags.csv", PLACES)


Start = Callable[..., VendorServer]


@pytest.fixture(scope="module")
def start(folder: Path) -> Iterator[Start]:
    """A function that starts a server, `start(users=True)`, which ends with the module."""
    servers = []

    def make(**settings: Any) -> VendorServer:
        settings = {"trusted": (str(folder / "own" / CERTIFICATE), str(folder / "user.der")), **settings}
        servers.append(VendorServer(Settings(str(folder), **settings)))
        return servers[-1]

    yield make
    for server in servers:
        server.kill()


@pytest.fixture(scope="module")
def server(start: Start) -> VendorServer:
    """Fewer nodes per request than the map has, users with name or certificate."""
    return start(most_nodes=3, users=True, extra=10)


def sha256(folder: Path, name: str = "server") -> str:
    return PlcCertificate("", (folder / f"{name}.der").read_bytes()).sha256


@pytest.fixture(scope="module")
def trusting(folder: Path, server: VendorServer) -> PlcAccess:
    """Access by name to the server, which is trusted."""
    access = PlcAccess(USER, PASSWORD, certificates=folder / "own")
    alone(trust_server(server.url, access._replace(trust=sha256(folder)), lambda _: None))
    return access


def connect(url: str, tags: Path, access: PlcAccess) -> list[str]:
    """Connect and disconnect; what is said about the connection."""
    said: list[str] = []
    with Scenario(LINE) as plant:
        mapped = read_tag_map(tags, plant.simulation.process_image.tags)
    link = plc_link(url, mapped.all, access, said.append)

    async def come() -> None:
        try:
            await link.connect()
        finally:
            await link.close()

    alone(come())
    return said


def test_an_encrypted_plc_gives_the_bits_of_its_program(
    server: VendorServer, trusting: PlcAccess, tags: Path, filled: Path, tmp_path: Path
) -> None:
    """Reads and writes are split, because the server refuses more than three nodes."""
    with Scenario(LINE, start=filled) as inside, Scenario(LINE, start=filled, bag=tmp_path / "bag") as outside:
        inside.attach(Twin())
        outside.attach_plc(server.url, tags, access=trusting)
        for plant in (inside, outside):
            plant.run_for(SECONDS)
        assert outside.simulation.state_hash() == inside.simulation.state_hash()
        assert np.array_equal(outside.history[SETPOINT], inside.history[SETPOINT])
        assert np.ptp(outside.history[SETPOINT]) > 0.0 and np.ptp(outside.history[ALARM]) > 0.0
    assert replay(tmp_path / "bag").difference is None


def test_a_target_of_an_earlier_run_is_not_taken_for_the_present_one(
    server: VendorServer, trusting: PlcAccess, tags: Path, filled: Path
) -> None:
    """The program runs on between two tests, so its target is far ahead of the second."""
    for _ in range(2):
        with Scenario(LINE, start=filled) as inside, Scenario(LINE, start=filled) as outside:
            inside.attach(Twin())
            outside.attach_plc(server.url, tags, access=trusting)
            for plant in (inside, outside):
                plant.run_for(0.3)
            assert outside.simulation.state_hash() == inside.simulation.state_hash()
            assert outside.signals[OWN] == outside.simulation.tick + 1


@pytest.mark.parametrize(
    ("security", "mode"), [("best", "SignAndEncrypt"), ("encrypt", "SignAndEncrypt"), ("sign", "Sign")]
)
def test_it_uses_the_security_that_is_asked_for_and_says_which(
    server: VendorServer, trusting: PlcAccess, tags: Path, security: Security, mode: str
) -> None:
    (said,) = connect(server.url, tags, trusting._replace(security=security))
    assert missing(said, [server.url, "Basic256Sha256", mode, "user name", USER]) == []


def test_a_user_may_have_a_certificate_instead_of_a_name(
    server: VendorServer, trusting: PlcAccess, folder: Path, tags: Path
) -> None:
    of_user = PlcAccess(user_certificate=folder / "user.der", user_key=folder / "user.pem", certificates=folder / "own")
    (said,) = connect(server.url, tags, of_user)
    assert missing(said, ["SignAndEncrypt", "user certificate", "user.der"]) == []
    with pytest.raises(CertificateError, match=stating("server.pem", "key of", "user.der")):
        connect(server.url, tags, of_user._replace(user_key=folder / "server.pem"))
    stranger = of_user._replace(user_certificate=folder / "server.der", user_key=folder / "server.pem")
    with pytest.raises(PlcLinkError, match=stating("BadUserAccessDenied", "user certificate")):
        connect(server.url, tags, stranger)


def test_an_unknown_server_is_refused_until_it_is_trusted(
    server: VendorServer, trusting: PlcAccess, folder: Path, tags: Path, tmp_path: Path
) -> None:
    """The error has all that is needed to compare the certificate, and the command that trusts it."""
    identity(tmp_path / "own")
    stranger = trusting._replace(certificates=tmp_path / "own")
    with pytest.raises(PlcLinkError) as refused:
        connect(server.url, tags, stranger)
    text = str(refused.value)
    command = f"conveyor-sim attach {server.url} --trust {sha256(folder)} --opcua-certificates {tmp_path / 'own'}"
    assert missing(text, "not trusted", "CN=server of a plant", "thumbprint", command, HOST, "not to 127.0.0.1") == []
    wrong = sha256(folder, "user")
    answer = CliRunner().invoke(main, [*command.replace(sha256(folder), wrong).split()[1:]])
    assert answer.exit_code == 1 and missing(answer.output, wrong, sha256(folder)) == []
    assert not list((tmp_path / "own").glob(f"{PLCS}/*"))
    answer = CliRunner().invoke(main, command.split()[1:])
    assert answer.exit_code == 0 and missing(answer.output, "trusted", str(tmp_path / "own" / CERTIFICATE)) == []
    # The server trusts the certificate of another line only.
    with pytest.raises(PlcLinkError, match=stating("BadCertificateUntrusted", str(tmp_path / "own" / CERTIFICATE))):
        connect(server.url, tags, stranger)


def test_a_wrong_password_is_refused_in_words(server: VendorServer, trusting: PlcAccess, tags: Path) -> None:
    with pytest.raises(PlcLinkError, match=stating(server.url, "BadUserAccessDenied", "password")):
        connect(server.url, tags, trusting._replace(password="sesame"))


def test_a_server_without_the_kind_of_user_is_refused(server: VendorServer, folder: Path, tags: Path) -> None:
    with pytest.raises(PlcLinkError, match=stating("anonymous", "offered", "user name", "user certificate")):
        connect(server.url, tags, PlcAccess(certificates=folder / "own"))


def test_a_variable_that_can_t_be_written_is_named(server: VendorServer, trusting: PlcAccess, tmp_path: Path) -> None:
    others = {ours: theirs for ours, theirs in PLACES.items() if ours not in (BOTTLES, SETPOINT)}
    tags = write_map(tmp_path / "tags.csv", {BOTTLES: PLACES[SETPOINT], **others})
    with pytest.raises(TagMapError, match=stating("line 2", "GVL.speed", "read-only", BOTTLES)):
        connect(server.url, tags, trusting)


def test_browse_prints_a_map_that_needs_names_only(
    server: VendorServer, trusting: PlcAccess, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It asks for a few references at a time, so that the server answers with continuation points."""
    monkeypatch.setenv("CONVEYOR_SIM_PLC_PASSWORD", PASSWORD)
    monkeypatch.setattr(opcua_requests, "MOST_REFERENCES", 4)
    options = ["--browse", "--user", USER, "--opcua-certificates", str(trusting.certificates)]
    printed = CliRunner().invoke(main, ["attach", server.url, *options])
    assert printed.exit_code == 0, printed.output
    rows = list(csv.DictReader(printed.stdout.splitlines()))
    notes = {row["theirs"]: row["note"].split() for row in rows}
    assert all(not row["tag"] for row in rows) and len(rows) == len(notes)
    assert notes[PLACES["run/tick"]] == ["UInt32", "GVL/tick"]
    assert notes[PLACES[SETPOINT]] == ["Float", "read-only", "GVL/speed"]
    assert sum("extra" in theirs for theirs in notes) == 10
    assert missing(printed.stderr, [server.url, str(len(rows)), "variables", "SignAndEncrypt"]) == []
    ours = {theirs: name for name, theirs in PLACES.items()}
    lines = [f"{ours.get(row['theirs'], '')},{row['theirs']},{row['note']}\n" for row in rows]
    (tmp_path / "tags.csv").write_text("tag,theirs,note\n" + "".join(lines))
    assert connect(server.url, tmp_path / "tags.csv", trusting)


def test_a_plc_that_is_killed_fails_the_test_and_serves_the_next(
    server: VendorServer, trusting: PlcAccess, tags: Path, tmp_path: Path
) -> None:
    """After the restart it lists its namespaces in another order."""
    with Scenario(LINE) as plant:
        plant.attach_plc(server.url, tags, access=trusting)
        plant.run_for(0.1)
        server.kill()
        server.settings = replace(server.settings, namespaces=("urn:other", "urn:more", NAMESPACE))
        try:
            with pytest.raises(ControlError, match=stating("no PLC", server.url)):
                plant.run_for(0.1)
        finally:
            server.start()
    with Scenario(LINE) as plant:
        plant.attach_plc(server.url, tags, access=trusting)
        plant.run_for(0.1)
        assert plant.signals["belts/zone1/speed"] > 0.0 and plant.signals[OWN] == plant.simulation.tick + 1
    unknown = write_map(tmp_path / "tags.csv", {**PLACES, ALARM: "nsu=urn:lost;s=GVL.full"})
    with pytest.raises(TagMapError, match=stating("line 4", "urn:lost", "urn:other", NAMESPACE)):
        connect(server.url, unknown, trusting)


def test_a_free_running_plc_is_reached_again_with_its_security(
    server: VendorServer, trusting: PlcAccess, tags: Path, filled: Path
) -> None:
    """Its certificate is compared at each connect: another one stops the commands, and is reported once."""
    with Scenario(LINE, start=filled) as plant, ServerThread() as thread:
        free = FreeRunning(plant, SimpleNamespace(url=server.url, tags=tags), thread, trusting)
        free.until(lambda: free.face.status().writes > 0)
        server.kill()
        free.until(lambda: free.face.status().clients == 0)
        writes = free.face.status().writes
        other = Path(server.settings.folder) / "other"
        other.mkdir()
        for name in ("server", "user"):
            make_certificate(other, name)
        before, server.settings = server.settings, replace(server.settings, folder=str(other))
        server.start()
        free.until(lambda: any("changed" in text for text in free.said))
        plant.run_for(0.1)
        assert free.face.status().writes == writes
        server.kill()
        server.settings = before
        server.start()
        free.until(lambda: free.face.status().writes > writes)
        free.stop()
    assert len(free.connected) == 2 and missing(free.connected[0], "SignAndEncrypt", USER) == []
    assert free.said[-1].endswith("connected again")
    (changed,) = (text for text in free.said if "changed" in text)
    trust = f"--trust {PlcCertificate('', (other / 'server.der').read_bytes()).sha256}"
    assert missing(changed, trust, "trusted so far", sha256(other.parent), "commands nothing") == []


@pytest.mark.parametrize(("days", "said"), [((-30, -1), "expired on"), ((2, 30), "not valid before")])
def test_a_certificate_out_of_its_time_is_refused(tmp_path: Path, days: tuple[int, int], said: str) -> None:
    shown = PlcCertificate("opc.tcp://plc", make_certificate(tmp_path, "server", days=days))
    with pytest.raises(PlcLinkError, match=stating("opc.tcp://plc", said, "clocks", "CN=server of a plant")):
        shown.require_usable()


def test_differences_between_certificate_and_server_are_told(tmp_path: Path) -> None:
    made = make_certificate(tmp_path, "server", hosts=("plc1", "plc1.plant"))
    shown = PlcCertificate("opc.tcp://plc", made)
    assert shown.doubts("PLC1", URI) == ""
    assert missing(shown.doubts("plc2", "urn:other"), ["plc1.plant", "plc2", URI, "urn:other"]) == []


@pytest.mark.parametrize("certificate", [None, b"", b"\x30\x82\xff\xff", b"0" * 5000])
def test_a_certificate_that_can_t_be_read_is_refused(certificate: bytes | None) -> None:
    with pytest.raises(PlcLinkError, match=stating("opc.tcp://plc", "certificate", "DER")):
        PlcCertificate("opc.tcp://plc", certificate)


@pytest.mark.parametrize("text", ["", "12", "g" * 64, "0" * 63, "0" * 65])
def test_a_fingerprint_that_can_t_be_is_refused(text: str) -> None:
    answer = CliRunner().invoke(main, ["attach", "opc.tcp://127.0.0.1:1", "--trust", text])
    assert answer.exit_code == 1 and missing(answer.output, "--trust") == []


def test_an_attacker_can_t_hide_the_encrypted_endpoint(
    proxy: FaultyProxy, trusting: PlcAccess, folder: Path, tags: Path
) -> None:
    """Endpoints are read without security, where they can be changed; the secured session shows all of them."""
    uri = b"http://opcfoundation.org/UA/SecurityPolicy#Basic256Sha256"
    encrypted, signed = (bytes([mode, 0, 0, 0]) + struct.pack("<I", len(uri)) + uri for mode in (3, 2))
    changed = []

    def hide(data: bytes) -> bytes:
        if encrypted in data and not changed:
            changed.append(data)
            return data.replace(encrypted, signed)
        return data

    alone(trust_server(url_of(proxy), trusting._replace(trust=sha256(folder)), lambda _: None))
    proxy.fault = hide
    with pytest.raises(PlcRefusedError, match=stating(url_of(proxy), "better endpoint", "attacker")):
        connect(url_of(proxy), tags, trusting)
    assert len(changed) == 1


POLICY = "http://opcfoundation.org/UA/SecurityPolicy#"


def endpoint(policy: str, mode: str, password: str | None = "", kinds: str = "Anonymous UserName") -> Any:
    """An endpoint. password: policy that encrypts passwords; "": that of the endpoint; None: none."""
    from asyncua import ua

    tokens = [ua.UserTokenPolicy(kind, ua.UserTokenType[kind]) for kind in kinds.split()]
    for token in tokens:
        token.SecurityPolicyUri = POLICY + "None" if password is None else password and POLICY + password
    return ua.EndpointDescription(
        EndpointUrl="opc.tcp://plc:4840",
        SecurityMode=ua.MessageSecurityMode[mode],
        SecurityPolicyUri=POLICY + policy,
        UserIdentityTokens=tokens,
    )


OPEN = ("None", "None_")
SIGNED, ENCRYPTED = ("Basic256Sha256", "Sign"), ("Basic256Sha256", "SignAndEncrypt")
ANYBODY, BY_NAME = PlcAccess(), PlcAccess("jo", "secret")


@pytest.mark.parametrize(
    ("access", "offered", "chosen"),
    [
        (ANYBODY, [OPEN, SIGNED, ENCRYPTED], 2),
        (ANYBODY, [ENCRYPTED, SIGNED, OPEN], 0),
        (ANYBODY, [("Aes256_Sha256_RsaPss", "Sign"), ("Aes128_Sha256_RsaOaep", "SignAndEncrypt")], 1),
        (ANYBODY, [("Aes128_Sha256_RsaOaep", "Sign"), ("Aes256_Sha256_RsaPss", "Sign"), SIGNED], 1),
        (ANYBODY, [("Basic256", "SignAndEncrypt"), ("Basic128Rsa15", "SignAndEncrypt"), OPEN], 2),
        (ANYBODY, [("Basic256Sha256", "None_"), ("None", "Sign"), ("None", "Invalid"), SIGNED], 3),
        (ANYBODY, [(*ENCRYPTED, "", "UserName"), OPEN], 1),
        (ANYBODY._replace(security="none"), [ENCRYPTED, OPEN], 1),
        (ANYBODY._replace(security="sign"), [ENCRYPTED, SIGNED, OPEN], 1),
        (BY_NAME, [(*ENCRYPTED, None), OPEN], 0),
        (BY_NAME, [(*SIGNED, "Basic256Sha256"), OPEN], 0),
        (BY_NAME, [(*OPEN, "Basic256Sha256")], 0),
        (BY_NAME._replace(plain_password=True), [OPEN], 0),
        (PlcAccess("jo"), [OPEN], 0),
    ],
)
def test_the_most_secure_endpoint_is_chosen(access: PlcAccess, offered: list[Any], chosen: int) -> None:
    endpoints = [endpoint(*each) for each in offered]
    assert choose("opc.tcp://plc", endpoints, access) is endpoints[chosen]


@pytest.mark.parametrize(
    ("access", "offered", "said"),
    [
        (BY_NAME, [OPEN], ["no security", "password", "--plain-password"]),
        (BY_NAME, [(*SIGNED, None)], ["Basic256Sha256 Sign", "password", "--plain-password"]),
        (BY_NAME, [(*ENCRYPTED, "", "Anonymous")], ["user name", "offered", "SignAndEncrypt", "anonymous"]),
        (ANYBODY._replace(security="encrypt"), [SIGNED, OPEN], ["encrypt", "offered", "Sign", "no security"]),
        (ANYBODY, [("Basic256", "Sign")], ["offered", "none"]),
        (ANYBODY, [], ["offered", "none"]),
    ],
)
def test_without_a_fitting_endpoint_it_is_told_what_there_is(
    access: PlcAccess, offered: list[Any], said: list[str]
) -> None:
    with pytest.raises(PlcLinkError, match=stating("opc.tcp://plc", *said)):
        choose("opc.tcp://plc", [endpoint(*each) for each in offered], access)


@pytest.fixture
def proxy(server: VendorServer) -> Iterator[FaultyProxy]:
    proxy = FaultyProxy(int(server.url.rpartition(":")[2]))
    yield proxy
    proxy.close()


def url_of(proxy: FaultyProxy) -> str:
    return f"opc.tcp://127.0.0.1:{proxy.port}"


def flipped(data: bytes) -> bytes:
    """Change one bit near the end, in the encrypted part."""
    return data[:-9] + bytes([data[-9] ^ 1]) + data[-8:]


def without_end(data: bytes) -> bytes:
    return data[:-1]


def of_another_protocol(data: bytes) -> bytes:
    return b"HTTP/1.1 400 Bad Request\r\n\r\n"


def empty(data: bytes) -> bytes:
    return b""


@pytest.mark.parametrize("spoil", [flipped, without_end, of_another_protocol, empty], ids=lambda spoil: spoil.__name__)
def test_a_spoiled_answer_ends_the_test_with_one_error(
    proxy: FaultyProxy,
    trusting: PlcAccess,
    folder: Path,
    tags: Path,
    spoil: Callable[[bytes], bytes],
    monkeypatch: pytest.MonkeyPatch,
    capfd: pytest.CaptureFixture[str],
) -> None:
    """No traceback, and no command from an answer that is not the PLC's."""
    monkeypatch.setattr(opcua_client, "PATIENCE", 0.5)
    alone(trust_server(url_of(proxy), trusting._replace(trust=sha256(folder)), lambda _: None))
    with Scenario(LINE) as plant:
        plant.attach_plc(url_of(proxy), tags, access=trusting)
        plant.run_for(0.1)
        proxy.fault = spoil
        with pytest.raises(ControlError, match=stating("no PLC", url_of(proxy))):
            plant.run_for(0.1)
    assert "Traceback" not in capfd.readouterr().err
    with pytest.raises(PlcLinkError, match=stating(url_of(proxy))):
        connect(url_of(proxy), tags, trusting)


HELLO = b"ACKF" + struct.pack("<I5I", 28, 0, 65535, 65535, 0, 0)
"""Answer of a server to the first message."""


@pytest.mark.parametrize(
    "answers",
    [
        [b""],
        [b"\x16\x03\x01" * 99],
        [b"HTTP/1.1 400 Bad Request\r\n\r\n"],
        [b"ERRF" + struct.pack("<III4s", 20, 0x80130000, 4, b"nope")],
        [HELLO, b""],
        [HELLO, b"OPNF" + struct.pack("<I", 0xFFFFFFFF) + b"x" * 99],
        [HELLO, b"OPNF" + struct.pack("<I", 0) + b"x" * 99],
        [HELLO, b"OPNF" + struct.pack("<I", 60) + b"\0" * 52],
        [b"ACKF" + struct.pack("<I5I", 28, 0, 0, 0, 1, 1), b""],
    ],
)
def test_a_port_that_is_no_opc_ua_server_is_one_error(
    answers: list[bytes], monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    """An empty answer is silence, which is not waited for without an end."""
    monkeypatch.setattr(opcua_client, "PATIENCE", 0.2)

    async def answer(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        for each in answers:
            await reader.read(2**16)
            writer.write(each)
        await reader.read()
        writer.close()

    async def come() -> None:
        async with await asyncio.start_server(answer, "127.0.0.1", 0) as server:
            url = f"opc.tcp://127.0.0.1:{server.sockets[0].getsockname()[1]}"
            with pytest.raises(PlcLinkError, match=stating(url)):
                await plc_link(url, ()).connect()

    alone(come())
    assert capfd.readouterr().err == ""


def test_a_damaged_file_of_a_trusted_certificate_is_named(
    server: VendorServer, trusting: PlcAccess, tags: Path, tmp_path: Path
) -> None:
    identity(tmp_path / "own")
    trust_plc(tmp_path / "own", server.url.removeprefix("opc.tcp://"), b"damaged")
    with pytest.raises(CertificateError, match=stating(str(tmp_path), "certificate", "DER or PEM")):
        connect(server.url, tags, trusting._replace(certificates=tmp_path / "own"))


def test_security_is_for_opc_ua_only(tmp_path: Path) -> None:
    answer = CliRunner().invoke(main, ["attach", LINE, "modbus://127.0.0.1:1", "--browse"])
    assert answer.exit_code == 1 and missing(answer.output, "--browse", "modbus://", "opc.tcp://") == []
    with pytest.raises(PlcLinkError, match=stating("modbus", "security", "opc.tcp")):
        plc_link("modbus://127.0.0.1:1", (), PlcAccess(security="sign"))


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ([], ["SCENE", "--browse", "--trust"]),
        (["--password-file", "x", "--browse"], ["--password-file", "--user"]),
        (["--user", "a", "--user-certificate", "x", "--browse"], ["--user-certificate", "--user"]),
        (["--user", "a", "--password-file", "/no/file", "--browse"], ["/no/file", "password", "PLC"]),
    ],
)
def test_options_that_do_not_fit_are_refused(options: list[str], said: list[str]) -> None:
    answer = CliRunner().invoke(main, ["attach", "opc.tcp://127.0.0.1:1", *options])
    assert answer.exit_code == 1 and missing(answer.output, *said) == []
