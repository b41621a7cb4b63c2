# SPDX-License-Identifier: Apache-2.0
"""A broker, a line that a test steps, and a host application that follows it."""

from __future__ import annotations

import json
import shutil
import socket
import subprocess
import time
from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import pytest
from protocols.waiting import PATIENCE, until

from conveyor_sim.line.run_state import RUNNING, RunState
from conveyor_sim.protocols.hosting.server_thread import ServerThread
from conveyor_sim.protocols.tags.tag_provider import SteppedTagProvider
from conveyor_sim.scene import load_scene
from conveyor_sim.simulation import Simulation

pytest.importorskip("paho", reason="paho-mqtt is not installed: pip install conveyor-sim[mqtt]")
pytest.importorskip("google.protobuf", reason="protobuf is not installed: pip install conveyor-sim[mqtt]")

from paho.mqtt.client import Client, MQTTMessage
from paho.mqtt.enums import CallbackAPIVersion

from conveyor_sim.protocols.mqtt.broker import Broker
from conveyor_sim.protocols.mqtt.edge_node import EdgeNode
from conveyor_sim.protocols.mqtt.line_metrics import BOOLEAN, DOUBLE, Payload, add_metric, decoded, whole

MOSQUITTO = shutil.which("mosquitto") or shutil.which("mosquitto", path="/usr/sbin:/usr/local/sbin")
if MOSQUITTO is None:
    pytest.skip("mosquitto is not installed: apt-get install mosquitto", allow_module_level=True)

SCENE = "config/scenarios/zoned_line.yaml"
GROUP = "zoned_line"
NODE = "zoned_line"
HOST = "scada1"
SPEED, SETPOINT = "belts/zone1/speed", "belts/zone1/cmd_speed"
LONG = 600.0  # s of wall time that a controller may be silent


class Mosquitto:
    """Broker of this machine, on a separate port, which tests kill and restart."""

    def __init__(self, folder: Path, *lines: str) -> None:
        with socket.create_server(("127.0.0.1", 0)) as free:
            self.port = int(free.getsockname()[1])
        self._configuration, self._log = folder / f"{self.port}.conf", folder / f"{self.port}.log"
        # Root's broker becomes another user otherwise, who can't read a test's files.
        lines = ("persistence false", "user root", f"listener {self.port} 127.0.0.1", *lines, "")
        self._configuration.write_text("\n".join(lines))
        self.process: subprocess.Popen[bytes] | None = None
        self.start()

    @property
    def url(self) -> str:
        return f"mqtt://127.0.0.1:{self.port}"

    def start(self) -> None:
        with self._log.open("ab") as log:
            command = [str(MOSQUITTO), "-c", str(self._configuration)]
            self.process = subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=log, stderr=log)
        until(self._listens, "the broker")

    def _listens(self) -> bool:
        assert self.process is not None and self.process.poll() is None, self._log.read_text()
        with suppress(OSError):
            socket.create_connection(("127.0.0.1", self.port), 1.0).close()
            return True
        return False

    def kill(self) -> None:
        if self.process is not None:
            self.process.kill()
            self.process.wait()
            self.process = None


class Heard:
    """Message that a host has received."""

    def __init__(self, message: MQTTMessage) -> None:
        _, self.group, self.kind, self.node, *device = message.topic.split("/")
        self.device = "/".join(device)
        self.payload = decoded(message.payload)
        self.kept, self.qos = message.retain, message.qos
        self.metrics = {metric.name: metric for metric in self.payload.metrics}

    def value(self, name: str) -> Any:
        return value_of(self.metrics[name])


def value_of(metric: Any) -> Any:
    """Return the value of a metric; None: it has no value."""
    field = metric.WhichOneof("value")
    if field is None:
        assert metric.is_null
        return None
    value = getattr(metric, field)
    return whole(field, value) if field in ("int_value", "long_value") else value


def properties_of(metric: Any) -> dict[str, Any]:
    assert len(metric.properties.keys) == len(metric.properties.values)
    pairs = zip(metric.properties.keys, metric.properties.values, strict=True)
    return {key: getattr(value, value.WhichOneof("value")) for key, value in pairs}


