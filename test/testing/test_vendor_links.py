# SPDX-License-Identifier: Apache-2.0
"""Links by the protocols of PLC vendors: in lockstep with the bits of the same program inside, and free-running."""

from __future__ import annotations

import asyncio
import random
import threading
import time
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from facts import missing, stating
from testing.conftest import LINE
from testing.faults import RIGHT_VALUES, WRONG_VALUES
from testing.faulty_proxy import FaultyProxy, healthy
from testing.plc_servers import ALARM, OWN, write_map
from testing.soft_plc import BOTTLES, SETPOINT
from testing.vendor_servers import FILL, VENDORS, VendorPlc, program

from conveyor_sim.bag.replay import replay
from conveyor_sim.control.scan import ControlError, Inputs
from conveyor_sim.line.tag import count as tag_count
from conveyor_sim.protocols.attach import isolated_link
from conveyor_sim.protocols.attach.free_running import FreeRunningPlc
from conveyor_sim.protocols.attach.links import plc_link
from conveyor_sim.protocols.attach.plc_link import PlcLinkError, write_signals
from conveyor_sim.protocols.attach.tag_map import MappedTag, TagMapError, read_tag_map
from conveyor_sim.protocols.hosting.server_thread import ServerThread
from conveyor_sim.protocols.tags.handshake import TARGET, TICK
from conveyor_sim.support.rounded_limit import single
from conveyor_sim.testing.scenario import Scenario

SECONDS = 0.5
"""Simulated time of a comparison. A request to cpppo takes several milliseconds."""


class Twin:
    """Controller in this process with the same program, whose commands have the type of the map."""

    def __init__(self, real: str) -> None:
        self._rounded = single if real == "REAL" else float

    def scan(self, inputs: Inputs) -> Mapping[str, float]:
        answer, full = program(inputs[BOTTLES])
        return {SETPOINT: self._rounded(answer), ALARM: float(full)}


class Plc:
    """A PLC that listens, with its map."""

    def __init__(self, made: VendorPlc, folder: Path) -> None:
        self.thread, self.made = ServerThread(), made
        self.url = self.thread.run(made.start(0))
        self.tags = write_map(folder / "tags.csv", made.places())

    @property
    def port(self) -> int:
        return int(self.url.rpartition(":")[2])

    def begin(self) -> None:
        self.thread.run(self.made.halt())
        self.thread.run(self.made.scan())

    def start_again(self) -> None:
        """Start it again at the same address, after `made.stop`."""
        self.thread.run(self.made.start(self.port))
        self.begin()

    def close(self) -> None:
        self.thread.run(self.made.stop())
        self.thread.close()


Start = Callable[..., Plc]


@pytest.fixture(scope="module")
def start(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Start]:
    """A function that returns the PLC of a kind, which is started once."""
    plcs: dict[tuple[str, str], Plc] = {}

    def of(kind: str, real: str = "REAL") -> Plc:
        library, extra = VENDORS[kind].library, VENDORS[kind].extra
        pytest.importorskip(library, reason=f"{library} is not installed: pip install conveyor-sim[{extra}]")
        if (kind, real) not in plcs:
            plcs[kind, real] = Plc(VENDORS[kind](real), tmp_path_factory.mktemp(kind))
        plcs[kind, real].begin()
        return plcs[kind, real]

    yield of
    for plc in plcs.values():
        plc.close()


@pytest.fixture(params=[*VENDORS])
def plc(request: pytest.FixtureRequest, start: Start) -> Iterator[Plc]:
    plc = start(request.param)
    yield plc
    plc.thread.run(plc.made.halt())


