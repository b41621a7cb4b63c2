# SPDX-License-Identifier: Apache-2.0
"""The page on a recording that a server reads by its index: what is read and refused, and that the same is drawn."""

from __future__ import annotations

import json
import socket
import struct
import threading
import time
import zlib
from collections.abc import Iterator
from contextlib import ExitStack
from http.client import HTTPConnection
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

import numpy as np
import pytest
from page.line import LINE, record
from page.pixels import TYPE_COLOURS, canvas, disc, settled, to_pixels
from page.test_page import clock
from protocols.waiting import until

from conveyor_sim.bag import own_reader
from conveyor_sim.bag.mcap import chunk
from conveyor_sim.bag.mcap.chunk import next_chunk
from conveyor_sim.bag.messages.encode import Header
from conveyor_sim.bag.messages.topics import TOPICS
from conveyor_sim.bag.outputs import OutputWriter
from conveyor_sim.bag.reader import open_bag
from conveyor_sim.bag.recorder import Recorder
from conveyor_sim.columns.bottles import BottleColumns
from conveyor_sim.columns.events import Event, event_columns
from conveyor_sim.errors import BagError, ConveyorError
from conveyor_sim.page.http_host import MOST_CONNECTIONS, PageHandler
from conveyor_sim.page.one_file import write_page
from conveyor_sim.page.recording import PageRecording
from conveyor_sim.page.server import SERVED, RecordingServer
from conveyor_sim.scene import load_scene
from conveyor_sim.simulation import Simulation


@pytest.fixture
def server(bag: Path) -> Iterator[RecordingServer]:
    with RecordingServer(bag) as made:
        yield made


def get(server: RecordingServer, path: str, **headers: str) -> tuple[int, bytes, dict[str, str]]:
    """Status, content and headers of an answer."""
    connection = HTTPConnection(urlsplit(server.url).netloc, timeout=60)
    connection.request("GET", path, headers=headers)
    answer = connection.getresponse()
    found = answer.status, answer.read(), dict(answer.getheaders())
    connection.close()
    return found


def test_parts_of_a_recording_are_answered_by_name(server: RecordingServer, bag: Path) -> None:
    with open_bag(bag) as opened:
        recording = PageRecording(opened, SERVED)
        assert zlib.decompress(get(server, "/data/block/3")[1]) == recording.block(3)
        assert zlib.decompress(get(server, "/data/story/0")[1]) == recording.story(0)


@pytest.mark.parametrize(
    "path",
    [
        "/data/block/99",
        "/data/block/-1",
        f"/data/block/{'9' * 5000}",
        "/data/block/x",
        "/data/",
        "/../setup.py",
        "/x.py",
    ],
)
def test_what_there_is_not_is_not_found(server: RecordingServer, path: str) -> None:
    assert get(server, path)[0] == 404


def test_it_listens_on_this_machine_only_and_lets_in_no_other_page(server: RecordingServer) -> None:
    assert server.url.startswith("http://127.0.0.1:")
    status, content, headers = get(server, "/")
    assert status == 200 and b"<canvas" in content
    assert "default-src 'none'" in headers["Content-Security-Policy"]
    assert get(server, "/data/head", Host="evil.example")[0] == 403


@pytest.mark.parametrize("host", ["127.0.0.1", "127.0.0.1:80", "localhost", "LOCALHOST.", "[::1]"])
def test_a_browser_may_leave_out_the_default_port(server: RecordingServer, host: str) -> None:
    """Browsers do so when the server listens on port 80."""
    assert get(server, "/data/head", Host=host)[0] == 200
    assert get(server, "/data/head", Host=f"{host}.evil.example")[0] == 403


def test_two_names_at_once_are_none(server: RecordingServer) -> None:
    parts = urlsplit(server.url)
    with socket.create_connection(("127.0.0.1", parts.port or 0), timeout=60) as client:
        client.sendall(b"GET / HTTP/1.1\r\nHost: 127.0.0.1\r\nHost: evil.example\r\nConnection: close\r\n\r\n")
        assert client.recv(100).split()[1] == b"403"


def test_a_port_that_is_taken_is_said_in_one_sentence(server: RecordingServer, bag: Path) -> None:
    taken = urlsplit(server.url).port
    assert taken is not None
    with pytest.raises(ConveyorError, match=rf"^--port: {taken} given, expected one that is free"):
        RecordingServer(bag, taken)