class Host:
    """Host application that follows one line and checks each message against the rules of Sparkplug."""

    def __init__(self, port: int, group: str = GROUP, node: str = NODE) -> None:
        self.heard: list[Heard] = []
        self.values: dict[str, Any] = {}
        self.qualities: dict[str, int] = {}
        self.forced: set[str] = set()
        self.alive = {"node": False, "line": False}
        self.broken = ""  # the first rule that was
        self._next: int | None = None
        self._connection: int | None = None
        self._group, self._node = group, node
        self._client = Client(CallbackAPIVersion.VERSION2)
        self._client.on_message = self._on_message
        self._client.on_connect = lambda client, *_: client.subscribe(f"spBv1.0/{group}/+/{node}/#", 1)
        self.subscribed = False
        self._client.on_subscribe = self._on_subscribe
        self._client.on_disconnect = self._on_disconnect
        self._client.reconnect_delay_set(1, 1)
        self._client.connect("127.0.0.1", port)
        self._client.loop_start()
        until(lambda: self.subscribed, "a subscription")

    def close(self) -> None:
        self._client.disconnect()
        self._client.loop_stop()

    def _on_subscribe(self, *_: Any) -> None:
        self.subscribed = True

    def _on_disconnect(self, *_: Any) -> None:
        self.subscribed = False
        self._next = None  # what was said meanwhile is not known

    def _on_message(self, client: Client, userdata: Any, message: MQTTMessage) -> None:
        if message.topic.split("/")[2] in ("NCMD", "DCMD"):
            return
        heard = Heard(message)
        try:
            self._follow(heard)
        except AssertionError as error:
            self.broken = self.broken or f"{heard.kind}: {error}"
        self.heard.append(heard)

    def _follow(self, heard: Heard) -> None:
        """Check a message against the rules of Sparkplug 3.0."""
        kind, payload = heard.kind, heard.payload
        assert not heard.kept and payload.timestamp > 0
        if kind == "NDEATH":
            assert not payload.HasField("seq") and list(heard.metrics) == ["bdSeq"]
            if heard.value("bdSeq") == self._connection:
                self.alive = dict.fromkeys(self.alive, False)
            return
        assert heard.qos == 0 and payload.HasField("seq")
        if kind == "NBIRTH":
            assert payload.seq == 0
            self._connection = heard.value("bdSeq")
            self.alive = {"node": True, "line": False}
            self._next = 0
        elif self._next is None:
            return  # this host came later
        assert payload.seq == self._next, f"seq {payload.seq}, expected {self._next}"
        self._next = (self._next + 1) % 256
        assert self.alive["node"] and heard.device == ("line" if kind.startswith("D") else "")
        if kind in ("DDATA", "DDEATH"):
            assert self.alive["line"]
        if kind in ("DBIRTH", "DDEATH"):
            self.alive["line"] = kind == "DBIRTH"
        for name, metric in heard.metrics.items():
            assert metric.timestamp > 0 and metric.datatype > 0
            found = properties_of(metric)
            self.qualities[name] = found.get("Quality", 192)
            (self.forced.add if found.get("forced") else self.forced.discard)(name)
        # All at once: tests read them from another thread, and what is in one message belongs together.
        self.values |= {name: value_of(metric) for name, metric in heard.metrics.items()}

    def kinds(self) -> list[str]:
        return [heard.kind for heard in self.heard]

    def last(self, kind: str) -> Heard:
        return next(heard for heard in reversed(self.heard) if heard.kind == kind)

    def state(self, online: bool, stamp: int) -> None:
        """Publish the state of a primary host."""
        told = json.dumps({"online": online, "timestamp": stamp})
        self._client.publish(f"spBv1.0/STATE/{HOST}", told, qos=1, retain=True).wait_for_publish(PATIENCE)

    def rebirth(self) -> None:
        self.send("NCMD", [("Node Control/Rebirth", BOOLEAN, True)])

    def set(self, name: str, value: float, kind: int = DOUBLE) -> None:
        self.send("DCMD", [(name, kind, value)])

    def send(self, kind: str, metrics: list[tuple[str, int, float]], retain: bool = False) -> None:
        payload = Payload(timestamp=int(time.time() * 1e3))
        for name, datatype, value in metrics:
            add_metric(payload, name, datatype, value, payload.timestamp)
        self.send_bytes(kind, payload.SerializeToString(), retain)

    def send_bytes(self, kind: str, data: bytes, retain: bool = False) -> None:
        device = "/line" if kind.startswith("D") else ""
        self._client.publish(f"spBv1.0/{self._group}/{kind}/{self._node}{device}", data, qos=0, retain=retain)


