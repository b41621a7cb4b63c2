# SPDX-License-Identifier: Apache-2.0
"""Connections to the page of a line that runs: lost ones, those of strangers, and more of all than there should be."""

from __future__ import annotations

import asyncio
import json
import os
import signal
import socket
import threading
from collections.abc import Callable, Coroutine, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import AsyncExitStack, ExitStack, contextmanager, suppress
from pathlib import Path
from typing import Any, TypeVar

import pytest
from facts import missing
from page.live_line import PASSWORD, SETPOINT, WEB, Live, clock, signed_in, soon
from protocols.waiting import PATIENCE

pytest.importorskip("aiohttp", reason="aiohttp is not installed: pip install conveyor-sim[scada]")

from aiohttp import ClientSession, WSCloseCode, WSMsgType, WSServerHandshakeError

from conveyor_sim.protocols.hosting.server_thread import ServerThread
from conveyor_sim.protocols.hosting.serving import Serving
from conveyor_sim.protocols.hosting.settings import ServerSettings
from conveyor_sim.protocols.server.certificates import server_context
from conveyor_sim.protocols.server.interface import ServerError
from conveyor_sim.protocols.server.quotas import QUOTA, share_of_guests
from conveyor_sim.protocols.web import feed, server
from conveyor_sim.protocols.web.feed import MOST_WAITING, UNSEEN
from conveyor_sim.protocols.web.server import LONGEST_REQUEST, MOST_CONNECTIONS, MOST_REQUESTS, WebServer

T = TypeVar("T")


@pytest.fixture
def page(open_page: Callable[[str], Any], live: Live) -> Any:
    return open_page(live.url)


def test_a_page_comes_back_when_its_server_does(page: Any, live: Live) -> None:
    signed_in(page, "jo")
    live.end()
    page.wait_for_selector("body[data-link=broken]")
    assert missing(page.inner_text("#link"), "●", "No connection") == []
    before = clock(page)
    live.serve()
    page.wait_for_selector("body[data-link=live]")
    soon(page, lambda: clock(page) > before + 0.2, "time goes on")
    assert page.get_attribute("body", "data-person") == "", "who was signed in is so no longer"


def test_a_picture_that_is_old_is_not_called_new(page: Any, live: Live) -> None:
    soon(page, lambda: page.inner_text("#latency").endswith(" ms behind"), "how late it is")
    os.kill(live.source.pid, signal.SIGSTOP)
    try:
        soon(page, lambda: "no new frame for" in page.inner_text("#latency"), "that nothing comes")
    finally:
        os.kill(live.source.pid, signal.SIGCONT)
    soon(page, lambda: page.inner_text("#latency").endswith(" ms behind"), "new pictures")


def test_a_line_whose_process_dies_is_lost_and_begins_anew(page: Any, live: Live) -> None:
    soon(page, lambda: clock(page) > 2.0, "some time has passed")
    os.kill(live.source.pid, signal.SIGKILL)
    soon(page, lambda: clock(page) < 2.0, "it began anew")
    soon(page, lambda: page.get_attribute("body", "data-link") == "live", "it is there")
    soon(page, lambda: int(page.get_attribute("body", "data-bottles") or 0) > 2, "its bottles")


def run(work: Coroutine[Any, Any, T]) -> T:
    """Run a coroutine in a separate thread, because the browser's driver has a loop in this one."""
    with ThreadPoolExecutor(1) as thread:
        return thread.submit(asyncio.run, asyncio.wait_for(work, PATIENCE)).result()


@contextmanager
def served_here(source: Any, **options: Any) -> Iterator[WebServer]:
    """Serve the page in this process, where a test can change or watch the server."""
    with ServerThread() as thread:
        page = WebServer(source, **options)
        thread.run(page.start())
        yield page
        thread.run(page.stop())


def test_pages_of_others_are_refused(live: Live) -> None:
    async def status(**headers: str) -> int:
        async with ClientSession() as session:
            try:
                async with session.ws_connect(f"{live.url}/live", headers=headers):
                    return 101
            except WSServerHandshakeError as error:
                return error.status

    async def page_of(host: str) -> int:
        async with ClientSession() as session, session.get(live.url, headers={"Host": host}) as answer:
            return answer.status

    assert run(status(Origin=live.url)) == 101
    assert run(status(Origin="http://evil.example")) == 403
    assert run(status(Origin=live.url.replace("http", "https"))) == 403
    assert run(status()) == 403
    assert run(status(Origin=f"http://evil.example:{live.port}", Host=f"evil.example:{live.port}")) == 403
    assert run(page_of(f"localhost:{live.port}")) == 200
    assert run(page_of(f"evil.example:{live.port}")) == 403
    for host in ("127.0.0.1", "127.0.0.1:80", "LocalHost", "[::1]", "localhost."):
        assert run(page_of(host)) == 200  # browsers leave out port 80
        assert run(status(Origin=f"http://{host.removesuffix(':80')}", Host=host)) == 101
        assert run(status(Origin=f"http://{host}:8081", Host=host)) == 403
    assert run(page_of("localhost.evil.example")) == 403


