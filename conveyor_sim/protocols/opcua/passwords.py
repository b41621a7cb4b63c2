# SPDX-License-Identifier: Apache-2.0
"""`Passwords`: passwords of clients, checked one at a time outside the event loop, before a session is activated.

The library checks a password within the event loop. Other requests would wait for it, and for all checks before it.
"""

from __future__ import annotations

import asyncio
import time
from contextvars import ContextVar
from typing import Any, NamedTuple

from asyncua import ua
from asyncua.ua.ua_binary import struct_from_binary

from conveyor_sim.protocols.server.users import LoginService, User


class Checked(NamedTuple):
    """Result for the request that is being answered."""

    name: str
    password: str
    user: User | None
    """None: the password is wrong."""


checked: ContextVar[Checked | None] = ContextVar("checked", default=None)
"""Result of the last check in this task; None: a request without a password."""


class Passwords:
    """Checks of one OPC UA server. Clients wait in the order of their requests."""

    def __init__(self, logins: LoginService) -> None:
        """Prepare the checks. logins: checks passwords; its method may block."""
        self._logins = logins
        self._turn = asyncio.Lock()

    async def check(self, server: Any, session: Any, body: Any, origin: str) -> None:
        """Check the password of an ActivateSession request, and note the result in `checked`.

        server: a SafeServer. body: encoded parameters, which are not consumed. origin: address of the client.
        """
        checked.set(None)
        try:
            token = struct_from_binary(ua.ActivateSessionParameters, body.copy()).UserIdentityToken
            if session is None or not isinstance(token, ua.UserNameIdentityToken):
                return
            name, password = server.decrypt_user_token(session, token)
        except Exception:  # the library decodes it again, and answers with the matching status code
            return
        async with self._turn:
            user = await asyncio.to_thread(self._logins.enter, name, password, origin, time.monotonic())
        checked.set(Checked(name, password, user))
