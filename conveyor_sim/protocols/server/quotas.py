# SPDX-License-Identifier: Apache-2.0
"""`Budget`: limit on the work of a client. `ConnectionSlots`: limit on connections, and the order of displacement.

A client needs a slot before it can log in, so connections without a session are the first to be dropped. When all slots
are taken, a connection with a failed login is dropped, otherwise one at the earliest stage. Among several,
it is the one that was idle for longest.
Guests have a session and no user. They hold at most three quarters of the slots; the rest is for users and for
connections without a session yet. This also holds for the slots of one address. A user is never dropped for a guest.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, field


class Budget:
    """Units of one client, or of a group of clients, refilled at a constant rate (token bucket)."""

    def __init__(self, rate: float, burst: float, clock: Callable[[], float] = time.monotonic) -> None:
        """Start full. rate: units per second. burst: units that may be used at once. clock: returns seconds."""
        self._rate, self._burst, self._clock = rate, burst, clock
        self._level, self._at = burst, clock()

    def spend(self, units: float) -> bool:
        """Spend units; the balance may become negative. Return True if it did not."""
        now = self._clock()
        self._level = min(self._burst, self._level + self._rate * (now - self._at)) - units
        self._at = now
        return self._level >= 0.0

    def delay(self) -> float:
        """Return the seconds until the balance is no longer negative."""
        self.spend(0.0)
        return max(0.0, -self._level / self._rate)

    def restore(self, share: float) -> None:
        """Raise the level to a share of the burst, 0 to 1, if it is lower."""
        self._level = max(self._level, share * self._burst)


RESERVED = 0.25
"""Share of all slots, and of the slots of one address, that guests never hold."""

NEW, GREETED, OPENED, GUEST, USER = range(5)
"""Stages of a connection: nothing valid was received; greeted; channel open or request valid; session without a user;
session of a user.
"""


@dataclass(frozen=True)
class Quota:
    """Limits on the connections of one protocol server. All are positive integers."""

    connections: int = 64
    """Connections at once."""
    connections_per_address: int = 48
    """Connections from one address, users not counted. The default leaves a quarter for other addresses. Within one
    address, guests hold at most three quarters, so an operator can connect.
    """
    connections_per_user: int = 16
    """Connections of one user."""
    idle: float = 30.0
    """Seconds without a request after which a connection may be dropped: a guest's for another guest, and a user's for
    a new connection of the same user. A Modbus client that is idle for longer loses its control of the line.
    """


QUOTA = Quota()
"""Default quota."""


@dataclass(eq=False)
class ConnectionSlot:
    """Slot of one connection."""

    address: str
    end: Callable[[], None]
    """Closes the connection."""
    stage: int = NEW
    user: str = ""
    active: float = field(default_factory=time.monotonic)
    """Time of the last request in s, as time.monotonic() has it."""
    has_failed: bool = False
    """True if a login failed and none succeeded since."""

    def touch(self, stage: int = NEW) -> None:
        """Note a request, and the stage that the connection has reached."""
        self.active, self.stage = time.monotonic(), max(stage, self.stage)


def share_of_guests(places: int) -> int:
    """Return the number of slots, out of `places`, that guests may hold."""
    return max(1, int(places * (1.0 - RESERVED)))


class ConnectionSlots:
    """All connections of one protocol server."""

    def __init__(self, quota: Quota, keeps_active: bool = False) -> None:
        """Start with all slots free. keeps_active: True if active guests are never dropped.

        This is for a protocol without users, where a new connection can't be a user's.
        """
        self._quota, self._keeps_active = quota, keeps_active
        self.idle = quota.idle
        """Seconds without a request after which a connection is idle."""
        self._taken: set[ConnectionSlot] = set()
        self.dropped = self.refused = 0
        """Connections dropped so far to make room, and connections refused for lack of a slot."""

    def __len__(self) -> int:
        return len(self._taken)

    def take(self, address: str, end: Callable[[], None]) -> ConnectionSlot | None:
        """Return a slot for a connection from an address; None: all slots are taken and none may be displaced."""
        own = self._of(address)
        if len(own) >= self._quota.connections_per_address and not self._drop_first(own):
            self.refused += 1
            return None
        if len(self._taken) >= self._quota.connections and not self._drop_first(list(self._taken)):
            self.refused += 1
            return None
        place = ConnectionSlot(address, end)
        self._taken.add(place)
        return place

    def admit_guest(self, place: ConnectionSlot) -> bool:
        """Let a connection go on without a user. Return False if guests hold their share, and none of them is idle."""
        if place.user:
            self.leave_user(place)
        if place.stage == GUEST:
            return True
        for those, places in (
            (self._of(place.address), self._quota.connections_per_address),
            (list(self._taken), self._quota.connections),
        ):
            guests = [one for one in those if one.stage == GUEST]
            if len(guests) >= share_of_guests(places) and not self._drop_first(self._idle(guests)):
                self.refused += 1
                return False
        place.has_failed = False
        place.touch(GUEST)
        return True

    def admit_user(self, place: ConnectionSlot, user: str) -> bool:
        """Let a connection go on as a user. Return False if that user holds all its slots, and none is idle."""
        same = [one for one in self._taken if one.user == user and one is not place]
        if len(same) >= self._quota.connections_per_user:
            idle = self._idle(same)
            if not idle:
                self.refused += 1
                return False
            self._drop(min(idle, key=lambda one: one.active))
        place.user, place.has_failed = user, False
        place.touch(USER)
        return True

    def leave_user(self, place: ConnectionSlot) -> None:
        """Note that a connection has no session any more."""
        place.user, place.stage = "", min(place.stage, OPENED)

    def leave(self, place: ConnectionSlot) -> None:
        """Note that a connection has ended."""
        self._taken.discard(place)

    def _of(self, address: str) -> list[ConnectionSlot]:
        """Return connections from an address; users are not counted against it."""
        return [one for one in self._taken if one.address == address and one.stage < USER]

    def _idle(self, those: list[ConnectionSlot]) -> list[ConnectionSlot]:
        before = time.monotonic() - self.idle
        return [one for one in those if one.active < before]

    def _drop_first(self, those: list[ConnectionSlot]) -> bool:
        """Drop the first connection in the order described in the module. Return False if there are only users."""
        kept = set(those) - set(self._idle(those)) if self._keeps_active else set()
        may = (one for one in those if one.stage < GUEST or (one.stage == GUEST and one not in kept))
        first = min(may, key=lambda one: (not one.has_failed, one.stage, one.active), default=None)
        if first is None:
            return False
        self._drop(first)
        return True

    def _drop(self, place: ConnectionSlot) -> None:
        self._taken.discard(place)
        self.dropped += 1
        place.end()