class Stepped(SteppedTagProvider):
    """Simulation that a test steps, with a run state that the test sets."""

    run = RunState(RUNNING)

    @property
    def _run(self) -> RunState:
        return self.run

    def show(self, **changes: Any) -> None:
        """Show the line with some fields replaced."""
        self._snapshot = replace(self._snapshot, **changes)
        self._listeners.tell()


@dataclass
class Line:
    """Line that the test steps, connected to a broker."""

    source: Stepped
    node: EdgeNode
    host: Host
    broker: Mosquitto
    thread: ServerThread

    @property
    def simulation(self) -> Simulation:
        return self.source._simulation

    def advance(self, ticks: int = 1) -> None:
        """Step, and wait until the host has received the tick."""
        for _ in range(ticks):
            self.source.before_tick()
            self.simulation.advance()
            self.source.after_tick()
        self.until(lambda: self.host.values.get("run/tick") == self.simulation.tick, "the tick")

    def stop(self) -> None:
        self.thread.run(self.node.stop())

    def until(self, condition: Callable[[], Any], what: str) -> None:
        """Wait for a condition of the host, whose messages must follow the rules."""
        until(condition, what)
        assert not self.host.broken, self.host.broken

    def outcomes(self) -> list[tuple[str, str, tuple[str, ...], tuple[float, ...], bool]]:
        """Return the results of all inputs so far: writer, operation, names, values, accepted."""
        return [
            (outcome.input.writer, outcome.operation, outcome.names, outcome.values, outcome.accepted)
            for outcome in self.simulation.take_outcomes()
        ]

    def refused(self, count: int) -> str:
        """Return the reason of the latest refusal, once `count` commands are refused."""
        self.until(lambda: self.host.values["commands/refused"] >= count, f"refusal {count}")
        assert self.host.values["commands/refused"] == count
        return str(self.host.values["commands/refusal"])


@pytest.fixture
def mosquitto(tmp_path: Path) -> Iterator[Callable[..., Mosquitto]]:
    """Return a function that starts brokers: `mosquitto("allow_anonymous true")`."""
    started: list[Mosquitto] = []

    def start(*lines: str) -> Mosquitto:
        started.append(Mosquitto(tmp_path, *(lines or ["allow_anonymous true"])))
        return started[-1]

    yield start
    for broker in started:
        broker.kill()


@pytest.fixture
def broker(mosquitto: Callable[..., Mosquitto]) -> Mosquitto:
    """Start a broker without authentication."""
    return mosquitto()


Serve = Callable[..., Line]


@pytest.fixture
def serve(broker: Mosquitto) -> Iterator[Serve]:
    """Return a function that connects the zoned line from its first tick on, and a host: `serve(role="operator")`."""
    lines: list[Line] = []
    with ServerThread() as thread:

        def start(
            primary_host: str = "",
            port: int | None = None,
            wait: bool = True,
            scene: str | Path = SCENE,
            **options: Any,
        ) -> Line:
            source = Stepped(Simulation(load_scene(scene), threads=1))
            place = Broker("127.0.0.1", port or broker.port, secured=False, primary_host=primary_host)
            node = EdgeNode(source, place, **options)
            lines.append(Line(source, node, Host(broker.port), broker, thread))
            thread.run(node.start())
            if wait:
                lines[-1].until(lambda: lines[-1].host.alive["line"], "births")
            return lines[-1]

        yield start
        for line in lines:
            line.stop()
            line.host.close()
            assert not line.host.broken, line.host.broken


@pytest.fixture
def line(serve: Serve) -> Line:
    """Serve the zoned line, which operators may command."""
    return serve(role="operator")
