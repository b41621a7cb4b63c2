# SPDX-License-Identifier: Apache-2.0
"""A simulation that can't go on leaves a node that answers: paused, with the reason, until it is reset."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from diagnostic_msgs.msg import DiagnosticStatus
from facts import missing
from ros.line_client import LineClient, until
from scenes import MASS, NO_FLOOR, RADIUS, bottle, contact, scene, segment
from std_srvs.srv import Trigger

from conveyor_sim.bag.recover import recover
from conveyor_sim.ros.child import Child


def test_a_bottle_that_nothing_can_stop_stops_the_run_and_not_the_node(
    start_node: Callable[..., Child], client: LineClient, tmp_path: Path
) -> None:
    speed = 1.1 * RADIUS * (1e3 / MASS) ** 0.5
    given = scene(
        contacts=[contact(1e3, "steel")],
        rails={"stop": segment((0.6, -1.0), (0.6, 1.0))},
        bottles=[bottle(0.6 - RADIUS - 0.055 * speed, 0.0, speed)],
        outputs={"bottles": 100},
        **NO_FLOOR,
    )
    file = tmp_path / "soft.yaml"
    file.write_text(given.source_text)
    node = start_node(scene=file, record=tmp_path / "bag")
    client.call(Trigger, "resume")

    def failed() -> Any:
        status, values = client.diagnostics()
        return (status, values) if status.level == DiagnosticStatus.ERROR else None

    status, values = until(failed, "an error")
    assert status.message.startswith("stopped: bottle 0 sinks ")
    assert missing(status.message, ["stiffness of about"]) == []
    assert (values["state"], values["tick"], values["bottles present"]) == ("PAUSED", "6", "1")
    assert recover(tmp_path / "bag").healthy
    resumed = client.call(Trigger, "resume")
    assert not resumed.success
    assert "expected a reset" in resumed.message
    client.reset()
    status, values = client.diagnostics()
    assert (status.level, values["tick"]) == (DiagnosticStatus.OK, "0")
    node.stop()
