# SPDX-License-Identifier: Apache-2.0
"""A line in Foxglove: a WebSocket client decodes messages with rosbags, by the definitions that the server states."""

from __future__ import annotations

import asyncio
import json
import struct
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from page.line import record
from protocols.served import Served
from protocols.waiting import PATIENCE, until
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from conveyor_sim.bag.reader import open_bag
from conveyor_sim.protocols.hosting.server_kinds import SERVER_KINDS
from conveyor_sim.protocols.hosting.serving import Serving
from conveyor_sim.protocols.hosting.settings import ServerSettings
from conveyor_sim.protocols.server.interface import ServerError
from conveyor_sim.protocols.tags.bag_provider import BagTagProvider

aiohttp = pytest.importorskip("aiohttp", reason="aiohttp is not installed: pip install conveyor-sim[scada]")
pytest.importorskip("foxglove", reason="foxglove-sdk is not installed: pip install conveyor-sim[foxglove]")

FOXGLOVE = next(kind for kind in SERVER_KINDS if kind.name == "foxglove")
LATCHED = {"/line", "/readback", "/alarm_states", "/plant"}
SPHERE_LIST, LINE_STRIP = 7, 4


class Client:
    """Connection like that of the app."""

    def __init__(self, socket: Any) -> None:
        self._socket = socket
        self._store = get_typestore(Stores.EMPTY)
        self.channels: dict[str, dict[str, Any]] = {}
        self.sessions: list[str] = []

    async def advertised(self, *topics: str) -> None:
        """Wait until topics are advertised."""
        while not set(topics) <= self.channels.keys():
            await self.receive()

    async def subscribe(self, *topics: str) -> None:
        await self.advertised(*topics)
        wanted = [{"id": self.channels[topic]["id"], "channelId": self.channels[topic]["id"]} for topic in topics]
        await self._socket.send_json({"op": "subscribe", "subscriptions": wanted})

    async def receive(self) -> tuple[str, Any] | None:
        """Return the next topic and message; None: it was something else."""
        heard = await self._socket.receive(PATIENCE)
        assert heard.type in (aiohttp.WSMsgType.TEXT, aiohttp.WSMsgType.BINARY), heard
        if heard.type is aiohttp.WSMsgType.TEXT:
            told = json.loads(heard.data)
            if told["op"] == "serverInfo":
                self.sessions.append(told["sessionId"])
            if told["op"] == "advertise":
                self.channels |= {channel["topic"]: channel for channel in told["channels"]}
            return None
        code, number, _ = struct.unpack_from("<BIQ", heard.data)
        channel = next(channel for channel in self.channels.values() if channel["id"] == number)
        assert (code, channel["encoding"], channel["schemaEncoding"]) == (1, "cdr", "ros2msg")
        name = channel["schemaName"]
        if name not in self._store.types:
            new = get_types_from_msg(channel["schema"], name)
            self._store.register({key: value for key, value in new.items() if key not in self._store.types})
        return channel["topic"], self._store.deserialize_cdr(heard.data[13:], name)

    async def messages(self, *topics: str, until: Callable[[dict[str, list[Any]]], bool]) -> dict[str, list[Any]]:
        """Subscribe and collect messages until there are enough."""
        await self.subscribe(*topics)
        found: dict[str, list[Any]] = {topic: [] for topic in topics}
        while not until(found):
            if (heard := await self.receive()) is not None:
                found[heard[0]].append(heard[1])
        return found


def connected(address: str, act: Callable[[Client], Any]) -> Any:
    """Return the result of a coroutine of a client."""

    async def run() -> Any:
        async with (
            aiohttp.ClientSession() as session,
            session.ws_connect(address, protocols=["foxglove.sdk.v1"], max_msg_size=0) as socket,
        ):
            return await act(Client(socket))

    with ThreadPoolExecutor(1) as thread:  # a browser that tests before this one have opened keeps a loop in this one
        return thread.submit(asyncio.run, asyncio.wait_for(run(), 3 * PATIENCE)).result()


