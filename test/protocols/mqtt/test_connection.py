# SPDX-License-Identifier: Apache-2.0
"""Connection of a line to its broker: versions of MQTT, users, TLS, and reasons of failures."""

from __future__ import annotations

import datetime
import shutil
import socket
import struct
import subprocess
import threading
from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING

import pytest
from protocols.waiting import until

from conveyor_sim.protocols.hosting.server_kinds import SERVER_KINDS
from conveyor_sim.protocols.hosting.serving import Serving
from conveyor_sim.protocols.hosting.settings import ServerSettings
from conveyor_sim.protocols.mqtt import link
from conveyor_sim.protocols.mqtt.broker import PASSWORD, broker_of
from conveyor_sim.protocols.server.interface import ServerError
from conveyor_sim.protocols.tags.tag_provider import LineInfo
from conveyor_sim.scene import load_scene
from conveyor_sim.simulation import Simulation
from test.protocols.mqtt.kit import SCENE, SETPOINT, Stepped

if TYPE_CHECKING:
    from test.protocols.mqtt.kit import Line, Mosquitto

MQTT = next(kind for kind in SERVER_KINDS if kind.name == "mqtt")
WORD = "open sesame"


class OldBroker:
    """Broker that supports only MQTT 3.1.1: it refuses newer versions, and passes everything else to mosquitto."""

    def __init__(self, port: int, answer: bytes = b"\x20\x02\x00\x01", reset: bool = False) -> None:
        """Start it. answer: to newer versions, before the connection is closed. reset: close by RST."""
        self._to, self.answer, self.reset = port, answer, reset
        self._server = socket.create_server(("127.0.0.1", 0))
        self.port = int(self._server.getsockname()[1])
        self.refused = 0
        threading.Thread(target=self._accept, daemon=True).start()

    def close(self) -> None:
        self._server.close()

    def _accept(self) -> None:
        with suppress(OSError):
            while True:
                client, _ = self._server.accept()
                threading.Thread(target=self._serve, args=(client,), daemon=True).start()

    def _serve(self, client: socket.socket) -> None:
        first = client.recv(65536)
        at = first.index(b"MQTT") + 4
        if first[at] > 4:
            self.refused += 1
            client.sendall(self.answer)
            if self.reset:
                client.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
            client.close()
            return
        broker = socket.create_connection(("127.0.0.1", self._to))
        broker.sendall(first)
        threading.Thread(target=_copy, args=(broker, client), daemon=True).start()
        _copy(client, broker)


def _copy(source: socket.socket, to: socket.socket) -> None:
    with suppress(OSError):
        while data := source.recv(65536):
            to.sendall(data)
    for one in (source, to):
        with suppress(OSError):
            one.shutdown(socket.SHUT_RDWR)


@pytest.fixture
def old_broker(broker: Mosquitto) -> Iterator[OldBroker]:
    old = OldBroker(broker.port)
    yield old
    old.close()


def test_a_broker_that_knows_no_newer_version_is_spoken_to_in_its_own(
    serve: Callable[..., Line], old_broker: OldBroker
) -> None:
    line = serve(role="controller", port=old_broker.port)
    assert old_broker.refused == 1 and line.host.last("NBIRTH").value("bdSeq") == 1
    line.host.set(SETPOINT, 0.1)
    line.until(lambda: line.node.status().writes == 1, "the command")
    line.advance()
    assert line.host.values[SETPOINT] == 0.1
    line.host.send_bytes("DCMD", b"\x00" * 2 * link.MOST_BYTES)
    assert line.refused(1) == f"a command of {2 * link.MOST_BYTES} bytes, expected at most {link.MOST_BYTES}"
    line.stop()
    line.until(lambda: not line.host.alive["node"], "a death")
    assert line.host.last("NDEATH").value("bdSeq") == 1


