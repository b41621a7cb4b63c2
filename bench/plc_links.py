# SPDX-License-Identifier: Apache-2.0
"""Time of one scan of a PLC over each link of `attach`: signals, `run/tick`, `run/target_tick`, commands."""

from __future__ import annotations

import re
import subprocess
import sys
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from importlib.util import find_spec

from bench.markdown import table as markdown
from bench.measure import Effort, say
from bench.plc_servers import TARGET, TICK, place
from bench.rows import Row, Rows
from conveyor_sim.line.tag import count as tag
from conveyor_sim.protocols.attach.links import LIBRARIES, plc_link
from conveyor_sim.protocols.attach.plc_link import write_signals
from conveyor_sim.protocols.attach.tag_map import MappedTag
from conveyor_sim.protocols.hosting.server_thread import ServerThread
from conveyor_sim.protocols.tags import handshake

CASE = "plc links"
SCAN, CONNECT = "ms per scan", "s to connect"
SIZES = (10, 200)
"""Numbers of signals; there are as many commands."""
SCANS, QUICK_SCANS, SLOW = 40, 5, 4
"""Scans of a measurement. cpppo, the EtherNet/IP server, is slow."""
LABELS: Mapping[str, str] = {
    "opc.tcp": "OPC UA (asyncua)",
    "modbus": "Modbus TCP (pymodbus)",
    "s7": "Siemens S7 (snap7)",
    "eip": "Rockwell EtherNet/IP (pylogix; cpppo)",
    "ads": "Beckhoff ADS (pyads)",
}
"""Protocols, with the library of the client, and of the server if it is another one."""


def measure(effort: Effort) -> list[Row]:
    """Measure each link whose library is installed."""
    rows = []
    for turn in range(1 if effort.quick else effort.rounds):
        for scheme, (library, _) in LIBRARIES.items():
            if find_spec(library) is None or (scheme == "eip" and find_spec("cpppo") is None):
                say(f"{scheme} is left out: its library or server is not installed")
                continue
            say(f"{scheme}, round {turn + 1}")
            for size in SIZES:
                scans = QUICK_SCANS if effort.quick else SLOW if scheme == "eip" else SCANS
                connect, scan = _measured(scheme, size, scans)
                rows.append(Row(CASE, size, LABELS[scheme], CONNECT, turn, connect))
                rows.append(Row(CASE, size, LABELS[scheme], SCAN, turn, scan))
    return rows


def _measured(scheme: str, size: int, scans: int) -> tuple[float, float]:
    """Return the time to connect (s) and the mean time of a scan (ms)."""
    signals, commands = ([f"v{number}" for number in range(first, first + size)] for first in (0, size))
    names = {name: name for name in (*signals, *commands)} | {handshake.TICK: TICK, handshake.TARGET: TARGET}
    mapped = [MappedTag(tag(ours, "status", ""), place(scheme, theirs), "") for ours, theirs in names.items()]
    with _server(scheme, 2 * size) as url, ServerThread() as thread:
        link = plc_link(url, mapped)
        begin = time.perf_counter()
        thread.run(link.connect())
        connected = time.perf_counter()

        async def scan_all() -> None:
            for tick in range(scans):
                await write_signals(link, dict.fromkeys(signals, float(tick)), tick)
                await link.read([handshake.TARGET])
                await link.read(commands)

        thread.run(scan_all())
        end = time.perf_counter()
        thread.run(link.close())
    return connected - begin, 1e3 * (end - connected) / scans


@contextmanager
def _server(scheme: str, count: int) -> Iterator[str]:
    command = [sys.executable, "-m", "bench.plc_servers", scheme, str(count)]
    server = subprocess.Popen(
        command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True
    )
    assert server.stdout is not None
    try:
        line = server.stdout.readline()
        port = re.search(r"(\d+)\)?$", line.strip())
        assert port is not None, f"{scheme}: {line}"
        yield f"eip://127.0.0.1:{port[1]}" if scheme == "eip" else line.strip()
    finally:
        server.kill()
        server.wait()


def tables(rows: Rows) -> str:
    """One table."""
    head = ["", *(f"{size} + {size} values: {SCAN}" for size in SIZES), f"{CONNECT}, {SIZES[-1]} + {SIZES[-1]} values"]
    body: list[list[object]] = [
        [label, *(rows.spread(CASE, size, label, SCAN) for size in SIZES), rows.spread(CASE, SIZES[-1], label, CONNECT)]
        for label in LABELS.values()
    ]
    return markdown(head, body)
