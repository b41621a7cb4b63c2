# SPDX-License-Identifier: Apache-2.0
"""A line as the client of a PLC: in lockstep in a test, with the bits of the same program inside; and free-running."""

from __future__ import annotations

import re
import signal
import time
from collections.abc import Callable, Iterator, Mapping
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner
from facts import missing, stating
from protocols.waiting import alone
from testing.conftest import LINE
from testing.plc_servers import ALARM, KINDS, OWN, program, write_map
from testing.soft_plc import BOTTLES, SETPOINT
from warm import Warm

from conveyor_sim.bag.reader import open_bag
from conveyor_sim.bag.replay import replay
from conveyor_sim.cli import main
from conveyor_sim.control.scan import ControlError, Inputs
from conveyor_sim.protocols.attach.access import ANONYMOUS, PlcAccess, Security
from conveyor_sim.protocols.attach.free_running import FreeRunningPlc
from conveyor_sim.protocols.attach.links import plc_link
from conveyor_sim.protocols.attach.plc_link import PlcLinkError, PlcRefusedError
from conveyor_sim.protocols.attach.tag_map import TagMapError, read_tag_map
from conveyor_sim.protocols.hosting.server_thread import ServerThread
from conveyor_sim.protocols.server.certificates import identity, trust_plc
from conveyor_sim.testing.scenario import Scenario

SECONDS = 4.0


class Twin:
    """Controller in this process with the same program."""

    def scan(self, inputs: Inputs) -> Mapping[str, float]:
        answer, full = program(inputs[BOTTLES])
        return {SETPOINT: answer, ALARM: float(full)}


class Plc:
    """One that listens, with its map."""

    def __init__(self, kind: str, folder: Path) -> None:
        self.thread = ServerThread()
        self.made: Any = KINDS[kind]()
        self.places = KINDS[kind].places()
        self.url = self.thread.run(self.made.start(0))
        self.tags = write_map(folder / "tags.csv", self.places)

    def start_again(self) -> None:
        """Start it again at the same address, after `made.stop`."""
        self.thread.run(self.made.start(int(self.url.rpartition(":")[2])))
        self.thread.run(self.made.scan())

    def close(self) -> None:
        self.thread.run(self.made.stop())
        self.thread.close()


@pytest.fixture(scope="module")
def plcs(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Callable[[str], Plc]]:
    """One of each kind, which listens from when it is first asked for."""
    made: dict[str, Plc] = {}

    def of(kind: str) -> Plc:
        library = {"modbus": "pymodbus", "opcua": "asyncua"}[kind]
        pytest.importorskip(library, reason=f"{library} is not installed: pip install conveyor-sim[scada]")
        if kind not in made:
            made[kind] = Plc(kind, tmp_path_factory.mktemp(kind))
        return made[kind]

    yield of
    for plc in made.values():
        plc.close()


@pytest.fixture(params=["modbus", "opcua"])
def plc(request: pytest.FixtureRequest, plcs: Callable[[str], Plc]) -> Iterator[Plc]:
    """Start a PLC that scans, without any written value."""
    plc = plcs(request.param)
    plc.thread.run(plc.made.scan())
    yield plc
    plc.thread.run(plc.made.halt())


def test_a_served_plc_gives_the_bits_of_its_program(plc: Plc, filled: Path, tmp_path: Path) -> None:
    with Scenario(LINE, start=filled) as inside, Scenario(LINE, start=filled, bag=tmp_path / "bag") as outside:
        first = outside.simulation.tick
        inside.attach(Twin())
        outside.attach_plc(plc.url, plc.tags)
        for plant in (inside, outside):
            plant.run_for(SECONDS)
        assert outside.simulation.state_hash() == inside.simulation.state_hash()
        for name in (BOTTLES, SETPOINT, ALARM):
            assert np.array_equal(outside.history[name], inside.history[name])
        assert np.ptp(outside.history[SETPOINT]) > 0.0 and np.ptp(outside.history[ALARM]) > 0.0
        assert outside.signals[OWN] == outside.simulation.tick + 1
        assert plc.made.scans == SECONDS / inside.scene.tick + 1
    assert replay(tmp_path / "bag").difference is None
    with open_bag(tmp_path / "bag") as bag:
        told = [(tuple(frame.data.name), *frame.data.value) for frame in bag.read("variables")]
    assert told == [((OWN,), first + i + 1) for i in range(len(told))] and len(told) == plc.made.scans


