# SPDX-License-Identifier: Apache-2.0
"""The fixture `opcua`: a client that others wrote works a line under test, and all that it did is on record."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import pytest

from conveyor_sim.bag.replay import replay
from conveyor_sim.testing.scenario import Scenario

pytest.importorskip("asyncua", reason="asyncua is not installed: pip install conveyor-sim[scada]")

from asyncua import ua
from asyncua.sync import Client

SETPOINT, SPEED = "ns=2;s=belts/zone1/cmd_speed", "belts/zone1/speed"


def test_the_example_of_the_page_passes(pytester: pytest.Pytester) -> None:
    page = (Path(__file__).parent.parent.parent / "docs" / "opcua.md").read_text()
    ((name, text),) = re.findall(r"```python\n# (\S+)\n(.*?)```", page, re.DOTALL)
    (pytester.path / name).write_text(text)
    pytester.runpytest_inprocess("-p", "conveyor_sim.testing.plugin", "-p", "no:cacheprovider").assert_outcomes(
        passed=1
    )


def test_an_operator_takes_a_belt_in_hand_and_the_recording_replays(opcua: Any, tmp_path: Path) -> None:
    with Scenario("scenarios/zoned_line", bag=tmp_path / "bag") as line:
        server = opcua(line, users={"jo": ("operator", "geheim")})
        client = Client(server.address, timeout=60, watchdog_intervall=60)
        client.set_user("jo")
        client.set_password("geheim")
        with client:
            line.run_for(0.5)
            with pytest.raises(ua.UaStatusCodeError, match="BadUserAccessDenied"):
                client.get_node(SETPOINT).write_value(0.125)  # the controller has it
            of_line = client.get_node("ns=2;s=line")
            of_line.call_method("2:set_mode", "belts/zone1", ua.Variant(3, ua.VariantType.UInt32))
            line.run_for(0.1)
            client.get_node(SETPOINT).write_value(0.125)
            line.eventually(lambda s: s[SPEED] == 0.125, within=2.0)
    report = replay(tmp_path / "bag")
    assert report.exact and report.difference is None
    assert report.compared["readback"] >= 2
