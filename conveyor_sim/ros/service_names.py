# SPDX-License-Identifier: Apache-2.0
"""Names of services: below the node's name (`~/pause`), and for one release as in 0.1 (`pause`)."""

from __future__ import annotations

from collections.abc import Callable
from inspect import isawaitable
from typing import Any

from rclpy.node import Node

SIMULATION = "conveyor_sim"
"""Name of the node that simulates, unless it is remapped."""


def of_simulation(name: str) -> str:
    """Return the name under which a client in the same namespace finds a service of the simulation."""
    return f"{SIMULATION}/{name}"


def create_service(node: Node, kind: Any, name: str, handler: Callable[[Any, Any], Any], **options: Any) -> None:
    """Create a service below the node's name, and under its old name. options: of Node.create_service."""
    node.create_service(kind, f"~/{name}", handler, **options)
    deprecation = Deprecation(node, name)

    async def handle_old(request: Any, response: Any) -> Any:
        deprecation.log()
        answer = handler(request, response)
        return await answer if isawaitable(answer) else answer

    node.create_service(kind, name, handle_old, **options)


def create_standard_service(
    node: Node, kind: Any, name: str, handler: Callable[[Any, Any], Any], **options: Any
) -> None:
    """Create a service of simulation_interfaces, below the node's name and in its namespace.

    Gazebo has the former names, Isaac Sim and O3DE the latter. options: of Node.create_service.
    """
    for place in (f"~/{name}", name):
        node.create_service(kind, place, handler, **options)


class Deprecation:
    """Warning of a service's old name, logged at its first use."""

    def __init__(self, node: Node, name: str) -> None:
        self._node = node
        self._name = name
        self._logged = False

    def log(self) -> None:
        """Log the warning, once."""
        if not self._logged:
            self._logged = True
            old, new = map(self._node.resolve_service_name, (self._name, f"~/{self._name}"))
            self._node.get_logger().warning(f"the service {old} is deprecated and will be removed; call {new}")
