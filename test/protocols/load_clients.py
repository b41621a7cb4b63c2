# SPDX-License-Identifier: Apache-2.0
"""Clients of test_load.py, as a process: they report each value that all of them have seen in all tags."""

from __future__ import annotations

import asyncio
import json
import logging
import sys
from collections.abc import Callable
from urllib.parse import urlsplit

from asyncua import Client
from pymodbus.client import AsyncModbusTcpClient

from bench.scada_clients import CHANGING, CLIENTS, POLL, PUBLISH, Seen

QUEUE = 20
"""Changes of a tag that the server queues for a subscriber of OPC UA."""


class All:
    """Values that the clients have seen."""

    def __init__(self) -> None:
        self.seen = [Seen() for _ in range(CLIENTS)]
        self.lowest = -1

    def tell(self) -> None:
        """Print what all have reached, if it is more than before."""
        lowest = min(one.lowest for one in self.seen)
        if lowest > self.lowest:
            self.lowest = lowest
            print(lowest, flush=True)


async def modbus(address: str, seen: Seen, more: Callable[[], bool]) -> None:
    """Poll the registers."""
    parts = urlsplit(address)
    client = AsyncModbusTcpClient(parts.hostname or "", port=parts.port or 0, timeout=20)
    await client.connect()
    while more():
        answer = await client.read_input_registers(0, count=2 * CHANGING)
        for n in range(CHANGING):
            seen.note(str(n), answer.registers[2 * n] << 16 | answer.registers[2 * n + 1])
        await asyncio.sleep(POLL)
    client.close()


async def opcua(address: str, seen: Seen, more: Callable[[], bool]) -> None:
    """Subscribe to the tags."""
    async with Client(address, timeout=60, watchdog_intervall=60) as client:
        subscription = await client.create_subscription(PUBLISH, seen)
        nodes = [client.get_node(f"ns=2;s=belts/belt{n}/count") for n in range(CHANGING)]
        await subscription.subscribe_data_change(nodes, queuesize=QUEUE)
        while more():
            await asyncio.sleep(POLL)
        await subscription.delete()


async def main(address: str, last: int) -> None:
    """Run all clients until each has seen all tags at the last value."""
    logging.disable()
    those, act = All(), {"modbus": modbus, "opc.tcp": opcua}[urlsplit(address).scheme]

    def more() -> bool:
        those.tell()
        return those.lowest < last

    await asyncio.gather(*(act(address, seen, more) for seen in those.seen))
    print(json.dumps([seen.told for seen in those.seen]))


if __name__ == "__main__":
    asyncio.run(main(sys.argv[1], int(sys.argv[2])))
