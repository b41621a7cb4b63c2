# SPDX-License-Identifier: Apache-2.0
"""`conveyor-sim serve --mqtt` as a separate process: messages to a host, and the recording."""

from __future__ import annotations

import os
import re
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import pytest
from protocols.served import Served
from protocols.waiting import PATIENCE, until

from conveyor_sim.bag.reader import open_bag
from conveyor_sim.bag.replay import replay
from conveyor_sim.protocols.hosting.server_messages import BEAT
from test.protocols.mqtt.kit import SETPOINT, SPEED, Host

if TYPE_CHECKING:
    from test.protocols.mqtt.kit import Mosquitto

SCENE = "scenarios/zoned_line"
MANUAL, INT32 = 3, 3


@pytest.fixture
def host(broker: Mosquitto) -> Iterator[Host]:
    host = Host(broker.port)
    yield host
    host.close()
    assert not host.broken, host.broken


def test_a_scene_is_served_until_ctrl_c_and_what_an_operator_did_replays(
    command: Callable[..., Served], broker: Mosquitto, host: Host, tmp_path: Path
) -> None:
    served = command(SCENE, "--mqtt", broker.url, "--mqtt-role", "operator", "--out", "bag")
    until(lambda: host.values.get(SPEED) == 0.5, "the line")
    host.set("belts/zone1/mode", MANUAL, INT32)
    until(lambda: host.values["belts/zone1/mode"] == MANUAL, "the mode")
    host.set(SETPOINT, 0.25)
    until(lambda: host.values[SPEED] == 0.25, "the speed")
    greeting = (
        f"{broker.url}/zoned_line/zoned_line: clients that the broker admits can read everything and write as operator"
    )
    assert greeting in served.told
    out = served.end()
    until(lambda: not host.alive["node"], "its death")
    assert re.fullmatch(r"served up to [\d.]+ s; mqtt 2 written, 0 refused; recorded to bag\n", out)
    assert served.process.returncode == 0 and "Traceback" not in served.told
    report = replay(tmp_path / "bag")
    assert report.exact and report.difference is None
    with open_bag(tmp_path / "bag") as bag:
        given = [frame.data for frame in bag.outcomes() if frame.data.writer_kind == "operator"]
    writer = f"mqtt 127.0.0.1:{broker.port}"
    assert [(outcome.writer, outcome.accepted) for outcome in given] == [(writer, True)] * 2


EXAMPLE = Path(__file__).parents[3] / "examples" / "scada" / "sparkplug_host.py"


def test_the_example_of_a_host_shows_a_birth_and_reports_mistakes(
    command: Callable[..., Served], broker: Mosquitto, host: Host, tmp_path: Path
) -> None:
    """The output is that of docs/scada.md. Unknown metrics and missing brokers are named."""
    command(SCENE, "--mqtt", broker.url, "--mqtt-role", "operator", "--no-record")
    until(lambda: host.alive["line"], "births")
    patterns = ["belts/zone1/*speed", "belts/zone1/mode"]
    example = [sys.executable, "-u", str(EXAMPLE), "zoned_line/zoned_line", *patterns, "--set", "belts/zone9/mode=3"]
    with (tmp_path / "out").open("w") as out, (tmp_path / "errors").open("w") as errors:
        process = subprocess.Popen([*example, "--port", str(broker.port)], stdout=out, stderr=errors)
    try:
        until(lambda: "belts/zone9/mode: not in the birth" in (tmp_path / "errors").read_text(), "its sentence")
    finally:
        process.kill()
        process.wait()
    shown = (tmp_path / "out").read_text().splitlines()
    assert shown[:4] == [
        "belts/zone1/speed = 0.5", "belts/zone1/cmd_speed = 0.5", "belts/zone1/at_speed = True", "belts/zone1/mode = 1",
    ]  # fmt: skip
    alone = subprocess.run([*example, "--port", "1"], capture_output=True, text=True)
    assert alone.returncode == 1 and alone.stderr.startswith("mqtt://127.0.0.1:1: the broker can't be reached")