def test_a_plc_that_goes_away_fails_the_test(plc: Plc) -> None:
    with Scenario(LINE) as plant:
        plant.attach_plc(plc.url, plc.tags)
        plant.run_for(0.1)
        plc.thread.run(plc.made.stop())
        try:
            with pytest.raises(ControlError, match=rf"at 0\.1\d? s no PLC: {plc.url}"):
                plant.run_for(0.1)
        finally:
            plc.start_again()


def test_a_plc_that_does_not_scan_is_waited_for_so_long(plc: Plc) -> None:
    plc.thread.run(plc.made.halt())
    with Scenario(LINE) as plant, pytest.raises(ControlError, match=stating("no run/target_tick", "after 0", "1 s")):
        plant.attach_plc(plc.url, plc.tags, patience=1.0)


def test_a_plc_that_is_not_there_is_said(plc: Plc) -> None:
    url = f"{plc.url.rpartition(':')[0]}:1"
    with Scenario(LINE) as plant, pytest.raises(PlcLinkError, match=f"^{url}: "):
        plant.attach_plc(url, plc.tags)


def test_the_command_attach_records_what_a_plc_commands(plc: Plc, tmp_path: Path) -> None:
    """In real time; what it did there is on record."""
    command = ["-c", "from conveyor_sim.cli import main; main()", "attach", LINE, plc.url]
    # It ends by the interrupt: a run that has come to its end shows the PLC no new tick, however few it has seen.
    command += ["--tags", str(plc.tags), "--real-time-factor", "10", "--duration", "90", "--out", str(tmp_path / "bag")]
    files = [(tmp_path / name).open("w") for name in ("out", "told")]
    process = Warm(command, *files)
    try:
        end = time.monotonic() + 120.0
        while plc.made.scans < 20 and process.poll() is None and time.monotonic() < end:
            time.sleep(0.05)
        scans = plc.made.scans
        process.send_signal(signal.SIGINT)
        process.wait(timeout=120.0)
    finally:
        process.kill()
    out, told = (Path(file.name).read_text() for file in files)
    assert process.returncode == 0 and scans >= 20 and f"{plc.url} commands the line" in told, f"{scans} scans: {told}"
    assert re.search(r"served up to .* s; plc \d+ written, 0 refused; recorded to", out)
    assert replay(tmp_path / "bag").difference is None
    with open_bag(tmp_path / "bag") as bag:
        assert any(SETPOINT in frame.data.names for frame in bag.outcomes())
        assert any(tuple(frame.data.name) == (OWN,) and frame.data.value[0] > 1 for frame in bag.read("variables"))


