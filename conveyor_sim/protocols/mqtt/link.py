# SPDX-License-Identifier: Apache-2.0
"""`BrokerConnection`: one connection to a broker, by MQTT 5, or 3.1.1 for an older broker. It does not reconnect.

The library has a thread for each connection. Messages wait in a bounded queue for the event loop. `full` reports that
sent messages do not leave fast enough, because the library would store any number of them.
"""

from __future__ import annotations

import socket
import threading
from collections import deque
from collections.abc import Callable, Iterator
from contextlib import suppress
from typing import Any, NamedTuple

from paho.mqtt.client import Client, DisconnectFlags, MQTTMessage
from paho.mqtt.enums import CallbackAPIVersion, MQTTErrorCode, MQTTProtocolVersion
from paho.mqtt.packettypes import PacketTypes
from paho.mqtt.properties import Properties
from paho.mqtt.reasoncodes import ReasonCode

from conveyor_sim.errors import ConveyorError
from conveyor_sim.protocols.mqtt.broker import PATIENCE, Broker
from conveyor_sim.support.printable import printable

MOST_BYTES = 64 * 1024
"""Largest accepted message, bytes. By MQTT 5 the broker knows this limit, and larger messages never arrive."""

MOST_WAITING = 200
"""Largest number of messages that wait to be taken; more are dropped and counted."""

MOST_UNSENT = 20
"""Largest number of messages that the library may store before it has sent them."""

MOST_UNREAD = 64 * 1024
"""Size of the system's send buffer, bytes; if the broker does not read, later messages are left out."""

KEEP_ALIVE = 15
"""Wall time without messages after which a side checks the connection, s."""

_properties: Any = Properties  # not typed
NEWEST, OLDEST = MQTTProtocolVersion.MQTTv5, MQTTProtocolVersion.MQTTv311
_TOO_NEW = "Unsupported protocol version"
_WITH_WILL = "Disconnect with will message"


class BrokerConnectionError(ConveyorError):
    """Error: a connection fails or is refused. States the reason."""


class TooNewError(BrokerConnectionError):
    """Error: the broker does not support the version of MQTT. It refuses it, or closes the connection without an
    answer.
    """


class MqttMessage(NamedTuple):
    """Received message."""

    topic: str
    data: bytes
    """Payload; empty if it is too large."""
    size: int
    retained: bool
    """True if the broker stored it before this connection."""


class _Client(Client):
    end: Callable[[str], None]

    def loop_forever(self, timeout: float = 1.0, retry_first_connection: bool = False) -> MQTTErrorCode:
        """Run the thread of the library. Any error in messages of the broker only ends the connection."""
        reason = "the connection has ended"
        try:
            return super().loop_forever(timeout, retry_first_connection)
        except Exception as error:
            reason = f"{type(error).__name__}: {error}"
            return MQTTErrorCode.MQTT_ERR_PROTOCOL
        finally:
            self.end(reason)