@pytest.fixture(scope="module")
def loaded(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A checkpoint of LINE shortly before the program stops the first zone."""
    path = tmp_path_factory.mktemp("loaded") / "start.npz"
    with Scenario(LINE) as line:
        line.run_for(5.6)
        line.simulation.save(path)
    return path


@pytest.mark.parametrize("real", ["REAL", "LREAL"])
@pytest.mark.parametrize("kind", [*VENDORS])
def test_a_vendor_link_gives_the_bits_of_its_program(
    kind: str, real: str, start: Start, loaded: Path, tmp_path: Path
) -> None:
    plc = start(kind, real)
    bag = tmp_path / "bag"
    with Scenario(LINE, start=loaded) as inside, Scenario(LINE, start=loaded, bag=bag) as outside:
        inside.attach(Twin(real))
        outside.attach_plc(plc.url, plc.tags)
        for plant in (inside, outside):
            plant.run_for(SECONDS)
        assert outside.simulation.state_hash() == inside.simulation.state_hash()
        for name in (BOTTLES, SETPOINT, ALARM):
            assert np.array_equal(outside.history[name], inside.history[name])
        assert np.ptp(outside.history[SETPOINT]) > 0.0 and np.ptp(outside.history[ALARM]) > 0.0
        assert outside.signals[OWN] == outside.simulation.tick + 1
        assert plc.made.scans == round(SECONDS / inside.scene.tick) + 1
    plc.thread.run(plc.made.halt())
    assert replay(bag).difference is None


def test_a_rounded_command_has_other_bits_than_an_exact_one(loaded: Path) -> None:
    """Otherwise the comparison above would not tell REAL from LREAL."""
    hashes = set()
    for real in ("REAL", "LREAL"):
        with Scenario(LINE, start=loaded) as plant:
            plant.attach(Twin(real))
            plant.run_for(SECONDS)
            hashes.add(plant.simulation.state_hash())
    assert len(hashes) == 2


def test_a_plc_that_goes_away_fails_the_test(plc: Plc) -> None:
    with Scenario(LINE) as plant:
        plant.attach_plc(plc.url, plc.tags)
        plant.run_for(0.05)
        plc.thread.run(plc.made.stop())
        try:
            with pytest.raises(ControlError, match=rf"at 0\.0\d? s no PLC: {plc.url.partition('?')[0]}"):
                plant.run_for(0.1)
        finally:
            plc.start_again()


def test_a_plc_that_is_not_there_is_said(plc: Plc) -> None:
    url = plc.url.replace(f":{plc.port}", ":1")
    with Scenario(LINE) as plant, pytest.raises(PlcLinkError, match=f"^{url.partition('?')[0]}"):
        plant.attach_plc(url, plc.tags)


HALF = FILL // 2
"""Numbers of written and of read values of a map of more tags than one request holds."""
TICKS = {"s7": 30, "eip": 2, "ads": 30}


async def _scan_all(made: VendorPlc, count: int, over: threading.Event) -> list[set[float]]:
    """Run a program that copies all written values; return those that it saw in each scan."""
    seen: list[set[float]] = []
    for tick in range(count):
        while await made.get("tick") != tick:
            if over.is_set():
                return seen
            await asyncio.sleep(0)
        values = await made.get_all([f"fill{number}" for number in range(HALF)])
        seen.append(set(values))
        await made.put({f"fill{HALF + number}": value + 0.5 for number, value in enumerate(values)})
        await made.put({"target": tick + 1})
    return seen


def test_a_map_of_several_requests_is_written_before_the_tick_and_read_after_the_target(
    plc: Plc, request: pytest.FixtureRequest
) -> None:
    made, count = plc.made, TICKS[request.node.callspec.params["plc"]]
    plc.thread.run(made.halt())
    names = {f"plc/{number}": f"fill{number}" for number in range(FILL)} | {TICK: "tick", TARGET: "target"}
    mapped = [MappedTag(tag_count(ours, "status", ""), made.place(theirs), "") for ours, theirs in names.items()]
    link = plc_link(plc.url, mapped)
    with ServerThread() as thread, ThreadPoolExecutor(1) as pool:
        over = threading.Event()
        thread.run(link.connect())
        task = pool.submit(plc.thread.run, _scan_all(made, count, over))
        try:
            for tick in range(count):
                thread.run(write_signals(link, {f"plc/{number}": float(tick) for number in range(HALF)}, tick))
                while thread.run(link.read([TARGET]))[TARGET] <= tick:
                    pass
                answer = thread.run(link.read([f"plc/{HALF + number}" for number in range(HALF)]))
                assert set(answer.values()) == {tick + 0.5}
        finally:
            over.set()
        thread.run(link.close())
        assert task.result() == [{float(tick)} for tick in range(count)]


LACKING = {"s7": "DB7.DBD0 REAL", "eip": "Nothing", "ads": "GVL.nothing"}


def test_a_place_that_the_plc_lacks_is_said_at_once(plc: Plc, request: pytest.FixtureRequest, tmp_path: Path) -> None:
    theirs = LACKING[request.node.callspec.params["plc"]]
    tags = write_map(tmp_path / "tags.csv", plc.made.places() | {SETPOINT: theirs})
    with Scenario(LINE) as plant, pytest.raises(TagMapError) as refused:
        plant.attach_plc(plc.url, tags)
    assert str(refused.value).startswith(f"{tags}: line 3: {theirs} ({SETPOINT}): ")


def test_a_tick_that_would_overflow_is_refused(plc: Plc, tmp_path: Path) -> None:
    tags = write_map(tmp_path / "tags.csv", plc.made.places() | {"run/tick": plc.made.place("fill1")})
    with Scenario(LINE) as plant, pytest.raises(TagMapError, match=stating("line 5", "run/tick", "REAL", "DINT")):
        plant.attach_plc(plc.url, tags)


def test_a_target_of_an_earlier_test_is_no_answer(plc: Plc) -> None:
    """Otherwise the line would run up to it without the PLC."""
    plc.thread.run(plc.made.put({"target": 500}))
    with Scenario(LINE) as plant:
        plant.attach_plc(plc.url, plc.tags)
        plant.run_for(0.05)
        assert plc.made.scans == 6


def test_a_target_beyond_reach_fails_the_test(plc: Plc) -> None:
    """Otherwise the line would run on with its last commands until then."""
    with Scenario(LINE) as plant:
        plant.attach_plc(plc.url, plc.tags)
        plant.run_for(0.05)
        plc.thread.run(plc.made.halt())
        plc.thread.run(plc.made.put({"target": 2**30}))
        with pytest.raises(ControlError, match=stating("run/target_tick", "1.07374e+09")):
            plant.run_for(0.05)


class FreeRunning:
    """A line that a PLC commands without waiting for it."""

    def __init__(self, plant: Scenario, url: str, tags: Path, thread: ServerThread) -> None:
        self.plant, self._thread = plant, thread
        self.said: list[str] = []
        self.observed: list[Mapping[str, float]] = []
        self.source = plant.source()
        mapped = read_tag_map(tags, self.source.info.tags)
        link = partial(plc_link, url, mapped.all)
        self.server = FreeRunningPlc(self.source, url, mapped, link, 0.005, self.said.append, self.observed.append)
        thread.run(self.server.start())

    def until(self, done: Callable[[], object]) -> None:
        end = time.monotonic() + 120.0
        while not done():
            assert time.monotonic() < end, self.said
            self.plant.run_for(0.05)
            time.sleep(0.01)

    def stop(self) -> None:
        self._thread.run(self.server.stop())


def test_a_free_running_plc_commands_a_line_and_is_reached_again(plc: Plc) -> None:
    with Scenario(LINE) as plant, ServerThread() as thread:
        free = FreeRunning(plant, plc.url, plc.tags, thread)
        free.until(lambda: plant.signals[BOTTLES] > 2)
        free.until(lambda: plant.simulation.line.read_back.values[0] == 0.0 and ALARM in plant.signals)
        writes = free.server.status().writes
        assert writes > 0 and 0.0 < free.observed[-1][OWN] <= plant.simulation.tick + 1
        plc.thread.run(plc.made.stop())
        free.until(lambda: free.said and free.server.status().clients == 0)
        assert free.said[0].endswith("it commands nothing until it is connected again")
        plc.start_again()
        free.until(lambda: free.server.status().clients == 1 and free.server.status().writes > writes)
        assert free.said[-1] == f"{plc.url}: connected again"
        free.stop()


FAULTS = {"silent": RIGHT_VALUES["silent"], "garbage": WRONG_VALUES["garbage"]}


@pytest.mark.parametrize("fault", [*FAULTS])
def test_a_free_running_line_survives_a_faulty_plc(plc: Plc, fault: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """It reports the fault in one sentence, gives no command until it has reached the PLC again, and runs on."""
    proxy = FaultyProxy(plc.port)
    with Scenario(LINE) as plant, ServerThread() as thread:
        free = FreeRunning(plant, plc.url.replace(f":{plc.port}", f":{proxy.port}"), plc.tags, thread)
        free.until(lambda: free.server.status().writes > 0)
        monkeypatch.setattr(isolated_link, "LIMIT", 2.0)
        proxy.fault = partial(FAULTS[fault], random.Random(0))
        free.until(lambda: free.said)
        assert free.said[0].endswith("it commands nothing until it is connected again")
        assert "Traceback" not in free.said[0]
        monkeypatch.undo()
        speed, lost = plant.simulation.line.read_back.values[0], plant.simulation.tick
        free.until(lambda: plant.simulation.tick > lost + 50)
        assert plant.simulation.line.read_back.values[0] == speed
        proxy.fault = healthy
        proxy.cut()
        free.until(lambda: free.said[-1].endswith(": connected again"))
        free.until(lambda: free.server.status().clients == 1)
        free.stop()
    proxy.close()


@pytest.mark.parametrize(
    ("url", "theirs", "said"),
    [
        ("s7://127.0.0.1:1", "DB1.DBX0 BOOL", "BOOL is a bit"),
        ("s7://127.0.0.1:1", "DB1.DBX0.8 BOOL", "expected such as"),
        ("s7://127.0.0.1:1", "DB1.DBX0.1 INT", "INT begins with bit 0"),
        ("s7://127.0.0.1:1", "DB1.DBW0 REAL", "REAL has 4 bytes"),
        ("s7://127.0.0.1:1", "DB1.DBD65533 REAL", "last byte is above 65535"),
        ("s7://127.0.0.1:1", "DB0.DBD0 REAL", "data block is 1 to"),
        ("s7://127.0.0.1:1", "DB1.DBD0", "expected such as"),
        ("s7://127.0.0.1:1", "DB1.DBD0 STRING", "expected such as"),
        ("s7://127.0.0.1:1", "M4 REAL", "neither a width nor a bit"),
        ("eip://127.0.0.1:1", "1Speed", "expected a tag such as"),
        ("eip://127.0.0.1:1", "Speed[1][2]x", "expected a tag such as"),
        ("ads://1.2.3.4.1.1", "GVL.Größe", "expected a symbol such as"),
    ],
)
def test_an_invalid_place_is_refused(tmp_path: Path, url: str, theirs: str, said: str) -> None:
    tags = write_map(tmp_path / "tags.csv", {SETPOINT: theirs})
    with Scenario(LINE) as plant:
        mapped = read_tag_map(tags, plant.simulation.process_image.tags)
    with pytest.raises(TagMapError) as refused:
        plc_link(url, mapped.all)
    assert missing(str(refused.value), [f"{tags}: line 2: {theirs} given", said]) == []


@pytest.mark.parametrize(
    "url",
    [
        "s7://",
        "s7://a/8/1",
        "s7://a/0/1/2",
        "s7://a/x/1",
        "s7://a:99999",
        "eip://a/b",
        "eip://a/1/2",
        "ads://1.2.3",
        "ads://1.2.3.4.5.256",
        "ads://1.2.3.4.1.1?port=3",
        "ads://1.2.3.4.1.1?local=1.2",
    ],
)
def test_an_invalid_url_is_refused(url: str) -> None:
    with pytest.raises(PlcLinkError) as refused:
        plc_link(url, ())
    assert str(refused.value).startswith(f"{url} given, expected ")
    assert f"{url.partition(':')[0]}://host" in str(refused.value) or "ads://net-id" in str(refused.value)


def test_two_signals_in_one_place_are_refused(tmp_path: Path) -> None:
    places = {BOTTLES: "DB1.DBD0 DINT", "belts/zone1/bottles": "DB1.DBB3 USINT"}
    tags = write_map(tmp_path / "tags.csv", places)
    with Scenario(LINE) as plant:
        mapped = read_tag_map(tags, plant.simulation.process_image.tags)
    with pytest.raises(TagMapError, match=stating("line 3", "DB1.DBB3 USINT", BOTTLES)):
        plc_link("s7://127.0.0.1:1", mapped.all)
