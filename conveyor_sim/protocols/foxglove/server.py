# SPDX-License-Identifier: Apache-2.0
"""`FoxgloveServer`: a line in Foxglove and Lichtblick, by their WebSocket protocol. Messages pass unchanged.

Topics have the names and definitions that recordings have, so that a layout shows both. Clients only read.
"""

from __future__ import annotations

import asyncio
import time
from collections import defaultdict
from collections.abc import Callable
from contextlib import suppress
from typing import Any

import foxglove
import numpy as np
from foxglove.websocket import ChannelView, Client, ServerListener, WebSocketServer

from conveyor_sim.bag.channels import schema_of
from conveyor_sim.bag.messages.encode import Header
from conveyor_sim.bag.messages.markers import bottles_markers, plant_markers
from conveyor_sim.bag.messages.topics import TOPICS
from conveyor_sim.bag.messages.typestore import default_distro
from conveyor_sim.protocols.server.interface import ServerError, Status
from conveyor_sim.protocols.tags.line_mirror import DRAWING_TOPICS, STATE_TOPICS, DrawableProvider
from conveyor_sim.scene import parse_again, parse_overrides
from conveyor_sim.scene.geometry import rail_shapes, surface_shapes
from conveyor_sim.scene.marks import marks_of
from conveyor_sim.scene.moving import bodies_by_signals

PLANT, MARKERS = "plant", "markers"
"""Topics made here from other topics: the drawing."""

KEPT = ("line", "run_state", "readback", "alarm_states")
"""Topics whose latest message a new subscriber gets at once."""

SHORTEST = 0.04
"""Shortest wall time between two messages of MARKERS, s."""

WAITING = 256
"""Largest number of messages that wait for a client; beyond it the oldest are dropped."""

FRAME = "world"