@pytest.fixture(scope="module")
def bag(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Record ten seconds; a gate closes at 6 s and opens at 9 s."""
    return record(tmp_path_factory.mktemp("foxglove") / "bag", 10.0)


@pytest.fixture(scope="module")
def source(bag: Path) -> Iterator[BagTagProvider]:
    with BagTagProvider(bag, print, loop=True) as source:
        yield source


@pytest.fixture(scope="module")
def serving(source: BagTagProvider) -> Iterator[Serving]:
    with Serving(source, [(FOXGLOVE, 0)], ServerSettings()) as serving:
        yield serving


@pytest.fixture
def address(serving: Serving) -> str:
    return serving.hosts[0].address


def test_messages_come_as_they_were_recorded(address: str, bag: Path) -> None:
    found = connected(
        address,
        lambda client: client.messages("/bottles", "/signals", until=lambda found: min(map(len, found.values())) > 5),
    )
    with open_bag(bag) as opened:
        bottles = {frame.tick: frame.data for frame in opened.bottles()}
        signals = {frame.tick: frame.data for frame in opened.signals()}
    for message in found["/bottles"]:
        assert np.array_equal(message.id, bottles[message.tick].id)
        assert np.array_equal(message.x, bottles[message.tick].x)
    for message in found["/signals"]:
        assert np.array_equal(message.values, signals[message.tick], equal_nan=True)


def test_who_comes_late_is_sent_what_is_latched(address: str, bag: Path) -> None:
    found = connected(
        address,
        lambda client: client.messages(*LATCHED, until=lambda found: all(found.values())),
    )
    with open_bag(bag) as opened:
        assert found["/line"][0].signal_names == opened.line.signal_names
        plant = next(frame for frame in opened.raw({"plant"}))[2]
        recorded = opened.decode("plant", plant)
    assert [marker.ns for marker in found["/plant"][0].markers] == [marker.ns for marker in recorded.markers]
    assert {marker.text for marker in found["/plant"][0].markers} >= {"line", "turn", "out"}


def test_bottles_and_gates_are_drawn_where_they_are(source: BagTagProvider, address: str, bag: Path) -> None:
    assert source.control("pause", 0.0, "a test") == "" and source.control("seek", 7.0, "a test") == ""
    until(lambda: source.snapshot.tick == 700, "7 s")

    def drawn(found: dict[str, list[Any]]) -> bool:
        return any(marker.header.stamp.sec == 7 for message in found["/markers"] for marker in message.markers)

    message = connected(address, lambda client: client.messages("/markers", until=drawn))["/markers"][-1]
    with open_bag(bag) as opened:
        bottles = next(frame.data for frame in opened.bottles() if frame.tick == 700)
    spheres = [point.x for marker in message.markers if marker.type == SPHERE_LIST for point in marker.points]
    assert sorted(spheres) == sorted(bottles.x)
    gate = next(marker for marker in message.markers if marker.ns == "moving_rails" and marker.type == LINE_STRIP)
    assert {round(point.y, 4) for point in gate.points} == {-0.044, 0.044}, "it is closed"
    assert source.control("resume", 0.0, "a test") == ""


def test_another_time_begins_another_session_with_all_that_is_latched(source: BagTagProvider, address: str) -> None:
    async def seek(client: Client) -> list[str]:
        await client.messages(*LATCHED, until=lambda found: all(found.values()))
        assert source.control("seek", 0.0, "a test") == ""
        while len(client.sessions) < 2:
            await client.receive()
        again: set[str] = set()
        while again < LATCHED:
            if (heard := await client.receive()) is not None:
                again.add(heard[0])
        return client.sessions

    sessions = connected(address, seek)
    assert len(set(sessions)) == len(sessions)


def test_clients_that_look_are_counted(serving: Serving, address: str) -> None:
    async def look(client: Client) -> None:
        await client.messages("/bottles", until=lambda found: len(found["/bottles"]) > 0)
        await asyncio.to_thread(until, lambda: "foxglove: 1 client, 1 monitored item" in serving.progress(), "a client")

    connected(address, look)
    until(lambda: "foxglove: 0 clients" in serving.progress(), "that it has left")


def test_a_port_that_is_taken_is_said_in_one_sentence(source: BagTagProvider, serving: Serving, address: str) -> None:
    port = int(address.rpartition(":")[2])
    with pytest.raises(ServerError, match=rf"^foxglove: 127.0.0.1:{port} can't be served \("):
        Serving(source, [(FOXGLOVE, port)], ServerSettings())


def test_a_scene_is_served_to_foxglove(command: Callable[..., Served]) -> None:
    """A separate process simulates it and sends drawings while they are requested."""
    served = command("scenarios/zoned_line", "--foxglove", "0", "--no-record")
    found = connected(
        served.address,
        lambda client: client.messages(
            "/markers", "/line", until=lambda found: len(found["/markers"]) > 2 and bool(found["/line"])
        ),
    )
    assert found["/line"][0].scene_name == "zoned_line"
    assert "clients can read everything" in served.told
    assert served.end().startswith("served up to ")