def test_attach_says_that_there_is_no_plc(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    pytest.importorskip("pymodbus", reason="pymodbus is not installed: pip install conveyor-sim[scada]")
    tags = write_map(tmp_path / "tags.csv", {SETPOINT: "holding register 0 float32"})
    asked = ["attach", LINE, "modbus://127.0.0.1:1", "--tags", str(tags), "--no-record"]
    refused = CliRunner().invoke(main, asked)
    assert refused.exit_code == 1
    assert missing(refused.output, ["modbus://127.0.0.1:1", "can't be reached", "Modbus server", "PLC"]) == []
    assert not [record for record in caplog.records if record.name.startswith("pymodbus")]


@pytest.mark.parametrize(
    ("lines", "said"),
    [
        ("", "line 1: nothing given, expected tag,theirs"),
        ("ours,theirs\n", "line 1: ours,theirs given, expected tag,theirs"),
        ("tag;theirs\n", "line 1: tag;theirs given, expected tag,theirs separated by commas"),
        ("tag,theirs\n", "has no tag, expected one or more"),
        ("tag,theirs\nbelts/zone9/speed,x\n", "line 2: belts/zone9/speed given, expected a signal or command"),
        ("tag,theirs\nbelts/zone1/trip,x\n", "line 2: belts/zone1/trip given, expected a signal or command"),
        ("tag,theirs\nalarms/,x\n", "line 2: alarms/ given, expected a signal or command"),
        ("tag,theirs\nalarms/a,x\nalarms/a,y\n", "line 3: alarms/a given twice"),
        ("tag,theirs\nalarms/a\n", "line 2: alarms/a given, expected a tag and its place in the PLC"),
        ('tag,theirs\nplc/a,"x\n', "line 2: unexpected end of data, expected a CSV file"),
        ('tag,theirs\nplc/a,"x\ny"\nzone,z\n', "line 4: zone given, expected a signal or command"),
        ("tag,theirs\nrun/tick,x\nrun/target_tick, x\n", "line 3:  x given, expected a place that run/tick does not"),
        ("tag,theirs\nalarms/a,coil 0 bool\n", "run/tick or run/target_tick is missing"),
    ],
)
def test_a_map_that_can_t_be_is_refused(tmp_path: Path, lines: str, said: str) -> None:
    path = tmp_path / "tags.csv"
    path.write_text(lines)
    with Scenario(LINE) as plant, pytest.raises(TagMapError) as refused:
        plant.attach_plc("modbus://127.0.0.1:1", path)
    assert str(refused.value).startswith(f"{path}: {said}")


def test_a_map_has_lines_of_any_end_spaces_and_as_many_rows_as_fit(tmp_path: Path) -> None:
    path, many = tmp_path / "tags.csv", 50_000
    rows = "".join(f"plc/{n},x{n}\r\n" for n in range(many))
    path.write_text(f"\ufefftag,theirs\r\nalarms/a ,x\r\nalarms/b,x\r\n{rows}", newline="")
    tags = read_tag_map(path, ())
    assert [each.tag.name for each in tags.read] == ["alarms/a", "alarms/b"] and len(tags.own) == many


@pytest.mark.parametrize(
    ("theirs", "said"),
    [
        ("register 3 bool", "register 3 bool given, expected such as"),
        ("coil 3", "coil 3 given, expected such as"),
        ("coil 3 float32", "float32 given in a coil, expected such as"),
        ("holding register 65536 uint16", "address 65536 given, expected 0 to 65535"),
        ("holding register 1 float32 middle", "middle given, expected such as"),
    ],
)
def test_a_place_in_modbus_that_can_t_be_is_refused(tmp_path: Path, theirs: str, said: str) -> None:
    pytest.importorskip("pymodbus", reason="pymodbus is not installed: pip install conveyor-sim[scada]")
    tags = write_map(tmp_path / "tags.csv", {SETPOINT: theirs})
    with Scenario(LINE) as plant:
        mapped = read_tag_map(tags, plant.simulation.process_image.tags)
    with pytest.raises(TagMapError) as refused:
        plc_link("modbus://127.0.0.1:1", mapped.all)
    assert str(refused.value).startswith(f"{tags}: line 2: ") and said in str(refused.value)


def test_a_signal_is_not_written_where_nothing_can_be(tmp_path: Path) -> None:
    """Else it would go to the holding register of the same address."""
    pytest.importorskip("pymodbus", reason="pymodbus is not installed: pip install conveyor-sim[scada]")
    tags = write_map(tmp_path / "tags.csv", {BOTTLES: "input register 2 uint16"})
    with (
        Scenario(LINE) as plant,
        pytest.raises(TagMapError, match=stating("line 2", BOTTLES, "written", "input registers")),
    ):
        plc_link("modbus://127.0.0.1:1", read_tag_map(tags, plant.simulation.process_image.tags).all)


def test_a_place_that_the_plc_lacks_is_said_at_once(plcs: Callable[[str], Plc], tmp_path: Path) -> None:
    plc = plcs("modbus")
    tags = write_map(tmp_path / "tags.csv", plc.places | {SETPOINT: "holding register 900 float32"})
    with (
        Scenario(LINE) as plant,
        pytest.raises(PlcLinkError, match=stating("holding register 900", "refused", "exception 2")),
    ):
        plant.attach_plc(plc.url, tags)


@pytest.mark.parametrize(
    "url",
    [
        "http://127.0.0.1:1",
        "127.0.0.1",
        "opc.tcp://",
        "modbus://[",
        "modbus://a:b",
        "opc.tcp://a:0",
        "modbus://a..b",
        "modbus://a\0b",
        "opc.tcp://\ud800:1",
        f"modbus://{'a' * 64}",
    ],
)
def test_a_url_that_can_t_be_is_refused(url: str) -> None:
    with pytest.raises(PlcLinkError, match=stating("opc.tcp://host:port", "modbus://host:port")):
        plc_link(url, ())


@pytest.mark.parametrize("url", ["modbus://127.0.0.1/3", "modbus://127.0.0.1?unit=3"])
def test_a_part_of_a_url_without_effect_is_refused(url: str) -> None:
    with pytest.raises(PlcLinkError, match=stating(url, "expected modbus://host:port")):
        plc_link(url, ())


@pytest.mark.parametrize(
    "url", ["opc.tcp://jo:secret@127.0.0.1:1", "http://jo:secret@127.0.0.1", "jo:secret@127.0.0.1"]
)
def test_a_url_with_a_password_is_refused_and_not_printed(url: str) -> None:
    with pytest.raises(PlcLinkError, match=stating("127.0.0.1", "user in the URL", "--user")) as refused:
        plc_link(url, ())
    assert "secret" not in str(refused.value)


@pytest.mark.parametrize("options", [["--browse"], ["--trust", "0" * 64]])
def test_options_without_a_scene_do_not_print_a_password_either(options: list[str]) -> None:
    answer = CliRunner().invoke(main, ["attach", "opc.tcp://jo:secret@127.0.0.1:1", *options])
    assert answer.exit_code == 1 and "user in the URL" in answer.output and "secret" not in answer.output


def test_a_variable_that_the_plc_lacks_is_named(plcs: Callable[[str], Plc], tmp_path: Path) -> None:
    plc = plcs("opcua")
    tags = write_map(tmp_path / "tags.csv", plc.places | {ALARM: "ns=2;s=GVL.lost"})
    with Scenario(LINE) as plant, pytest.raises(TagMapError, match=r"line 4: ns=2;s=GVL\.lost"):
        plant.attach_plc(plc.url, tags)


def test_a_plc_that_has_lost_its_security_is_refused(plcs: Callable[[str], Plc], tmp_path: Path) -> None:
    """Its certificate was trusted, so a server without one at its address may be another."""
    plc = plcs("opcua")
    access = PlcAccess(certificates=tmp_path / "own")
    trust_plc(tmp_path / "own", plc.url.removeprefix("opc.tcp://"), identity(tmp_path / "own").certificate)
    with Scenario(LINE) as plant:
        mapped = read_tag_map(plc.tags, plant.simulation.process_image.tags).all

    async def come(security: Security) -> None:
        link = plc_link(plc.url, mapped, access._replace(security=security))
        try:
            await link.connect()
        finally:
            await link.close()

    with pytest.raises(PlcRefusedError, match=stating(plc.url, "certificate is trusted", "--security none")):
        alone(come("best"))
    alone(come("none"))


class FreeRunning:
    """A line that a PLC commands without waiting for it, run by a test."""

    def __init__(self, plant: Scenario, plc: Any, thread: ServerThread, access: PlcAccess = ANONYMOUS) -> None:
        """plc: has a URL and a map of tags."""
        self.plant, self.plc, self._thread = plant, plc, thread
        self.said: list[str] = []
        self.connected: list[str] = []
        """Descriptions of the connections."""
        self.observed: list[Mapping[str, float]] = []
        self.source = plant.source()
        tags = read_tag_map(plc.tags, self.source.info.tags)
        way = partial(plc_link, plc.url, tags.all, access, self.connected.append)
        self.face = FreeRunningPlc(self.source, plc.url, tags, way, 0.005, self.said.append, self.observed.append)
        thread.run(self.face.start())

    def until(self, done: Callable[[], object]) -> None:
        end = time.monotonic() + 60.0
        while not done():
            assert time.monotonic() < end, self.said
            self.plant.run_for(0.05)
            time.sleep(0.01)

    def stop(self) -> None:
        self._thread.run(self.face.stop())


@pytest.fixture
def free(plc: Plc) -> Iterator[FreeRunning]:
    with Scenario(LINE) as plant, ServerThread() as thread:
        free = FreeRunning(plant, plc, thread)
        yield free
        free.stop()


def test_a_free_running_plc_commands_a_line_and_is_reached_again(free: FreeRunning) -> None:
    """In real time there are no bits to compare: inputs arrive, outputs act, and its loss is reported."""
    plant, plc, face, said = free.plant, free.plc, free.face, free.said
    free.until(lambda: plant.signals[BOTTLES] > 2)
    free.until(lambda: plant.simulation.line.read_back.values[0] == 0.0 and ALARM in plant.signals)
    assert plant.simulation.line.read_back.writers[0] == (f"plc {plc.url}", "controller")
    status = face.status()
    assert status.clients == 1 and status.writes > 0 and status.refused == 0 and 0.0 < status.latency < 60.0
    assert 0.0 < free.observed[-1][OWN] <= plant.simulation.tick + 1
    plc.thread.run(plc.made.stop())
    free.until(lambda: said and face.status().clients == 0)
    assert said[0].endswith("it commands nothing until it is connected again")
    plc.start_again()
    free.until(lambda: face.status().clients == 1 and face.status().writes > status.writes)
    assert said[-1] == f"{plc.url}: connected again"


@pytest.mark.parametrize("plc", ["opcua"], indirect=True)
def test_what_the_plc_calls_bad_is_no_command(free: FreeRunning) -> None:
    """Nor does it end the run: the PLC is looked at again until it stands by its value."""
    from asyncua import ua

    made, face = free.plc.made, free.face

    def set_speed(value: float, code: int) -> None:
        given = ua.DataValue(ua.Variant(value, ua.VariantType.Float), ua.StatusCode(code))
        free.plc.thread.run(made._nodes["speed"].write_value(given))

    free.until(lambda: face.status().writes > 0)
    free.plc.thread.run(made.halt())
    set_speed(0.25, ua.StatusCodes.BadSensorFailure)
    free.until(lambda: len(free.said) > 1)
    assert face.status().clients == 0
    first, second = free.said
    facts = ["GVL.speed", "BadSensorFailure", "commands nothing", "again"]
    assert missing(first, [*facts, SETPOINT]) == []
    assert missing(second, [*facts, "number", "bool"]) == []
    assert free.plant.signals["belts/zone1/speed"] != 0.25
    set_speed(0.25, ua.StatusCodes.Good)
    free.until(lambda: free.plant.signals["belts/zone1/speed"] == 0.25)
    assert free.said[-1] == f"{free.plc.url}: connected again"


@pytest.mark.parametrize("plc", ["opcua"], indirect=True)
def test_a_float_at_a_limit_is_the_limit(plc: Plc) -> None:
    """A REAL of 0.6 is 0.60000002384 on its way; a Double of as much is beyond the limit."""
    limits = {"conveyors": {"zone1": {"speed_limits": [0.0, 0.6]}}}
    plc.thread.run(plc.made.halt())
    with Scenario(LINE, overrides=limits) as plant, ServerThread() as thread:
        free = FreeRunning(plant, plc, thread)
        plc.thread.run(plc.made._write("speed", 0.6, "Float"))
        place = plant.simulation.process_image.command_names.index(SETPOINT)
        free.until(lambda: plant.simulation.line.read_back.values[place] == 0.6)
        assert free.face.status().refused == 0
        plc.thread.run(plc.made._write("speed", 0.6000001, "Float"))
        free.until(lambda: free.face.status().refused == 1)
        free.stop()


@pytest.mark.parametrize("plc", ["opcua"], indirect=True)
def test_a_command_out_of_range_is_refused_once_and_alone(free: FreeRunning) -> None:
    made = free.plc.made

    def set_value(name: str, value: float | bool, kind: str) -> None:
        free.plc.thread.run(made._write(name, value, kind))

    def refused() -> list[str]:
        return [event.name for event in free.source.events(0)[1] if event.kind == "command_refused"]

    free.until(lambda: free.face.status().writes > 0)
    free.plc.thread.run(made.halt())
    set_value("full", False, "Boolean")
    free.until(lambda: free.plant.signals.get(ALARM) == 0.0)
    set_value("speed", 9.0, "Float")
    free.until(refused)
    set_value("full", True, "Boolean")
    free.until(lambda: free.plant.signals[ALARM] == 1.0)
    seen = len(free.observed)
    free.until(lambda: len(free.observed) > seen + 20)
    assert refused() == [SETPOINT] and free.face.status().refused == 1
    set_value("speed", 0.25, "Float")
    free.until(lambda: free.plant.signals["belts/zone1/speed"] == 0.25)


def test_an_empty_file_is_no_password(tmp_path: Path) -> None:
    file = tmp_path / "password.txt"
    file.write_text("\n")
    options = ["--user", "a", "--password-file", str(file), "--browse"]
    answer = CliRunner().invoke(main, ["attach", "opc.tcp://127.0.0.1:1", *options])
    assert answer.exit_code == 1 and missing(answer.output, str(file), "line 1", "empty", "password") == []
