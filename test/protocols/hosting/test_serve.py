# SPDX-License-Identifier: Apache-2.0
"""The command `serve` as a separate process: from its first line to its last, and killed in between."""

from __future__ import annotations

import os
import re
import resource
import signal
import socket
from collections.abc import Callable
from pathlib import Path
from urllib.request import urlopen

import pytest
from protocols.modbus.modbus_line import speed_of
from protocols.served import Served
from protocols.waiting import PATIENCE, until

from conveyor_sim.bag.reader import open_bag
from conveyor_sim.bag.replay import replay
from conveyor_sim.errors import BagError
from conveyor_sim.support.modbus_rows import read_map

pytest.importorskip("pymodbus", reason="pymodbus is not installed: pip install conveyor-sim[scada]")
pytest.importorskip("aiohttp", reason="aiohttp is not installed: pip install conveyor-sim[scada]")

from pymodbus.client import ModbusTcpClient

SCENE = "scenarios/zoned_line"


def give(client: ModbusTcpClient, value: float) -> None:
    answer = client.write_registers(0, client.convert_to_registers(value, client.DATATYPE.FLOAT32))
    assert not answer.isError(), answer


def test_a_scene_is_served_until_ctrl_c_and_what_clients_wrote_replays(
    command: Callable[..., Served], tmp_path: Path
) -> None:
    options = ["--modbus", "0", "--modbus-role", "controller", "--modbus-map", "map.csv", "--web", "0", "--out", "bag"]
    served = command(SCENE, *options, fresh=True)
    with ModbusTcpClient("127.0.0.1", port=served.port, timeout=60) as client:
        until(lambda: speed_of(client) == 0.5, "the line")
        give(client, 0.25)
        until(lambda: speed_of(client) == 0.25, "the speed")
    page = re.search(r"(http://127\.0\.0\.1:\d+/): clients can read everything and write nothing", served.told)
    assert page and b'<meta name="line" content="live">' in urlopen(page.group(1), timeout=PATIENCE).read()
    assert "clients can read everything and write as controller" in served.told
    out = served.end()
    assert re.fullmatch(
        r"served up to [\d.]+ s; modbus 1 written, 0 refused, web 0 written, 0 refused; recorded to bag\n", out
    )
    assert served.process.returncode == 0
    assert read_map(tmp_path / "map.csv")[0].table == "coil"
    report = replay(tmp_path / "bag")
    assert report.exact and report.difference is None
    assert report.compared["outcomes"] >= 2
    with open_bag(tmp_path / "bag") as bag:
        writers = {frame.data.writer for frame in bag.outcomes() if frame.data.writer_kind == "controller"}
    assert len(writers) == 1 and next(iter(writers)).startswith("modbus 127.0.0.1:")


def test_a_recording_is_served(command: Callable[..., Served], tmp_path: Path) -> None:
    first = command(SCENE, "--modbus", "0", "--out", "bag", "--duration", "2", "--real-time-factor", "0")
    with ModbusTcpClient("127.0.0.1", port=first.port, timeout=60) as client:
        until(lambda: speed_of(client) == 0.5, "the line")
    assert "recorded to bag" in first.end()
    second = command("bag", "--modbus", "0", "--loop")
    with ModbusTcpClient("127.0.0.1", port=second.port, timeout=60) as client:
        until(lambda: speed_of(client) == 0.5, "the recording")
        assert client.write_coil(0, True).exception_code == 1
    assert "recorded" not in second.end(signal.SIGTERM)
    assert second.process.returncode == 0


def test_a_server_that_is_killed_leaves_a_whole_recording_and_its_port(
    command: Callable[..., Served], tmp_path: Path
) -> None:
    served = command(SCENE, "--modbus", "0", "--out", "bag")
    port = served.port
    with ModbusTcpClient("127.0.0.1", port=port, timeout=2, retries=0) as client:
        until(lambda: speed_of(client) == 0.5, "the line")
        served.end(signal.SIGKILL)
        assert speed_of(client) is None

        def is_whole() -> bool:
            try:
                open_bag(tmp_path / "bag").close()
            except BagError:
                return False
            return True

        until(is_whole, "the end of the recording by the process that simulates")
        command(SCENE, "--modbus", str(port), "--no-record")
        until(lambda: speed_of(client) == 0.5, "the other server")


