"""`LockstepClient`: client of the service `lockstep`, whose thread waits for the answer itself."""

from __future__ import annotations

import time
from collections.abc import Set
from typing import Any

from conveyor_msgs.srv import Lockstep
from rclpy.node import Node

from conveyor_sim.bag.messages.qos import ANSWERS
from conveyor_sim.ros.direct import Aside, WaitSet, send_request, take_response
from conveyor_sim.ros.publishers import ros_qos


class LockstepClient:
    """Client for one thread."""

    def __init__(self, node: Node) -> None:
        self._client = node.create_client(Lockstep, "lockstep", qos_profile=ros_qos(ANSWERS), callback_group=Aside())
        self._waiting = WaitSet(node.context, clients=[self._client])

    def close(self) -> None:
        """Release the client."""
        self._waiting.close()

    def is_ready(self) -> bool:
        """Return True if the service is available."""
        ready: bool = self._client.service_is_ready()
        return ready

    def send(self, request: Any) -> int:
        """Send a request. Return the number of its answer."""
        return send_request(self._client, request)

    def response(self, numbers: Set[int], seconds: float) -> Any:
        """Return the answer to a request with one of these numbers; None if none comes within `seconds`."""
        until = time.monotonic() + seconds
        while (left := until - time.monotonic()) > 0.0:
            self._waiting.wait(left)
            while (taken := take_response(self._client)) is not None:
                number, response = taken
                if number in numbers:
                    return response
        return None