def test_files_outside_the_page_are_not_there(live: Live) -> None:
    async def status(path: str) -> int:
        async with ClientSession() as session, session.get(f"{live.url}{path}") as answer:
            return answer.status

    for path, expected in {"/main.js": 200, "/../server.py": 404, "/%2e%2e/server.py": 404, "/users": 404}.items():
        assert run(status(path)) == expected, path


async def messages(socket: Any, seconds: float) -> list[bytes]:
    """Return the messages until none comes for `seconds`."""
    found = []
    while True:
        try:
            message = await asyncio.wait_for(socket.receive(), seconds)
        except asyncio.TimeoutError:
            return found
        if message.type is not WSMsgType.BINARY:
            return found
        found.append(message.data)


async def next_text(socket: Any, kind: str) -> dict[str, Any]:
    while True:
        message = await socket.receive()
        assert message.type is WSMsgType.BINARY, message
        if message.data[0] == 0:
            text: dict[str, Any] = json.loads(message.data[1:])
            if text["kind"] == kind:
                return text


async def frames(socket: Any, count: int) -> None:
    """Receive `count` frames and acknowledge each."""
    while count:
        message = await socket.receive()
        assert message.type is WSMsgType.BINARY, message
        if message.data[0] == 1:
            count -= 1
            await socket.send_json({"do": "saw"})


@pytest.mark.parametrize(
    "sent",
    ["x" * (LONGEST_REQUEST + 1), "no json", "[]", "[" * 10_000, b"\0", '{"do": "saw"}\0'],
    ids=["too long", "no json", "no object", "deep", "binary", "a tail"],
)
def test_what_is_no_request_ends_its_connection_and_no_other(live: Live, sent: str | bytes) -> None:
    async def work() -> None:
        async with (
            ClientSession() as session,
            session.ws_connect(f"{live.url}/live", origin=live.url) as bad,
            session.ws_connect(f"{live.url}/live", origin=live.url) as good,
        ):
            await next_text(bad, "begin")
            await next_text(good, "begin")
            await (bad.send_str(sent) if isinstance(sent, str) else bad.send_bytes(sent))
            while (await bad.receive()).type is WSMsgType.BINARY:
                pass
            assert bad.closed
            await frames(good, 3)

    run(work())


def test_requests_that_make_no_sense_are_refused(live: Live) -> None:
    asked: list[dict[str, Any]] = [
        {"do": "set", "names": [SETPOINT], "values": [0.1, 0.2]},
        {"do": "set", "names": ["alarms/x"], "values": [1]},
        {"do": "set", "names": [SETPOINT], "values": [float("nan")]},
        {"do": "set", "names": [SETPOINT], "values": ["0.1"]},
        {"do": "set", "names": SETPOINT, "values": 1},
        {"do": "set", "names": [SETPOINT] * 101, "values": [0.1] * 101},
        {"do": "force", "names": ["x" * 1000], "values": [1]},
        {"do": "force", "names": ["\ud800"], "values": [1]},
        {"do": "set", "names": [SETPOINT], "values": [10**400]},
        {"do": "x" * 10_000},
        {"do": "control", "names": ["target"], "values": [5]},
        {"do": "control", "names": [], "values": []},
        {"do": "declare", "names": ["x"], "values": []},
        {"do": 7},
        {},
    ]

    async def work() -> list[str]:
        async with ClientSession() as session, session.ws_connect(f"{live.url}/live", origin=live.url) as socket:
            await socket.send_json({"do": "sign_in", "name": "tess", "password": PASSWORD, "id": 0})
            assert (await next_text(socket, "reply"))["person"] == {"name": "tess", "role": "test"}
            replies = []
            for number, request in enumerate(asked, start=1):
                await socket.send_json({**request, "id": number})
                reply = await next_text(socket, "reply")
                assert reply["id"] == number
                replies.append(reply["refused"])
            return replies

    tick = live.source.snapshot.tick
    assert all(run(work()))
    assert live.source.snapshot.tick > tick and live.source.snapshot.values[SETPOINT] == 0.5


def test_a_flood_of_requests_is_cut_off_and_holds_up_nobody(live: Live) -> None:
    async def work() -> int | None:
        async with (
            ClientSession() as session,
            session.ws_connect(f"{live.url}/live", origin=live.url) as flood,
            session.ws_connect(f"{live.url}/live", origin=live.url) as good,
        ):
            with suppress(ConnectionError):
                for number in range(10 * MOST_REQUESTS):
                    await flood.send_json({"do": "set", "names": [SETPOINT], "values": [0.1], "id": number})
            await frames(good, 5)
            await messages(flood, PATIENCE)
            return flood.close_code

    assert run(work()) == WSCloseCode.POLICY_VIOLATION
    assert live.source.snapshot.values[SETPOINT] == 0.5