@pytest.mark.parametrize(
    ("answer", "reset"),
    [(b"", False), (b"", True), (b"\x20\x03\x00\x84\x00", False), (b"\x00" * 8, False), (b"\x20\x02", False)],
    ids=["closed", "reset", "refused by MQTT 5", "no MQTT", "half an answer"],
)
def test_a_broker_that_closes_on_a_newer_version_is_spoken_to_in_its_own(
    serve: Callable[..., Line], old_broker: OldBroker, answer: bytes, reset: bool
) -> None:
    old_broker.answer, old_broker.reset = answer, reset
    line = serve(port=old_broker.port)
    assert old_broker.refused == 1 and line.host.last("NBIRTH").value("bdSeq") == 1
    assert line.node.status().state == "connected"
    line.stop()
    line.until(lambda: not line.host.alive["node"], "a death")


def test_a_broker_that_closes_on_all_versions_refuses_the_connection() -> None:
    """And each next try begins with the newest again."""
    versions: list[int] = []
    with socket.create_server(("127.0.0.1", 0)) as server:

        def close_all() -> None:
            with suppress(OSError):
                while True:
                    client, _ = server.accept()
                    first = client.recv(65536)
                    if b"MQTT" in first:  # else the client only checks that something listens
                        versions.append(first[first.index(b"MQTT") + 4])
                    client.close()

        threading.Thread(target=close_all, daemon=True).start()
        url = f"mqtt://127.0.0.1:{server.getsockname()[1]}"
        for _ in range(2):
            with pytest.raises(ServerError, match="refuses the connection"):
                serving(url)
    assert versions == [5, 4, 5, 4]


def source() -> Stepped:
    return Stepped(Simulation(load_scene(SCENE), threads=1))


def serving(url: str, **settings: object) -> Serving:
    return Serving(source(), [(MQTT, url)], ServerSettings(**settings))  # type: ignore[arg-type]


@pytest.fixture
def strict(mosquitto: Callable[..., Mosquitto], tmp_path: Path) -> Mosquitto:
    """Start a broker with a password, where user line may publish only its own topics."""
    passwords, rights = tmp_path / "passwords", tmp_path / "rights"
    command = shutil.which("mosquitto_passwd")
    assert command is not None
    for number, user in enumerate(("line", "host")):
        subprocess.run([command, "-b", *(["-c"] if number == 0 else []), str(passwords), user, WORD], check=True)
    for file in (passwords, rights):
        file.touch(mode=0o600)
    rights.write_text("user line\ntopic write spBv1.0/plant/+/a/#\nuser host\ntopic readwrite spBv1.0/#\n")
    return mosquitto("allow_anonymous false", f"password_file {passwords}", f"acl_file {rights}")


