# SPDX-License-Identifier: Apache-2.0
"""A line as the client of node-opcua's server, which no Python is part of."""

from __future__ import annotations

import os
import shutil
import subprocess
from collections.abc import Iterator
from pathlib import Path

import pytest
from facts import missing
from protocols.waiting import alone
from testing.conftest import LINE
from testing.plc_servers import write_map
from testing.soft_plc import SETPOINT
from testing.test_plc_security import PLACES, connect
from testing.test_plc_server import Twin
from testing.vendor_plc import NAMESPACE, PASSWORD, USER

from conveyor_sim.protocols.attach.access import PlcAccess, Security
from conveyor_sim.protocols.attach.opcua_browse import browse, tag_rows
from conveyor_sim.protocols.attach.opcua_client import trust_server
from conveyor_sim.protocols.attach.plc_link import PlcRefusedError
from conveyor_sim.testing import Scenario

FOLDER = Path(__file__).parents[1] / "protocols" / "opcua" / "node_client"

pytestmark = pytest.mark.skipif(
    shutil.which("node") is None or not (FOLDER / "node_modules" / "node-opcua-server").exists(),
    reason=f"node-opcua is not installed: npm install --no-package-lock --prefix {FOLDER}",
)


@pytest.fixture(scope="module")
def url(tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    folder = str(tmp_path_factory.mktemp("node"))
    command = ["node", str(FOLDER / "plc.js"), folder, NAMESPACE, USER, PASSWORD]
    home = {**os.environ, "HOME": folder, "XDG_CONFIG_HOME": folder}
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, env=home) as process:
        assert process.stdout is not None
        # The library may print a warning about Node.js first.
        yield next(row.strip() for row in process.stdout if row.startswith("opc.tcp://"))
        process.kill()


@pytest.fixture(scope="module")
def access(url: str, tmp_path_factory: pytest.TempPathFactory) -> PlcAccess:
    """Access by name; the certificate is trusted as a user does it, by the error."""
    access = PlcAccess(USER, PASSWORD, certificates=tmp_path_factory.mktemp("line") / "own")
    with pytest.raises(PlcRefusedError) as refused:
        alone(browse(url, access, str, lambda *_: None))
    fingerprint = str(refused.value).partition("--trust ")[2].split()[0]
    alone(trust_server(url, access._replace(trust=fingerprint), str))
    return access


@pytest.mark.parametrize(
    ("security", "used"), [("best", "Aes256_Sha256_RsaPss SignAndEncrypt"), ("sign", "Aes256_Sha256_RsaPss Sign")]
)
def test_it_gives_the_bits_of_its_program(
    url: str, access: PlcAccess, filled: Path, tmp_path: Path, security: Security, used: str
) -> None:
    chosen = access._replace(security=security)
    tags = write_map(tmp_path / "tags.csv", PLACES)
    assert missing(connect(url, tags, chosen)[0], used, USER) == []
    with Scenario(LINE, start=filled) as inside, Scenario(LINE, start=filled) as outside:
        inside.attach(Twin())
        outside.attach_plc(url, tags, access=chosen)
        for plant in (inside, outside):
            plant.run_for(0.5)
        assert outside.simulation.state_hash() == inside.simulation.state_hash()


def test_its_variables_are_browsed(url: str, access: PlcAccess) -> None:
    rows = tag_rows(alone(browse(url, access, str, lambda *_: None)), ()).splitlines()
    assert f",{PLACES[SETPOINT]},Float read-only GVL/speed" in rows
    assert f",{PLACES['run/tick']},UInt32 GVL/tick" in rows