class FoxgloveServer:
    """Foxglove server of one tag provider. It requests drawings only while a client subscribes to them."""

    def __init__(self, source: DrawableProvider, host: str, port: int) -> None:
        """Prepare the server. port: 0 for any free one."""
        self._source, self._at = source, (host, port)
        self._context = foxglove.Context()  # without it channels are closed
        self._channels: dict[str, foxglove.Channel] = {}
        self._server: WebSocketServer | None = None
        self._looks: dict[str, set[int]] = defaultdict(set)  # clients by topic
        self._ends: list[Callable[[], None]] = []
        self._end_watch: Callable[[], None] | None = None
        self._changed = asyncio.Event()
        self._task: asyncio.Task[None] | None = None
        self._drawn: Any = None
        self._latency = 0.0

    @property
    def address(self) -> str:
        """Address to enter in Foxglove: Open connection, Foxglove WebSocket."""
        port = self._at[1] if self._server is None else self._server.port
        host = f"[{self._at[0]}]" if ":" in self._at[0] else self._at[0]
        return f"ws://{host}:{port}"

    async def start(self) -> None:
        """Serve from now on. Raises ServerError if that is not possible."""
        self._loop = asyncio.get_running_loop()
        distro = default_distro()
        for topic in (*STATE_TOPICS, *DRAWING_TOPICS, PLANT, MARKERS):
            known = schema_of(topic, distro)
            schema = foxglove.Schema(name=known.name, encoding=known.encoding, data=known.text)
            self._channels[topic] = foxglove.Channel(
                f"/{topic}", message_encoding="cdr", schema=schema, context=self._context
            )

        try:
            self._server = foxglove.start_server(
                name=self._source.info.name,
                host=self._at[0],
                port=self._at[1],
                context=self._context,
                server_listener=_Listener(self._in_loop, self._look, self._look_away),
                message_backlog_size=WAITING,
            )
        except Exception as error:  # the library raises plain exceptions
            raise ServerError(f"foxglove: {self._at[0]}:{self._at[1]} can't be served ({error})") from error
        self._ends = [self._source.hear(self._heard), self._source.listen(lambda: self._in_loop(self._changed.set))]
        self._task = asyncio.create_task(self._draw_all())

    async def stop(self) -> None:
        """End all connections."""
        for end in self._ends:
            end()
        self._ends = []
        if self._task is not None:
            self._task.cancel()
            await asyncio.gather(self._task, return_exceptions=True)
            self._task = None
        self._looks.clear()
        self._watch()
        if self._server is not None:
            await asyncio.to_thread(self._server.stop)  # it waits for threads that may need the interpreter's lock
            self._server = None

    def status(self) -> Status:
        """Return the activity. A client counts while it has a subscription."""
        latency, self._latency = self._latency, 0.0
        looks = [client for clients in self._looks.values() for client in clients]
        return Status(len(set(looks)), len(looks), 0, 0, latency)

    def _heard(self, topic: str, data: bytes) -> None:
        """Pass a message on. Called by the thread of the tag provider."""
        server = self._server
        if topic == "line" and server is not None:  # another run or a seek: clients discard their data
            server.clear_session()
            self._in_loop(self._draw_plant)
        self._channels[topic].log(data)

    def _in_loop(self, function: Callable[..., object], *arguments: object) -> None:
        """Call a function in the event loop. May be called by any thread."""
        with suppress(RuntimeError):  # the loop has ended
            self._loop.call_soon_threadsafe(function, *arguments)

    # In the loop

    def _look(self, client: int, topic: str) -> None:
        self._looks[topic].add(client)
        self._watch()
        if topic == PLANT:
            self._draw_plant()
        elif topic in KEPT and (data := self._source.newest.get(topic)) is not None:
            self._channels[topic].log(data)
        elif topic == MARKERS:
            self._drawn = None
            self._changed.set()

    def _look_away(self, client: int, topic: str) -> None:
        self._looks[topic].discard(client)
        self._watch()

    def _watch(self) -> None:
        """Request drawings while there are subscriptions to them, and only then."""
        wanted = any(self._looks[topic] for topic in (*DRAWING_TOPICS, MARKERS))
        if wanted and self._end_watch is None:
            self._end_watch = self._source.watch()
        elif not wanted and self._end_watch is not None:
            self._end_watch()
            self._end_watch = None

    async def _draw_all(self) -> None:
        while True:
            await self._changed.wait()
            self._changed.clear()
            if self._looks[MARKERS]:
                with suppress(Exception):  # messages of a damaged recording may have any content; the next may be valid
                    self._draw()
            await asyncio.sleep(SHORTEST)

    def _draw(self) -> None:
        """Publish moving objects at their present positions."""
        drawable = self._source.frame
        decode = drawable.drawn.get("bottles")
        if decode is None or decode is self._drawn:
            return
        self._drawn = decode
        message, line = decode(), drawable.line
        signals = dict(zip(line.signal_names, drawable.signals.tolist(), strict=False))
        moving = bodies_by_signals(self._scene(), signals.__getitem__)
        header = Header(int(message.tick), int(message.tick) * int(line.tick_ns), FRAME)
        columns = TOPICS["bottles"].unpack(message)
        self._channels[MARKERS].log(bottles_markers(columns, np.asarray(line.type_radius), moving, header))
        self._latency = max(self._latency, time.time() - drawable.at)

    def _draw_plant(self) -> None:
        """Publish static objects if a client subscribes to them."""
        if self._looks[PLANT]:
            scene = self._scene()
            shapes = surface_shapes(scene), rail_shapes(scene), marks_of(scene)
            self._channels[PLANT].log(plant_markers(*shapes, Header(0, 0, FRAME)))

    def _scene(self) -> Any:
        line = self._source.frame.line
        if self._parsed[0] is not line:
            scene = parse_again(line.scene_text, "the scene of the line", parse_overrides(line.overrides))
            self._parsed = line, scene
        return self._parsed[1]

    _parsed: tuple[Any, Any] = (None, None)
    """Latest message of topic line, and its scene."""


class _Listener(ServerListener):
    """Listener that threads of the library call."""

    def __init__(
        self,
        in_loop: Callable[..., None],
        look: Callable[[int, str], None],
        look_away: Callable[[int, str], None],
    ) -> None:
        self._in_loop, self._look, self._look_away = in_loop, look, look_away

    def on_subscribe(self, client: Client, channel: ChannelView) -> None:
        self._in_loop(self._look, client.id, channel.topic.removeprefix("/"))

    def on_unsubscribe(self, client: Client, channel: ChannelView) -> None:
        self._in_loop(self._look_away, client.id, channel.topic.removeprefix("/"))
