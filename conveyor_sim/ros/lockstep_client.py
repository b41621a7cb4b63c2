"""The controller's end of the service `lockstep`: one thread asks, and waits for the answer itself."""

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
    """For one thread."""

    def __init__(self, node: Node) -> None:
        self._client = node.create_client(Lockstep, "lockstep", qos_profile=ros_qos(ANSWERS), callback_group=Aside())
        self._waiting = WaitSet(node.context, clients=[self._client])

    def close(self) -> None:
        """Ask no more."""
        self._waiting.close()

    def is_ready(self) -> bool:
        """Whether the service has been found."""
        ready: bool = self._client.service_is_ready()
        return ready

    def send(self, request: Any) -> int:
        """Ask; the number that the answer will have."""
        return send_request(self._client, request)

    def response(self, numbers: Set[int], seconds: float) -> Any:
        """The answer to one of the requests with these numbers, None if it does not come within so many seconds."""
        until = time.monotonic() + seconds
        while (left := until - time.monotonic()) > 0.0:
            self._waiting.wait(left)
            while (taken := take_response(self._client)) is not None:
                number, response = taken
                if number in numbers:
                    return response
        return None
