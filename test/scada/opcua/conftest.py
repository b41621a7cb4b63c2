"""A line that a test steps, served to OPC UA clients."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Callable, Coroutine, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, TypeVar

import pytest

pytest.importorskip("asyncua", reason="asyncua is not installed: pip install conveyor-sim[scada]")

from asyncua import ua
from asyncua.sync import Client, SyncNode

from conveyor_sim.scada.face import Stamps
from conveyor_sim.scada.opcua.server import OpcUaServer
from conveyor_sim.scada.server_thread import ServerThread
from conveyor_sim.scada.source import TickSource
from conveyor_sim.scada.users import User, new_user
from conveyor_sim.scene import load_scene
from conveyor_sim.simulation import Simulation

T = TypeVar("T")

PATIENCE = 60.0
"""s"""

PASSWORD = "open sesame"
ROLES = ("viewer", "operator", "engineer", "controller", "test")


@dataclass
class Line:
    """One that is stepped by the test, and served. Each role has a user of its name."""

    simulation: Simulation
    source: Any
    server: OpcUaServer
    thread: ServerThread
    open: list[Client] = field(default_factory=list)

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
        """A new one, connected; it is closed with the test."""
        client = Client(self.server.address, timeout=PATIENCE)
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
        """Of what was given so far: writer, operation, names, values, accepted."""
        return [
            (outcome.input.writer, outcome.operation, outcome.names, outcome.values, outcome.accepted)
            for outcome in self.simulation.take_outcomes()
        ]


@pytest.fixture(scope="session")
def certificates(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Keys take a while to be made."""
    return tmp_path_factory.mktemp("opcua") / "own"


@pytest.fixture(scope="session")
def users() -> dict[str, User]:
    return {role: new_user(role, PASSWORD) for role in ROLES}


Serve = Callable[..., Any]


@pytest.fixture
def serve(certificates: Path, users: dict[str, User]) -> Iterator[Serve]:
    """Serves a scene: `serve(stamps="simulated")`."""
    with serving(certificates, users) as make:
        yield make


@contextmanager
def serving(certificates: Path, users: dict[str, User]) -> Iterator[Serve]:
    """What `serve` is, for as long as is wanted."""
    with ServerThread() as thread:
        lines: list[Line] = []

        def make(
            scene: str = "config/scenarios/zoned_line.yaml",
            stamps: Stamps = "wall",
            source: Callable[[TickSource], Any] = lambda real: real,
            **options: Any,
        ) -> Line:
            simulation = Simulation(load_scene(scene), threads=1)
            shown = source(TickSource(simulation))
            options = {"users": users, "certificates": certificates, "stamps": stamps, **options}
            server = OpcUaServer(shown, options.pop("users"), **options)
            lines.append(line := Line(simulation, shown, server, thread))
            thread.run(server.start())
            return line

        yield make
        for line in lines:
            for client in line.open:
                client.disconnect()
            thread.run(line.server.stop())


@pytest.fixture
def line(serve: Serve) -> Line:
    """The zoned line."""
    made: Line = serve()
    return made


@pytest.fixture(scope="module")
def still(certificates: Path, users: dict[str, User]) -> Iterator[Line]:
    """The same for tests that don't change it: to start a server takes a second or two."""
    with serving(certificates, users) as make:
        yield make()


@contextmanager
def refused(code: int) -> Iterator[None]:
    """A request that is answered with a status code."""
    with pytest.raises(ua.UaStatusCodeError) as caught:
        yield
    assert caught.value.code == code, caught.value


def alone(coroutine: Coroutine[Any, Any, T]) -> T:
    """What a coroutine comes to, in a thread of its own: browsers of other tests may keep a loop in this one."""
    with ThreadPoolExecutor(1) as pool:
        return pool.submit(asyncio.run, coroutine).result()
