# SPDX-License-Identifier: Apache-2.0
"""The clients of bench/scada.py, as a process: `python -m bench.scada_clients SECONDS ADDRESS...` prints what they saw.

They begin to count when all of them are connected.
"""

from __future__ import annotations

import asyncio
import json
import logging
import sys
import time
from typing import Any
from urllib.parse import urlsplit

CLIENTS, CHANGING = 5, 50
POLL = 0.025
"""s of wall time between two requests of a Modbus client."""
PUBLISH = 50.0
"""ms between two notifications of OPC UA."""


class Ready:
    """Opens once so many wait."""

    def __init__(self, count: int) -> None:
        self._missing, self._open = count, asyncio.Event()

    async def wait(self) -> None:
        """Wait until all others wait as well."""
        self._missing -= 1
        if not self._missing:
            self._open.set()
        await self._open.wait()


class Seen:
    """Record of one client of tags that count up."""

    def __init__(self) -> None:
        self._last: dict[str, int] = {}
        self.changes = self.lost = 0

    @property
    def lowest(self) -> int:
        """Return the value that all tags have reached; -1: some have not been received."""
        return min(self._last.values()) if len(self._last) == CHANGING else -1

    @property
    def told(self) -> tuple[int, int]:
        """Changes seen, and lost."""
        return self.changes, self.lost

    def note(self, name: str, value: int) -> None:
        """Record a tag's value."""
        last = self._last.get(name)
        if last is not None and value != last:
            self.changes += 1
            self.lost += max(0, value - last - 1)
        self._last[name] = value

    def datachange_notification(self, node: Any, value: Any, _: Any) -> None:
        """Record a data change; called by asyncua."""
        if value is not None:
            self.note(str(node), int(value))


async def modbus(address: str, ready: Ready, seconds: float) -> tuple[int, int]:
    """Poll the registers."""
    from pymodbus.client import AsyncModbusTcpClient

    seen, parts = Seen(), urlsplit(address)
    client = AsyncModbusTcpClient(parts.hostname or "", port=parts.port or 0, timeout=20)
    await client.connect()
    await ready.wait()
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        answer = await client.read_input_registers(0, count=2 * CHANGING)
        for n in range(CHANGING):
            seen.note(str(n), answer.registers[2 * n] << 16 | answer.registers[2 * n + 1])
        await asyncio.sleep(POLL)
    client.close()
    return seen.told


async def opcua(address: str, ready: Ready, seconds: float) -> tuple[int, int]:
    """Subscribe to the tags."""
    from asyncua import Client

    seen = Seen()
    async with Client(address, timeout=60, watchdog_intervall=60) as client:
        subscription = await client.create_subscription(PUBLISH, seen)
        nodes = [client.get_node(f"ns=2;s=belts/belt{n}/count") for n in range(CHANGING)]
        await subscription.subscribe_data_change(nodes, queuesize=20)
        await ready.wait()
        seen.changes = seen.lost = 0
        await asyncio.sleep(seconds)
        told = seen.told
        await subscription.delete()
    return told


async def main(seconds: float, addresses: list[str]) -> None:
    """All at once."""
    ready = Ready(CLIENTS * len(addresses))
    kinds = {"modbus": modbus, "opc.tcp": opcua}
    logging.disable()
    tasks = {}
    for address in addresses:
        scheme = urlsplit(address).scheme
        tasks["opcua" if scheme == "opc.tcp" else scheme] = [
            asyncio.create_task(kinds[scheme](address, ready, seconds)) for _ in range(CLIENTS)
        ]
    print(json.dumps({name: await asyncio.gather(*all_of) for name, all_of in tasks.items()}))


if __name__ == "__main__":
    asyncio.run(main(float(sys.argv[1]), sys.argv[2:]))