def test_a_recording_that_is_not_there_is_refused(tmp_path: Path) -> None:
    with pytest.raises(BagError, match="no such bag"):
        RecordingServer(tmp_path / "bag")


def test_the_page_draws_what_the_one_file_draws(
    browser: Any, server: RecordingServer, bag: Path, tmp_path: Path
) -> None:
    html = write_page(bag, tmp_path / "page.html")
    pictures = []
    for url in (server.url, html.as_uri()):
        context = browser.new_context(viewport={"width": 1280, "height": 720})
        page = context.new_page()
        page.goto(url)
        page.wait_for_selector("body[data-told]", timeout=60_000)
        page.uncheck("#forces")  # shown twice as often where they are served
        page.click("#plan", position={"x": 20, "y": 20})
        for key in ("Home", "ArrowRight", "ArrowRight", "ArrowRight"):
            page.keyboard.press(key)
        settled(page)
        assert clock(page) == 3.0
        pictures.append(canvas(page))
        assert page.inner_text("#tab_alarms") == "Alarms"
        context.close()
    assert np.array_equal(*pictures)


def test_what_can_not_be_read_is_said_and_gone_over(browser: Any, tmp_path: Path) -> None:
    folder = record(tmp_path / "bag", 45.0)
    file = next(folder.glob("*.mcap"))
    content = bytearray(file.read_bytes())
    chunk = next_chunk(bytes(content), len(content) // 2, len(content))
    assert chunk is not None
    content[(chunk.content + chunk.stop) // 2] ^= 255
    file.write_bytes(content)
    asked: list[str] = []
    with RecordingServer(folder) as server:
        page = browser.new_page(viewport={"width": 1280, "height": 720})
        page.on("request", lambda request: asked.append(request.url))
        page.goto(server.url)
        page.wait_for_selector("body[data-told]", timeout=60_000)
        assert "can't be read as a bag" in page.inner_text("#notice")
        page.select_option("#speed", "30")
        page.focus("#plan")
        page.keyboard.press("Home")
        page.keyboard.press("k")
        until(lambda: page.inner_text("#clock") == "45.00 s" or page.wait_for_timeout(20), "the end, past the damage")
        assert int(page.get_attribute("body", "data-bottles")) > 0
        assert len(asked) == len(set(asked)), "each is asked for once"
        page.close()


def test_a_server_that_ends_is_waited_for(browser: Any, bag: Path) -> None:
    with RecordingServer(bag) as server:
        port = urlsplit(server.url).port
        page = browser.new_page(viewport={"width": 1280, "height": 720})
        page.goto(server.url)
        page.wait_for_selector("body[data-told]", timeout=60_000)
    assert port is not None
    page.focus("#plan")
    page.keyboard.press("End")
    page.wait_for_selector("body[data-link=broken]", timeout=60_000)
    said = "● No answer from the server: trying again"
    until(lambda: page.inner_text("#notice") == said or page.wait_for_timeout(20), "what is said of it")
    with RecordingServer(bag, port):
        page.wait_for_selector("body[data-link=served]", timeout=60_000)
        settled(page)
        assert page.inner_text("#notice") == "" and int(page.get_attribute("body", "data-bottles")) > 0
        page.close()


def written(folder: Path, seconds: float, bottles: int = 300, rejected: int = 0) -> Path:
    """A recording of many bottles in rows of 60, 0.1 m apart, at 50 Hz on the small line, not simulated. rejected: how
    many of the first are, at 0.1 s.
    """
    simulation = Simulation(load_scene(LINE))
    ids, zeros = np.arange(bottles, dtype=np.uint64), np.zeros(bottles)
    kinds, belts = np.zeros(bottles, np.uint16), np.zeros(bottles, np.int32)
    with Recorder(folder) as recorder:
        OutputWriter(simulation, [recorder], run_id="run").start()
        if rejected:
            events = event_columns(
                [Event(10, "bottle_rejected", "machines/x", one, 1.0, "") for one in range(rejected)], rejected
            )
            recorder.write("events", TOPICS["events"].pack(events, Header(10, 100_000_000, "world")), 100_000_000)
        for tick in range(2, round(100 * seconds) + 1, 2):
            x, y = 0.1 * (ids % 60) + 0.3 * np.sin(0.001 * tick), 0.1 * (ids // 60) + 0.2
            columns = BottleColumns(ids, kinds, x, y, zeros, zeros, zeros, zeros, belts, zeros, zeros)
            header = Header(tick, tick * 10_000_000, "world")
            recorder.write("bottles", TOPICS["bottles"].pack(columns, header), header.stamp_ns)
    return folder


@pytest.fixture(scope="module")
def minutes(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Four minutes of few bottles: 120 blocks."""
    return written(tmp_path_factory.mktemp("minutes") / "bag", 240.0, 20)


def test_who_seeks_wildly_sees_where_he_stops_before_where_he_went_by(browser: Any, minutes: Path) -> None:
    with RecordingServer(minutes) as server:
        page = browser.new_page(viewport={"width": 1280, "height": 720})
        page.goto(server.url)
        page.wait_for_selector("body[data-told]", timeout=60_000)
        page.click("#toggle_trends")  # which read, too
        settled(page)
        held: list[Any] = []
        is_held = True
        page.route("**/data/block/*", lambda route: held.append(route) if is_held else route.continue_())
        page.focus("#scrubber")
        for key in "2468":
            page.keyboard.press(key)
            page.evaluate("() => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))")
        until(lambda: len(held) >= 2 or page.wait_for_timeout(5), "two are asked for")
        assert len(held) == 2
        is_held = False
        with page.expect_request("**/data/block/*") as asked:
            for route in held:
                route.continue_()
        assert asked.value.url.endswith(f"/data/block/{round(0.8 * 240 / 2)}")
        settled(page)
        assert float(page.get_attribute("#plan", "data-frame")) == clock(page)
        page.close()


def test_a_page_that_stands_reads_nothing_however_long_its_trends_are(browser: Any, minutes: Path) -> None:
    with RecordingServer(minutes) as server:
        page = browser.new_page(viewport={"width": 1280, "height": 720})
        page.goto(server.url)
        page.wait_for_selector("body[data-told]", timeout=60_000)
        page.select_option("#trendbar select", "120")
        page.focus("#scrubber")
        page.keyboard.press("6")
        settled(page)
        asked: list[str] = []
        page.on("request", lambda request: asked.append(request.url))
        for _ in range(5):
            settled(page)
        assert asked == []
        page.close()


def test_thousands_of_bottles_are_drawn_where_they_are_too(browser: Any, tmp_path: Path) -> None:
    """From 2000 on, another way."""
    html = write_page(written(tmp_path / "bag", 0.2, 2100), tmp_path / "page.html")
    page = browser.new_page(viewport={"width": 1280, "height": 720})
    page.goto(html.as_uri())
    page.wait_for_selector("body[data-ready]", timeout=60_000)
    page.uncheck("#names")
    page.click("#plan", position={"x": 20, "y": 20})
    page.keyboard.press("End")
    settled(page)
    pixels = canvas(page)
    for row, column in ((5, 0), (12, 30), (15, 10)):
        x, y = to_pixels(page, 0.1 * column + 0.3 * np.sin(0.02), 0.1 * row + 0.2)
        found = disc(pixels, TYPE_COLOURS[0], x, y, 3.0)
        assert np.abs(found - [x, y]).max() <= 1.0
    page.close()


def test_bottles_that_are_rejected_are_crossed_out(browser: Any, tmp_path: Path) -> None:
    html = write_page(written(tmp_path / "bag", 0.2, 20, rejected=1), tmp_path / "page.html")
    page = browser.new_page(viewport={"width": 1280, "height": 720})
    page.goto(html.as_uri())
    page.wait_for_selector("body[data-ready]", timeout=60_000)
    page.uncheck("#names")
    page.select_option("#colour", "defect")
    page.focus("#plan")
    page.keyboard.press("End")
    settled(page)
    pixels, middles = canvas(page), []
    for bottle in range(2):
        x, y = (round(part) for part in to_pixels(page, 0.1 * bottle + 0.3 * np.sin(0.02), 0.2))
        middles.append(pixels[y - 1 : y + 2, x - 1 : x + 2].mean(axis=(0, 1)))
    assert middles[1] == pytest.approx([0, 114, 178], abs=10), "one that is not"
    assert middles[0].sum() < 0.75 * middles[1].sum(), "the cross is dark"
    assert "✕ rejected" in page.inner_text("#legend")
    page.close()


def test_only_the_chunks_of_a_moment_are_read_of_a_long_recording(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    read: set[int] = set()
    really_read = chunk.read_content

    def noted(data: Any, one: chunk.Chunk) -> bytes:
        read.add(one.start)
        return really_read(data, one)

    bag = written(tmp_path / "bag", 120.0)
    monkeypatch.setattr(chunk, "read_content", noted)
    with open_bag(bag, by_index=True) as opened:
        recording = PageRecording(opened, SERVED)
        recording.head()
        assert len(read) <= 2, "what is latched is at the beginning"
        before = len(read)
        recording.block(recording.blocks // 2)
        assert 1 <= len(read) - before <= 4
        list(opened.raw())
    assert len(read) > 20, "there were others to be read"


def test_the_first_frame_needs_as_much_of_a_long_recording_as_of_a_short_one(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The page asks for the head, the tick with the most bottles, and the blocks that it draws first."""
    read: list[int] = []
    really_read = chunk.read_content

    def noted(data: Any, one: chunk.Chunk) -> bytes:
        read.append(one.content_stop - one.content)
        return really_read(data, one)

    indexes: list[Path] = []
    really_open = own_reader.own_reader

    def noted_index(file: Path) -> Any:
        indexes.append(file)
        return really_open(file)

    monkeypatch.setattr(chunk, "read_content", noted)
    monkeypatch.setattr("conveyor_sim.bag.reader.own_reader", noted_index)
    chunks, content = [], []
    for seconds in (90.0, 900.0):
        bag = written(tmp_path / f"bag_{seconds:.0f}", seconds, 20)
        read.clear()
        indexes.clear()
        with RecordingServer(bag) as server:
            times = json.loads(zlib.decompress(server.answer("head")))["times"]
            fullest = json.loads(zlib.decompress(server.answer("fullest")))
            for number in (0, fullest // times["block"], fullest // times["block"] + 1):
                server.answer(f"block/{number}")
            assert len(indexes) == 1, "an index grows with the recording"
        assert times["last"] == 100 * seconds
        assert times["stories"] > 1, "the story is read later"
        chunks.append(len(read))
        content.append(sum(read))
    assert chunks[1] == pytest.approx(chunks[0], abs=3), "a block may begin within a chunk"
    assert content[1] == pytest.approx(content[0], rel=0.1)


def test_connections_that_ask_for_nothing_make_room(server: RecordingServer) -> None:
    address = urlsplit(server.url)
    with ExitStack() as stack:
        waiting = [
            stack.enter_context(socket.create_connection((address.hostname, address.port), timeout=60))
            for _ in range(MOST_CONNECTIONS + 5)
        ]
        assert get(server, "/")[0] == 200  # accepted behind them all
        for connection in waiting[:6]:
            assert connection.recv(1) == b"", "the oldest have ended"
        waiting[-1].setblocking(False)
        with pytest.raises(BlockingIOError):
            waiting[-1].recv(1)


def test_who_asks_for_nothing_is_not_waited_for_without_end(server: RecordingServer, monkeypatch: Any) -> None:
    monkeypatch.setattr(PageHandler, "timeout", 0.05)
    address = urlsplit(server.url)
    for asked in (b"", b"GET /data/hea"):
        with socket.create_connection((address.hostname, address.port), timeout=60) as waiting:
            waiting.sendall(asked)
            assert waiting.recv(1) == b""


def test_a_browser_that_leaves_while_it_is_answered_is_not_told_of(
    server: RecordingServer, capfd: pytest.CaptureFixture[str]
) -> None:
    address = urlsplit(server.url)
    for _ in range(20):
        with socket.create_connection((address.hostname, address.port), timeout=60) as leaving:
            leaving.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))  # closes by a reset
            leaving.sendall(b"GET /data/block/0 HTTP/1.1\r\nHost: 127.0.0.1:1\r\n")
    assert get(server, "/")[0] == 200  # accepted behind them all
    patience = time.monotonic() + 60
    while any("process_request_thread" in thread.name for thread in threading.enumerate()):
        assert time.monotonic() < patience, "a thread still serves a browser that left"
        time.sleep(0.01)
    assert "Traceback" not in capfd.readouterr().err
