# SPDX-License-Identifier: Apache-2.0
"""Latency of Modbus and of the page while the OPC UA server is attacked, all on two cores.

The line, its protocol servers, the attacker and the clients that measure share the cores. An
anonymous client attacks (bench/isolation_attacks.py): each attack keeps the event loop of the OPC UA server busy until
the server is restarted.
"""

from __future__ import annotations

import json
import math
import os
import re
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from tempfile import TemporaryFile
from typing import IO

from bench.markdown import table as markdown
from bench.measure import Effort, say
from bench.rows import Row, Rows
from conveyor_sim.protocols.hosting.server_kinds import SERVER_KINDS

CASE = "attacked"
CORES = 2
SCENE = "scenarios/zoned_line"
SERVERS = ("opcua", "modbus", "web")
NONE = "none"
SERVED = ("modbus", "page, websocket", "page, HTTP")
P99, WORST, RESTARTS = "ms, 99th percentile", "ms, at most", "restarts of the OPC UA server"
SECONDS, QUICK_SECONDS = 20.0, 4.0
SETTLE = 2.0
"""s of wall time in which the line begins, and an attack."""
PATIENCE = 300.0
GREETING = r"^(\w[\w.]*)(://\S+): clients can"


def measure(effort: Effort) -> list[Row]:
    """Return latencies without an attack and during each attack."""
    if missing := [kind.libraries[0] for kind in SERVER_KINDS if kind.name in SERVERS and not kind.installed]:
        say(f"isolation is left out: {', '.join(missing)} not installed")
        return []
    from bench.isolation_attacks import ATTACKS

    before = os.sched_getaffinity(0)
    os.sched_setaffinity(0, set(sorted(before)[:CORES]))  # of all processes that are started from here
    try:
        rows = []
        for turn in range(1 if effort.quick else min(3, effort.rounds)):
            for attack in (NONE, *ATTACKS):
                say(f"isolation: attack {attack}, round {turn + 1}")
                rows += _measure(attack, turn, QUICK_SECONDS if effort.quick else SECONDS)
    finally:
        os.sched_setaffinity(0, before)
    return rows


def _measure(attack: str, turn: int, seconds: float) -> list[Row]:
    with _served() as (addresses, log), _attacked(attack, addresses["opcua"]):
        time.sleep(SETTLE)
        command = [sys.executable, "-m", "bench.isolation_clients"]
        clients = [
            subprocess.Popen([*command, addresses[name], str(seconds)], stdout=subprocess.PIPE, text=True)
            for name in ("modbus", "web")
        ]
        latencies: dict[str, list[float]] = {}
        for client in clients:
            latencies |= json.loads(client.communicate(timeout=PATIENCE)[0])
        restarts = _logged(log).count("it is restarted")
    rows = [Row(CASE, 0, attack, RESTARTS, turn, restarts)]
    for name, seconds_each in latencies.items():
        rows.append(Row(CASE, 0, attack, f"{name}: {P99}", turn, 1e3 * _percentile(seconds_each, 0.99)))
        rows.append(Row(CASE, 0, attack, f"{name}: {WORST}", turn, 1e3 * max(seconds_each)))
    return rows


@contextmanager
def _served() -> Iterator[tuple[dict[str, str], IO[str]]]:
    """Run `conveyor-sim serve`. Yield the addresses of its servers by name, and its log."""
    code = "from conveyor_sim.cli import main; main()"
    ports = [argument for name in SERVERS for argument in (f"--{name}", "0")]
    with TemporaryFile("w+") as log:
        process = subprocess.Popen(
            [sys.executable, "-c", code, "serve", SCENE, *ports, "--no-record", "--duration", "1e5"],
            stdout=subprocess.DEVNULL,
            stderr=log,
        )
        try:
            end = time.monotonic() + PATIENCE
            while len(greetings := re.findall(GREETING, _logged(log), re.MULTILINE)) < len(SERVERS):
                if process.poll() is not None or time.monotonic() > end:
                    raise RuntimeError(f"the line is not served: {_logged(log)}")
                time.sleep(0.1)
            schemes = {"opc.tcp": "opcua", "modbus": "modbus", "http": "web"}
            yield {schemes[scheme]: scheme + rest for scheme, rest in greetings}, log
        finally:
            process.send_signal(signal.SIGINT)
            process.wait()


@contextmanager
def _attacked(attack: str, address: str) -> Iterator[None]:
    if attack == NONE:
        yield
        return
    command = [sys.executable, "-m", "bench.isolation_attacks", attack, address]
    process = subprocess.Popen(command, stderr=subprocess.DEVNULL)
    try:
        yield
    finally:
        process.kill()
        process.wait()


def _logged(log: IO[str]) -> str:
    return os.pread(log.fileno(), 100_000, 0).decode()


def _percentile(values: list[float], share: float) -> float:
    return sorted(values)[max(0, math.ceil(share * len(values)) - 1)]


def tables(rows: Rows) -> str:
    """Return the Markdown table, one row per attack."""
    attacks = list(dict.fromkeys(row.contestant for row in rows.all))
    if not attacks:
        return "Not measured."
    head = ["attack", *(f"{name}: {what}" for name in SERVED for what in (P99, WORST)), RESTARTS]
    body = [[attack, *(rows.spread(CASE, 0, attack, quantity) for quantity in head[1:])] for attack in attacks]
    return markdown(head, body)
