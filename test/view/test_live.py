"""The page of a line that runs, in a real browser: what it shows, what is commanded on it, and who may."""

from __future__ import annotations

import asyncio
import json
import os
import signal
from collections.abc import Callable, Coroutine, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from pathlib import Path
from typing import Any, TypeVar

import pytest
from scada.waiting import PATIENCE, until
from view.line import LINE
from view.pixels import count_where_they_are, settled

pytest.importorskip("aiohttp", reason="aiohttp is not installed: pip install conveyor-sim[scada]")

from aiohttp import ClientSession, WSCloseCode, WSMsgType, WSServerHandshakeError

from conveyor_sim.bag.reader import open_bag
from conveyor_sim.bag.replay import replay
from conveyor_sim.bag.topics import TOPICS
from conveyor_sim.scada.bag_source import BagSource
from conveyor_sim.scada.face import FaceError, Settings
from conveyor_sim.scada.faces import FACES
from conveyor_sim.scada.scene_messages import Task
from conveyor_sim.scada.scene_source import SceneSource
from conveyor_sim.scada.serving import Serving
from conveyor_sim.scada.users import Role, keep_user, new_user
from conveyor_sim.scada.web.server import LONGEST_REQUEST, MOST_REQUESTS, MOST_VIEWERS
from conveyor_sim.scada.web.viewer import MOST_WAITING, UNSEEN
from conveyor_sim.scene import load_scene

T = TypeVar("T")

WEB = next(kind for kind in FACES if kind.name == "web")
PEOPLE: dict[str, Role] = {"vic": "viewer", "jo": "operator", "tess": "test"}
PASSWORD = "open sesame"
SPEED, SETPOINT = "belts/line/speed", "belts/line/cmd_speed"


class Live:
    """A line that runs, and the server of its page, which may be ended and begun again."""

    def __init__(self, folder: Path, source: Any) -> None:
        self.folder, self.source, self.port = folder, source, 0
        self.serving: Serving | None = None

    def serve(self, host: str = "127.0.0.1") -> None:
        settings = Settings(host, users=self.folder / "users", opcua_certificates=self.folder / "certificates")
        self.serving = Serving(self.source, [(WEB, self.port)], settings)
        self.port = int(self.serving.faces[0].address.rstrip("/").rpartition(":")[2])

    def end(self) -> None:
        if self.serving is not None:
            self.serving.close()
            self.serving = None

    @property
    def url(self) -> str:
        return f"http://127.0.0.1:{self.port}"


