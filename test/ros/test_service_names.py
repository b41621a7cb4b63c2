# SPDX-License-Identifier: Apache-2.0
"""Names of services, over DDS: below the node's name, and the deprecated old ones."""

from __future__ import annotations

from conveyor_msgs import srv
from facts import missing
from ros.line_client import LineClient
from std_srvs.srv import Trigger

from conveyor_sim.ros.child import Child


def relative_services(client: LineClient, node: str) -> set[str]:
    """The names of a node's services in the root namespace."""
    offered = client.node.get_service_names_and_types_by_node(node, "/")
    return {name.removeprefix("/") for name, kinds in offered if not kinds[0].startswith(("rcl_", "type_desc"))}


def test_every_service_has_its_name_below_the_node_and_its_old_name(shared_node: Child, client: LineClient) -> None:
    client.client(srv.Lockstep, "lockstep")
    names = relative_services(client, "conveyor_sim")
    below = {name.removeprefix("conveyor_sim/") for name in names if name.startswith("conveyor_sim/")}
    assert {"pause", "lockstep", "get_simulation_state", "save_checkpoint", "operate", "inject_fault"} <= below
    old = {name for name in names if "/" not in name}
    assert old == {name for name in below if "/" not in name}


def test_an_old_name_answers_and_is_logged_once(shared_node: Child, client: LineClient) -> None:
    for kind, name in (
        (Trigger, "pause"),
        (srv.SaveCheckpoint, "save_checkpoint"),
        (srv.Lockstep, "lockstep"),
    ):
        for _ in range(2):
            client.call(kind, f"/{name}")
        lines = [line for line in shared_node.log.read_text().splitlines() if f" /{name} " in line]
        assert len(lines) == 1
        assert missing(lines[0], ["WARN", "deprecated", f"/conveyor_sim/{name}"]) == []
