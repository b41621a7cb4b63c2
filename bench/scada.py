# SPDX-License-Identifier: Apache-2.0
"""SCADA servers under load: 500 tags, 50 of which change at 10 Hz, to five clients of each protocol.

The clients of a protocol are a process of their own (bench/scada_clients.py). Changes are whole numbers that go up by
one, so each client knows how many it has missed. What servers cost the ticks is measured on a scene, with clients and
without.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import replace
from pathlib import Path

from bench.markdown import table as markdown
from bench.measure import Effort, say
from bench.rows import Row, Rows
from conveyor_sim.columns.events import Event
from conveyor_sim.line.commands.inputs import Input
from conveyor_sim.line.run_state import RUNNING, RunState
from conveyor_sim.line.tag import Tag, count
from conveyor_sim.protocols.hosting.server_kinds import SERVER_KINDS
from conveyor_sim.protocols.hosting.serving import Serving
from conveyor_sim.protocols.hosting.settings import ServerSettings
from conveyor_sim.protocols.tags.scene_messages import SceneTask
from conveyor_sim.protocols.tags.scene_provider import SceneTagProvider
from conveyor_sim.protocols.tags.tag_provider import Control, LineInfo, LineSnapshot, Listeners
from conveyor_sim.scene import load_scene

CASE, TICKS = "faces", "ticks"
TAGS, CHANGING, EVERY, TICK = 500, 50, 10, 0.01
"""EVERY: ticks, from one change to the next."""
CLIENTS = 5
"""Clients per protocol."""
KINDS = [kind for kind in SERVER_KINDS if kind.by_default]
SCENE = "config/scenarios/zoned_line.yaml"
LOST, SEEN, LATENCY = "changes lost", "changes seen", "ms at most from a request or a change on"
CPU, MEMORY, GROWTH = "cores of the servers", "MB", "MB more after than before"
TICK_CPU = "cores of the process that simulates"
ALONE, SERVED = "not served", "served to all clients"
SECONDS, QUICK_SECONDS, TICK_SECONDS = 20.0, 3.0, 10.0
SETTLE = 5.0
"""s of wall time in which clients connect."""
MB = 1 << 20


class Counting:
    """A source of tags, some of which go up by one every EVERY ticks."""

    controls: frozenset[Control] = frozenset()
    past = None

    def __init__(self) -> None:
        tags = [
            replace(count(f"belts/belt{n}/count", "counter", "Goes up."), device=f"belts/belt{n}") for n in range(TAGS)
        ]
        self.info = LineInfo(
            "bench", "", TICK, "2025-01-01T00:00:00Z", [replace(tag, device_class="belt") for tag in tags]
        )
        self._listeners = Listeners()
        self.snapshot = self._at(0)

    def show(self, tick: int) -> None:
        """Set the tick of the line."""
        self.snapshot = self._at(tick)
        self._listeners.tell()

    def _at(self, tick: int) -> LineSnapshot:
        values = {tag.name: float(tick // EVERY if n < CHANGING else n) for n, tag in enumerate(self.info.tags)}
        return LineSnapshot(tick, values, run=RunState(RUNNING))

    def events(self, after: int) -> tuple[int, Sequence[Event]]:
        return 0, ()

    def listen(self, heard: object) -> object:
        return self._listeners.add(heard)  # type: ignore[arg-type]

    def give(self, given: Input) -> str:
        return "nothing can be written"

    def control(self, what: Control, value: float, by: str) -> str:
        return "nothing can be asked for"

    def close(self) -> None:
        """Nothing is open."""


class Changing(Counting):
    """One that goes on by itself, as the clock does."""

    def __init__(self) -> None:
        super().__init__()
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()

    def _run(self) -> None:
        tick, due = 0, time.monotonic()
        while not self._stop.wait(max(0.0, due - time.monotonic())):
            tick, due = tick + 1, due + TICK
            self.show(tick)

    def close(self) -> None:
        self._stop.set()
        self._thread.join()


def _tag(belt: str) -> Tag:
    return replace(count(f"{belt}/count", "counter", "Goes up."), device=belt, device_class="belt")


def measure(effort: Effort) -> list[Row]:
    """Measure the losses of clients and their cost; then the cost for the ticks."""
    if missing := [kind.libraries[0] for kind in KINDS if not kind.installed]:
        say(f"scada is left out: {', '.join(missing)} not installed")
        return []
    return [*_faces(QUICK_SECONDS if effort.quick else SECONDS), *_ticks(effort)]


def _faces(seconds: float) -> list[Row]:
    say(f"scada: {CLIENTS} clients of each protocol for {seconds:g} s")
    source = Changing()
    try:
        with Serving(source, [(kind, 0) for kind in KINDS], ServerSettings()) as serving:  # type: ignore[arg-type]
            with _clients(serving, seconds + SETTLE) as clients:
                time.sleep(SETTLE)
                serving.latencies()  # from now on
                memory, cpu, began = _memory(), time.process_time(), time.monotonic()
                time.sleep(seconds)
                cores = (time.process_time() - cpu) / (time.monotonic() - began)
                grown = _memory() - memory
                told = clients()
            latencies = serving.latencies()
    finally:
        source.close()
    rows = [Row(CASE, CLIENTS, "both", CPU, 0, cores), Row(CASE, CLIENTS, "both", MEMORY, 0, memory / MB)]
    rows.append(Row(CASE, CLIENTS, "both", GROWTH, 0, grown / MB))
    for name, clients_of in told.items():
        for number, (seen, lost) in enumerate(clients_of):
            rows += [Row(CASE, CLIENTS, name, SEEN, number, seen), Row(CASE, CLIENTS, name, LOST, number, lost)]
    return rows + [Row(CASE, CLIENTS, name, LATENCY, 0, 1e3 * latency) for name, latency in latencies.items()]


def _ticks(effort: Effort) -> list[Row]:
    rows = []
    for turn in range(1 if effort.quick else min(3, effort.rounds)):
        for how in (ALONE, SERVED):
            say(f"scada: the ticks of a line, {how}, round {turn + 1}")
            seconds = QUICK_SECONDS if effort.quick else TICK_SECONDS
            task = SceneTask(load_scene(SCENE, {"duration": 1e6}), None, 0, 1.0, 1)
            with SceneTagProvider(task, say) as source:
                source.wait_for_line()
                cores = _cores_of(source.pid, seconds) if how == ALONE else _cores_served(source, seconds)
            rows.append(Row(TICKS, CLIENTS, how, TICK_CPU, turn, cores))
    return rows


def _cores_served(source: SceneTagProvider, seconds: float) -> float:
    with (
        Serving(source, [(kind, 0) for kind in KINDS], ServerSettings()) as serving,
        _clients(serving, seconds + SETTLE) as clients,
    ):
        time.sleep(SETTLE)
        cores = _cores_of(source.pid, seconds)
        clients()
    return cores


@contextmanager
def _clients(serving: Serving, seconds: float) -> Iterator[Callable[[], dict[str, list[tuple[int, int]]]]]:
    """Run the clients of each protocol in a separate process; the yielded function waits for their results."""
    command = [sys.executable, "-m", "bench.scada_clients", str(seconds)]
    with ExitStack() as stack:
        processes = []
        for face in serving.hosts:
            process = subprocess.Popen([*command, face.address], stdout=subprocess.PIPE, text=True)
            stack.callback(process.wait)
            stack.callback(process.kill)
            processes.append(process)

        def told() -> dict[str, list[tuple[int, int]]]:
            found: dict[str, list[tuple[int, int]]] = {}
            for process in processes:
                found |= json.loads(process.communicate(timeout=600)[0])
            return found

        yield told


def _cores_of(pid: int, seconds: float) -> float:
    """Return the cores that another process uses."""
    before, began = _cpu_of(pid), time.monotonic()
    time.sleep(seconds)
    return (_cpu_of(pid) - before) / (time.monotonic() - began)


def _cpu_of(pid: int) -> float:
    """Return the processor time of all its threads so far, s."""
    fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def _memory() -> int:
    """Bytes of this process that are in memory."""
    return int(Path("/proc/self/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE")


def tables(rows: Rows) -> str:
    """By protocol, and the ticks."""
    head = ["protocol", "clients", "changes seen by each", "lost", "ms at most"]
    lines: list[list[str | None]] = []
    for kind in KINDS:
        seen, lost = (rows.values(CASE, CLIENTS, kind.name, what) for what in (SEEN, LOST))
        latency = rows.spread(CASE, CLIENTS, kind.name, LATENCY)
        if seen:
            least = f"{min(seen.values()):.0f}"
            ms = None if latency is None else f"{latency.middle:.3g}"
            lines.append([kind.name, str(len(seen)), least, f"{sum(lost.values()):.0f}", ms])
    cpu, memory, grown = (rows.spread(CASE, CLIENTS, "both", what) for what in (CPU, MEMORY, GROWTH))
    alone, served = (rows.spread(TICKS, CLIENTS, how, TICK_CPU) for how in (ALONE, SERVED))
    if not lines or cpu is None or memory is None or grown is None:
        return "Not measured."
    return (
        f"{TAGS} tags, {CHANGING} of which change at {1 / (EVERY * TICK):g} Hz:\n\n{markdown(head, lines)}\n\n"
        f"Both servers together took {cpu.middle:.2f} cores and {memory.middle:.0f} MB, {grown.middle:+.1f} MB by the "
        f"end. The process that simulates a line in real time took {alone} cores alone, {served} served to all."
    )
