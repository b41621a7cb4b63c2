# SPDX-License-Identifier: Apache-2.0
"""Named drives as Sparkplug metrics: the drive is commanded, its belts are read-only."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import pytest
from scenes import DRIVEN_LINE

from test.protocols.mqtt.kit import NODE, properties_of

if TYPE_CHECKING:
    from test.protocols.mqtt.kit import Serve

SPEED = "drives/m1/cmd_speed"


def test_a_host_commands_the_drive_and_not_its_belts(serve: Serve, tmp_path: Path) -> None:
    scene = tmp_path / "scene.yaml"
    scene.write_text(DRIVEN_LINE.read_text().replace("name: driven_line", f"name: {NODE}"))
    line = serve(role="controller", silence=600.0, scene=scene)
    metrics = line.host.last("DBIRTH").metrics
    assert {f"drives/m1/{name}" for name in ("speed", "running", "at_speed", "fault", "pulses", "mode")} <= set(metrics)
    of_belt = [name for name in metrics if name.startswith("belts/feeder/")]
    assert sorted(of_belt) == ["belts/feeder/bottles", "belts/feeder/speed"]
    assert all(properties_of(metrics[name])["readOnly"] is True for name in of_belt)
    line.host.set(SPEED, 0.25)
    line.until(lambda: line.node.status().writes == 1, "the setpoint")
    line.advance(30)
    assert line.host.values["drives/m1/speed"] == pytest.approx(0.25)
    assert line.host.values["belts/feeder/speed"] == pytest.approx(0.5)
    line.host.set("belts/feeder/cmd_speed", 0.1)
    assert line.refused(1).startswith("belts/feeder/cmd_speed: ")