class BrokerConnection:
    """Connection that one thread uses, except for `wake`."""

    def __init__(
        self, broker: Broker, name: str, will: MqttMessage, version: MQTTProtocolVersion, wake: Callable[[], None]
    ) -> None:
        """Prepare the connection. name: client ID; the newest client of an ID stays connected. will: message that the
        broker sends when the connection ends. wake: called by any thread when there is news. Raises ServerError.
        """
        self._broker, self._will, self._wake = broker, will, wake
        self._is_new = version == NEWEST
        self._arrived: deque[MqttMessage] = deque()
        self._decided, self._lost, self._over = threading.Event(), threading.Event(), threading.Event()
        self._refusal = ""
        self._answered = False  # by any acknowledgement
        self._published = self._sent = 0
        self.dropped = 0
        """Messages that were dropped so far."""
        self.lost = ""
        """Reason why it has ended; empty: it has not."""
        self.denied = False
        """True if the broker refuses subscriptions."""
        clean = None if self._is_new else True
        client = _Client(CallbackAPIVersion.VERSION2, name, clean, protocol=version, reconnect_on_failure=False)
        client.connect_timeout = PATIENCE
        client.will_set(will.topic, will.data, qos=1)
        if broker.user:
            client.username_pw_set(broker.user, broker.password or None)
        if broker.secured:
            client.tls_set_context(broker.context())
        client.on_connect, client.on_disconnect = self._on_connect, self._on_disconnect
        client.on_message, client.on_subscribe = self._on_message, self._on_subscribe
        client.on_publish = self._on_publish
        client.on_socket_open, client.end = _bound, self._end
        self._client = client

    def open(self) -> None:
        """Connect; this may take twice PATIENCE. Raises BrokerConnectionError, TooNewError."""
        properties = None
        if self._is_new:
            properties = _properties(PacketTypes.CONNECT)
            properties.MaximumPacketSize = MOST_BYTES
        where = self._broker.address
        try:
            self._client.connect(self._broker.host, self._broker.port, KEEP_ALIVE, properties=properties)
        except (OSError, ValueError) as error:
            reason = getattr(error, "strerror", None) or error
            raise BrokerConnectionError(
                f"{where}: can't be connected to ({reason}), expected an MQTT broker"
            ) from error
        self._client.loop_start()
        decided = self._decided.wait(PATIENCE)
        if decided and not self._refusal and not self.lost:
            return
        lost = self.lost
        self.close()
        reason = self._refusal or lost or f"no answer within {PATIENCE:g} s"
        sentence = f"{where}: refuses the connection ({reason}), expected an MQTT broker that takes {self._whom}"
        closed = self._is_new and not self._answered and bool(lost)
        raise TooNewError(sentence) if closed or self._refusal == _TOO_NEW else BrokerConnectionError(sentence)

    @property
    def full(self) -> bool:
        """True if published messages do not leave; `wake` is called once they do."""
        return self._published - self._sent >= MOST_UNSENT

    def subscribe(self, *topics: str) -> None:
        """Subscribe to topics, with quality of service 1."""
        self._client.subscribe([(topic, 1) for topic in topics])

    def publish(self, topic: str, data: bytes) -> None:
        """Send a message, with quality of service 0."""
        self._published += 1
        self._client.publish(topic, data)

    def take(self) -> Iterator[MqttMessage]:
        """Yield the received messages, each once."""
        with suppress(IndexError):
            while True:
                yield self._arrived.popleft()

    def close(self) -> None:
        """End the connection and have its will sent. Do nothing if it has ended.

        This may take a few seconds if the broker is silent.
        """
        if not self.lost:
            if self._is_new:
                self._client.disconnect(ReasonCode(PacketTypes.DISCONNECT, _WITH_WILL))
            else:
                self._published += 1
                with suppress(RuntimeError, ValueError):
                    self._client.publish(self._will.topic, self._will.data, qos=1).wait_for_publish(PATIENCE)
                self._client.disconnect()
            self._lost.wait(PATIENCE)
        connection: Any = self._client.socket()
        if connection is not None:
            with suppress(OSError):
                connection.shutdown(socket.SHUT_RDWR)
        self._over.wait(PATIENCE)

    # By the library's thread

    def _on_connect(self, client: Any, userdata: Any, flags: Any, reason: ReasonCode, properties: Any) -> None:
        self._answered = True
        if reason.is_failure:
            self._refusal = str(reason)
        self._decided.set()

    def _on_disconnect(
        self, client: Any, userdata: Any, flags: DisconnectFlags, reason: ReasonCode, properties: Any
    ) -> None:
        by_broker = flags.is_disconnect_packet_from_server
        self._lose(f"{reason}" if by_broker else "the connection has ended")

    def _on_subscribe(self, client: Any, userdata: Any, mid: int, reasons: list[ReasonCode], properties: Any) -> None:
        self.denied = self.denied or any(reason.is_failure for reason in reasons)

    def _on_publish(self, client: Any, userdata: Any, mid: int, reason: ReasonCode, properties: Any) -> None:
        was_full = self.full
        self._sent += 1
        if was_full:
            self._wake()

    def _on_message(self, client: Any, userdata: Any, message: MQTTMessage) -> None:
        if len(self._arrived) >= MOST_WAITING:
            self.dropped += 1
        else:
            size = len(message.payload)
            data = bytes(message.payload) if size <= MOST_BYTES else b""
            self._arrived.append(MqttMessage(message.topic, data, size, message.retain))
        self._wake()

    def _lose(self, reason: str) -> None:
        self.lost = self.lost or printable(reason)
        self._decided.set()
        self._lost.set()
        self._wake()

    def _end(self, reason: str) -> None:
        self._lose(reason)
        self._over.set()

    @property
    def _whom(self) -> str:
        return f"user {printable(self._broker.user)}" if self._broker.user else "clients without a user"


def _bound(client: Any, userdata: Any, connection: Any) -> None:
    connection.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, MOST_UNREAD)
