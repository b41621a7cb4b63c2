# SPDX-License-Identifier: Apache-2.0
"""A host application in JavaScript, with the codec of Eclipse Tahu: an independent implementation."""

from __future__ import annotations

import json
import shutil
import subprocess
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest
from protocols.waiting import PATIENCE

from test.protocols.mqtt.kit import GROUP, NODE

if TYPE_CHECKING:
    from test.protocols.mqtt.kit import Line

CLIENT = Path(__file__).parent / "node_client"

pytestmark = pytest.mark.skipif(
    shutil.which("node") is None or not (CLIENT / "node_modules").is_dir(),
    reason=f"sparkplug-payload is not installed: npm install --no-package-lock --prefix {CLIENT}",
)


def test_it_reads_births_and_commands_the_line(serve: Callable[..., Line]) -> None:
    line = serve(role="controller")
    line.advance(7)
    command = ["node", str(CLIENT / "host.js"), line.broker.url, GROUP, NODE]
    host = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    try:
        line.until(lambda: line.node.status().writes or host.poll() is not None, "its command")
        line.advance()
        out, errors = host.communicate(timeout=PATIENCE)
    finally:
        host.kill()
    assert host.returncode == 0, errors
    told: dict[str, Any] = json.loads(out)
    assert (told["NBIRTH"]["seq"], told["DBIRTH"]["seq"]) == (0, 1)
    node, device = told["NBIRTH"]["metrics"], told["DBIRTH"]["metrics"]
    assert node["bdSeq"] == {"type": "Int64", "value": 0}
    assert node["Node Control/Rebirth"] == {"type": "Boolean", "value": False}
    shown = line.source.info.tags
    assert {tag.name for tag in shown if tag.role not in ("fault", "run")} <= set(device)
    assert device["belts/zone1/speed"] == {
        "type": "Double",
        "value": pytest.approx(line.source.snapshot.values["belts/zone1/speed"], abs=0.1),
        "Quality": 192,
        "engUnit": "m/s",
        "engLow": -1,
        "engHigh": 1,
        "readOnly": True,
    }
    assert device["run/tick"]["value"] == 7 and device["run/tick"]["type"] == "Int64"
    assert device["machines/filler/state"]["type"] == "Int32"
    assert told["changed"]["value"] == 0.125
    _, outcome = line.outcomes()
    assert outcome[1:] == ("set", ("belts/zone1/cmd_speed", "belts/zone1/run"), (0.125, 1.0), True)