def test_a_password_comes_from_the_environment_or_a_file(
    strict: Mosquitto, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    url = f"mqtt://line@127.0.0.1:{strict.port}/plant/a"
    with pytest.raises(ServerError, match=r"refuses the connection \(Not authorized\), expected .* takes user line"):
        serving(url)
    with pytest.raises(ServerError, match="takes clients without a user"):
        serving(strict.url)
    monkeypatch.setenv(PASSWORD, WORD)
    with serving(url) as served:
        assert served.greeting == [
            f"mqtt://127.0.0.1:{strict.port}/plant/a: "
            "clients that the broker admits can read everything and write nothing"
        ]
        until(lambda: "mqtt: connected, 0 written" in served.progress(), "the broker")
    monkeypatch.delenv(PASSWORD)
    (tmp_path / "word").write_text(WORD + "\n")
    with serving(url, mqtt_password_file=tmp_path / "word", mqtt_role="operator") as served:
        assert "write as operator" in served.greeting[0]


@pytest.fixture
def certificates(tmp_path: Path) -> Path:
    """Make ca.pem, and server.pem with server.key for 127.0.0.1, which it has signed."""
    x509 = pytest.importorskip("cryptography.x509")
    from ipaddress import ip_address

    from cryptography.hazmat.primitives import hashes, serialization
    from cryptography.hazmat.primitives.asymmetric import ec

    now = datetime.datetime.now(datetime.timezone.utc)
    keys = [ec.generate_private_key(ec.SECP256R1()) for _ in range(2)]
    names = [x509.Name([x509.NameAttribute(x509.NameOID.COMMON_NAME, name)]) for name in ("authority", "broker")]
    for index, file in enumerate(("ca", "server")):
        made = x509.CertificateBuilder().subject_name(names[index]).issuer_name(names[0])
        made = made.public_key(keys[index].public_key()).serial_number(index + 1)
        made = made.not_valid_before(now - datetime.timedelta(days=1)).not_valid_after(now + datetime.timedelta(days=1))
        made = made.add_extension(x509.BasicConstraints(ca=index == 0, path_length=None), critical=True)
        made = made.add_extension(
            x509.SubjectAlternativeName([x509.IPAddress(ip_address("127.0.0.1"))]), critical=False
        )
        signed = made.sign(keys[0], hashes.SHA256())
        (tmp_path / f"{file}.pem").write_bytes(signed.public_bytes(serialization.Encoding.PEM))
    private = keys[1].private_bytes(
        serialization.Encoding.PEM, serialization.PrivateFormat.PKCS8, serialization.NoEncryption()
    )
    (tmp_path / "server.key").write_bytes(private)
    return tmp_path


def test_by_tls_only_to_a_broker_that_is_known(mosquitto: Callable[..., Mosquitto], certificates: Path) -> None:
    broker = mosquitto(
        "allow_anonymous true", f"certfile {certificates}/server.pem", f"keyfile {certificates}/server.key"
    )
    url = f"mqtts://127.0.0.1:{broker.port}"
    with pytest.raises(ServerError, match="certificate verify failed"):
        serving(url)
    with serving(url, mqtt_ca=certificates / "ca.pem") as served:
        assert served.greeting[0].startswith(f"mqtts://127.0.0.1:{broker.port}/zoned_line/zoned_line: ")
    with pytest.raises(ServerError, match=r"server\.key: .*, expected certificates in PEM"):
        serving(url, mqtt_ca=certificates / "server.key")


@pytest.mark.parametrize(
    ("url", "settings", "sentence"),
    [
        ("127.0.0.1:1883", {}, "mqtt: 127.0.0.1:1883 given, expected mqtt://HOST, or mqtts:// for TLS"),
        ("http://127.0.0.1", {}, "expected mqtt://HOST"),
        ("mqtt://", {}, "expected mqtt://HOST"),
        ("mqtt://host:port", {}, "mqtt: mqtt://host:port given (Port could not be cast to integer"),
        ("mqtt://host:99999", {}, "mqtt: mqtt://host:99999 given (Port out of range 0-65535), expected mqtt://HOST"),
        ("mqtt://host/a/b/c", {}, "as mqtt://USER@HOST:PORT/GROUP/NODE"),
        ("mqtt://host/a+b", {}, "mqtt: a+b given as a name, expected letters, digits, or any of _ . : -"),
        ("mqtt://host/STATE", {}, "mqtt: STATE given as a name"),
        ("mqtt://jo:sesame@host", {}, "mqtt: a password given in the URL, where all users of this machine see it"),
        ("mqtt://host", {"primary_host": "a/b"}, "mqtt: a/b given as a name"),
        ("mqtt://host", {"authority": Path("ca.pem")}, "--mqtt-ca: given with mqtt://, expected mqtts://"),
        ("mqtt://host", {"password_file": Path("word")}, "--mqtt-password-file: given without a user"),
        ("mqtt://jo@host", {"password_file": Path("/none")}, "/none: no such file, expected a file with the pass"),
    ],
)
def test_what_can_not_be_is_one_sentence(url: str, settings: dict[str, object], sentence: str) -> None:
    with pytest.raises(ServerError) as caught:
        broker_of(url, **settings)  # type: ignore[arg-type]
    assert sentence in str(caught.value) and "sesame" not in str(caught.value)


def test_the_group_is_the_place_of_the_line_and_the_node_its_name() -> None:
    about = LineInfo("zoned_line", "hall2/cell1/line7", 0.01, "2026-01-01T00:00:00Z", ())
    assert broker_of("mqtt://host").named(about) == ("hall2:cell1:line7", "zoned_line")
    assert broker_of("mqtt://host/plant").named(about) == ("plant", "zoned_line")
    assert broker_of("mqtt://host/plant/a").named(about) == ("plant", "a")
    nowhere = LineInfo("zoned_line", "", 0.01, "2026-01-01T00:00:00Z", ())
    assert broker_of("mqtts://host/").named(nowhere) == ("zoned_line", "zoned_line")
    assert broker_of("mqtts://host/").port == 8883
