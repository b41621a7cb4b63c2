# SPDX-License-Identifier: Apache-2.0
"""A line that a test steps, served to OPC UA clients."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, TypeVar

import pytest

pytest.importorskip("asyncua", reason="asyncua is not installed: pip install conveyor-sim[scada]")

from asyncua import ua
from asyncua.sync import Client, SyncNode

from conveyor_sim.line.run_state import RUNNING, RunState
from conveyor_sim.protocols.hosting.server_thread import ServerThread
from conveyor_sim.protocols.opcua.server import OpcUaServer
from conveyor_sim.protocols.server.interface import Stamps
from conveyor_sim.protocols.server.users import User, new_user
from conveyor_sim.protocols.tags.tag_provider import SteppedTagProvider
from conveyor_sim.scene import load_scene
from conveyor_sim.simulation import Simulation

T = TypeVar("T")

PATIENCE = 60.0
"""s"""

SCENE = Path("config/scenarios/zoned_line.yaml")
HISTORY = ["belts/zone1/cmd_*", "machines/*/produced"]

PASSWORD = "open sesame"
ROLES = ("viewer", "operator", "engineer", "controller", "test")


class Renewed(SteppedTagProvider):
    """Simulation that a test steps, with a run state that the test sets. A reset replaces it by another one."""

    def __init__(self, simulation: Simulation) -> None:
        self._reason = ""
        super().__init__(simulation)

    @property
    def _run(self) -> RunState:
        return RunState(RUNNING, self._reason)

    def begin(self, simulation: Simulation, reason: str) -> None:
        """Start another simulation of the same scene. reason: distinguishes it for clients."""
        self._simulation, self._reason = simulation, reason
        self._waiting.clear()
        self._alarms, self._read_back = simulation.line.alarms.columns(), simulation.line.read_back.columns()
        self._show()
        self._listeners.tell()

    def show(self, **changes: Any) -> None:
        """Show the line with some fields replaced."""
        self._snapshot = replace(self._snapshot, **changes)
        self._listeners.tell()


@dataclass
class Line:
    """Line that the test steps and serves. Each role has a user of its name."""

    source: Renewed
    server: OpcUaServer
    thread: ServerThread
    open: list[Client] = field(default_factory=list)

    @property
    def simulation(self) -> Simulation:
        return self.source._simulation

    def begin(self, simulation: Simulation) -> None:
        """Serve another simulation of the same scene, to clients that connect from now on."""
        reason = f"the line of a test, at {time.monotonic()}"
        self.source.begin(simulation, reason)
        server: Any = self.server._server
        self.until(lambda: self.thread.run(server.get_node("ns=2;s=run/reason").read_value()) == reason)

    def leave(self) -> None:
        """Disconnect all clients, and wait until the server has noticed."""
        for client in self.open:
            client.disconnect()
        self.open.clear()
        self.until(lambda: self.clients == (0, 0))

    @property
    def clients(self) -> tuple[int, int]:
        """Return the numbers of clients and of subscriptions."""
        server: Any = self.server._server
        return self.server.status().clients, len(server.iserver.subscription_service.subscriptions)

    def advance(self, ticks: int = 1) -> None:
        """Step, and wait until clients see it."""
        for _ in range(ticks):
            self.source.before_tick()
            self.simulation.advance()
            self.source.after_tick()
        self.until(lambda: self.read("run/tick") == self.simulation.tick)

    def until(self, condition: Callable[[], bool]) -> None:
        end = time.monotonic() + PATIENCE
        while not condition():
            assert time.monotonic() < end, "waited for too long"
            time.sleep(0.01)

    def client(self, user: str = "", password: str = PASSWORD, security: str = "") -> Client:
        """Return a new connected client, which is closed with the test."""
        client = Client(self.server.address, timeout=PATIENCE, watchdog_intervall=PATIENCE)
        if user:
            client.set_user(user)
            client.set_password(password)
        if security:
            client.set_security_string(security)
        try:
            client.connect()
        except BaseException:
            client.tloop.stop()
            raise
        self.open.append(client)
        return client

    def node(self, name: str, client: Client | None = None) -> SyncNode:
        if client is None and not self.open:
            self.client()
        return (client or self.open[0]).get_node(f"ns=2;s={name}")

    def read(self, name: str) -> Any:
        return self.node(name).read_value()

    def outcomes(self) -> list[tuple[str, str, tuple[str, ...], tuple[float, ...], bool]]:
        """Return the results of all inputs so far: writer, operation, names, values, accepted."""
        return [
            (outcome.input.writer, outcome.operation, outcome.names, outcome.values, outcome.accepted)
            for outcome in self.simulation.take_outcomes()
        ]


@pytest.fixture(scope="session")
def certificates(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder for certificates, shared because making keys takes a while."""
    return tmp_path_factory.mktemp("opcua") / "own"


@pytest.fixture(scope="session")
def users() -> dict[str, User]:
    return {role: new_user(role, PASSWORD) for role in ROLES}


Serve = Callable[..., Line]


@pytest.fixture(scope="module")
def serve(certificates: Path, users: dict[str, User]) -> Iterator[Serve]:
    """Return a function that serves a scene while a module runs: `serve(anonymous=False)`.

    A server takes one to two seconds to start, so most tests share those below.
    """
    with serving(certificates, users) as make:
        yield make


@contextmanager
def serving(certificates: Path, users: dict[str, User]) -> Iterator[Serve]:
    """Yield the function of `serve`, within a context."""
    with ServerThread() as thread:
        lines: list[Line] = []

        def make(scene: Path = SCENE, **options: Any) -> Line:
            source = Renewed(Simulation(load_scene(scene), threads=1))
            options = {"users": users, "certificates": certificates, **options}
            server = OpcUaServer(source, options.pop("users"), **options)
            thread.run(server.start())
            lines.append(Line(source, server, thread))
            return lines[-1]

        yield make
        for line in lines:
            line.leave()
            thread.run(line.server.stop())


@pytest.fixture(scope="session")
def shared(certificates: Path, users: dict[str, User]) -> Iterator[Callable[[Stamps], Line]]:
    """Serve the zoned line by one shared server for each kind of time stamps."""
    with serving(certificates, users) as make:
        lines: dict[Stamps, Line] = {}

        def find(stamps: Stamps) -> Line:
            if stamps not in lines:
                lines[stamps] = make(stamps=stamps, history=HISTORY)
            lines[stamps].begin(Simulation(load_scene(SCENE), threads=1))
            return lines[stamps]

        yield find


@pytest.fixture
def line(shared: Callable[[Stamps], Line]) -> Iterator[Line]:
    """Serve the zoned line from its first tick, with wall time; clients are separate for each test."""
    found = shared("wall")
    yield found
    found.leave()


@pytest.fixture
def simulated(shared: Callable[[Stamps], Line]) -> Iterator[Line]:
    """Serve the zoned line from its first tick, with simulated time."""
    found = shared("simulated")
    yield found
    found.leave()


@contextmanager
def refused(code: int) -> Iterator[None]:
    """Check that a request is answered with a status code."""
    with pytest.raises(ua.UaStatusCodeError) as caught:
        yield
    assert caught.value.code == code, caught.value