@pytest.mark.parametrize("kind", [WSMsgType.PING, WSMsgType.PONG], ids=["pings", "pongs"])
def test_a_flood_of_what_needs_no_answer_is_cut_off_too(live: Live, kind: WSMsgType) -> None:
    async def work() -> int | None:
        async with (
            ClientSession() as session,
            session.ws_connect(f"{live.url}/live", origin=live.url, autoping=False) as flood,
            session.ws_connect(f"{live.url}/live", origin=live.url) as good,
        ):
            send = flood.ping if kind is WSMsgType.PING else flood.pong
            with suppress(ConnectionError):
                for _ in range(10 * MOST_REQUESTS):
                    await send()
            await frames(good, 5)
            while (await flood.receive()).type not in (WSMsgType.CLOSE, WSMsgType.CLOSING, WSMsgType.CLOSED):
                pass
            return flood.close_code

    assert run(work()) == WSCloseCode.POLICY_VIOLATION


def is_open(connection: socket.socket) -> bool:
    """Return True if the server has left a connection open; its data is discarded."""
    connection.setblocking(False)
    try:
        while connection.recv(1 << 20):
            pass
    except BlockingIOError:
        return True
    except ConnectionError:
        pass
    return False


def test_connections_that_only_wait_make_room(live: Live) -> None:
    """The oldest clients without a request, with half a request, or with an unread answer are closed, but no page."""
    asked = [b"", b"GET / HTT", f"GET /lib/uplot.js HTTP/1.1\r\nHost: 127.0.0.1:{live.port}\r\n\r\n".encode()]

    async def work() -> None:
        async with ClientSession() as session, session.ws_connect(f"{live.url}/live", origin=live.url) as page:
            await next_text(page, "begin")
            with ExitStack() as stack:
                waiting = []
                for number in range(MOST_CONNECTIONS + 10):
                    waiting.append(stack.enter_context(socket.create_connection(("127.0.0.1", live.port), PATIENCE)))
                    with suppress(ConnectionError):
                        waiting[-1].sendall(asked[number % len(asked)])
                async with session.get(live.url) as answer:
                    assert answer.status == 200
                still = [is_open(connection) for connection in waiting]
                assert sum(still) < MOST_CONNECTIONS and not any(still[:9]) and all(still[-9:])
                await frames(page, 3)

    run(work())


