# SPDX-License-Identifier: Apache-2.0
"""`IsolatedLink`: a link to a PLC whose library runs in a child process, which is killed if it does not answer."""

from __future__ import annotations

import asyncio
import subprocess
from collections.abc import Mapping, Sequence
from contextlib import suppress
from multiprocessing import Pipe
from multiprocessing.connection import Connection
from typing import Any

from conveyor_sim.protocols.attach.driver_process import CLOSE, CONNECT, DONE, PLACE
from conveyor_sim.protocols.attach.elementary_types import REAL
from conveyor_sim.protocols.attach.plc_link import PATIENCE, PlcLinkError
from conveyor_sim.protocols.attach.tag_map import MappedTag, TagMapError
from conveyor_sim.protocols.tags.handshake import TARGET, TICK
from conveyor_sim.support.child_process import how_it_ended, start_python
from conveyor_sim.support.printable import SENTENCE, printable
from conveyor_sim.support.rounded_limit import at_limit

PROCESS = "conveyor_sim.protocols.attach.driver_process"
LIMIT = 3.0 * PATIENCE
"""Longest time of the process for a call, s of wall time. It covers a lost request and its retry."""
PER_TAG = 0.05
"""Additional time for each tag when connecting, s: some libraries ask for the type of each tag alone."""
COUNTERS = ("DINT", "UDINT", "DWORD", "LINT", "ULINT", "LWORD")
"""Types of the two tags of the handshake. An INT would end after 327 s, a REAL counts up to 16777216."""
FAREWELL = 1.0
"""Longest time for an orderly end of the connection, s."""


class IsolatedLink:
    """Link by the library of a vendor. All of its errors, hangs and crashes are a PlcLinkError."""

    def __init__(self, url: str, module: str, settings: tuple[Any, ...], mapped: Sequence[MappedTag]) -> None:
        """Store the parameters. module: its `make` returns the `VendorDriver` for settings, which are pickled."""
        self._url, self._module, self._settings = url, module, settings
        self._mapped = {each.tag.name: each for each in mapped}
        self._process: subprocess.Popen[bytes] | None = None
        self._pipe: Connection | None = None
        self._singles: frozenset[str] = frozenset()

    async def connect(self) -> None:
        """Start the process, connect, and check every place of the map."""
        self._pipe, its_pipe = Pipe()
        with its_pipe:
            self._process = start_python(PROCESS, its_pipe)
        limit = LIMIT + PER_TAG * len(self._mapped)
        kinds: dict[str, str] = await self._ask(CONNECT, self._module, self._settings, limit=limit)
        for name in {TICK, TARGET}.intersection(kinds):
            if kinds[name] not in COUNTERS:
                each = self._mapped[name]
                text = f"{each.where}: {printable(each.theirs)} ({name}) is {kinds[name]}"
                raise TagMapError(f"{text}, expected one of {', '.join(COUNTERS)}")
        self._singles = frozenset(name for name, kind in kinds.items() if kind == REAL)

    async def write(self, values: Mapping[str, float]) -> None:
        """Write values in their order, by our names."""
        await self._ask("write", dict(values), limit=LIMIT)

    async def read(self, names: Sequence[str]) -> dict[str, float]:
        """Return values, by our names."""
        values: dict[str, float] = await self._ask("read", list(names), limit=LIMIT)
        for name in self._singles.intersection(values):
            tag = self._mapped[name].tag
            values[name] = at_limit(values[name], tag.low, tag.high)
        return values

    async def close(self) -> None:
        """Disconnect, and end the process."""
        if self._pipe is not None:
            with suppress(PlcLinkError):
                await self._ask(CLOSE, limit=FAREWELL)
        self._end()

    async def _ask(self, what: str, *arguments: Any, limit: float) -> Any:
        """Return the answer of the process. Without one the process is killed: no later call gets an old answer."""
        if self._pipe is None:
            raise PlcLinkError(f"{self._url}: is not connected")
        try:
            return self._result(await self._exchange(self._pipe, (what, arguments), limit))
        except asyncio.TimeoutError:
            self._end()
            raise PlcLinkError(f"{self._url}: does not answer within {limit:g} s") from None
        except (EOFError, OSError):
            ending = how_it_ended(self._end())
            raise PlcLinkError(f"{self._url}: the process of the link {ending}") from None
        except BaseException:
            self._end()
            raise

    @staticmethod
    async def _exchange(pipe: Connection, request: tuple[str, tuple[Any, ...]], limit: float) -> tuple[Any, ...]:
        loop, readable = asyncio.get_running_loop(), asyncio.Event()
        pipe.send(request)
        loop.add_reader(pipe.fileno(), readable.set)
        try:
            await asyncio.wait_for(readable.wait(), limit)
        finally:
            loop.remove_reader(pipe.fileno())
        answer: tuple[Any, ...] = pipe.recv()
        return answer

    def _result(self, answer: tuple[Any, ...]) -> Any:
        kind, *rest = answer
        if kind == DONE:
            return rest[0]
        if kind == PLACE:
            name, reason = rest
            mapped = self._mapped[name]
            raise TagMapError(f"{mapped.where}: {printable(mapped.theirs)} ({name}): {printable(reason, SENTENCE)}")
        raise PlcLinkError(f"{self._url}: {printable(rest[0], SENTENCE)}")

    def _end(self) -> int | None:
        """End the process. Return its exit code if it had ended before; else None."""
        process, self._process = self._process, None
        pipe, self._pipe = self._pipe, None
        if pipe is not None:
            pipe.close()
        if process is None:
            return None
        with suppress(subprocess.TimeoutExpired):
            return process.wait(0.1)
        process.kill()
        process.wait()
        return None
