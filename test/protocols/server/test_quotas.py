# SPDX-License-Identifier: Apache-2.0
"""Slots of connections, and the order in which connections make room."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from conveyor_sim.protocols.hosting.settings import ServerSettings, limit_names, limit_settings
from conveyor_sim.protocols.opcua.limits import OpcUaLimits
from conveyor_sim.protocols.server.interface import ServerError
from conveyor_sim.protocols.server.quotas import (
    GREETED,
    GUEST,
    OPENED,
    Budget,
    ConnectionSlot,
    ConnectionSlots,
    Quota,
    share_of_guests,
)

HERE, THERE = "10.0.0.1", "10.0.0.2"


class Clients:
    """Connections to one server with 16 slots, 12 per address, 4 per user."""

    def __init__(self, keeps_active: bool = False, idle: float = 1000.0) -> None:
        self.places = ConnectionSlots(Quota(16, 12, 4, idle), keeps_active)
        self.ended: list[ConnectionSlot] = []

    def come(self, address: str = HERE, user: str | None = None) -> ConnectionSlot | None:
        """Connect. user: "" for a guest, None for a connection without a session."""
        place = self.places.take(address, lambda: self.ended.append(place) if place else None)
        if place is not None and user is not None:
            admitted = self.places.admit_user(place, user) if user else self.places.admit_guest(place)
            if not admitted:
                self.places.leave(place)
                return None
        return place


def test_guests_hold_three_quarters_of_an_address_and_of_all_places() -> None:
    clients = Clients()
    here = [clients.come(HERE, "") for _ in range(12)]
    assert sum(one is not None for one in here) == share_of_guests(12) == 9
    there = [clients.come(THERE, "") for _ in range(12)]
    assert sum(one is not None for one in there) == share_of_guests(16) - 9 == 3
    assert not clients.ended and len(clients.places) == 12


@pytest.mark.parametrize("address", [HERE, THERE])
def test_a_user_comes_in_among_guests_and_sockets_that_say_nothing(address: str) -> None:
    clients = Clients()
    for _ in range(12):
        clients.come(HERE, "")
    silent = [clients.come(HERE) for _ in range(20)]
    jo = clients.come(address, "jo")
    assert jo is not None and jo not in clients.ended
    assert set(clients.ended) <= set(silent)
    for _ in range(100):
        clients.come(HERE)
        clients.come(THERE, "")
    assert jo not in clients.ended


def test_who_has_got_least_far_makes_room_first_and_the_idle_before_the_active() -> None:
    clients = Clients()
    places = [clients.come() for _ in range(12)]
    first, second, third = (place for place in places[:3] if place is not None)
    first.touch(OPENED)
    second.touch(GREETED)
    expected = [*places[2:], second, first]
    third.touch()  # the last one without a greeting
    expected.remove(third)
    expected.insert(9, third)
    for _ in range(12):
        new = clients.come()
        assert new is not None
        new.touch(OPENED)
    assert clients.ended == expected


def test_guests_that_are_idle_make_room_for_other_guests() -> None:
    clients = Clients(idle=-1.0)
    first, *_ = [clients.come(HERE, "") for _ in range(9)]
    assert clients.come(HERE, "") is not None and clients.ended == [first]


def test_a_user_has_its_share_and_a_session_that_ends_gives_it_back() -> None:
    clients = Clients()
    held = [clients.come(HERE, "jo") for _ in range(4)]
    assert None not in held and clients.come(HERE, "jo") is None and clients.come(HERE, "al") is not None
    assert held[0] is not None
    clients.places.leave_user(held[0])
    assert clients.come(HERE, "jo") is not None


def test_users_are_never_dropped_for_others() -> None:
    clients = Clients()
    for user in "abcd":
        for _ in range(4):
            assert clients.come(HERE, user) is not None
    assert clients.come(THERE) is None and clients.come(HERE, "") is None
    assert clients.places.refused == 2 and not clients.ended


def test_without_users_only_idle_connections_make_room() -> None:
    clients = Clients(keeps_active=True)
    places = [clients.come(HERE) for _ in range(12)]
    for place in places[1:]:
        assert place is not None
        place.touch(GUEST)
    assert clients.come(HERE) is not None and clients.ended == places[:1]
    clients.places.idle = -1.0
    assert clients.come(THERE) is not None and len(clients.ended) == 1, "there is a place for another address"
    for _ in range(4):
        clients.come(HERE)
    assert clients.ended[1:2] != places[1:2], "connections without a request make room first"


def test_a_guest_that_becomes_a_user_and_a_guest_again_is_counted_as_such() -> None:
    clients = Clients()
    guests = [clients.come(HERE, "") for _ in range(9)]
    place = guests[0]
    assert place is not None and clients.places.admit_user(place, "jo")
    assert clients.come(HERE, "") is not None
    assert not clients.places.admit_guest(place) and place.user == ""


def test_budgets_refill_at_their_rate() -> None:
    now = [0.0]
    budget = Budget(100.0, 200.0, lambda: now[0])
    assert budget.spend(200) and budget.delay() == 0.0
    assert not budget.spend(50) and budget.delay() == 0.5
    now[0] = 0.5
    assert budget.delay() == 0.0 and not budget.spend(1)
    now[0] = 100.0
    assert budget.spend(200) and not budget.spend(1), "no more than the burst is saved"
    budget.restore(0.1)
    assert budget.spend(20) and not budget.spend(1)


def test_limits_are_options() -> None:
    settings = ServerSettings(**limit_settings(["opcua.nodes_per_read=5", "opcua.connections=7", "web.idle=3"]))
    assert settings.opcua_limits == OpcUaLimits(nodes_per_read=5)
    assert settings.opcua_quota.connections == 7 and settings.web_quota.idle == 3
    assert settings.modbus_quota == Quota()
    assert all(limit_settings([f"{name}=1"]) for name in limit_names())


@pytest.mark.parametrize(
    "option",
    ["opcua.nodes_per_read", "nodes_per_read=5", "opcua.nodes=5", "modbus.connections_per_user=5", "=", ""]
    + [f"opcua.connections={text}" for text in ("0", "-1", "1.5", "x", "", "²", "9" * 5000, "1e3", "1000000001")],
)
def test_limits_that_can_not_be_are_named(option: str) -> None:
    with pytest.raises(ServerError, match=r"^--limit: .* given, expected"):
        limit_settings([option])


def test_a_limit_is_given_once() -> None:
    with pytest.raises(ServerError, match="given twice, expected once"):
        limit_settings(["web.idle=3", "web.idle=4"])


def test_the_docs_state_all_limits_and_their_defaults() -> None:
    text = Path("docs/reliability.md").read_text(encoding="utf-8")
    rows = re.findall(r"^\| ((?:`[a-z]+\.\w+`,? ?)+) \| (\d+) \|", text, re.MULTILINE)
    stated = {name: int(value) for names, value in rows for name in re.findall(r"`([^`]+)`", names)}
    assert set(stated) == set(limit_names())
    settings = ServerSettings(**limit_settings(f"{name}={value}" for name, value in stated.items()))
    assert settings == ServerSettings()


def test_a_connection_whose_login_failed_makes_room_first() -> None:
    clients = Clients()
    for _ in range(10):
        clients.come(HERE)
    waiting, failed = clients.come(HERE), clients.come(HERE)
    assert waiting is not None and failed is not None
    waiting.touch(OPENED)
    failed.touch(OPENED)
    failed.has_failed = True
    clients.come(HERE)
    assert clients.ended == [failed]
    assert clients.places.admit_user(waiting, "jo")
