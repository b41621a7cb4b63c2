# SPDX-License-Identifier: Apache-2.0
"""Users of OPC UA and of the page: a file with one line per user, and checks of passwords.

    jo:operator:scrypt:<salt>:<hash>

Salt and hash are in base 64; the hash is scrypt's (RFC 7914), so a password can't be read from the file.
"""

from __future__ import annotations

import hashlib
import hmac
import os
import re
import threading
from base64 import b64decode, b64encode
from collections.abc import Mapping
from pathlib import Path
from typing import Literal, NamedTuple, Protocol, get_args

from conveyor_sim.errors import ConveyorError
from conveyor_sim.line.commands.inputs import WriterKind
from conveyor_sim.support.files import MB, FileError, read_file, write_file
from conveyor_sim.support.printable import printable

Role = Literal["viewer", "operator", "engineer", "controller", "test"]
"""Role of a user. A viewer only reads; docs/line.md describes the others."""

ROLES: tuple[Role, ...] = get_args(Role)

MOST_WRONG, PERIOD = 10, 60.0
"""Limit of wrong passwords per name and machine. Further ones are refused unchecked until PERIOD seconds of wall time
have passed since the first one.
"""

_LONGEST_NAME, _MOST_KEPT = 40, 1000
_NAME = re.compile(r"[A-Za-z0-9_.-]{1,40}")
_METHOD = "scrypt"
_BYTES = 32
_LONGEST_PASSWORD = 200


class UsersError(ConveyorError):
    """Error: a file of users can't be read, or a user is not valid. States file, line, value and expectation."""


class User(NamedTuple):
    """Role and password of one user."""

    role: Role
    salt: bytes
    hash: bytes

    @property
    def kind(self) -> WriterKind | None:
        """Kind of writer for the line; None: the user only reads."""
        return None if self.role == "viewer" else self.role


def new_user(role: Role, password: str) -> User:
    """Return a user with a password of 1 to 200 characters. Raises UsersError."""
    if not 1 <= len(password) <= _LONGEST_PASSWORD:
        raise UsersError(f"password: {len(password)} characters given, expected 1 to {_LONGEST_PASSWORD}")
    salt = os.urandom(16)
    return User(role, salt, _hash(password, salt))


def line_of(name: str, user: User) -> str:
    """Return the line of the file. Raises UsersError for an invalid name."""
    if not _NAME.fullmatch(name):
        raise UsersError(f"name: {printable(name)} given, expected 1 to 40 letters, digits, or any of _ . -")
    return f"{name}:{user.role}:{_METHOD}:{b64encode(user.salt).decode()}:{b64encode(user.hash).decode()}"


def read_users(path: Path) -> dict[str, User]:
    """Return users by name. Empty lines, and lines that begin with #, are ignored. Raises UsersError."""
    try:
        text = read_file(path, MB).decode()
    except FileError as error:
        raise UsersError(f"{path}: {error}, expected a file of users") from error
    except UnicodeDecodeError as error:
        raise UsersError(f"{path}: is not UTF-8, expected a file of users") from error
    users: dict[str, User] = {}
    for number, line in enumerate(text.splitlines(), start=1):
        if not line.strip() or line.startswith("#"):
            continue
        where = f"{path}: line {number}"
        cells = line.strip().split(":")
        if len(cells) != 5 or not _NAME.fullmatch(cells[0]) or cells[2] != _METHOD:
            raise UsersError(f"{where}: expected name:role:{_METHOD}:salt:hash, as `conveyor-sim user` writes it")
        name, role, _, salt, hashed = cells
        if role not in ROLES:
            raise UsersError(f"{where}: role {printable(role)} given, expected one of {', '.join(ROLES)}")
        if name in users:
            raise UsersError(f"{where}: {name} given twice")
        try:
            user = User(role, b64decode(salt, validate=True), b64decode(hashed, validate=True))
        except ValueError:
            user = User(role, b"", b"")
        if not user.salt or len(user.hash) != _BYTES:
            raise UsersError(f"{where}: salt and hash of {name} can't be read, as `conveyor-sim user` writes them")
        users[name] = user
    return users


def keep_user(path: Path, name: str, user: User) -> None:
    """Add a user to a file, or replace the one of the same name. Raises UsersError."""
    line, lines = line_of(name, user), []
    if path.exists():
        read_users(path)
        lines = [kept for kept in path.read_text().splitlines() if kept.partition(":")[0].strip() != name]
    try:
        write_file(path, "".join(f"{kept}\n" for kept in (*lines, line)).encode())
    except FileError as error:
        raise UsersError(f"{path}: {error}, expected a file of users") from error


def authenticate(users: Mapping[str, User], name: str, password: str) -> User | None:
    """Return the user of a name if the password is right. The time does not show whether there is such a user."""
    user = users.get(name, _UNKNOWN)
    digest = _hash(password[: _LONGEST_PASSWORD + 1], user.salt)
    return user if hmac.compare_digest(digest, user.hash) and user is not _UNKNOWN else None


class LoginService(Protocol):
    """Checks passwords. Its method may be called from any thread."""

    has_users: bool
    """True if any user can log in."""

    def enter(self, name: str, password: str, origin: str, now: float) -> User | None:
        """Return the user if the password is right, None otherwise. `Logins.enter` documents the arguments."""


class Logins:
    """The common `LoginService` of all protocol servers of a line. It counts wrong passwords, so guessing takes years.

    It checks one password at a time, because each check keeps a processor busy.
    """

    def __init__(self, users: Mapping[str, User]) -> None:
        """Start without a wrong password."""
        self.has_users = bool(users)
        self._checking = threading.Lock()
        self._users = users
        self._wrong: dict[
            tuple[str, str], tuple[int, float]
        ] = {}  # count, and time of the first, s; ordered by the latest

    def enter(self, name: str, password: str, origin: str, now: float) -> User | None:
        """Return the user; None for a wrong name or password. After too many wrong passwords, None without a check.

        origin: the client's machine. now: time of any steady clock, s.
        """
        with self._checking:
            return self._enter(name, password, origin, now)

    def _enter(self, name: str, password: str, origin: str, now: float) -> User | None:
        who = (name[:_LONGEST_NAME], origin)
        count, since = self._wrong.get(who, (0, now))
        if now > since + PERIOD:
            count, since = 0, now
        if count >= MOST_WRONG:
            return None
        user = authenticate(self._users, name, password)
        self._wrong.pop(who, None)
        if user is None:
            self._wrong[who] = count + 1, since
            if len(self._wrong) > _MOST_KEPT:
                del self._wrong[next(iter(self._wrong))]
        return user


def _hash(password: str, salt: bytes) -> bytes:
    return hashlib.scrypt(password.encode(errors="surrogatepass"), salt=salt, n=2**14, r=8, p=1, dklen=_BYTES)


_UNKNOWN = User("viewer", b"\0" * 16, b"\0" * _BYTES)