def test_an_edge_node_that_is_killed_is_born_again_and_counts_on(
    command: Callable[..., Served], broker: Mosquitto, host: Host
) -> None:
    served = command(SCENE, "--mqtt", broker.url, "--mqtt-role", "operator", "--no-record")
    until(lambda: host.alive["line"], "births")
    host.set("belts/zone1/mode", MANUAL, INT32)
    host.set("no/such/tag", 0.1)
    until(lambda: (host.values["commands/written"], host.values["commands/refused"]) == (1, 1), "the commands")
    time.sleep(5 * BEAT)  # counts are as of the last heartbeat
    os.kill(served.server("mqtt"), signal.SIGKILL)
    until(lambda: not host.alive["node"] or host.kinds().count("NBIRTH") == 2, "its last will")
    until(lambda: host.alive["line"] and host.kinds().count("NBIRTH") == 2, "births")
    assert (host.values["commands/written"], host.values["commands/refused"]) == (1, 1)
    host.set(SETPOINT, 0.2)
    until(lambda: host.values["commands/written"] == 2, "another command")
    assert "mqtt 2 written, 1 refused, restarted 1 time" in served.end()


def test_a_recording_is_read_only_and_a_server_that_is_killed_is_dead_at_once(
    command: Callable[..., Served], broker: Mosquitto, host: Host
) -> None:
    first = command(SCENE, "--mqtt", broker.url, "--out", "bag", "--duration", "2", "--real-time-factor", "0")
    until(lambda: host.alive["node"] and host.values["run/state"] == 4, "its end")
    until(lambda: not host.alive["line"], "the death of the line")
    first.end()
    until(lambda: not host.alive["node"], "its death")
    second = command("bag", "--mqtt", broker.url, "--loop")
    until(lambda: host.alive["line"], "the recording")
    host.set(SETPOINT, 0.1)
    until(lambda: host.values["commands/refused"] == 1, "a refusal")
    second.end(signal.SIGKILL)
    until(lambda: not host.alive["node"], "its last will")
    assert host.last("NDEATH").value("bdSeq") == 1


def test_the_will_of_a_process_that_was_killed_is_not_of_the_next_one(
    command: Callable[..., Served], broker: Mosquitto, host: Host
) -> None:
    births: list[int] = []
    for number in range(3):
        served = command(SCENE, "--mqtt", broker.url)
        until(lambda: host.alive["line"], "births")
        births.append(host.last("NBIRTH").value("bdSeq"))
        served.end(signal.SIGKILL)
        until(lambda: not host.alive["node"], "its last will")
        assert host.last("NDEATH").value("bdSeq") == births[-1] == number


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (["--mqtt", "mqtt://jo:sesame@127.0.0.1"], "mqtt: a password given in the URL"),
        ([".", "--mqtt", "{url}", "--mqtt-role", "operator"], "--mqtt-role: given with ., expected none: a recording"),
    ],
)
def test_what_can_not_be_is_one_sentence(
    command: Callable[..., Served], broker: Mosquitto, arguments: list[str], sentence: str
) -> None:
    served = command(*(argument.format(url=broker.url) for argument in arguments))
    served.process.wait(timeout=PATIENCE)
    (error,) = [line for line in served.told.splitlines() if line.startswith("Error: ")]
    assert served.process.returncode == 1 and sentence in error and "Traceback" not in served.told


def test_a_broker_that_is_not_there_is_said_before_anything_is_compiled(
    command: Callable[..., Served], tmp_path: Path
) -> None:
    with socket.create_server(("127.0.0.1", 0)) as free:
        port = free.getsockname()[1]
    served = command(SCENE, "--mqtt", f"mqtt://127.0.0.1:{port}")
    served.process.wait(timeout=PATIENCE)
    expected = f"Error: mqtt://127.0.0.1:{port}: can't be reached (Connection refused), expected an MQTT broker"
    (line,) = served.told.splitlines()
    assert line.startswith(expected) and served.process.returncode == 1
    assert {path.name for path in tmp_path.iterdir()} == {"log"}
