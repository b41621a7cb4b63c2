# SPDX-License-Identifier: Apache-2.0
"""A line that runs, served as a page for as long as tests look at it, and what a person does on that page."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from page.pixels import settled
from protocols.waiting import until

from conveyor_sim.protocols.hosting.server_kinds import SERVER_KINDS
from conveyor_sim.protocols.hosting.serving import Serving
from conveyor_sim.protocols.hosting.settings import ServerSettings
from conveyor_sim.protocols.server.users import Role

WEB = next(kind for kind in SERVER_KINDS if kind.name == "web")
PEOPLE: dict[str, Role] = {"vic": "viewer", "jo": "operator", "tess": "test"}
PASSWORD = "open sesame"
SPEED, SETPOINT = "belts/line/speed", "belts/line/cmd_speed"


class Live:
    """A line that runs, and the server of its page, which may be ended and begun again."""

    def __init__(self, folder: Path, source: Any) -> None:
        self.folder, self.source, self.port = folder, source, 0
        self.serving: Serving | None = None

    def serve(self, host: str = "127.0.0.1") -> None:
        settings = ServerSettings(host, users=self.folder / "users", opcua_certificates=self.folder / "certificates")
        self.serving = Serving(self.source, [(WEB, self.port)], settings)
        self.port = int(self.serving.hosts[0].address.rstrip("/").rpartition(":")[2])

    def end(self) -> None:
        if self.serving is not None:
            self.serving.close()
            self.serving = None

    @property
    def url(self) -> str:
        return f"http://127.0.0.1:{self.port}"


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
