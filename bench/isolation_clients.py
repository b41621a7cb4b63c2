# SPDX-License-Identifier: Apache-2.0
"""Clients of bench/isolation.py: `python -m bench.isolation_clients ADDRESS SECONDS` prints latencies in s, as JSON."""

from __future__ import annotations

import asyncio
import json
import socket
import struct
import sys
import time
from urllib.parse import urlsplit

from aiohttp import ClientSession

BEGIN = 1.0
"""s of wall time for the first data of a page, which is not measured."""
POLL, PING, GET = 0.01, 0.02, 0.1
"""s of wall time between two requests: of Modbus; of the page by websocket; of the page by HTTP."""
TICK = struct.pack(">HHHBBHH", 1, 0, 6, 1, 4, 65_534, 2)
"""Read two input registers: the tick."""


def modbus(address: str, seconds: float) -> dict[str, list[float]]:
    """Read the tick repeatedly."""
    parts, latencies = urlsplit(address), list[float]()
    end = time.monotonic() + seconds
    with socket.create_connection((parts.hostname or "", parts.port or 0), 600.0) as connection:
        while time.monotonic() < end:
            began = time.perf_counter()
            connection.sendall(TICK)
            if not connection.recv(100):
                raise ConnectionError(f"{address}: the connection has ended")
            latencies.append(time.perf_counter() - began)
            time.sleep(POLL)
    return {"modbus": latencies}


async def page(address: str, seconds: float) -> dict[str, list[float]]:
    """Follow the page by websocket, and fetch it by HTTP meanwhile."""
    url, pings, gets = address.rstrip("/"), list[float](), list[float]()
    end = time.monotonic() + BEGIN + seconds
    async with ClientSession() as session, session.ws_connect(f"{url}/live", origin=url, max_msg_size=0) as socket:

        async def ping() -> None:
            await asyncio.sleep(BEGIN)
            while time.monotonic() < end:
                await socket.send_json({"do": "ping", "sent": time.perf_counter()})
                await asyncio.sleep(PING)
            await socket.close()

        async def get() -> None:
            await asyncio.sleep(BEGIN)
            while time.monotonic() < end:
                began = time.perf_counter()
                async with session.get(url) as answer:
                    await answer.read()
                gets.append(time.perf_counter() - began)
                await asyncio.sleep(GET)

        asking = [asyncio.create_task(ping()), asyncio.create_task(get())]
        async for message in socket:
            if message.data[0] == 0 and (told := json.loads(message.data[1:]))["kind"] == "pong":
                pings.append(time.perf_counter() - told["sent"])
            elif message.data[0] == 1:
                await socket.send_json({"do": "saw"})
        await asyncio.gather(*asking)
    return {"page, websocket": pings, "page, HTTP": gets}


def main(address: str, seconds: float) -> None:
    """Print the latencies of the server at an address: Modbus or the page."""
    latencies = modbus(address, seconds) if address.startswith("modbus") else asyncio.run(page(address, seconds))
    print(json.dumps(latencies))


if __name__ == "__main__":
    main(sys.argv[1], float(sys.argv[2]))