def test_the_process_that_simulates_may_die(command: Callable[..., Served], tmp_path: Path) -> None:
    served = command(SCENE, "--modbus", "0", "--out", "bag")
    with ModbusTcpClient("127.0.0.1", port=served.port, timeout=60) as client:
        until(lambda: speed_of(client) == 0.5, "the line")
        os.kill(served.simulator, signal.SIGKILL)
        until(lambda: speed_of(client) is None, "exception 11")
        until(lambda: speed_of(client) == 0.5, "another process")
    assert "was killed by signal 9; the scene is restarted" in served.told
    assert served.end().endswith("; recorded to bag_1\n")
    assert served.process.returncode == 1 and "not recorded up to the end: bag: " in served.told


def test_a_recording_that_a_full_disk_ended_is_said_at_the_end(command: Callable[..., Served], tmp_path: Path) -> None:
    """By a limit of the size of files, which the system keeps as it does that of the disk."""
    served = command(SCENE, "--modbus", "0", "--out", "bag")
    with ModbusTcpClient("127.0.0.1", port=served.port, timeout=60) as client:
        until(lambda: speed_of(client) == 0.5, "the line")
    (file,) = (tmp_path / "bag").glob("*.mcap")
    resource.prlimit(served.simulator, resource.RLIMIT_FSIZE, (file.stat().st_size, file.stat().st_size))
    until(lambda: "bag: recording stopped at" in served.told, "the full disk")
    assert "recorded to" not in served.end()
    assert served.process.returncode == 1
    assert "Error: not recorded up to the end: bag: " in served.told and "conveyor-sim recover" in served.told


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_who_ends_it_while_it_compiles_finds_nothing_left(
    command: Callable[..., Served], tmp_path: Path, tmp_path_factory: pytest.TempPathFactory, number: int
) -> None:
    served = command(SCENE, "--modbus", "0", NUMBA_CACHE_DIR=str(tmp_path_factory.mktemp("empty")))
    until(lambda: "compiling the kernels" in served.told, "the compiler")
    served.end(number)
    assert served.process.returncode == 130 and "Traceback" not in served.told
    assert {path.name for path in tmp_path.iterdir()} == {"log"}


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        ([], "expected one of SCENE, BAG and --node"),
        ([SCENE, "--node"], "expected one of SCENE, BAG and --node"),
        ([SCENE, "--loop"], "--loop: given with scenarios/zoned_line, expected it with a bag only"),
        (["--node", "--no-record"], "--no-record: given with --node, expected it with a scene only"),
        (
            [".", "--modbus-role", "operator"],
            "--modbus-role: given with ., expected none: a recording can't be commanded",
        ),
        ([".", "--modbus", "0"], "metadata.yaml is missing"),
        ([SCENE, "--limit", "opcua.nodes=5"], "--limit: opcua.nodes given, expected one of opcua.nodes_per_read"),
        (["none", "--modbus", "0"], "none"),
        (
            [SCENE, "--modbus", "0", "--bind", "no.such.host.invalid"],
            "modbus: no.such.host.invalid:0 can't be listened on",
        ),
        ([SCENE, "--modbus", "0", "--bind", "192.0.2.1"], "expected an address of this machine"),
        ([SCENE, "--opcua", "0", "--bind", "192.0.2.1"], "expected an address of this machine"),
    ],
)
def test_what_can_not_be_is_one_sentence(command: Callable[..., Served], arguments: list[str], sentence: str) -> None:
    served = command(*arguments)
    served.process.wait(timeout=PATIENCE)
    assert served.process.returncode == 1
    (error,) = [line for line in served.told.splitlines() if line.startswith("Error: ")]
    assert sentence in error
    assert "Traceback" not in served.told


def test_a_history_of_no_tag_is_one_sentence_and_leaves_nothing(command: Callable[..., Served], tmp_path: Path) -> None:
    """Tags are known once the scene is loaded, and its recording has begun."""
    pytest.importorskip("asyncua", reason="asyncua is not installed: pip install conveyor-sim[scada]")
    served = command(SCENE, "--opcua", "0", "--opcua-history", "belts/*/sped")
    served.process.wait(timeout=PATIENCE)
    assert served.process.returncode == 1
    assert "Error: opcua: history of belts/*/sped: fits no tag, expected a pattern such as" in served.told
    assert {path.name for path in tmp_path.iterdir()} == {"log"}


def test_a_port_that_is_taken_leaves_nothing_behind(command: Callable[..., Served], tmp_path: Path) -> None:
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        served = command(SCENE, "--modbus", str(port))
        served.process.wait(timeout=PATIENCE)
    assert served.process.returncode == 1
    assert f"Error: modbus: 127.0.0.1:{port} can't be listened on" in served.told
    assert {path.name for path in tmp_path.iterdir()} == {"log"}
