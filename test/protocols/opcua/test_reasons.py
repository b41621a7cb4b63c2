# SPDX-License-Identifier: Apache-2.0
"""Refusals that node-opcua gets: "not permitted" and "wrong state" have different codes, and each has its reason."""

from __future__ import annotations

from typing import TYPE_CHECKING

from conveyor_sim.line.run_state import ENDED, RunState
from test.facts import missing
from test.protocols.opcua.node_session import needs_node_opcua, node_session

if TYPE_CHECKING:
    from pathlib import Path

    from test.protocols.opcua.conftest import Line

pytestmark = needs_node_opcua

SETPOINT = ["ns=2;s=belts/zone1/cmd_speed", "Double", 0.1]
FAST = ["ns=2;s=belts/zone1/cmd_speed", "Double", 99.0]
MACHINE = "ns=2;s=machines/filler/PackML"
LATER = "GoodCompletesAsynchronously"


def test_not_permitted_and_wrong_state_differ(line: Line, tmp_path: Path) -> None:
    line.client()
    with node_session(line.server.address, tmp_path, "operator") as session:
        index = session.ask("browse", node="i=85")[-1]["node"].partition(";")[0]
        unhold = [f"{MACHINE}.BaseStateMachine.MachineState.ExecuteState", f"{index};i=368"]
        stop = [f"{MACHINE}.BaseStateMachine.MachineState", f"{index};i=375"]
        own = ["ns=2;s=line", "ns=2;s=line/disown"]
        answers = session.ask("refusals", writes=[SETPOINT, FAST], calls=[unhold, own, stop])
        (mode, mode_reason), (beyond, beyond_reason), (state, state_reason), (role, role_reason), good = answers
        assert (mode, missing(mode_reason, "belts/zone1", "Automatic", "Manual")) == ("BadUserAccessDenied", [])
        assert (beyond, missing(beyond_reason, "belts/zone1/cmd_speed", "99")) == ("BadOutOfRange", [])
        assert (state, missing(state_reason, "machines/filler", "Unhold", "Execute", "Held")) == ("BadInvalidState", [])
        assert (role, missing(role_reason, "disown", "operator", "controller")) == ("BadUserAccessDenied", [])
        assert good == [LATER, ""]
        line.source.show(run=RunState(ENDED))
        for ended, ended_reason in session.ask("refusals", writes=[SETPOINT], calls=[stop]):
            assert (ended, missing(ended_reason, "ended")) == ("BadInvalidState", [])


def test_a_viewer_gets_the_reason(line: Line, tmp_path: Path) -> None:
    with node_session(line.server.address, tmp_path, "viewer") as session:
        ((code, reason),) = session.ask("refusals", writes=[SETPOINT], calls=[])
    assert (code, missing(reason, "only reads")) == ("BadUserAccessDenied", [])