def test_who_does_not_agree_on_tls_is_not_waited_for(live: Live, users: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(server, "HANDSHAKE", 0.05)
    secured = server_context(None, users / "certificates")
    with (
        served_here(live.source, secured=secured, host="127.0.0.2") as page,
        socket.create_connection(("127.0.0.2", page.port), timeout=PATIENCE / 2) as waiting,
    ):
        assert waiting.recv(1) == b""


def test_who_shows_no_frames_gets_no_more_and_all_that_happened(live: Live) -> None:
    async def work() -> tuple[int, int]:
        async with (
            ClientSession() as session,
            session.ws_connect(f"{live.url}/live", origin=live.url) as slow,
            session.ws_connect(f"{live.url}/live", origin=live.url) as good,
        ):
            await frames(good, 20)
            got = await messages(slow, 0.3)
            return sum(message[0] == 1 for message in got), sum(message[0] == 0 for message in got)

    drawn, happened = run(work())
    assert drawn == UNSEEN and happened >= 1


def test_others_are_answered_while_the_first_page_is_prepared(live: Live, monkeypatch: pytest.MonkeyPatch) -> None:
    """The drawing below a line can take a second to read."""
    begun, answered = threading.Event(), threading.Event()
    really_head = feed.head

    def slow(line: Any, scene: Any) -> Any:
        begun.set()
        assert answered.wait(PATIENCE), "no answer while the page is prepared"
        return really_head(line, scene)

    monkeypatch.setattr(feed, "head", slow)

    async def work(url: str) -> None:
        async with ClientSession() as session, session.ws_connect(f"{url}/live", origin=url) as page:
            await asyncio.to_thread(begun.wait, PATIENCE)
            async with session.get(url) as answer:
                assert answer.status == 200
            answered.set()
            await next_text(page, "begin")

    with served_here(live.source) as here:
        run(work(here.address.rstrip("/")))


def test_a_picture_is_packed_once_however_many_look(live: Live, monkeypatch: pytest.MonkeyPatch) -> None:
    packed: list[Any] = []
    really_pack = feed._packed

    def counted(picture: Any) -> bytes:
        packed.append((picture.tick, *picture.drawn.values()))
        return really_pack(picture)

    monkeypatch.setattr(feed, "_packed", counted)

    async def work(url: str) -> None:
        async with ClientSession() as session, AsyncExitStack() as stack:
            looking = [session.ws_connect(f"{url}/live", origin=url) for _ in range(8)]
            sockets = [await stack.enter_async_context(one) for one in looking]
            await asyncio.gather(*(frames(socket, 20) for socket in sockets))

    with served_here(live.source) as page:
        run(work(page.address.rstrip("/")))
    assert len(packed) >= 20 and len(packed) == len(set(packed)), "none was packed anew for another page"


def test_a_flood_of_pages_leaves_a_place_for_a_user(live: Live) -> None:
    """Guests hold three quarters of an address's places; of the other pages the oldest make room, but no user."""
    most = QUOTA.connections_per_address
    guests = share_of_guests(most)

    async def work() -> None:
        async with ClientSession() as session:
            pages = [await session.ws_connect(f"{live.url}/live", origin=live.url) for _ in range(guests + 1)]
            await pages[-1].send_json({"do": "sign_in", "name": "jo", "password": PASSWORD, "id": 0})
            reply = await next_text(pages[-1], "reply")
            assert reply["person"]["name"] == "jo"
            late = [await session.ws_connect(f"{live.url}/live", origin=live.url) for _ in range(most - guests + 4)]
            await frames(late[-1], 1)
            for page in late[:4]:
                while (message := await page.receive()).type is WSMsgType.BINARY:
                    pass
                assert message.data == WSCloseCode.TRY_AGAIN_LATER
            await pages[-1].send_json({"do": "ping", "sent": 1.0})
            assert (await next_text(pages[-1], "pong"))["sent"] == 1.0
            for page in [*pages, *late]:
                await page.close()

    run(work())


def test_what_waits_for_a_page_is_bounded() -> None:
    from conveyor_sim.protocols.web.feed import Viewer

    async def work() -> None:
        viewer = Viewer(None)  # type: ignore[arg-type]  # nothing is sent
        viewer.tell(b"x" * 1000)
        for _ in range(MOST_WAITING // 1000 + 10):
            viewer.tell(b"x" * 1000)
        assert viewer.lagging and viewer.waiting <= MOST_WAITING
        viewer.begin(b"y")
        assert not viewer.lagging and viewer.waiting == 1

    run(work())


def test_nobody_who_is_not_let_in_sees_anything(browser: Any, live: Live, users: Path) -> None:
    settings = ServerSettings(users=users / "users", anonymous=False)
    with Serving(live.source, [(WEB, 0)], settings) as serving:
        url = serving.hosts[0].address.rstrip("/")

        async def work() -> None:
            async with ClientSession() as session, session.ws_connect(f"{url}/live", origin=url) as socket:
                assert [json.loads(message[1:])["kind"] for message in await messages(socket, 0.5)] == ["locked"]

        run(work())
        page = browser.new_page()
        page.set_default_timeout(PATIENCE * 1e3)
        page.goto(url)
        page.click("#signing button:has-text('Cancel')")
        page.click("#desk button:has-text('Sign in')")
        page.fill("#signing input[autocomplete=username]", "vic")
        page.fill("#signing input[type=password]", PASSWORD)
        page.click("#signing button.main")
        page.wait_for_selector("body[data-link=live]")
        page.click("#sign")
        page.wait_for_selector("body[data-link=locked]")
        page.close()


def test_other_machines_get_it_by_tls_alone(open_page: Callable[[str], Any], live: Live, users: Path) -> None:
    settings = ServerSettings("127.0.0.2", users=users / "users", opcua_certificates=users / "certificates")
    with Serving(live.source, [(WEB, 0)], settings) as serving:
        address = serving.hosts[0].address
        assert address.startswith("https://127.0.0.2:")
        page = open_page(address)
        signed_in(page, "jo")

        async def plain() -> None:
            async with ClientSession() as session:
                await session.get(address.replace("https", "http"))

        with pytest.raises(Exception, match=r"disconnected|reset|Bad status|Connection"):
            run(plain())


def test_a_certificate_that_cant_be_is_told_in_a_sentence(live: Live, tmp_path: Path) -> None:
    settings = ServerSettings(web_certificates=tmp_path)
    with pytest.raises(ServerError, match=r"certificate\.pem: can't be read, expected a certificate and its key"):
        Serving(live.source, [(WEB, 0)], settings)
    (tmp_path / "certificate.pem").write_text("no")
    (tmp_path / "key.pem").write_text("no")
    with pytest.raises(ServerError, match=r"certificate\.pem: .*expected a certificate in PEM"):
        Serving(live.source, [(WEB, 0)], settings)