@pytest.fixture(scope="module")
def users(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("users")
    for name, role in PEOPLE.items():
        keep_user(folder / "users", name, new_user(role, PASSWORD))
    return folder


@pytest.fixture(scope="module")
def live(users: Path) -> Iterator[Live]:
    """The line, in real time, recorded; its end is an hour away."""
    scene = load_scene(LINE, {"duration": 3600.0})
    with SceneSource(Task(scene, users / "bag", 0, 1.0, 1), lambda text: None) as source:
        source.wait_for_line()
        made = Live(users, source)
        made.serve()
        yield made
        made.end()


@pytest.fixture
def open_page(browser: Any) -> Iterator[Callable[[str], Any]]:
    """Opens a page that has begun; anything that goes wrong in it fails the test, but for the network."""
    contexts, wrong = [], []

    def open_it(url: str) -> Any:
        contexts.append(browser.new_context(viewport={"width": 1280, "height": 720}, ignore_https_errors=True))
        contexts[-1].set_default_timeout(PATIENCE * 1e3)
        page = contexts[-1].new_page()
        page.on("pageerror", lambda error: wrong.append(str(error)))
        page.on("dialog", lambda dialog: (wrong.append(dialog.message), dialog.dismiss()))
        page.goto(url)
        page.wait_for_selector("body[data-ready]")
        return page

    yield open_it
    for context in contexts:
        context.close()
    assert wrong == []


@pytest.fixture
def page(open_page: Callable[[str], Any], live: Live) -> Any:
    return open_page(live.url)


def soon(page: Any, condition: Callable[[], Any], what: str) -> None:
    """Wait for something that will happen on a page, which goes on meanwhile."""
    until(lambda: condition() or page.wait_for_timeout(20), what)


def sign_in(page: Any, name: str, password: str = PASSWORD) -> None:
    page.click("#sign")
    page.fill("#signing input[autocomplete=username]", name)
    page.fill("#signing input[type=password]", password)
    page.click("#signing button.main")


def signed_in(page: Any, name: str) -> None:
    sign_in(page, name)
    page.wait_for_selector(f"body[data-person={name}]")


def show_device(page: Any, name: str) -> None:
    page.click("#tab_device")
    page.select_option("#panel_device select", name)
    settled(page)


def told(page: Any, text: str) -> None:
    soon(page, lambda: text in page.inner_text("#notice"), text)


def set_speed(page: Any, value: str) -> None:
    show_device(page, "belts/line")
    page.fill(f"[aria-label='Set {SETPOINT}']", value)
    page.click(f"[aria-label='Set {SETPOINT} now']")


def put_into_mode(page: Any, mode: str) -> None:
    show_device(page, "belts/line")
    page.select_option("[aria-label='Set belts/line/mode']", mode)
    page.click("[aria-label='Set belts/line/mode now']")


def clock(page: Any) -> float:
    return float(page.inner_text("#clock").removesuffix(" s"))


# What is shown


def test_the_picture_follows_the_line_and_says_how_late_it_is(page: Any, live: Live) -> None:
    first = clock(page)
    soon(page, lambda: clock(page) > first + 0.5, "time goes on")
    assert page.inner_text("#link") == "● Live" and page.inner_text("#run") == "running"
    soon(page, lambda: page.inner_text("#latency").endswith(" ms behind"), "how late it is")
    assert page.inner_text("#scene") == "small_packaging"
    drawn = clock(page)
    assert live.source.shown.tick * 0.01 >= drawn - 0.005


def test_bottles_are_drawn_where_the_source_has_them_to_a_pixel(page: Any, live: Live) -> None:
    signed_in(page, "tess")
    until(lambda: live.source.shown.tick > 1000, "bottles behind the capper")
    page.click("text=Pause the line")
    page.wait_for_selector("text=Let it go on")
    until(lambda: live.source.picture.drawn["bottles"]().tick == live.source.shown.tick, "a picture of where it stands")
    drawn = live.source.picture.drawn["bottles"]()
    soon(
        page, lambda: float(page.get_attribute("#plan", "data-frame")) == pytest.approx(drawn.tick * 0.01), "its frame"
    )
    page.uncheck("#names")
    page.uncheck("#forces")
    settled(page)
    bottles = TOPICS["bottles"].unpack(drawn)
    assert int(page.get_attribute("body", "data-bottles")) == len(bottles.id)
    assert count_where_they_are(page, bottles, lambda x: 2.1 < x < 2.4 or 2.6 < x < 3.5) >= 2
    before = clock(page)
    page.click("text=One tick")
    soon(page, lambda: clock(page) == pytest.approx(before + 0.01), "one tick")
    page.click("text=Let it go on")
    soon(page, lambda: clock(page) > before + 0.2, "time goes on")


def test_what_was_received_can_be_gone_back_to(page: Any) -> None:
    def drawn() -> bool:
        return int(page.get_attribute("body", "data-bottles") or 0) > 0

    soon(page, drawn, "the first picture")
    first = clock(page)
    soon(page, lambda: clock(page) > first + 1.0, "a second to go back to")
    page.click("#plan", position={"x": 20, "y": 20})
    page.keyboard.press("k")
    stopped = clock(page)
    page.keyboard.press("Home")
    soon(page, lambda: clock(page) < stopped - 0.5 and drawn(), "what was received first")
    soon(page, lambda: page.inner_text("#latency").endswith(" s ago"), "how long ago that was")
    page.click("#follow_now")
    soon(page, lambda: clock(page) > stopped, "it is now again")


def test_hostile_names_are_text_and_a_policy_is_set(page: Any, live: Live) -> None:
    until(
        lambda: "capper_full" in {event.name.removeprefix("alarms/") for event in live.source.events(0)[1]}, "an alarm"
    )
    page.click("#tab_events")
    page.fill("#panel_events input[type=search]", "capper_full")
    soon(page, lambda: "<img src=x onerror=alert(2)>" in page.inner_text("#panel_events"), "the text of the alarm")
    assert page.locator("#panels img").count() == 0
    answer = page.request.get(live.url)
    policy = answer.headers["content-security-policy"]
    assert "default-src 'none'" in policy and "unsafe" not in policy and "frame-ancestors 'none'" in policy


@pytest.mark.parametrize("size", [(1280, 720), (820, 1180)], ids=["laptop", "tablet"])
def test_everything_fits_and_has_a_name_for_those_who_hear_it(page: Any, size: tuple[int, int]) -> None:
    page.set_viewport_size({"width": size[0], "height": size[1]})
    show_device(page, "belts/line")
    assert page.evaluate(
        "document.documentElement.scrollWidth <= innerWidth && document.body.scrollHeight <= innerHeight"
    )
    nameless = page.evaluate(
        """() => Array.from(document.querySelectorAll("button, select, input, canvas[role], [role=slider]"))
            .filter((one) => one.offsetParent && !(one.getAttribute("aria-label") || one.textContent.trim()
                || one.labels?.length || one.title)).map((one) => one.outerHTML)"""
    )
    assert nameless == []
    assert page.locator("#plan").bounding_box()["height"] > 200


# Who may do what


def test_who_has_not_signed_in_is_refused_with_the_reason(page: Any, live: Live) -> None:
    set_speed(page, "0.3")
    told(page, "Refused: nobody has signed in")
    assert live.source.shown.values[SETPOINT] == 0.5


def test_a_viewer_is_refused_with_the_reason(page: Any, live: Live) -> None:
    signed_in(page, "vic")
    set_speed(page, "0.3")
    told(page, "Refused: vic is a viewer, who only reads")
    page.click("text=Pause the line")
    told(page, "vic is a viewer")
    assert live.source.shown.values[SETPOINT] == 0.5 and live.source.shown.run.text == "running"
    page.click("#sign")
    page.wait_for_selector("body[data-person='']")


def test_a_wrong_password_is_none(page: Any) -> None:
    sign_in(page, "tess", "open wheat")
    soon(page, lambda: page.inner_text("#signing .wrong") == "name or password are wrong", "the reason")
    assert page.get_attribute("body", "data-person") == ""
    page.click("text=Cancel")


def test_an_operator_is_refused_in_automatic_and_for_what_is_out_of_range(page: Any, live: Live) -> None:
    signed_in(page, "jo")
    set_speed(page, "0.3")
    told(page, "Refused: belts/line: is in Automatic")
    set_speed(page, "7")
    told(page, "Refused: belts/line/cmd_speed: 7 given, expected 0 to 1 m/s")
    show_device(page, "photo_eyes/exit")
    page.click("[aria-label='Inject photo_eyes/exit/stuck_on on']")
    told(page, "Refused: inject: given by operator web jo, expected one of the kind test")
    put_into_mode(page, "2")
    told(page, "Refused: belts/line: Maintenance is not for operators")  # by the line, a tick later


def test_what_a_tester_does_is_shown(page: Any, live: Live) -> None:
    signed_in(page, "tess")
    show_device(page, "photo_eyes/exit")
    page.click("[aria-label='Watch photo_eyes/exit/blocked']")
    page.click("#tab_watch")
    page.click("[aria-label='Force photo_eyes/exit/blocked on']")
    row = page.locator("#panel_watch li")
    soon(page, lambda: "forced" in row.inner_text() and "\non\n" in row.inner_text(), "the force")
    page.click("[aria-label='End the force on photo_eyes/exit/blocked']")
    soon(page, lambda: "forced" not in row.inner_text(), "its end")
    show_device(page, "photo_eyes/exit")
    page.click("[aria-label='Inject photo_eyes/exit/stuck_on on']")
    fault = page.locator("#panel_device tr", has_text="stuck_on").first
    soon(page, lambda: "on" in fault.locator("td").inner_text(), "the fault")
    page.click("[aria-label='Inject photo_eyes/exit/stuck_on off']")
    soon(page, lambda: "off" in fault.locator("td").inner_text(), "its end")


def test_alarms_are_shelved_acknowledged_and_reset(page: Any) -> None:
    """Of an eye that is forced, so that the alarm does nothing by itself meanwhile."""
    signed_in(page, "tess")
    show_device(page, "photo_eyes/queue")
    page.click("[aria-label='Watch photo_eyes/queue/blocked']")
    page.click("#tab_watch")
    page.click("[aria-label='Force photo_eyes/queue/blocked on']")
    page.click("#tab_alarms")
    row = page.locator("#panel_alarms li", has_text="queue_stands")
    page.wait_for_selector(".alarm.error:has-text('queue_stands')")
    page.click("[aria-label='Shelve 1 min queue_stands']")
    soon(page, lambda: "shelved by web tess" in row.inner_text(), "it is shelved")
    page.click("[aria-label='Unshelve queue_stands']")
    page.click("[aria-label='Acknowledge queue_stands']")
    soon(page, lambda: "\nacknowledged by web tess" in row.inner_text(), "it is acknowledged")
    page.click("#tab_watch")
    page.click("[aria-label='Force photo_eyes/queue/blocked off']")
    page.click("#tab_alarms")
    page.click("[aria-label='Reset queue_stands']")
    soon(page, lambda: row.count() == 0, "it is normal")
    page.click("#tab_watch")
    page.click("[aria-label='End the force on photo_eyes/queue/blocked']")
    soon(page, lambda: "forced" not in page.inner_text("#panel_watch li"), "the end of the force")


# Connections


def test_a_page_comes_back_when_its_server_does(page: Any, live: Live) -> None:
    signed_in(page, "jo")
    live.end()
    page.wait_for_selector("body[data-link=broken]")
    assert page.inner_text("#link") == "● No connection to the server: trying again"
    before = clock(page)
    live.serve()
    page.wait_for_selector("body[data-link=live]")
    soon(page, lambda: clock(page) > before + 0.2, "time goes on")
    assert page.get_attribute("body", "data-person") == "", "who was signed in is so no longer"


def test_a_line_whose_process_dies_is_lost_and_begins_anew(page: Any, live: Live) -> None:
    soon(page, lambda: clock(page) > 2.0, "some time has passed")
    os.kill(live.source.pid, signal.SIGKILL)
    soon(page, lambda: clock(page) < 2.0, "it began anew")
    soon(page, lambda: page.get_attribute("body", "data-link") == "live", "it is there")
    soon(page, lambda: int(page.get_attribute("body", "data-bottles")) > 2, "its bottles")


def run(work: Coroutine[Any, Any, T]) -> T:
    """In a thread of its own: the browser's driver has a loop in this one."""
    with ThreadPoolExecutor(1) as thread:
        return thread.submit(asyncio.run, asyncio.wait_for(work, PATIENCE)).result()


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


def test_files_outside_the_page_are_not_there(live: Live) -> None:
    async def status(path: str) -> int:
        async with ClientSession() as session, session.get(f"{live.url}{path}") as answer:
            return answer.status

    for path, expected in {"/main.js": 200, "/../server.py": 404, "/%2e%2e/server.py": 404, "/users": 404}.items():
        assert run(status(path)) == expected, path


async def messages(socket: Any, seconds: float) -> list[bytes]:
    """What comes until nothing does for so long."""
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
    """Take so many, and say so."""
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

    tick = live.source.shown.tick
    assert all(run(work()))
    assert live.source.shown.tick > tick and live.source.shown.values[SETPOINT] == 0.5


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
    assert live.source.shown.values[SETPOINT] == 0.5


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


def test_no_more_pages_look_than_may(live: Live) -> None:
    async def work() -> None:
        async with ClientSession() as session:
            sockets = []
            with pytest.raises(WSServerHandshakeError) as refused:
                for _ in range(MOST_VIEWERS + 1):
                    sockets.append(await session.ws_connect(f"{live.url}/live", origin=live.url))
            assert refused.value.status == 503 and len(sockets) <= MOST_VIEWERS
            for socket in sockets:
                await socket.close()

    run(work())


def test_what_waits_for_a_page_is_bounded() -> None:
    from conveyor_sim.scada.web.viewer import Viewer

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
    settings = Settings(users=users / "users", anonymous=False)
    with Serving(live.source, [(WEB, 0)], settings) as serving:
        url = serving.faces[0].address.rstrip("/")

        async def work() -> None:
            async with ClientSession() as session, session.ws_connect(f"{url}/live", origin=url) as socket:
                assert [json.loads(message[1:])["kind"] for message in await messages(socket, 0.5)] == ["locked"]

        run(work())
        page = browser.new_page()
        page.set_default_timeout(PATIENCE * 1e3)
        page.goto(url)
        page.fill("#signing input[autocomplete=username]", "vic")
        page.fill("#signing input[type=password]", PASSWORD)
        page.click("#signing button.main")
        page.wait_for_selector("body[data-link=live]")
        page.click("#sign")
        page.wait_for_selector("body[data-link=locked]")
        page.close()


# By other ways


def test_a_command_given_on_the_page_is_in_the_recording_which_replays(
    open_page: Callable[[str], Any], users: Path, tmp_path: Path
) -> None:
    scene = load_scene(LINE, {"duration": 3600.0})
    with SceneSource(Task(scene, tmp_path / "bag", 0, 1.0, 1), lambda text: None) as source:
        source.wait_for_line()
        with Serving(source, [(WEB, 0)], Settings(users=users / "users")) as serving:
            page = open_page(serving.faces[0].address)
            signed_in(page, "jo")
            put_into_mode(page, "3")
            mode = page.locator("#panel_device tr", has_text="mode").first.locator("td")
            soon(page, lambda: mode.inner_text() == "Manual", "the mode")
            set_speed(page, "0.2")
            soon(page, lambda: source.shown.values[SPEED] == 0.2, "the belt is slow")
            row = page.locator("#panel_device tr", has_text="cmd_speed").first
            soon(page, lambda: "by web jo since" in row.inner_text(), "who did it")
            page.locator("#panel_device tr", has_text="by scene since 0.00 s").first.wait_for()
            assert "1 client, 2 written, 0 refused" in serving.progress()
    report = replay(tmp_path / "bag")
    assert report.exact and report.difference is None
    with open_bag(tmp_path / "bag") as bag:
        given = [frame.data for frame in bag.outcomes() if frame.data.source == "web"]
    assert [(one.writer, one.writer_kind, one.accepted) for one in given] == [("web jo", "operator", True)] * 2


def test_a_recording_is_played_on_the_page(open_page: Callable[[str], Any], users: Path, bag: Path) -> None:
    with (
        BagSource(bag, lambda text: None, loop=True) as source,
        Serving(source, [(WEB, 0)], Settings(users=users / "users")) as serving,
    ):
        page = open_page(serving.faces[0].address)
        soon(page, lambda: int(page.get_attribute("body", "data-bottles")) > 3, "its bottles")
        signed_in(page, "tess")
        page.click("text=Pause the line")
        page.wait_for_selector("text=Let it go on")
        stands = clock(page)
        assert source.control("seek", max(0.0, stands - 0.5), "test") == ""
        soon(page, lambda: clock(page) < stands, "it went back")
        show_device(page, "belts/line")
        assert page.locator(f"[aria-label='Set {SETPOINT}']").count() == 0, "a recording can't be commanded"


def test_other_machines_get_it_by_tls_alone(open_page: Callable[[str], Any], live: Live, users: Path) -> None:
    settings = Settings("127.0.0.2", users=users / "users", opcua_certificates=users / "certificates")
    with Serving(live.source, [(WEB, 0)], settings) as serving:
        address = serving.faces[0].address
        assert address.startswith("https://127.0.0.2:")
        page = open_page(address)
        signed_in(page, "jo")

        async def plain() -> None:
            async with ClientSession() as session:
                await session.get(address.replace("https", "http"))

        with pytest.raises(Exception, match=r"disconnected|reset|Bad status|Connection"):
            run(plain())


def test_a_certificate_that_cant_be_is_told_in_a_sentence(live: Live, tmp_path: Path) -> None:
    settings = Settings(web_certificates=tmp_path)
    with pytest.raises(FaceError, match=r"certificate\.pem: can't be read, expected a certificate and its key"):
        Serving(live.source, [(WEB, 0)], settings)
    (tmp_path / "certificate.pem").write_text("no")
    (tmp_path / "key.pem").write_text("no")
    with pytest.raises(FaceError, match=r"certificate\.pem: .*expected a certificate in PEM"):
        Serving(live.source, [(WEB, 0)], settings)
