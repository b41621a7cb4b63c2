# SPDX-License-Identifier: Apache-2.0
"""`HeldButtons`: momentary buttons of the panel that clients hold, and their release when a client leaves."""

from __future__ import annotations

import asyncio
from collections.abc import Hashable
from contextlib import suppress

from conveyor_sim.line.commands.inputs import SET, Input
from conveyor_sim.line.tag import PANEL
from conveyor_sim.protocols.tags.tag_provider import TagProvider

MOMENTARY = "/press"
"""Ending of the names of tags by which momentary buttons are held."""

AGAIN = 0.1
"""Wall time before a release that the input queue had no room for is given again, s."""


class HeldButtons:
    """Buttons that clients of one protocol server hold. The last client that pressed a button holds it."""

    def __init__(self, source: TagProvider) -> None:
        """Start without a held button."""
        self._source = source
        self._buttons = frozenset(
            tag.name
            for tag in source.info.tags
            if tag.role == PANEL and tag.device_class == "button" and tag.name.endswith(MOMENTARY)
        )
        self._held: dict[str, tuple[Hashable, Input]] = {}
        self._due: list[Input] = []

    def note(self, client: Hashable, request: Input) -> None:
        """Note the buttons that an accepted input of a client presses and releases."""
        if not self._buttons or request.operation != SET:
            return
        for name, value in zip(request.names, request.values, strict=True):
            if name in self._buttons and value:
                self._held[name] = client, request
            elif name in self._buttons:
                self._held.pop(name, None)

    def leave(self, client: Hashable) -> None:
        """Release the buttons that a client holds, because it has left."""
        self._release([name for name, (holder, _) in self._held.items() if holder == client])

    def leave_all(self) -> None:
        """Release all held buttons, because no client is connected any more."""
        self._release(list(self._held))

    def look(self) -> None:
        """Give the releases that the input queue had no room for."""
        while self._due and not self._source.give(self._due[0]):
            self._due.pop(0)
        if self._due:
            with suppress(RuntimeError):  # outside an event loop, the owner calls `look` again
                asyncio.get_running_loop().call_later(AGAIN, self.look)

    def _release(self, names: list[str]) -> None:
        for name in names:
            _, pressed = self._held.pop(name)
            self._due.append(pressed._replace(names=(name,), values=(0.0,)))
        if names:
            self.look()
